//! Distribution to distribution: a transform near the right one, refined by generalised ICP.
//!
//! Segal, Hähnel, Thrun: Generalized-ICP (RSS 2009). Each point stands for a small piece of plane; a residual counts
//! along the normals of both, and hardly within the planes.

use super::gicp_cloud::{GicpCloud, GicpTarget};
use crate::geometry::RigidTransform;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use rayon::prelude::*;

/// Variance across a piece of plane, in that along it: the value of the paper.
const FLATNESS: f64 = 1e-3;
/// Points that a thread sums at a time. Sums of parts are added in their order: the same bits on any number of threads.
const PART: usize = 512;
/// The damping of the first step, and its growth and fall (Levenberg and Marquardt).
const DAMPING: f64 = 1e-3;
const DAMPING_FACTOR: f64 = 10.0;
/// Steps of growing damping that are tried before the transform is left as it is.
const MAX_TRIALS: usize = 10;

/// How [`gicp`] searches; lengths are in the unit of the points.
///
/// ```
/// let settings = surfsig::GicpSettings { max_correspondence_distance: 2.0, ..Default::default() };
/// assert_eq!(settings.max_iterations, 20);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GicpSettings {
    /// Largest distance between two points that correspond.
    pub max_correspondence_distance: f64,
    /// Steps after which the transform is taken as it is.
    pub max_iterations: usize,
    /// Rotation of a step, in radians, below which with `translation_epsilon` the transform has converged.
    pub rotation_epsilon: f64,
    /// Translation of a step, likewise.
    pub translation_epsilon: f64,
}

impl Default for GicpSettings {
    /// For clouds with about one point for each unit of length, as small_gicp's.
    fn default() -> Self {
        Self {
            max_correspondence_distance: 1.0,
            max_iterations: 20,
            rotation_epsilon: 0.1_f64.to_radians(),
            translation_epsilon: 1e-3,
        }
    }
}

/// What [`gicp`] found.
///
/// ```
/// let empty = surfsig::GicpCloud::new(Vec::new());
/// let start = surfsig::RigidTransform::identity();
/// let found = surfsig::gicp(&empty, &empty, start, &surfsig::GicpSettings::default());
/// assert_eq!((found.inliers, found.T_target_source), (0, start));
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GicpResult {
    /// Takes the source's points to the target.
    pub T_target_source: RigidTransform,
    /// Points of the source that had a correspondence in the last step.
    pub inliers: usize,
    /// Whether the last step was smaller than the epsilons.
    pub converged: bool,
}

/// A point of the source and the target's point it corresponds to, with the inverse of their joint covariance.
struct Correspondence {
    source: Vector3<f64>,
    target: Vector3<f64>,
    information: Matrix3<f64>,
}

/// The normal equations of a step: H x = -g.
struct NormalEquations {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    error: f64,
}

/// Refines a transform that is nearly right; where no point has a correspondence it stays as it is.
///
/// ```
/// use surfsig::{gicp, GicpCloud, GicpSettings, RigidTransform};
///
/// let height = |x: f64, y: f64| (0.3 * x).sin() + (0.25 * y).cos();
/// let bumps: Vec<[f64; 3]> = (0..900)
///     .map(|i| (f64::from(i % 30), f64::from(i / 30)))
///     .map(|(x, y)| [x, y, height(x, y)])
///     .collect();
/// let truth = RigidTransform::from_rotation_vector([0.02, -0.01, 0.03], [0.3, -0.2, 0.4]);
/// let moved = GicpCloud::new(truth.inverse().transform_points(&bumps));
/// let settings = GicpSettings { max_correspondence_distance: 4.0, ..Default::default() };
/// let found = gicp(&GicpCloud::new(bumps), &moved, RigidTransform::identity(), &settings);
/// let off = (truth.inverse() * found.T_target_source).log();
/// assert!(found.converged && off.iter().all(|component| component.abs() < 1e-3));
/// ```
pub fn gicp(
    target: &GicpCloud,
    source: &GicpCloud,
    start: RigidTransform,
    settings: &GicpSettings,
) -> GicpResult {
    gicp_with(target, source, start, settings)
}

/// [`gicp`] with any target.
pub(crate) fn gicp_with<Target: GicpTarget>(
    target: &Target,
    source: &GicpCloud,
    start: RigidTransform,
    settings: &GicpSettings,
) -> GicpResult {
    let mut transform = start;
    let mut inliers = 0;
    let mut damping = DAMPING;
    let mut memory = vec![Target::Memory::default(); source.len()];
    for _ in 0..settings.max_iterations {
        let correspondences =
            correspondences(target, source, &transform, settings.max_correspondence_distance, &mut memory);
        inliers = correspondences.len();
        if inliers == 0 {
            break;
        }
        let equations = normal_equations(&correspondences, &transform);
        let Some((better, step)) = damped_step(&correspondences, &equations, &transform, &mut damping) else {
            // No step makes the error smaller: this is its minimum.
            return GicpResult { T_target_source: transform, inliers, converged: true };
        };
        transform = better;
        let [rotation, translation] = [step.fixed_rows::<3>(0), step.fixed_rows::<3>(3)];
        if rotation.norm() <= settings.rotation_epsilon && translation.norm() <= settings.translation_epsilon
        {
            return GicpResult { T_target_source: transform, inliers, converged: true };
        }
    }
    GicpResult { T_target_source: transform, inliers, converged: false }
}

/// The nearest point of the target for each of the source, where there is one.
fn correspondences<Target: GicpTarget>(
    target: &Target,
    source: &GicpCloud,
    transform: &RigidTransform,
    reach: f64,
    memory: &mut [Target::Memory],
) -> Vec<Correspondence> {
    let correspondence = |(point, normal, memory): (&[f64; 3], &[f64; 3], &mut Target::Memory)| {
        let nearest = target.nearest_again(transform.transform_point(*point), reach, memory);
        let (there, facing) = target.surface(nearest?);
        // C_B + R C_A R^T of pieces of plane, whose covariances are 1 - (1 - flatness) n n^T.
        let mut joint = Matrix3::from_diagonal_element(2.0);
        for n in [Vector3::from(facing), transform.rotation * Vector3::from(*normal)] {
            joint -= (1.0 - FLATNESS) * n * n.transpose();
        }
        let information = joint.try_inverse()?;
        Some(Correspondence { source: (*point).into(), target: there.into(), information })
    };
    let pairs = (&source.points, &source.normals, memory).into_par_iter().with_min_len(PART);
    pairs.filter_map(correspondence).collect()
}

/// Sums over the correspondences, in float64 and in an order that no thread changes.
fn normal_equations(correspondences: &[Correspondence], transform: &RigidTransform) -> NormalEquations {
    let part = |part: &[Correspondence]| {
        let [mut rotations, mut mixed, mut translations] = [Matrix3::zeros(); 3];
        let [mut torque, mut force] = [Vector3::zeros(); 2];
        let mut error = 0.0;
        for Correspondence { source, target, information } in part {
            let moved = transform.rotation * source + transform.translation;
            let residual = moved - target;
            let weighted = information * residual;
            // d residual / d (w, v) of the transform exp(w, v) T is [-[p]x, 1] at the moved point p.
            let skew = moved.cross_matrix();
            let rotational = skew * information;
            rotations += rotational * skew.transpose();
            mixed += rotational;
            translations += information;
            torque += moved.cross(&weighted);
            force += weighted;
            error += residual.dot(&weighted);
        }
        (rotations, mixed, translations, torque, force, error)
    };
    let parts: Vec<_> = correspondences.par_chunks(PART).map(part).collect();
    let mut sum = NormalEquations { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), error: 0.0 };
    for (rotations, mixed, translations, torque, force, error) in parts {
        for (row, column, block) in
            [(0, 0, rotations), (0, 3, mixed), (3, 0, mixed.transpose()), (3, 3, translations)]
        {
            let mut view = sum.hessian.fixed_view_mut::<3, 3>(row, column);
            view += block;
        }
        for (row, block) in [(0, torque), (3, force)] {
            let mut view = sum.gradient.fixed_rows_mut::<3>(row);
            view += block;
        }
        sum.error += error;
    }
    sum
}

/// The step of the least damping that makes the error of the same correspondences smaller, and where it leads.
fn damped_step(
    correspondences: &[Correspondence],
    equations: &NormalEquations,
    transform: &RigidTransform,
    damping: &mut f64,
) -> Option<(RigidTransform, Vector6<f64>)> {
    for _ in 0..MAX_TRIALS {
        let mut damped = equations.hessian;
        for k in 0..6 {
            damped[(k, k)] *= 1.0 + *damping;
        }
        if let Some(factored) = damped.cholesky() {
            let step = -factored.solve(&equations.gradient);
            let [x, y, z, translation @ ..] = <[f64; 6]>::from(step);
            let moved = RigidTransform::from_rotation_vector([x, y, z], translation) * *transform;
            if error(correspondences, &moved) <= equations.error {
                *damping /= DAMPING_FACTOR;
                return Some((moved, step));
            }
        }
        *damping *= DAMPING_FACTOR;
    }
    None
}

/// The sum of squared residuals, weighted by the information of each.
fn error(correspondences: &[Correspondence], transform: &RigidTransform) -> f64 {
    let of_part = |part: &[Correspondence]| -> f64 {
        let of_one = |Correspondence { source, target, information }: &Correspondence| {
            let residual = transform.rotation * source + transform.translation - target;
            residual.dot(&(information * residual))
        };
        part.iter().map(of_one).sum()
    };
    let parts: Vec<f64> = correspondences.par_chunks(PART).map(of_part).collect();
    parts.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three walls of a room, two of them bent.
    fn room() -> Vec<[f64; 3]> {
        let grid = (0..1600).map(|i| (f64::from(i % 40) * 0.7, f64::from(i / 40) * 0.7));
        let walls = grid.map(|(u, v)| [[u, v, (0.3 * u).sin()], [u, (0.2 * v).cos() - 1.0, v], [0.0, u, v]]);
        walls.flatten().collect()
    }

    #[test]
    fn the_gradient_is_that_of_the_error() {
        let target = GicpCloud::new(room());
        let at = RigidTransform::from_rotation_vector([0.02, 0.01, -0.02], [0.2, -0.3, 0.1]);
        let pairs = correspondences(&target, &target, &at, 3.0, &mut vec![(); target.len()]);
        let equations = normal_equations(&pairs, &at);
        assert!((equations.error - error(&pairs, &at)).abs() < 1e-9 * equations.error);
        for k in 0..6 {
            let moved = |step: f64| {
                let mut twist = [0.0; 6];
                twist[k] = step;
                let [x, y, z, translation @ ..] = twist;
                error(&pairs, &(RigidTransform::from_rotation_vector([x, y, z], translation) * at))
            };
            let slope = (moved(1e-6) - moved(-1e-6)) / 4e-6;
            assert!((slope - equations.gradient[k]).abs() < 1e-5 * equations.gradient.norm(), "{k}");
        }
    }

    #[test]
    fn a_common_motion_of_both_clouds_moves_the_result() {
        let truth = RigidTransform::from_rotation_vector([0.03, -0.02, 0.04], [0.4, -0.3, 0.2]);
        let (here, there) = (room(), truth.inverse().transform_points(&room()));
        let common = RigidTransform::from_rotation_vector([0.5, 1.0, -0.7], [30.0, -20.0, 5.0]);
        let settings =
            GicpSettings { max_correspondence_distance: 3.0, max_iterations: 40, ..Default::default() };
        let identity = RigidTransform::identity();
        let found = gicp(&GicpCloud::new(here.clone()), &GicpCloud::new(there.clone()), identity, &settings);
        let target = GicpCloud::new(common.transform_points(&here));
        let moved = gicp(&target, &GicpCloud::new(there), common, &settings);
        for result in [found.T_target_source, common.inverse() * moved.T_target_source] {
            let off = (truth.inverse() * result).log();
            assert!(off.iter().all(|component| component.abs() < 1e-3), "{off:?}");
        }
    }

    #[test]
    fn the_result_is_the_same_on_any_number_of_threads() {
        let truth = RigidTransform::from_rotation_vector([0.03, -0.02, 0.04], [0.4, -0.3, 0.2]);
        let there = truth.inverse().transform_points(&room());
        let run = |threads| {
            crate::with_threads(Some(threads), || {
                let (target, source) = (GicpCloud::new(room()), GicpCloud::new(there.clone()));
                gicp(&target, &source, RigidTransform::identity(), &GicpSettings::default())
            })
        };
        assert_eq!(run(1).unwrap(), run(3).unwrap());
    }

    #[test]
    fn clouds_that_do_not_meet_keep_the_start() {
        let start = RigidTransform::from_rotation_vector([0.0; 3], [1000.0, 0.0, 0.0]);
        let cloud = GicpCloud::new(room());
        let found = gicp(&cloud, &cloud, start, &GicpSettings::default());
        assert_eq!(found, GicpResult { T_target_source: start, inliers: 0, converged: false });
        // All points at one place have no normal to speak of, and nothing fails.
        let same = GicpCloud::new(vec![[1.0, 2.0, 3.0]; 50]);
        let found = gicp(&same, &same, RigidTransform::identity(), &GicpSettings::default());
        assert!(found.T_target_source.to_matrix().as_flattened().iter().all(|x| x.is_finite()));
    }
}
