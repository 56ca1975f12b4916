//! Field signatures: which place of a surface a point is, to find it again in other scans.
//!
//! Around a place, normals and curvature of the surface ([`support`]) are pooled on a cylindrical grid about the
//! large-scale normal ([`patch`]), as angular Fourier sums, and seen in a learned frame ([`frame`]). Magnitudes do
//! not change when the patch is turned about its axis; the phases tell by how much it was turned.

mod distinctiveness;
mod field_places;
mod frame;
mod keypoints;
mod matching;
mod patch;
mod support;

pub use distinctiveness::field_distinctiveness;
pub use field_places::FieldPlaces;
pub use frame::{FIELD_PHASES, FIELD_SIGNATURE, FieldPhases};
pub(crate) use keypoints::keypoints_within;
pub use keypoints::{KeypointOptions, find_keypoints};
pub(crate) use matching::similar_places;
pub use matching::{FieldMatch, match_fields};

use crate::simd::InstructionSet;
use crate::simd::field::{FEATURES, ORDERS, Pool, WAVES};
use crate::{Error, Monitor, PointCloud, Queries, Radius, Status, with_threads};
use frame::FieldFrame;
use patch::patches;
use support::Support;

/// How field signatures are made.
///
/// ```
/// let options = surfsig::FieldOptions { viewpoint: Some([0.0; 3]), ..Default::default() };
/// assert!(options.threads.is_none());
/// ```
#[derive(Debug, Clone, Default)]
pub struct FieldOptions<'a> {
    /// Where the sensor stood, in the cloud's coordinates.
    pub viewpoint: Option<[f64; 3]>,
    /// In place of a viewpoint: for each point of the cloud a vector to the side from which it was seen.
    pub directions: Option<&'a [[f32; 3]]>,
    /// Number of threads; all cores where it is `None`. The result is the same, bit for bit.
    pub threads: Option<usize>,
    /// Instructions to use; the best there are where it is `None`. The result is the same, bit for bit.
    pub instruction_set: Option<InstructionSet>,
}

/// Where patches lie, and what they hold: one entry for each query. NaN where there is no value.
#[derive(Debug, Clone)]
pub struct FieldPatches<T> {
    /// What each patch holds.
    pub values: Vec<T>,
    /// Large-scale unit normals, on the side of the points' own.
    pub axes: Vec<[f32; 3]>,
    /// Unit vectors square to the axes, from which angles are counted, by the right-hand rule.
    pub tangents: Vec<[f32; 3]>,
    /// Points of the support in each patch.
    pub count: Vec<u32>,
    /// What became of each query.
    pub status: Vec<Status>,
}

/// What tells a place from others.
#[derive(Debug, Clone)]
pub struct FieldSignature {
    /// Of length 1; equal for equal places.
    pub vector: Box<[f32; FIELD_SIGNATURE]>,
    /// Some coefficients with their phases.
    pub phases: Box<FieldPhases>,
}

impl FieldSignature {
    /// One of equal numbers.
    fn of(number: f32) -> Self {
        let phases = Box::new([[[number; 2]; FIELD_PHASES]; ORDERS - 1]);
        Self { vector: Box::new([number; FIELD_SIGNATURE]), phases }
    }

    /// The same with a vector of length 1; `None` where it has no length.
    fn of_unit_length(mut self) -> Option<Self> {
        // Several sums that do not wait for each other.
        let mut squares = [0.0_f64; 8];
        for values in self.vector.chunks_exact(squares.len()) {
            for (sum, &value) in squares.iter_mut().zip(values) {
                *sum += f64::from(value) * f64::from(value);
            }
        }
        let length = squares.iter().sum::<f64>().sqrt();
        let scale = (1.0 / length) as f32;
        self.vector.iter_mut().for_each(|value| *value *= scale);
        self.phases.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|value| *value *= scale);
        (length.is_finite() && length > 0.0).then_some(self)
    }
}

/// Field signatures of places, from the surface within a radius.
///
/// # Errors
/// As [`crate::extract_monitored`]; directions are one for each point of the cloud.
///
/// ```
/// use surfsig::{field_signatures, FieldOptions, Monitor, PointCloud, Queries, Radius, Status};
/// // Two equal bumps on a floor, the second one turned.
/// let height = |x: f64, y: f64| (-15.0 * (x * x + 3.0 * y * y + x * y)).exp() * 0.15;
/// let points: Vec<[f64; 3]> = (0..160 * 80)
///     .map(|i| (f64::from(i % 160) * 0.025, f64::from(i / 160) * 0.025))
///     .map(|(x, y)| [x, y, height(x - 1.0, y - 1.0) + height(y - 1.0, 3.0 - x)])
///     .collect();
/// let places = [[1.0, 1.0, 0.15], [3.0, 1.0, 0.15], [2.0, 1.0, 0.0]];
/// let options = FieldOptions { viewpoint: Some([2.0, 1.0, 5.0]), ..Default::default() };
/// let found = field_signatures(
///     &PointCloud::new_f64(&points), Radius::new(0.5)?, &Queries::Positions(PointCloud::new_f64(&places)),
///     &options, &Monitor::default(),
/// )?;
/// assert_eq!(found.status, [Status::Ok; 3]);
/// let alike = |a: usize, b: usize| -> f32 {
///     found.values[a].vector.iter().zip(found.values[b].vector.iter()).map(|(a, b)| a * b).sum()
/// };
/// assert!(alike(0, 1) > 0.98 && alike(0, 2) < 0.8);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn field_signatures(
    cloud: &PointCloud<'_>,
    radius: Radius,
    queries: &Queries<'_>,
    options: &FieldOptions<'_>,
    monitor: &Monitor,
) -> Result<FieldPatches<FieldSignature>, Error> {
    with_threads(options.threads, || signatures_within(cloud, radius, queries, options, monitor))?
}

/// The same, on the threads that are there.
pub(crate) fn signatures_within(
    cloud: &PointCloud<'_>,
    radius: Radius,
    queries: &Queries<'_>,
    options: &FieldOptions<'_>,
    monitor: &Monitor,
) -> Result<FieldPatches<FieldSignature>, Error> {
    let frame = FieldFrame::shared();
    let of_pools = |set, pools: &[Pool]| frame.signatures(set, pools);
    run(cloud, radius, queries, options, monitor, of_pools, || FieldSignature::of(f32::NAN))
}

/// What [`field_signatures`] sees in its frame: for each place, bin (ring by ring, in each by height) and pooled
/// quantity, the sums times cosines of 0, 1, ... 7 times the angle, and then times sines. A frame is learned from it.
///
/// # Errors
/// As [`field_signatures`].
///
/// ```
/// use surfsig::{field_pools, FieldOptions, Monitor, PointCloud, Queries, Radius};
/// let points: Vec<[f64; 3]> = (0..900).map(|i| [f64::from(i % 30), f64::from(i / 30), 0.0]).collect();
/// let cloud = PointCloud::new_f64(&points);
/// let found = field_pools(
///     &cloud, Radius::new(10.0)?, &Queries::Indices(&[465]), &FieldOptions::default(), &Monitor::default(),
/// )?;
/// // On a plane, all normals are the axis.
/// let along: f32 = found.values[0].iter().step_by(7).map(|waves| waves[0]).sum();
/// assert!((along - found.count[0] as f32).abs() < 1e-3);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn field_pools(
    cloud: &PointCloud<'_>,
    radius: Radius,
    queries: &Queries<'_>,
    options: &FieldOptions<'_>,
    monitor: &Monitor,
) -> Result<FieldPatches<Box<[[f32; WAVES]; FEATURES]>>, Error> {
    let of_pools = |_, pools: &[Pool]| pools.iter().map(|pool| Some(Box::new(*pool.features()))).collect();
    let none = || Box::new([[f32::NAN; WAVES]; FEATURES]);
    with_threads(options.threads, || run(cloud, radius, queries, options, monitor, of_pools, none))?
}

fn run<T: Send>(
    cloud: &PointCloud<'_>,
    radius: Radius,
    queries: &Queries<'_>,
    options: &FieldOptions<'_>,
    monitor: &Monitor,
    of_pools: impl Fn(InstructionSet, &[Pool]) -> Vec<Option<T>> + Send + Sync,
    none: impl Fn() -> T + Send + Sync,
) -> Result<FieldPatches<T>, Error> {
    queries.check(cloud)?;
    if let Some(directions) = options.directions.map(<[_]>::len).filter(|&n| n != cloud.len()) {
        return Err(Error::DirectionsMismatch { directions, queries: cloud.len() });
    }
    let support = Support::new(cloud, radius, options, monitor)?;
    let places: Vec<[f64; 3]> = queries.positions(cloud).collect();
    let set = options.instruction_set.unwrap_or_else(InstructionSet::detect);
    patches(&support, &places, radius, set, monitor, &of_pools, &none)
}
