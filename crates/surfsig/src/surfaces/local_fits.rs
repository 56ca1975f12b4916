//! The surface through each point's nearest points.

use super::sheets::OVERLAP;
use crate::curvature::Principal;
use crate::fit::FitAxes;
use crate::fit::paraboloid::{Paraboloids, Task, fit_paraboloids};
use crate::fit::quadric::{Quadrics, fit_quadrics};
use crate::kd_tree::KdTree;
use crate::members::Members;
use crate::moments::Moments;
use crate::primitive::Vector;
use crate::simd::InstructionSet;
use crate::simd::lanes::LANES;
use crate::tensor::MomentBatch;
use crate::{Error, Monitor};
use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

/// Points that a thread takes at a time, in the order of the tree's leaves.
const PART: usize = 512;

/// Linearity of the nearest points from which they are a scanner's line.
const LINE: f32 = 0.9;

/// Parameters of the surfaces that are fitted: of an implicit quadric, and of the paraboloid where there is none.
const QUADRIC_PARAMETERS: f64 = 9.0;
const PARABOLOID_PARAMETERS: f64 = 6.0;

/// Deviation of points from a quadric, in units of that from a paraboloid, below which it is asked whether the quadric is
/// one sheet; noise leaves 0.9 of it.
const SUSPICIOUS: f64 = 0.2;

/// What is left of a quadric's other coefficients, in units of its largest principal one, where it is two parallel planes.
const TWO_PLANES: f64 = 1e-2;

/// Standard deviation of points that fill a ball instead of a surface in it, in units of its radius, and more.
const THICK: f32 = 0.32;

/// The surface through a point's nearest points.
#[derive(Clone, Copy)]
pub(super) struct LocalFit {
    /// The quadric, or the paraboloid where there is none.
    pub best: Sheet,
    /// The paraboloid where the quadric is two parallel planes, as two steps of a sensor that measures depth in steps are:
    /// exact, and no surface. Otherwise the same.
    pub one: Sheet,
    /// Distance to the farthest of the points.
    pub radius: f32,
    /// (l1 - l2) / l1 of the eigenvalues of their covariance: 1 on a line.
    pub linearity: f32,
    /// Whether the quadric is two parallel planes whose points lie side by side.
    pub is_step: bool,
}

/// A surface near some points.
#[derive(Clone, Copy)]
pub(super) struct Sheet {
    /// Unit normal at the point; not a number where there is no plane.
    pub normal: [f32; 3],
    /// Standard deviation of the points from the surface, corrected for its parameters; infinite where these leave no
    /// degrees of freedom, and not a number where there is no surface.
    pub deviation: f32,
}

impl LocalFit {
    pub const MISSING: Self = {
        let missing = Sheet { normal: [f32::NAN; 3], deviation: f32::NAN };
        Self { best: missing, one: missing, radius: f32::NAN, linearity: f32::NAN, is_step: false }
    };

    /// Whether the nearest points are a scanner's line, and tell nothing about the surface across it.
    pub fn is_line(&self) -> bool {
        self.linearity > LINE
    }

    /// Whether a surface is known by these points.
    pub fn is_known(&self, sheet: &Sheet) -> bool {
        sheet.deviation <= THICK * self.radius && !self.is_line()
    }
}

/// What was fitted at a point, and what was made of its nearest points.
pub(super) struct FitAt<T> {
    pub point: u32,
    pub fit: LocalFit,
    pub taken: T,
}

/// Fits quadrics, for a paraboloid's bias would seem to be noise, to so many nearest points of some of a tree's points
/// (each by its number, once), and shows `take` of each what was fitted and at least `fewest` nearest points with the
/// squares of their distances, itself among them, the nearest first. What `take` makes of them comes in the order of
/// the leaves.
pub(super) fn fit_nearest<T: Send>(
    tree: &KdTree,
    positions: &[[f64; 3]],
    is_asked: &(impl Fn(u32) -> bool + Sync),
    neighbours: usize,
    fewest: usize,
    take: &(impl Fn(u32, &[(f64, u32)]) -> T + Sync),
    monitor: &Monitor,
) -> Result<Vec<Vec<FitAt<T>>>, Error> {
    let set = InstructionSet::detect();
    let of_part = |search: &mut Search, part: &[u32]| {
        monitor.check()?;
        let mut fits = Vec::with_capacity(part.len());
        let mut previous = None;
        for &point in part.iter().filter(|&&point| is_asked(point)) {
            let from = positions[point as usize];
            tree.nearest_k_after(&mut previous, from, neighbours.max(fewest), &mut search.found);
            let nearest = &search.found[..neighbours.min(search.found.len())];
            let radius = nearest.last().map_or(0.0, |(square, _)| square.sqrt());
            // Points at one place have no size; any unit does for them.
            let scale = if radius > 0.0 { 1.0 / radius } else { 1.0 };
            search.members.points.clear();
            search.members.points.extend(nearest.iter().map(|&(_, other)| {
                let other = positions[other as usize];
                [0, 1, 2].map(|axis| ((other[axis] - from[axis]) * scale) as f32)
            }));
            search.moments.push(search.members.moments::<f64>(set, |_| true));
            search.radii.push(radius);
            fits.push(FitAt { point, fit: LocalFit::MISSING, taken: take(point, &search.found) });
            if search.moments.len() == LANES {
                let start = fits.len() - LANES;
                search.fit(set, fits[start..].iter_mut().map(|at| &mut at.fit));
            }
        }
        let start = fits.len() - search.moments.len();
        search.fit(set, fits[start..].iter_mut().map(|at| &mut at.fit));
        Ok(fits)
    };
    tree.indices().par_chunks(PART).map_init(Search::new, of_part).collect()
}

/// What one thread needs.
struct Search {
    found: Vec<(f64, u32)>,
    members: Members,
    moments: Vec<Moments<f64>>,
    radii: Vec<f64>,
}

impl Search {
    fn new() -> Self {
        Self { found: Vec::new(), members: Members::new(), moments: Vec::new(), radii: Vec::new() }
    }

    /// Fits a batch.
    fn fit<'a>(&mut self, set: InstructionSet, fits: impl Iterator<Item = &'a mut LocalFit>) {
        if self.moments.is_empty() {
            return;
        }
        let moments = &MomentBatch::new(&self.moments);
        let task = Task { moments, axes: FitAxes::Surface, to_sensor: None, start: None };
        let (paraboloids, quadrics) = (fit_paraboloids(set, &task), fit_quadrics(set, &task));
        for (lane, fit) in fits.enumerate() {
            *fit = LocalFit::of(moments, &paraboloids, &quadrics, lane, self.radii[lane]);
        }
        self.moments.clear();
        self.radii.clear();
    }
}

impl LocalFit {
    /// Of one lane of a batch, whose unit is the radius of the lane's points.
    fn of(
        moments: &MomentBatch,
        paraboloids: &Paraboloids,
        quadrics: &Quadrics,
        lane: usize,
        radius: f64,
    ) -> Self {
        let count = moments.count.0[lane];
        let has_paraboloid = !paraboloids.too_few.get(lane)
            && !paraboloids.no_plane.get(lane)
            && !paraboloids.singular.get(lane);
        let of_paraboloid = if has_paraboloid { paraboloids.residual.0[lane] } else { f64::NAN };
        let of_quadric = quadrics.residual.0[lane];
        let has_plane = !paraboloids.no_plane.get(lane);
        let sheet = |principal: &Principal, residual: f64, parameters: f64| {
            let freedom = count - parameters;
            let corrected = residual * radius * (count / freedom).sqrt();
            let deviation = if freedom > 0.0 { corrected } else { f64::INFINITY };
            let normal = principal.normal.map(|v| if has_plane { v.0[lane] as f32 } else { f32::NAN });
            Sheet { normal, deviation: deviation as f32 }
        };
        let paraboloid = || sheet(&paraboloids.principal, of_paraboloid, PARABOLOID_PARAMETERS);
        let has_quadric = quadrics.trusted.get(lane);
        let best = if has_quadric {
            sheet(&quadrics.principal, of_quadric, QUADRIC_PARAMETERS)
        } else {
            paraboloid()
        };
        let is_suspicious = has_quadric && of_quadric < SUSPICIOUS * of_paraboloid;
        let coefficients = quadrics.coefficients.map(|coefficient| coefficient.0[lane]);
        let planes = is_suspicious.then(|| TwoPlanes::of(&coefficients)).flatten();
        let [xx, xy, xz, yy, yz, zz] = moments.covariance().map(|c| c.0[lane]);
        let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let [longest, middle, _] = paraboloids.spread.map(|eigenvalue| eigenvalue.0[lane]);
        Self {
            best,
            one: if planes.is_some() { paraboloid() } else { best },
            radius: radius as f32,
            linearity: ((longest - middle) / longest) as f32,
            is_step: planes.is_some_and(|planes| planes.are_side_by_side(&covariance)),
        }
    }
}

/// Two parallel planes, in units of the ball's radius.
#[derive(Debug, PartialEq)]
struct TwoPlanes {
    normal: Vector,
    separation: f64,
}

impl TwoPlanes {
    /// Where a quadric (coefficients of 1, x, y, z, xx, xy, xz, yy, yz, zz) is two parallel planes that both go through
    /// the ball.
    fn of(coefficients: &[f64; 10]) -> Option<Self> {
        let &[constant, x, y, z, xx, xy, xz, yy, yz, zz] = coefficients;
        let form = Matrix3::new(xx, 0.5 * xy, 0.5 * xz, 0.5 * xy, yy, 0.5 * yz, 0.5 * xz, 0.5 * yz, zz);
        let SymmetricEigen { eigenvalues, eigenvectors } = form.symmetric_eigen();
        let largest = eigenvalues.iamax();
        let (square, normal) = (eigenvalues[largest], eigenvectors.column(largest).into_owned());
        let linear = Vector::new(x, y, z);
        let along = linear.dot(&normal);
        let across = (linear - along * normal).norm();
        let others = (0..3).filter(|&i| i != largest).map(|i| eigenvalues[i].abs()).fold(across, f64::max);
        // The roots of square t^2 + along t + constant are where the planes are along their normal.
        let discriminant = along * along - 4.0 * square * constant;
        let separation = discriminant.max(0.0).sqrt() / square.abs();
        let is_in_ball = separation > 0.0 && separation <= 2.0;
        (others <= TWO_PLANES * square.abs() && is_in_ball).then_some(Self { normal, separation })
    }

    /// Whether the points, which have this covariance, lie side by side on the two planes, as on the steps of a sensor that
    /// measures depth in steps, and not over each other, as on both faces of a plate.
    fn are_side_by_side(&self, covariance: &Matrix3<f64>) -> bool {
        let with_height = covariance * self.normal;
        let variance = with_height.dot(&self.normal);
        // Of shares a and 1 - a of the points the heights have the variance a (1 - a) separation^2, and their
        // covariance with the places along the planes is a (1 - a) separation times the distance of the means there.
        let along = with_height - variance * self.normal;
        let distance = along.norm() * self.separation / variance;
        distance > OVERLAP * (covariance.trace() - variance).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_parallel_planes_are_no_surface() {
        // z (z - 0.5), the same turned, a cylinder of radius 0.5, a parabolic one, a sphere.
        let upright = TwoPlanes::of(&[0.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]).unwrap();
        assert!((upright.normal.z.abs() - 1.0).abs() < 1e-12 && (upright.separation - 0.5).abs() < 1e-12);
        let s = 0.5_f64.sqrt();
        let turned = TwoPlanes::of(&[0.0, -0.5 * s, 0.0, -0.5 * s, 0.5, 0.0, 1.0, 0.0, 0.0, 0.5]).unwrap();
        assert!((turned.normal.x * turned.normal.z - 0.5).abs() < 1e-12);
        assert_eq!(TwoPlanes::of(&[0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0]), None);
        assert_eq!(TwoPlanes::of(&[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), None);
        assert_eq!(TwoPlanes::of(&[0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0]), None);
        // One plane, and another far away.
        assert_eq!(TwoPlanes::of(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01]), None);
    }

    #[test]
    fn steps_lie_side_by_side_and_faces_of_a_plate_over_each_other() {
        let planes = TwoPlanes { normal: Vector::z(), separation: 0.1 };
        let covariance = |height: fn(usize) -> f64| {
            let points: Vec<Vector> = (0..100)
                .map(|i| Vector::new((i % 10) as f64 / 10.0, (i / 10) as f64 / 10.0, height(i)))
                .collect();
            let mean = points.iter().sum::<Vector>() / 100.0;
            points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>() / 100.0
        };
        assert!(planes.are_side_by_side(&covariance(|i| if i < 40 { 0.1 } else { 0.0 })));
        assert!(!planes.are_side_by_side(&covariance(|i| if i % 3 == 0 { 0.1 } else { 0.0 })));
    }
}
