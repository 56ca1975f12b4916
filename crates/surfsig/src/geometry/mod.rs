//! Geometry that every other room may use: rigid transforms, and axes across a direction.

mod axes;
mod rigid_transform;

pub(crate) use axes::axes_across;
pub use rigid_transform::{RigidTransform, TransformError};
