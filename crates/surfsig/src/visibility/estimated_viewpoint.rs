//! From where a scan was measured, told by the density of its points.
//!
//! A sensor sends its rays evenly over directions, so that a surface at distance `r`, whose normal makes the angle `a` with
//! the ray, holds so many points for an area as `cos(a) / r^2`: the logarithm of the density, plus `2 ln r`, less `ln cos(a)`,
//! is the same everywhere for the true viewpoint only. It is fitted robustly. Sensors are not quite even: rows of a lidar
//! come closer towards its poles, pixels of a camera towards its rims. So the logarithm may change with the direction `u`
//! as `u^T A u`, the lowest even function of it.

use super::possible_viewpoint::may_be_scan_from;
use crate::kd_tree::KdTree;
use crate::random::some_of;
use crate::statistics::median;
use crate::voxels::voxel_means;
use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, Vector3};
use rayon::prelude::*;

/// Points at which the density is taken, at most: the errors of their densities are evened out by the fit.
const SAMPLE: usize = 4000;
/// Of these, one in so many is fitted from all starts.
const COARSE_STEP: usize = 8;
/// Points of a scan that are looked at, at most: those at random are as dense, relative to each other, as all.
const MOST: usize = 500_000;
/// Points without which nothing is said.
const LEAST: usize = 200;
/// Nearest points from which density and normal are taken: their number errs by a fifth, which the fit evens out.
const NEIGHBORS: usize = 24;
/// Points that a thread takes at a time.
const PART: usize = 128;
/// Thickness of a neighbourhood over its smaller width, at most: normals of others mean nothing.
const THICKEST: f64 = 0.35;
/// Smaller variance within a neighbourhood over the larger one, at least: points of one scan line have no area.
const LEAST_AREA: f64 = 0.02;
/// Cosine of the angle between ray and normal, at least: at steeper ones the normal's error is all that counts.
const GRAZING: f64 = 0.05;
/// Scale of the robust loss (Cauchy's), in the logarithm of the density: what the count of neighbours errs by.
const LOSS: f64 = 0.2;
/// Median error of the logarithm that is left, over its median deviation without a viewpoint, at most. Scans from one
/// place leave 0.01 to 0.1 of it, one point in four of them at random 0.45, surfaces that are sampled evenly, fused maps
/// and random points 0.9 and more.
const UNEXPLAINED: f64 = 0.6;
/// Mean loss, at most: counts of neighbours that err by chance alone lose 0.56; a forest's thin trunks 0.65.
const LARGEST_LOSS: f64 = 0.75;
/// Starts are the middle of the points and places at so many sizes from it, along axes and diagonals: of six depth
/// images two are missed with 6 directions and the first and last of the distances, none with these.
const DISTANCES: [f64; 3] = [0.7, 1.5, 3.0];
/// Starts that are fitted to the end.
const FITTED: usize = 3;
/// Steps of a fit, at most.
const STEPS: usize = 40;
/// Attempts at a step that lowers the loss, each damped four times as much as the one before.
const ATTEMPTS: usize = 8;
/// Decrease of the loss below which a fit has converged.
const CONVERGED: f64 = 1e-7;
/// Voxels along the size of a scan (the median distance from its middle), of which is told whether all is seen.
const VOXELS: f64 = 40.0;
/// A viewpoint, the logarithm of the density, and the five components of a symmetric matrix without a trace.
const UNKNOWNS: usize = 9;
/// Those without the matrix.
const EVEN: usize = 4;

/// From where a sensor has measured points, which are finite; `None` where their density does not tell, or too many of
/// them would be hidden from there, or nothing stands before anything else: many viewpoints fit the density of one smooth
/// surface.
///
/// ```
/// use surfsig::estimated_viewpoint;
/// // The walls of a room, and a pillar, measured from the origin in directions that are evenly spread.
/// let directions = (0..8000).map(|i| {
///     let z = 1.0 - (f64::from(i) + 0.5) / 4000.0;
///     let (sine, cosine) = ((f64::from(i) + 0.5) * 2.399963229728653).sin_cos();
///     [(1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z]
/// });
/// let points: Vec<[f64; 3]> = directions
///     .map(|ray: [f64; 3]| {
///         let walls = (0..3).map(|k| if ray[k] > 0.0 { [4.0, 3.0, 1.5][k] / ray[k] } else { -2.0 / ray[k] });
///         let wall = walls.fold(f64::INFINITY, f64::min);
///         let is_pillar = ray[0] > 0.0 && (ray[1] / ray[0]).abs() < 0.15;
///         ray.map(|x| x * if is_pillar { wall.min(1.5 / ray[0]) } else { wall })
///     })
///     .collect();
/// let found = estimated_viewpoint(&points).expect("the density tells");
/// assert!(found.iter().all(|x| x.abs() < 0.05));
/// ```
pub fn estimated_viewpoint(points: &[[f64; 3]]) -> Option<[f64; 3]> {
    let densities = Densities::new(points)?;
    let found = densities.viewpoint()?;
    let voxel = densities.size / VOXELS;
    may_be_scan_from(found, &voxel_means(points, voxel), voxel).then_some(found)
}

/// The surface around a point.
#[derive(Clone, Copy)]
struct Patch {
    position: Vector3<f64>,
    /// Of which the side is open.
    normal: Vector3<f64>,
    /// Natural logarithm of the points for an area.
    density: f64,
}

/// Patches of a scan about its middle.
struct Densities {
    patches: Vec<Patch>,
    middle: Vector3<f64>,
    /// Median distance of the patches from the middle.
    size: f64,
}

/// What is fitted: the viewpoint first.
type Unknowns = SVector<f64, UNKNOWNS>;

/// A fit with the loss that is left.
#[derive(Clone, Copy)]
struct Fit {
    unknowns: Unknowns,
    loss: f64,
}

impl Densities {
    fn new(points: &[[f64; 3]]) -> Option<Self> {
        if points.len() < LEAST {
            return None;
        }
        let points: Vec<[f64; 3]> = some_of(points.len(), MOST).into_iter().map(|i| points[i]).collect();
        let tree = KdTree::new(&points);
        let patch = |found: &mut Vec<(f64, u32)>, number: usize| {
            tree.nearest_k(points[number], NEIGHBORS, found);
            patch_of(&found.iter().map(|&(_, index)| points[index as usize].into()).collect::<Vec<_>>())
        };
        let chosen = some_of(points.len(), SAMPLE);
        let patches: Vec<Option<Patch>> =
            chosen.into_par_iter().with_min_len(PART).map_init(Vec::new, patch).collect();
        let mut patches: Vec<Patch> = patches.into_iter().flatten().collect();
        if patches.len() < LEAST {
            return None;
        }
        let middle = Vector3::from_fn(|k, _| {
            median(patches.iter().map(|patch| patch.position[k]).collect()).unwrap_or(0.0)
        });
        for patch in &mut patches {
            patch.position -= middle;
        }
        let size = median(patches.iter().map(|patch| patch.position.norm()).collect())?;
        (size > 0.0 && size.is_finite()).then_some(Self { patches, middle, size })
    }

    fn viewpoint(&self) -> Option<[f64; 3]> {
        let components = [-1.0_f64, 0.0, 1.0];
        let about = components.into_iter().flat_map(|x| {
            components
                .into_iter()
                .flat_map(move |y| components.into_iter().map(move |z| Vector3::new(x, y, z)))
        });
        // Axes have one component, diagonals three.
        let directions = about.filter(|v| matches!(v.iter().filter(|x| **x != 0.0).count(), 1 | 3));
        let directions: Vec<Vector3<f64>> = directions.map(|direction| direction.normalize()).collect();
        let around = DISTANCES
            .into_iter()
            .flat_map(|distance| directions.iter().map(move |direction| direction * (distance * self.size)));
        let starts: Vec<Vector3<f64>> = [Vector3::zeros()].into_iter().chain(around).collect();
        let mut fits: Vec<Fit> =
            starts.into_par_iter().map(|start| self.fitted(self.begun(start), EVEN, COARSE_STEP)).collect();
        // A stable sort: of equal losses the first start.
        fits.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        fits.truncate(FITTED);
        let fits: Vec<[Fit; 2]> =
            fits.into_par_iter().map(|even| [even, self.fitted(even.unknowns, UNKNOWNS, 1)]).collect();
        let [even, best] =
            fits.into_iter().reduce(|best, fit| if fit[1].loss < best[1].loss { fit } else { best })?;
        let left =
            |fit: &Fit| median(self.patches.iter().map(|patch| error(patch, &fit.unknowns).abs()).collect());
        let middle = median(self.patches.iter().map(|patch| patch.density).collect())?;
        let before = median(self.patches.iter().map(|patch| (patch.density - middle).abs()).collect())?;
        let viewpoint = best.unknowns.fixed_rows::<3>(0) + self.middle;
        // The viewpoint must explain the density alone, too: the sensor's part would fit any smooth change.
        let is_explained = left(&best)?.max(left(&even)?) < UNEXPLAINED * before;
        let tells = best.loss < LARGEST_LOSS && is_explained;
        (tells && viewpoint.iter().all(|x| x.is_finite())).then(|| viewpoint.into())
    }

    /// A viewpoint with the density that fits it best, the same in all directions.
    fn begun(&self, viewpoint: Vector3<f64>) -> Unknowns {
        let mut unknowns = Unknowns::zeros();
        unknowns.fixed_rows_mut::<3>(0).copy_from(&viewpoint);
        let errors = self.patches.iter().map(|patch| error(patch, &unknowns)).collect();
        unknowns[3] = median(errors).unwrap_or(0.0);
        unknowns
    }

    fn loss(&self, unknowns: &Unknowns, step: usize) -> f64 {
        let loss = |patch: &Patch| (error(patch, unknowns) / LOSS).powi(2).ln_1p();
        let loss = self.patches.iter().step_by(step).map(loss).sum::<f64>() / self.patches.len() as f64;
        if loss.is_nan() { f64::INFINITY } else { loss }
    }

    /// Fits the first of the unknowns to one patch in `step`, by iteratively reweighted least squares, damped as
    /// Levenberg and Marquardt do.
    fn fitted(&self, start: Unknowns, used: usize, step: usize) -> Fit {
        let mut fit = Fit { unknowns: start, loss: self.loss(&start, step) };
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let (products, gradient) = self.normal_equations(&fit.unknowns, used, step);
            let mut next = None;
            for _ in 0..ATTEMPTS {
                let mut damped = products;
                for k in 0..UNKNOWNS {
                    damped[(k, k)] += damping * products[(k, k)] + f64::MIN_POSITIVE;
                }
                if let Some(factored) = damped.cholesky() {
                    let mut change = -factored.solve(&gradient);
                    let length = change.fixed_rows::<3>(0).norm();
                    if length > self.size {
                        change *= self.size / length;
                    }
                    let unknowns = fit.unknowns + change;
                    let loss = self.loss(&unknowns, step);
                    if loss < fit.loss {
                        next = Some(Fit { unknowns, loss });
                        break;
                    }
                }
                damping *= 4.0;
            }
            let Some(better) = next else { break };
            let decrease = fit.loss - better.loss;
            fit = better;
            damping = (0.25 * damping).max(1e-9);
            if decrease < CONVERGED {
                break;
            }
        }
        fit
    }

    /// Of the first unknowns; the others stay as they are.
    fn normal_equations(
        &self,
        unknowns: &Unknowns,
        used: usize,
        step: usize,
    ) -> (SMatrix<f64, UNKNOWNS, UNKNOWNS>, Unknowns) {
        let (mut products, mut gradient) = (SMatrix::zeros(), Unknowns::zeros());
        for patch in self.patches.iter().step_by(step) {
            let (error, mut row) = linearised(patch, unknowns);
            row.rows_mut(used, UNKNOWNS - used).fill(0.0);
            let weight = 1.0 / (1.0 + (error / LOSS).powi(2));
            products += row * row.transpose() * weight;
            gradient += row * (weight * error);
        }
        for k in used..UNKNOWNS {
            products[(k, k)] = 1.0;
        }
        (products, gradient)
    }
}

/// Density and normal of neighbouring points, the first of which is the one that they are for.
fn patch_of(around: &[Vector3<f64>]) -> Option<Patch> {
    let count = around.len() as f64;
    let mean = around.iter().sum::<Vector3<f64>>() / count;
    let spread = around.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>() / count;
    let eigen = SymmetricEigen::new(spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let [long, middle, short] = order.map(|k| eigen.eigenvalues[k].max(0.0));
    let is_surface = middle > LEAST_AREA * long && short < THICKEST * THICKEST * middle;
    // The variance of an ellipse along an axis is a quarter of the square of its half length.
    let area = 4.0 * std::f64::consts::PI * (long * middle).sqrt();
    let density = (count / area).ln();
    let normal = eigen.eigenvectors.column(order[2]).into_owned();
    (is_surface && density.is_finite()).then_some(Patch { position: around[0], normal, density })
}

/// By how much more the logarithm of a density is than that of the sensor, brought to one distance and angle.
fn error(patch: &Patch, unknowns: &Unknowns) -> f64 {
    let ray = patch.position - unknowns.fixed_rows::<3>(0);
    let distance = ray.norm();
    let direction = ray / distance;
    let cosine = direction.dot(&patch.normal).abs().max(GRAZING);
    patch.density + 2.0 * distance.ln() - cosine.ln() - sensor(&direction).dot(&unknowns.fixed_rows::<6>(3))
}

/// What the unknowns but the viewpoint say in a direction: 1, and the components of a symmetric matrix without a trace.
fn sensor(u: &Vector3<f64>) -> SVector<f64, 6> {
    let square = u.z * u.z;
    SVector::from([1.0, u.x * u.x - square, u.y * u.y - square, u.x * u.y, u.x * u.z, u.y * u.z])
}

/// The error, and how it changes with the unknowns; that the direction changes with the viewpoint is left out of the
/// sensor's part, which is small.
fn linearised(patch: &Patch, unknowns: &Unknowns) -> (f64, Unknowns) {
    let ray = patch.position - unknowns.fixed_rows::<3>(0);
    let distance = ray.norm();
    let direction = ray / distance;
    let along = direction.dot(&patch.normal);
    let of_cosine =
        if along.abs() > GRAZING { (direction - patch.normal / along) / distance } else { Vector3::zeros() };
    let mut row = Unknowns::zeros();
    row.fixed_rows_mut::<3>(0).copy_from(&(-2.0 / distance * direction - of_cosine));
    row.fixed_rows_mut::<6>(3).copy_from(&-sensor(&direction));
    (error(patch, unknowns), row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;
    use std::f64::consts::PI;

    /// Walls of a room of 6 x 5 x 2.5 with a pillar, measured from a place in it in directions by chance.
    fn room(viewpoint: [f64; 3], is_even: bool) -> Vec<[f64; 3]> {
        let ray = |i: usize| -> [f64; 3] {
            let (u, v) = (2.0 * uniform(i, 3) - 1.0, 2.0 * PI * uniform(i, 4));
            // Evenly over directions, or, as a lidar with lines, over elevations, up to 60 degrees.
            let z = if is_even { u } else { (PI / 3.0 * u).sin() };
            [(1.0 - z * z).sqrt() * v.cos(), (1.0 - z * z).sqrt() * v.sin(), z]
        };
        let hit = |ray: [f64; 3]| {
            let to_wall = |k: usize| {
                let wall = if ray[k] > 0.0 { [6.0, 5.0, 2.5][k] } else { 0.0 };
                (wall - viewpoint[k]) / ray[k]
            };
            let pillar = (4.0 - viewpoint[0]) / ray[0];
            let y = viewpoint[1] + pillar * ray[1];
            let wall = (0..3).map(to_wall).fold(f64::INFINITY, f64::min);
            let distance = if pillar > 0.0 && (y - 2.0).abs() < 0.3 { wall.min(pillar) } else { wall };
            std::array::from_fn(|k| viewpoint[k] + distance * ray[k])
        };
        (0..20_000).map(ray).map(hit).collect()
    }

    #[test]
    fn a_room_tells_from_where_it_was_scanned() {
        for viewpoint in [[2.0, 1.5, 1.2], [2.5, 2.4, 1.0]] {
            for is_even in [true, false] {
                let found = estimated_viewpoint(&room(viewpoint, is_even)).expect("the density tells");
                let off = (Vector3::from(found) - Vector3::from(viewpoint)).norm();
                assert!(off < 0.08, "{viewpoint:?} {is_even} {off}");
            }
        }
    }

    #[test]
    fn the_estimate_moves_with_the_scan() {
        let motion = crate::RigidTransform::from_rotation_vector([0.4, -0.9, 1.9], [30.0, -20.0, 10.0]);
        let viewpoint = [2.0, 1.5, 1.2];
        let found = estimated_viewpoint(&motion.transform_points(&room(viewpoint, true))).expect("it tells");
        let off = Vector3::from(motion.inverse().transform_point(found)) - Vector3::from(viewpoint);
        assert!(off.norm() < 0.08, "{off}");
    }

    #[test]
    fn points_that_are_spread_evenly_over_a_surface_do_not_tell() {
        let walls = (0..20_000).map(|i| {
            let mut point = [6.0 * uniform(i, 1), 5.0 * uniform(i, 2), 2.5 * uniform(i, 3)];
            let k = i % 3;
            point[k] = if i % 2 == 0 { 0.0 } else { [6.0, 5.0, 2.5][k] };
            point
        });
        assert_eq!(estimated_viewpoint(&walls.collect::<Vec<_>>()), None);
    }

    #[test]
    fn too_few_equal_or_huge_points_do_not_tell() {
        for points in [vec![], vec![[1.0; 3]; 500], vec![[1e300, 0.0, 0.0]; 500]] {
            assert_eq!(estimated_viewpoint(&points), None);
        }
    }
}
