//! A model with one of its sides out.

use super::model::Model;
use crate::depth_image::{FACING, SurfacePlace, dot};
use crate::kd_tree::KdTree;
use std::borrow::Cow;
use std::f64::consts::PI;

/// Directions from which it is tried how much of a model can be seen at once.
const VIEWS: usize = 100;

/// A model, and what all its views before a scene look up.
pub(super) struct Side<'m> {
    pub model: Cow<'m, Model>,
    /// Of the model's points.
    pub tree: KdTree,
    /// Whether its surface goes all around.
    pub is_closed: bool,
}

impl<'m> Side<'m> {
    pub fn new(model: Cow<'m, Model>) -> Self {
        Self { tree: KdTree::new(&model.points), is_closed: model.is_closed(), model }
    }
}

/// The largest share of samples that face one of many directions, spread over the sphere by the golden angle.
pub(super) fn most_seen(samples: &[SurfacePlace]) -> f64 {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let seen_from = |view: usize| {
        let z = 1.0 - (2 * view + 1) as f64 / VIEWS as f64;
        let (sine, cosine) = (golden * view as f64).sin_cos();
        let across = (1.0 - z * z).sqrt();
        let direction = [across * cosine, across * sine, z].map(|x| x as f32);
        samples.iter().filter(|sample| dot(&sample.normal, &direction) > FACING).count()
    };
    (0..VIEWS).map(seen_from).max().unwrap_or(0).max(1) as f64 / samples.len().max(1) as f64
}
