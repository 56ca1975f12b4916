//! Surfaces read off moments.

mod covariance;
pub(crate) mod paraboloid;
pub(crate) mod tensor;

pub use paraboloid::FitAxes;
