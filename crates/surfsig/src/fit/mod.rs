//! Surfaces read off moments.

mod covariance;
pub(crate) mod paraboloid;
mod shape_error;
pub(crate) mod tensor;

pub use paraboloid::FitAxes;
