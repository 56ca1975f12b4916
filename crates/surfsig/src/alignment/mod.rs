//! What registration, finding, odometry and recurrences share: how one surface lies on another, and how sure that is.
//!
//! Matches propose a transform ([`consensus`]), distributions refine it ([`gicp`]), points fit it to the surface
//! ([`point_to_surface`]), many at once are fitted to tangent planes ([`point_to_plane`]), and [`observability`] tells in
//! which directions nothing determines it. [`rivals`] are transforms that explain as much, and [`scale`] tells whether
//! both surfaces are of one size.

mod clustered_covariance;
mod consensus;
mod even_sample;
mod explained;
mod gicp;
mod gicp_cloud;
mod least_squares;
mod observability;
mod point_to_plane;
mod point_to_surface;
mod rivals;
mod scale;

pub(crate) use clustered_covariance::{blocks, clustered_covariance};
pub use consensus::ConsensusSettings;
pub(crate) use consensus::Correspondences;
pub(crate) use even_sample::even_sample;
pub(crate) use explained::Explained;
pub(crate) use gicp::gicp_with;
pub use gicp::{GicpResult, GicpSettings, gicp};
pub use gicp_cloud::GicpCloud;
pub(crate) use gicp_cloud::{GicpTarget, plane_of};
pub(crate) use least_squares::{LinearisedDistances, solve_determined};
pub use observability::{FreeDirection, free_directions};
pub(crate) use point_to_plane::{FACING_AWAY, OrientedSurface, cosine_towards, transformed};
pub use point_to_surface::PointToSurfaceSettings;
pub(crate) use point_to_surface::{PointToSurface, TargetSurface};
pub(crate) use rivals::Rivals;
pub use rivals::{Alternative, RivalSettings};
