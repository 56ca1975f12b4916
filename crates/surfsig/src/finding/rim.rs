//! Where a model ends: there, the scene's surface must end as well.

use super::scene::{Free, SceneSurface};
use super::side::Side;
use crate::alignment::transformed;
use crate::depth_image::{SurfacePlace, dot};
use crate::geometry::{RigidTransform, axes_across};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Voxels along the surface from a sample of the model to a point beside it, at least.
const STEP: f64 = 3.0;
/// The same in point spacings of the scene, at least: depth cameras let an outline bleed over some four pixels, and
/// smooth over three.
const STEP_IN_SPACINGS: f64 = 7.0;
/// Voxels from that to all of the model at least.
const CLEARANCE: f64 = 1.5;
/// Directions in which a step is tried.
const DIRECTIONS: usize = 8;
/// Voxels from a point beside the model to the scene's nearest sample within which the scene goes on.
const NEAR: f64 = 1.0;
/// And of that sample from the point's tangent plane.
const MAX_RESIDUAL: f64 = 0.75;
/// Cosine to the mean normal of a view of an object, from which on its surface does not end because it was too steep to
/// be seen.
const FACING_VIEW: f64 = 0.5;
/// Points beside the model without which its rim says nothing.
const MIN_POINTS: usize = 8;
/// Share of the rim where the scene goes on, from which on the model lies in a larger surface, as a box sunk in a
/// table. Of true poses of a whole model hardly any does, but a neighbour may be flush with it.
pub(super) const TOO_MUCH: f64 = 0.4;
/// What such a share counts of a view, which also ends where something was before it, and at its holes.
const OF_VIEW: f64 = 0.5;

/// Points beside a model, each a step along the surface from a sample near its end.
#[derive(Default)]
pub(super) struct Rim {
    /// Numbers of the samples that were stepped from.
    from: Vec<u32>,
    points: Vec<SurfacePlace>,
    /// What the share of it counts where the scene goes on.
    weight: f64,
}

/// The way along the surface from a model's end to where the scene must not go on, in the scan's unit.
pub(super) fn step_beyond_rim(voxel: f64, spacing: f64) -> f64 {
    (STEP * voxel).max(STEP_IN_SPACINGS * spacing)
}

impl Rim {
    /// Steps from samples, which are some of the side's.
    pub fn new(side: &Side<'_>, samples: &[SurfacePlace], voxel: f64, spacing: f64) -> Self {
        let step_length = step_beyond_rim(voxel, spacing);
        let mean = side.model.normals.iter().map(|&normal| Vector3::from(normal)).sum::<Vector3<f64>>();
        let (mut from, mut points) = (Vec::new(), Vec::new());
        for (number, sample) in (0..).zip(samples) {
            let normal = Vector3::from(sample.normal.map(f64::from));
            if !side.is_closed && normal.dot(&mean) <= FACING_VIEW * mean.norm() {
                continue;
            }
            let [across, along] = axes_across(&normal.normalize());
            for step in 0..DIRECTIONS {
                let (sine, cosine) = (TAU * step as f64 / DIRECTIONS as f64).sin_cos();
                let offset = (across * cosine + along * sine) * step_length;
                let beside: [f64; 3] = (Vector3::from(sample.place.map(f64::from)) + offset).into();
                if side.tree.nearest(beside, CLEARANCE * voxel).is_none() {
                    from.push(number);
                    points.push(SurfacePlace { place: beside.map(|x| x as f32), normal: sample.normal });
                }
            }
        }
        Self { from, points, weight: if side.is_closed { 1.0 } else { OF_VIEW } }
    }

    /// Share of the rim where the scene goes on beyond the model under T_scene_model, half of it of a view; 0 where it ends
    /// with it, and where too little of the rim is seen.
    ///
    /// `is_touching` says which samples of the model lie on the scene's surface: where the model is hidden its rim does
    /// not count. Only free samples of the scene go on.
    pub fn going_on(
        &self,
        transform: &RigidTransform,
        is_touching: &[bool],
        scene: &SceneSurface,
        free: Free<'_>,
    ) -> f64 {
        let (mut asked, mut going_on) = (0_usize, 0_usize);
        for (&from, point) in self.from.iter().zip(&self.points) {
            if !is_touching[from as usize] {
                continue;
            }
            asked += 1;
            let point = transformed(transform, point);
            if let Some(near) = scene.surface.nearest(&point, NEAR * scene.voxel)
                && free.has(near)
            {
                let gap = [0, 1, 2].map(|k| scene.samples()[near].place[k] - point.place[k]);
                going_on +=
                    usize::from(f64::from(dot(&gap, &point.normal).abs()) < MAX_RESIDUAL * scene.voxel);
            }
        }
        if asked < MIN_POINTS { 0.0 } else { self.weight * going_on as f64 / asked as f64 }
    }
}
