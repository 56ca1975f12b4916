//! What patches are made of: points spread evenly over the surface, each with its normal and curvature.

use super::FieldOptions;
use crate::extract::extract_within;
use crate::simd::field::Curved;
use crate::{Error, ExtractOptions, Monitor, PointCloud, Queries, Radius, voxel_representatives};

/// Points of the support across a patch's radius: so many that its bins are filled, and patches of dense scans
/// cost no more than others. One for each voxel, so that density has no weight.
const PER_RADIUS: f64 = 10.0;

/// Balls of curvature within a patch's radius.
const CURVATURE_BALLS: f64 = 4.0;

/// Curvature times the ball's radius whose code is one half.
const HALF_CODE: f32 = 0.5;

/// Points of the surface with what is known there.
pub(super) struct Support {
    pub positions: Vec<[f64; 3]>,
    pub curved: Vec<Curved>,
}

impl Support {
    /// For patches of a radius. Points without curvature are not part of it.
    pub fn new(
        cloud: &PointCloud<'_>,
        radius: Radius,
        options: &FieldOptions<'_>,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        let chosen = voxel_representatives(cloud, Radius::new(radius.get() / PER_RADIUS)?)?;
        let directions: Option<Vec<[f32; 3]>> =
            options.directions.map(|all| chosen.iter().map(|&i| all[i as usize]).collect());
        let ball = Radius::new(radius.get() / CURVATURE_BALLS)?;
        let extract_options = ExtractOptions {
            viewpoint: options.viewpoint,
            directions: directions.as_deref(),
            ..Default::default()
        };
        let queries = Queries::Indices(&chosen);
        let found = extract_within(cloud, ball.into(), &queries, &extract_options, &monitor.apart())?;
        let mut support = Self { positions: Vec::new(), curved: Vec::new() };
        for (entry, &point) in chosen.iter().enumerate() {
            let [k1, k2] = [found.k1[entry], found.k2[entry]].map(|k| k * ball.get() as f32);
            let normal = found.normals[entry];
            let Some(position) = cloud.position(point as usize) else { continue };
            if k1.is_finite() && k2.is_finite() && normal[0].is_finite() {
                support.positions.push(position);
                support.curved.push(Curved {
                    normal,
                    direction: found.directions[entry],
                    bend: code(0.5 * (k1 + k2)),
                    difference: code(0.5 * (k1 - k2)),
                });
            }
        }
        Ok(support)
    }
}

/// Between -1 and 1: at edges curvature has no bound, and would drown everything else.
fn code(curvature: f32) -> f32 {
    curvature / (curvature.abs() + HALF_CODE)
}
