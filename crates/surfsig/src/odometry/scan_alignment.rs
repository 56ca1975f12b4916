//! A scan aligned with the map: GICP, the last steps point to plane, and how well it then lies.

use super::correspondences::Correspondences;
use super::deskewing::{MotionWithin, joint_step, moved_slightly};
use super::local_map::LocalMap;
use super::settings::ScanAlignmentSettings;
use super::thinned_scan::ThinnedScan;
use crate::RigidTransform;
use crate::alignment::{
    FreeDirection, GicpCloud, GicpSettings, HeldLimits, IndependentNormals, Motions, PlaceNormals,
    UNOBSERVABLE, blocks, clustered_covariance, gicp_with, halves, lengths, orthonormal, solve_determined,
    systematic_covariance, unscaled,
};
use crate::random::some_of;
use crate::statistics::{DEVIATIONS_PER_MEDIAN, median};
use nalgebra::{Matrix6, Vector3, Vector6};
use rayon::prelude::*;
use std::cell::OnceCell;
use std::collections::BTreeMap;

/// Eigenvalues of the normal matrix below this share of the largest are rounding: no step goes there.
const ROUNDING: f64 = 1e-9;
/// Points that one thread takes at a time.
const PART: usize = 256;
/// What a correspondence would have to say about a motion that steps leave out, in what one along its normal says.
const FIXED: f64 = 1e6;

/// How a scan lies on the map; lengths are in voxels.
#[allow(non_snake_case)]
#[derive(Debug, Clone)]
pub(super) struct ScanAlignment {
    pub T_map_scan: RigidTransform,
    /// Of the twist in the scan's axes by which the pose is off, if the map is right; without free directions, along
    /// which the pose is the predicted one.
    pub covariance: Matrix6<f64>,
    /// What errs alike over large parts of the scan, likewise.
    pub systematic: Matrix6<f64>,
    /// Points of the scan.
    pub count: usize,
    /// Share of them that lie on the map's surface.
    pub overlap: f64,
    /// Share of the map's points in free space, of those that the sensor would have measured.
    pub free_space: f64,
    /// Share of the scan's points that earlier scans would have measured.
    pub known: f64,
    /// Share of the scan's points that the map lacks, of those that earlier scans would have measured.
    pub unexplained: f64,
    /// Motions that the map does not determine, in the scan's coordinates.
    pub free_directions: Vec<FreeDirection>,
    /// The scans that the map's points on which it lies came from, each with its share of them.
    pub scans: Vec<(u32, f64)>,
    /// How the sensor moved within the scan, where the times of its points are known, and where these then are.
    pub within: Option<(Vector6<f64>, Vec<[f64; 3]>)>,
}

impl ScanAlignment {
    /// Standard deviation of the pose along the motions that the map determines: the distance by which it may carry
    /// a point at a range, in voxels.
    pub fn deviation(&self, range: f64) -> f64 {
        let twists: Vec<Vector6<f64>> =
            self.free_directions.iter().flat_map(|direction| direction.twists([0.0; 3])).collect();
        let free: Matrix6<f64> =
            orthonormal(&twists, range).iter().map(|motion| motion * motion.transpose()).sum();
        let kept = Matrix6::identity() - free;
        let both = lengths(range) * (self.covariance + self.systematic) * lengths(range);
        (kept * both * kept).trace().max(0.0).sqrt()
    }
}

/// Where an alignment starts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    pub pose: RigidTransform,
    /// Between corresponding points, in the first round.
    pub max_distance: f64,
    /// Whether nothing is known of the motion to it: few points may then lead to a wrong pose, and the first round takes all.
    pub is_guess: bool,
}

impl Start {
    /// A start that a motion or a search has led to.
    pub fn near(pose: RigidTransform, max_distance: f64) -> Self {
        Self { pose, max_distance, is_guess: false }
    }
}

/// Aligns a scan from a pose nearby; `None` where it hardly meets the map. Along motions that the map does not determine
/// the pose stays where it started.
///
/// `would_be_known` tells by the scan's pose which of its points earlier scans would have measured.
pub(super) fn align<F: Fn([f64; 3]) -> bool>(
    scan: &ThinnedScan,
    map: &LocalMap,
    start: Start,
    settings: &ScanAlignmentSettings,
    would_be_known: impl FnOnce(&RigidTransform) -> F,
) -> Option<ScanAlignment> {
    let Start { pose: start, max_distance, is_guess } = start;
    let first = if is_guess { &scan.coarse } else { &scan.few };
    let mut pose = gicp_round(first, map, start, max_distance, settings)?;
    pose = gicp_round(&scan.coarse, map, pose, max_distance.min(settings.max_point_distance), settings)?;
    let mut correspondences = Correspondences::new(scan.points.len());
    for _ in 0..settings.plane_steps {
        let plane = PointToPlane::new(&scan.points, map, &pose, &mut correspondences, settings)?;
        pose = pose * plane.step();
    }
    let within = match &scan.motion {
        Some(motion) => {
            Some(refined_within(&scan.points, motion, map, &mut pose, &mut correspondences, settings)?)
        }
        None => None,
    };
    let points = within.as_ref().map_or(&scan.points, |(_, points)| points);
    // Products of rotations are rotations but for rounding, which would grow with the trajectory.
    pose = RigidTransform::from_matrix(&pose.to_matrix()).unwrap_or(pose);
    let mut plane = PointToPlane::new(points, map, &pose, &mut correspondences, settings)?;
    let free_directions = plane.free_directions(map, &pose, settings);
    let twists: Vec<Vector6<f64>> =
        free_directions.iter().flat_map(|direction| direction.twists([0.0; 3])).collect();
    if !twists.is_empty() {
        let unit = plane.unit();
        let fixed = orthonormal(&twists, unit);
        pose = without_motion(&start, &pose, &fixed, unit);
        for _ in 0..settings.constrained_steps {
            plane = PointToPlane::new(points, map, &pose, &mut correspondences, settings)?;
            plane.fix(&fixed, unit);
            pose = pose * plane.step();
        }
        plane = PointToPlane::new(points, map, &pose, &mut correspondences, settings)?;
        plane.fix(&fixed, unit);
    }
    let is_known = would_be_known(&pose);
    let (mut known, mut lacking) = (0_usize, 0_usize);
    for (point, explained) in points.iter().zip(&plane.explained) {
        let is_known = is_known(*point);
        known += usize::from(is_known);
        lacking += usize::from(is_known && !explained);
    }
    let to_scan = pose.inverse();
    let stride = map.len().div_ceil(settings.free_space_samples.max(1)).max(1);
    let samples = map.points().iter().step_by(stride).map(|point| to_scan.transform_point(*point));
    let (covariance, systematic) = plane.covariance();
    Some(ScanAlignment {
        T_map_scan: pose,
        covariance,
        systematic,
        count: scan.points.len(),
        overlap: plane.on_map as f64 / scan.points.len() as f64,
        free_space: scan.range_image.free_space_share(samples),
        known: known as f64 / scan.points.len() as f64,
        unexplained: lacking as f64 / known.max(1) as f64,
        free_directions,
        scans: plane.shares_of_scans(map),
        within,
    })
}

/// The first round of [`align`], with some of the scan's points: near enough for the second one.
pub(super) fn align_roughly(
    scan: &ThinnedScan,
    map: &LocalMap,
    start: RigidTransform,
    max_distance: f64,
    settings: &ScanAlignmentSettings,
) -> Option<RigidTransform> {
    gicp_round(&scan.few, map, start, max_distance, settings)
}

fn gicp_round(
    points: &GicpCloud,
    map: &LocalMap,
    start: RigidTransform,
    max_distance: f64,
    settings: &ScanAlignmentSettings,
) -> Option<RigidTransform> {
    let round = GicpSettings {
        max_correspondence_distance: max_distance,
        max_iterations: settings.max_iterations,
        rotation_epsilon: settings.rotation_epsilon,
        translation_epsilon: settings.translation_epsilon,
    };
    let found = gicp_with(map, points, start, &round);
    (found.inliers >= settings.min_correspondences).then_some(found.T_target_source)
}

/// Refines pose and motion within the scan at once: the twist, and where the points then are.
fn refined_within(
    points: &[[f64; 3]],
    expected: &MotionWithin,
    map: &LocalMap,
    pose: &mut RigidTransform,
    correspondences: &mut Correspondences,
    settings: &ScanAlignmentSettings,
) -> Option<(Vector6<f64>, Vec<[f64; 3]>)> {
    let mut motion = expected.clone();
    let mut moved = points.to_vec();
    for _ in 0..settings.deskew_steps {
        let plane = PointToPlane::new(&moved, map, pose, correspondences, settings)?;
        let times = plane.numbers.iter().map(|number| expected.times[*number as usize]);
        let Some((step, change)) =
            joint_step(&plane.design, &plane.residuals, times, &motion, &expected.at_pose(pose))
        else {
            break;
        };
        *pose = *pose * RigidTransform::exp(step.into());
        motion.twist += change;
        for (point, time) in moved.iter_mut().zip(&expected.times) {
            *point = moved_slightly(*point, &(change * *time));
        }
    }
    Some((motion.twist, moved))
}

/// A pose without the part of its motion from a start that is along unit motions, which have rotations in units of
/// `unit`.
fn without_motion(
    start: &RigidTransform,
    pose: &RigidTransform,
    motions: &[Vector6<f64>],
    unit: f64,
) -> RigidTransform {
    let twist = Vector6::from((start.inverse() * *pose).log());
    let scaled = lengths(unit) * twist;
    let rest = motions.iter().fold(scaled, |rest, motion| rest - motion * motion.dot(&rest));
    *start * RigidTransform::exp(unscaled(&rest, unit).into())
}

/// The inliers of a pose, linearised.
struct PointToPlane {
    /// How each residual changes with a twist in the scan's axes.
    design: Vec<[f64; 6]>,
    residuals: Vec<f64>,
    /// The scan's points.
    points: Vec<[f64; 3]>,
    /// Their numbers.
    numbers: Vec<u32>,
    /// Numbers of the map's points.
    targets: Vec<u32>,
    /// For each point of the scan, whether the map has it.
    explained: Vec<bool>,
    /// Inliers, and points beside those of the map that are on no plane.
    on_map: usize,
    information: Matrix6<f64>,
    gradient: Vector6<f64>,
}

impl PointToPlane {
    /// `None` where inliers are too few.
    fn new(
        points: &[[f64; 3]],
        map: &LocalMap,
        pose: &RigidTransform,
        correspondences: &mut Correspondences,
        settings: &ScanAlignmentSettings,
    ) -> Option<Self> {
        let found = correspondences.update(map, points, pose, settings.max_point_distance);
        // The residual r = n (p - q) of a moved point p and the map's point q with its normal n, where it has one.
        let residual = |index: u32, point: &[f64; 3]| {
            let moved = Vector3::from(pose.transform_point(*point));
            let normal = Vector3::from(map.normal(index)?);
            Some(normal.dot(&(moved - Vector3::from(map.points()[index as usize]))))
        };
        let residuals: Vec<Option<f64>> = found
            .par_iter()
            .zip(points)
            .with_min_len(PART)
            .map(|(other, point)| other.and_then(|(index, _)| residual(index, point)))
            .collect();
        let sizes: Vec<f64> = residuals.iter().flatten().map(|residual| residual.abs()).collect();
        let deviation = DEVIATIONS_PER_MEDIAN * median(sizes)?;
        let limit = settings.max_residual.min(settings.max_deviation * deviation.max(settings.min_deviation));
        let beside = settings.explained_distance * settings.explained_distance;
        let mut plane = Self {
            design: Vec::with_capacity(found.len()),
            residuals: Vec::with_capacity(found.len()),
            points: Vec::with_capacity(found.len()),
            numbers: Vec::with_capacity(found.len()),
            targets: Vec::with_capacity(found.len()),
            explained: Vec::with_capacity(found.len()),
            on_map: 0,
            information: Matrix6::zeros(),
            gradient: Vector6::zeros(),
        };
        let to_scan = pose.inverse();
        for (number, ((other, residual), point)) in (0..).zip(found.iter().zip(&residuals).zip(points)) {
            let is_beside = other.is_some_and(|(_, squared)| squared < beside);
            let is_inlier = residual.map(|residual| residual.abs() < limit);
            plane
                .explained
                .push(is_beside || residual.is_some_and(|residual| residual.abs() < settings.max_residual));
            plane.on_map += usize::from(is_inlier.unwrap_or(is_beside));
            let (Some(true), Some((index, _)), Some(residual)) = (is_inlier, *other, *residual) else {
                continue;
            };
            // d r / d (w, v) of the pose T exp(w, v) is (p x n, n) in the scan's axes.
            let normal = Vector3::from(to_scan.transform_vector(map.normal(index).unwrap_or_default()));
            let torque = Vector3::from(*point).cross(&normal);
            plane.design.push([torque.x, torque.y, torque.z, normal.x, normal.y, normal.z]);
            plane.residuals.push(residual);
            plane.points.push(*point);
            plane.numbers.push(number);
            plane.targets.push(index);
        }
        if plane.residuals.len() < settings.min_correspondences {
            return None;
        }
        for (row, residual) in plane.design.iter().zip(&plane.residuals) {
            for i in 0..6 {
                for j in i..6 {
                    plane.information[(i, j)] += row[i] * row[j];
                }
                plane.gradient[i] += row[i] * residual;
            }
        }
        plane.information.fill_lower_triangle_with_upper_triangle();
        Some(plane)
    }

    /// The motion in the scan's axes that makes the residuals least, along the directions that they determine.
    fn step(&self) -> RigidTransform {
        let step = -solve_determined(self.information, &self.gradient, ROUNDING);
        let [x, y, z, translation @ ..] = <[f64; 6]>::from(step);
        RigidTransform::from_rotation_vector([x, y, z], translation)
    }

    /// The length by which a rotation moves the surface along its normals, per radian.
    fn unit(&self) -> f64 {
        let torques = self.design.iter().map(|row| Vector3::new(row[0], row[1], row[2]).norm_squared());
        let size = (torques.sum::<f64>() / self.residuals.len() as f64).sqrt();
        if size > 0.0 { size } else { 1.0 }
    }

    /// Makes steps leave out unit motions, which have rotations in units of `unit`.
    fn fix(&mut self, motions: &[Vector6<f64>], unit: f64) {
        let weight = FIXED * self.residuals.len() as f64;
        for motion in motions {
            let row = lengths(unit) * motion;
            self.information += row * row.transpose() * weight;
        }
    }

    /// By blocks of neighbouring points, or by points where blocks are few; and what halves say beyond.
    fn covariance(&self) -> (Matrix6<f64>, Matrix6<f64>) {
        let block = blocks(&self.points).unwrap_or_else(|| (0..self.points.len() as u32).collect());
        let normals: Vec<[f64; 3]> = self.design.iter().map(|row| [row[3], row[4], row[5]]).collect();
        let divided = halves(&self.points, &normals);
        (
            clustered_covariance(&self.design, &self.residuals, &block),
            systematic_covariance(&self.design, &self.residuals, &divided, &block),
        )
    }

    /// Motions of the scan, in its coordinates, that the map does not determine: along some its surface slides over
    /// itself, and along others only errors of the map's normals would hold it.
    fn free_directions(
        &self,
        map: &LocalMap,
        pose: &RigidTransform,
        settings: &ScanAlignmentSettings,
    ) -> Vec<FreeDirection> {
        let normals: Vec<[f64; 3]> = self.design.iter().map(|row| [row[3], row[4], row[5]]).collect();
        let motions = Motions::new(&self.points, &normals);
        let halves = OnceCell::new();
        let limits = HeldLimits { share: settings.held_share, deviations: settings.held_deviations };
        motions.named(|sliding, number| {
            let is_held = || {
                let halves = halves.get_or_init(|| self.half_normals(map, pose, settings.held_samples));
                halves.hold(|point| motions.velocity(number, point), limits)
            };
            sliding <= UNOBSERVABLE || sliding <= settings.weak && !is_held()
        })
    }

    /// Normals of both halves of the map's neighbourhoods at some of the points, in the scan's coordinates.
    fn half_normals(&self, map: &LocalMap, pose: &RigidTransform, samples: usize) -> IndependentNormals {
        let to_scan = pose.inverse();
        let of_point = |i: usize| {
            let used = to_scan.transform_vector(map.normal(self.targets[i])?);
            let halves = map.half_normals(self.targets[i])?;
            let independent = halves.map(|half| to_scan.transform_vector(half));
            Some(PlaceNormals { point: self.points[i], used, independent })
        };
        IndependentNormals::new(some_of(self.points.len(), samples).into_iter().filter_map(of_point))
    }

    fn shares_of_scans(&self, map: &LocalMap) -> Vec<(u32, f64)> {
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        for target in &self.targets {
            *counts.entry(map.scans()[*target as usize]).or_default() += 1;
        }
        let all = self.targets.len() as f64;
        counts.into_iter().map(|(scan, count)| (scan, count as f64 / all)).collect()
    }
}
