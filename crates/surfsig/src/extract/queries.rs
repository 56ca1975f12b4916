//! Where curvature is asked for.

use crate::cell_index::CellIndex;
use crate::{Error, Monitor, PointCloud, Radius};
use rustc_hash::FxHashMap;

/// The places at which curvature is asked for.
///
/// ```
/// use surfsig::{PointCloud, Queries};
/// let cloud = PointCloud::new(&[[0.0; 3], [1.0, 0.0, 0.0]]);
/// assert_eq!(Queries::All.len(&cloud), 2);
/// assert_eq!(Queries::Indices(&[1]).len(&cloud), 1);
/// ```
#[derive(Debug, Clone, Copy)]
pub enum Queries<'a> {
    /// Every point of the cloud.
    All,
    /// Some points of the cloud, by their numbers.
    Indices(&'a [u32]),
    /// Places of their own, in the cloud's coordinates.
    Positions(PointCloud<'a>),
}

impl Queries<'_> {
    /// How many places there are.
    pub fn len(&self, cloud: &PointCloud<'_>) -> usize {
        match self {
            Self::All => cloud.len(),
            Self::Indices(indices) => indices.len(),
            Self::Positions(positions) => positions.len(),
        }
    }

    pub(crate) fn check(&self, cloud: &PointCloud<'_>) -> Result<(), Error> {
        let Self::Indices(indices) = self else { return Ok(()) };
        match indices.iter().find(|&&i| i as usize >= cloud.len()) {
            Some(&index) => Err(Error::IndexOutOfRange { index: index as usize, len: cloud.len() }),
            None => Ok(()),
        }
    }

    /// Where they are; not a number where a coordinate is not finite.
    pub(crate) fn positions<'a>(&'a self, cloud: &'a PointCloud<'_>) -> impl Iterator<Item = [f64; 3]> + 'a {
        let position = |i| match self {
            Self::All => cloud.position(i),
            Self::Indices(indices) => cloud.position(indices[i] as usize),
            Self::Positions(positions) => positions.position(i),
        };
        (0..self.len(cloud)).map(move |i| position(i).unwrap_or([f64::NAN; 3]))
    }

    /// Those with the given numbers.
    pub(super) fn some(&self, chosen: &[usize]) -> SomeQueries {
        match self {
            Self::All => SomeQueries::Indices(chosen.iter().map(|&i| i as u32).collect()),
            Self::Indices(indices) => SomeQueries::Indices(chosen.iter().map(|&i| indices[i]).collect()),
            Self::Positions(positions) => {
                let place = |&i: &usize| positions.position(i).unwrap_or([f64::NAN; 3]);
                SomeQueries::Positions(chosen.iter().map(place).collect())
            }
        }
    }

    /// The queries sorted into rows, or `None` where they are the cloud's points themselves.
    pub(super) fn index(
        &self,
        cloud: &PointCloud<'_>,
        radius: Radius,
        monitor: &Monitor,
    ) -> Result<Option<CellIndex>, Error> {
        match self {
            Self::All => Ok(None),
            Self::Indices(indices) => {
                let position = |i: usize| cloud.position(indices[i] as usize);
                CellIndex::of_positions(indices.len(), position, radius, monitor).map(Some)
            }
            Self::Positions(positions) => {
                let position = |i| positions.position(i);
                CellIndex::of_positions(positions.len(), position, radius, monitor).map(Some)
            }
        }
    }
}

/// Some of the queries, as a list of their own.
pub(super) enum SomeQueries {
    Indices(Vec<u32>),
    Positions(Vec<[f64; 3]>),
}

impl SomeQueries {
    pub fn queries(&self) -> Queries<'_> {
        match self {
            Self::Indices(indices) => Queries::Indices(indices),
            Self::Positions(positions) => Queries::Positions(PointCloud::new_f64(positions)),
        }
    }
}

/// One point of the cloud for each voxel that holds any: the one nearest to the mean of the voxel's
/// points, so that queries lie on the surface. In the order of their numbers.
///
/// # Errors
/// As [`CellIndex::new`], for the voxel's edge in place of the radius.
///
/// ```
/// use surfsig::{voxel_representatives, PointCloud, Radius};
/// let points = [[0.1_f32, 0.0, 0.0], [0.2, 0.0, 0.0], [0.4, 0.0, 0.0], [1.5, 0.0, 0.0]];
/// assert_eq!(voxel_representatives(&PointCloud::new(&points), Radius::new(1.0)?)?, [1, 3]);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn voxel_representatives(cloud: &PointCloud<'_>, voxel: Radius) -> Result<Vec<u32>, Error> {
    let edge = voxel.get();
    let key = |p: [f64; 3]| p.map(|c| (c / edge).floor() as i64);
    // Sums are taken from the voxel's corner, where they lose nothing at large coordinates.
    let offset = |p: [f64; 3]| p.map(|c| c - (c / edge).floor() * edge);
    let finite = || (0..cloud.len()).filter_map(|i| cloud.position(i).map(|p| (i as u32, p)));
    let mut voxels: FxHashMap<[i64; 3], ([f64; 3], f64)> = FxHashMap::default();
    for (_, p) in finite() {
        if let Some(coordinate) = p.into_iter().find(|c| (c / edge).abs() > (1_u64 << 43) as f64) {
            return Err(Error::RadiusBelowResolution { radius: edge, coordinate });
        }
        let (sum, count) = voxels.entry(key(p)).or_default();
        for (total, part) in sum.iter_mut().zip(offset(p)) {
            *total += part;
        }
        *count += 1.0;
    }
    let mut nearest: FxHashMap<[i64; 3], (f64, u32)> = FxHashMap::default();
    for (i, p) in finite() {
        let (sum, count) = voxels[&key(p)];
        let square: f64 = offset(p).iter().zip(sum).map(|(o, s)| (o - s / count).powi(2)).sum();
        let best = nearest.entry(key(p)).or_insert((square, i));
        if square < best.0 {
            *best = (square, i);
        }
    }
    let mut representatives: Vec<u32> = nearest.into_values().map(|(_, i)| i).collect();
    representatives.sort_unstable();
    Ok(representatives)
}
