//! Surfaces read off moments.

mod covariance;
mod cylinder;
mod eigen;
mod implicit;
mod kind;
pub(crate) mod paraboloid;
pub(crate) mod quadric;
#[cfg(test)]
pub(crate) mod samples;
mod shape_error;
mod sphere;
mod taubin;

pub(crate) use cylinder::spread_direction;
pub use cylinder::{Cylinder, fit_cylinder};
pub use implicit::{Quadric, SurfacePoint, fit_quadric};
pub use kind::{FitKind, FitUsed};
pub use paraboloid::FitAxes;
pub use sphere::{Sphere, fit_sphere};
