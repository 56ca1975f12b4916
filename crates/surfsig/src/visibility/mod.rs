//! What a sensor saw: whether a point is on what it measured, in the free space before it, or hidden behind; whether a
//! viewpoint can be true; and from where a scan was measured, told by its points.

mod estimated_viewpoint;
mod hidden;
mod possible_viewpoint;
mod spherical_range_image;

pub use estimated_viewpoint::estimated_viewpoint;
pub use hidden::hidden_from;
pub(crate) use possible_viewpoint::measured_from;
pub use possible_viewpoint::{all_seen_from, measured_from_origin};
pub use spherical_range_image::{RangeImageSettings, SphericalRangeImage, Visibility};
