//! What a sensor saw: whether a point is on what it measured, in the free space before it, or hidden behind.

mod spherical_range_image;

pub use spherical_range_image::{RangeImageSettings, SphericalRangeImage, Visibility};
