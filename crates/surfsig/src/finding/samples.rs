//! A surface as it is looked for: one point per voxel with its normal, and places with a field signature.

use crate::depth_image::SurfacePlace;
use crate::extract::extract_within;
use crate::field::signatures_within;
use crate::orientation::directions_within;
use crate::random::some_of;
use crate::scan::CenteredScan;
use crate::statistics::median;
use crate::voxels::voxel_of;
use crate::{
    Error, ExtractOptions, FieldOptions, FieldPlaces, Monitor, Queries, Radius, voxel_representatives,
};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// Voxels: the radius of the balls from which normals are taken.
const NORMAL_BALL: f64 = 3.0;
/// Coefficients of the paraboloid in them.
const UNKNOWNS: f64 = 6.0;
/// Voxels along a patch's radius to which points are thinned before patches are described.
const DESCRIPTION_VOXELS: f64 = 16.0;
/// Places with a signature along a patch's radius, in models.
pub(super) const PLACES_OF_MODEL: f64 = 4.0;
/// The same in scenes: each has a place of the model near it. With 2.5 there are nearly three times as many, and no more
/// objects have a right pose among those that are judged (`benchmarks/clutter.py`, seeds 500, 501, 503, 504: 25 and 26 of 31).
pub(super) const PLACES_OF_SCENE: f64 = 1.5;
/// Cells along a patch's radius in which it is told where the surface is flat.
const CELLS_PER_RADIUS: i64 = 2;
/// Standard deviation of the points around a cell from their plane, in radii of a patch, up to which it is flat: as on
/// a cap of a sphere of ten patch radii.
const FLAT: f64 = 0.03;
/// The same in the scan's noise: what is bent less cannot be told from a plane.
const FLAT_IN_NOISE: f64 = 2.5;
/// Points that tell the noise of all.
const MEASURED: usize = 2000;
/// Voxels along a patch's radius between points whose sides are told from each other's.
const ORIENTATION_VOXELS: f64 = 10.0;

/// Points of a scan's surface, one per voxel, with unit normals on its outer side; its viewpoint or directions say which
/// that is.
pub(super) fn samples(
    scan: &CenteredScan,
    voxel: f64,
    monitor: &Monitor,
) -> Result<Vec<SurfacePlace>, Error> {
    let ball = Radius::new(NORMAL_BALL * voxel)?;
    let thinned = scan.thinned(voxel);
    let given = thinned.scan();
    let options =
        ExtractOptions { viewpoint: given.viewpoint, directions: given.directions, ..Default::default() };
    let found = extract_within(&given.cloud, ball.into(), &Queries::All, &options, &monitor.apart())?;
    let known = (0..found.len()).filter(|&i| found.normals[i].iter().all(|c| c.is_finite()));
    let point =
        |i: usize| SurfacePlace { place: thinned.points[i].map(|x| x as f32), normal: found.normals[i] };
    Ok(known.map(point).collect())
}

/// Standard deviation of the points from the surface around them, in balls for samples one voxel apart; the median of
/// some.
pub(super) fn noise(scan: &CenteredScan, voxel: f64, monitor: &Monitor) -> Result<f64, Error> {
    let ball = Radius::new(NORMAL_BALL * voxel)?;
    let some: Vec<u32> = some_of(scan.points.len(), MEASURED).into_iter().map(|i| i as u32).collect();
    let cloud = scan.scan().cloud;
    let options = ExtractOptions::default();
    let found = extract_within(&cloud, ball.into(), &Queries::Indices(&some), &options, &monitor.apart())?;
    let deviation = |i: usize| {
        let count = f64::from(found.count[i]);
        let deviation = f64::from(found.residual[i]) * (count / (count - UNKNOWNS)).sqrt();
        (count > UNKNOWNS && deviation.is_finite()).then_some(deviation)
    };
    Ok(median((0..found.len()).filter_map(deviation).collect()).unwrap_or(0.0))
}

/// Places all over a scan with their signatures, but where its surface is flat: a patch of a plane is nowhere. That is told
/// by some of its points, so far apart that noise is small beside a voxel, and by the scan's noise.
pub(super) fn described(
    scan: &CenteredScan,
    some: &[[f64; 3]],
    noise: f64,
    radius: f64,
    places_per_radius: f64,
    monitor: &Monitor,
) -> Result<FieldPlaces, Error> {
    let cells = BentCells::new(some, noise, radius);
    let thinned = scan.thinned(radius / DESCRIPTION_VOXELS).some(|point| cells.is_around(point));
    let given = thinned.scan();
    let mut indices = voxel_representatives(&given.cloud, Radius::new(radius / places_per_radius)?)?;
    indices.retain(|&i| cells.is_bent(&thinned.points[i as usize]));
    let points: Vec<[f64; 3]> = indices.iter().map(|&i| thinned.points[i as usize]).collect();
    let options =
        FieldOptions { viewpoint: given.viewpoint, directions: given.directions, ..Default::default() };
    let queries = Queries::Indices(&indices);
    let found = signatures_within(&given.cloud, Radius::new(radius)?, &queries, &options, &monitor.apart())?;
    Ok(FieldPlaces::known(radius, &indices, &points, &found))
}

/// Where a surface is bent, in cells of a part of a patch's radius.
struct BentCells {
    edge: f64,
    /// Cells around which points are off a plane.
    bent: FxHashSet<[i64; 3]>,
    /// Those and the cells that patches there reach.
    around: FxHashSet<[i64; 3]>,
}

/// Count, sum, and second moments of some points about the middle of their cell, which keeps digits.
#[derive(Clone, Copy)]
struct Spread {
    count: f64,
    sum: Vector3<f64>,
    squares: Matrix3<f64>,
}

impl Spread {
    const NONE: Self = Self {
        count: 0.0,
        sum: Vector3::new(0.0, 0.0, 0.0),
        squares: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    fn add(&mut self, point: Vector3<f64>) {
        self.count += 1.0;
        self.sum += point;
        self.squares += point * point.transpose();
    }

    /// Adds points that are about a middle `offset` away.
    fn join(&mut self, other: &Self, offset: Vector3<f64>) {
        let cross = other.sum * offset.transpose();
        self.count += other.count;
        self.sum += other.sum + offset * other.count;
        self.squares += other.squares + cross + cross.transpose() + offset * offset.transpose() * other.count;
    }

    /// Standard deviation from their plane.
    fn thickness(&self) -> f64 {
        let mean = self.sum / self.count;
        let covariance = self.squares / self.count - mean * mean.transpose();
        covariance.symmetric_eigenvalues().min().max(0.0).sqrt()
    }
}

impl BentCells {
    fn new(points: &[[f64; 3]], noise: f64, radius: f64) -> Self {
        let edge = radius / CELLS_PER_RADIUS as f64;
        let mut spreads: FxHashMap<[i64; 3], Spread> = FxHashMap::default();
        for point in points {
            let cell = voxel_of(point, edge);
            let middle = Vector3::from(cell.map(|x| x as f64 * edge));
            spreads.entry(cell).or_insert(Spread::NONE).add(Vector3::from(*point) - middle);
        }
        let flat = (FLAT * radius).max(FLAT_IN_NOISE * noise);
        let is_bent = |cell: &[i64; 3]| {
            let mut total = Spread::NONE;
            for other in block(*cell, CELLS_PER_RADIUS) {
                if let Some(spread) = spreads.get(&other) {
                    total.join(spread, Vector3::from([0, 1, 2].map(|k| (other[k] - cell[k]) as f64 * edge)));
                }
            }
            total.thickness() > flat
        };
        let cells: Vec<[i64; 3]> = spreads.keys().copied().collect();
        let bent: FxHashSet<[i64; 3]> = cells.par_iter().filter(|cell| is_bent(cell)).copied().collect();
        let is_around = |cell: &[i64; 3]| {
            bent.contains(cell) || block(*cell, CELLS_PER_RADIUS + 1).any(|other| bent.contains(&other))
        };
        let around = cells.par_iter().filter(|cell| is_around(cell)).copied().collect();
        Self { edge, bent, around }
    }

    fn is_bent(&self, point: &[f64; 3]) -> bool {
        self.bent.contains(&voxel_of(point, self.edge))
    }

    fn is_around(&self, point: &[f64; 3]) -> bool {
        self.around.contains(&voxel_of(point, self.edge))
    }
}

/// The cells of a cube around one, `reach` to each side.
fn block(cell: [i64; 3], reach: i64) -> impl Iterator<Item = [i64; 3]> {
    let steps = move || -reach..=reach;
    steps().flat_map(move |x| {
        steps().flat_map(move |y| steps().map(move |z| [cell[0] + x, cell[1] + y, cell[2] + z]))
    })
}

/// A scan with directions that are on one side of each piece of its surface: most of them away from its centre.
pub(super) fn oriented_outwards(
    scan: CenteredScan,
    radius: f64,
    monitor: &Monitor,
) -> Result<CenteredScan, Error> {
    let mut directions = directions_within(&scan.points, radius / ORIENTATION_VOXELS, monitor)?;
    let count = scan.points.len().max(1) as f64;
    let mean = scan.points.iter().map(|&point| Vector3::from(point)).sum::<Vector3<f64>>() / count;
    // The sign that makes the volume within positive.
    let outwards = scan.points.iter().zip(&directions).map(|(&point, direction)| {
        (Vector3::from(point) - mean).dot(&Vector3::from(direction.map(f64::from)))
    });
    if outwards.sum::<f64>() < 0.0 {
        directions.iter_mut().for_each(|direction| *direction = direction.map(|x| -x));
    }
    Ok(CenteredScan { viewpoint: None, directions: Some(directions), ..scan })
}

/// Length of the mean of unit vectors: 0 where they go all around.
pub(super) fn mean_length<'a>(vectors: impl ExactSizeIterator<Item = &'a [f32; 3]>) -> f64 {
    let count = vectors.len().max(1) as f64;
    let sum = vectors.map(|vector| Vector3::from(vector.map(f64::from))).sum::<Vector3<f64>>();
    sum.norm() / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_near_a_bend_is_bent() {
        // A floor and a wall that meet at x = 10.
        let square = || (0..40 * 40).map(|i| [0.25 * f64::from(i % 40), 0.25 * f64::from(i / 40)]);
        let floor = square().map(|[x, y]| [x, y, 0.0]);
        let wall = square().map(|[y, z]| [10.0, y, z]);
        let points: Vec<[f64; 3]> = floor.chain(wall).collect();
        let cells = BentCells::new(&points, 0.0, 1.0);
        for point in points {
            let to_bend = (10.0 - point[0]).max(point[2]);
            // A patch of radius 1 that reaches the bend, and none that is far from doing so.
            assert!(cells.is_bent(&point) || to_bend > 1.0, "{point:?}");
            assert!(!cells.is_bent(&point) || to_bend < 2.0, "{point:?}");
            assert!(cells.is_around(&point) || to_bend > 2.0, "{point:?}");
            assert!(!cells.is_around(&point) || to_bend < 4.0, "{point:?}");
        }
        assert_eq!(block([0, 5, -3], 1).count(), 27);
    }

    #[test]
    fn noise_is_the_standard_deviation_from_the_surface() {
        let number = |i: usize| (0..12).map(|k| crate::random::uniform(12 * i + k, 5)).sum::<f64>() - 6.0;
        let points: Vec<[f64; 3]> =
            (0..3600).map(|i| [(i % 60) as f64, (i / 60) as f64, 0.2 * number(i)]).collect();
        let scan = CenteredScan::new(
            &crate::Scan::new(crate::PointCloud::new_f64(&points)).seen_from([30.0, 30.0, 1e3]),
        );
        let noise = noise(&scan, 2.0, &Monitor::default()).unwrap();
        assert!((noise - 0.2).abs() < 0.02, "{noise}");
        let found = samples(&scan, 2.0, &Monitor::default()).unwrap();
        // The surface is in one layer of voxels or in two.
        assert!((800..2000).contains(&found.len()), "{}", found.len());
        assert!(found.iter().all(|sample| sample.normal[2] > 0.8));
    }
}
