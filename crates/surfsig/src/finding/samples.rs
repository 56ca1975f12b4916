//! A surface as it is looked for: one point per voxel with its normal, and places with a field signature.

use crate::depth_image::SurfacePlace;
use crate::extract::extract_within;
use crate::field::signatures_within;
use crate::orientation::directions_within;
use crate::scan::{CenteredScan, median};
use crate::{
    Error, ExtractOptions, FieldOptions, FieldPlaces, Monitor, Queries, Radius, voxel_representatives,
};
use nalgebra::Vector3;

/// Voxels: the radius of the balls from which normals are taken.
const NORMAL_BALL: f64 = 3.0;
/// Coefficients of the paraboloid in them.
const UNKNOWNS: f64 = 6.0;
/// Voxels along a patch's radius to which points are thinned before patches are described.
const DESCRIPTION_VOXELS: f64 = 24.0;
/// Places with a signature along a patch's radius.
const PLACES_PER_RADIUS: f64 = 4.0;
/// Voxels along a patch's radius between points whose sides are told from each other's.
const ORIENTATION_VOXELS: f64 = 10.0;
/// Points of a surface, one per voxel, with unit normals on its outer side.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    pub points: Vec<SurfacePlace>,
    /// Standard deviation of a scan's point from its surface.
    pub noise: f64,
}

impl Samples {
    /// Those of a scan, whose viewpoint or directions say on which side its normals are.
    pub fn new(scan: &CenteredScan, voxel: f64, monitor: &Monitor) -> Result<Self, Error> {
        let given = scan.scan();
        let chosen = voxel_representatives(&given.cloud, Radius::new(voxel)?)?;
        let directions: Option<Vec<[f32; 3]>> =
            given.directions.map(|all| chosen.iter().map(|&i| all[i as usize]).collect());
        let options = ExtractOptions {
            viewpoint: given.viewpoint,
            directions: directions.as_deref(),
            ..Default::default()
        };
        let ball = Radius::new(NORMAL_BALL * voxel)?;
        let queries = Queries::Indices(&chosen);
        let found = extract_within(&given.cloud, ball.into(), &queries, &options, &monitor.apart())?;
        let noise = (0..chosen.len()).filter_map(|i| {
            let count = f64::from(found.count[i]);
            let noise = f64::from(found.residual[i]) * (count / (count - UNKNOWNS)).sqrt();
            (count > UNKNOWNS && noise.is_finite()).then_some(noise)
        });
        let noise = median(noise.collect()).unwrap_or(0.0);
        let known = (0..chosen.len()).filter(|&i| found.normals[i].iter().all(|c| c.is_finite()));
        let point = |i: usize| SurfacePlace {
            place: scan.points[chosen[i] as usize].map(|x| x as f32),
            normal: found.normals[i],
        };
        Ok(Self { points: known.map(point).collect(), noise })
    }
}

/// Places all over a scan with their signatures.
pub(super) fn described(scan: &CenteredScan, radius: f64, monitor: &Monitor) -> Result<FieldPlaces, Error> {
    let thinned = scan.thinned(radius / DESCRIPTION_VOXELS);
    let given = thinned.scan();
    let indices = voxel_representatives(&given.cloud, Radius::new(radius / PLACES_PER_RADIUS)?)?;
    let points: Vec<[f64; 3]> = indices.iter().map(|&i| thinned.points[i as usize]).collect();
    let options = FieldOptions {
        viewpoint: given.viewpoint,
        directions: given.directions,
        ..Default::default()
    };
    let queries = Queries::Indices(&indices);
    let found =
        signatures_within(&given.cloud, Radius::new(radius)?, &queries, &options, &monitor.apart())?;
    Ok(FieldPlaces::known(radius, &indices, &points, &found))
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
