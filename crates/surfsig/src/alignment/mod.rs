//! What registration, finding, odometry and recurrences share: how one surface lies on another, and how sure that is.
//!
//! Matches propose a transform ([`consensus`]), distributions refine it ([`gicp`]), points fit it to the surface
//! ([`point_to_surface`], [`target_surface`]), many at once are fitted to tangent planes ([`point_to_plane`]), and
//! [`observability`] tells in which directions nothing determines it, or, by [`independent_normals`], only errors of
//! normals do; their variance is infinite ([`open_covariance`]). [`rivals`] are transforms that explain as much, some
//! of them proposed by [`symmetry`]; [`faces`] of buildings propose transforms, too; [`scale`] tells whether both
//! surfaces are of one size; and [`halves`] of an overlap tell what blocks of neighbours cannot see.

mod clustered_covariance;
mod consensus;
mod doubt;
mod even_sample;
mod explained;
mod faces;
mod free_motions;
mod gicp;
mod gicp_cloud;
mod halves;
mod independent_normals;
mod least_squares;
mod nearest_by_cell;
mod observability;
mod open_covariance;
mod point_to_plane;
mod point_to_surface;
mod rivals;
mod scale;
mod symmetry;
mod target_surface;

pub(crate) use clustered_covariance::{blocks, clustered_covariance};
pub use consensus::ConsensusSettings;
pub(crate) use consensus::Correspondences;
pub use doubt::Doubt;
pub(crate) use even_sample::even_sample;
pub(crate) use explained::{Closeness, Explained, HIDDEN};
pub(crate) use faces::{FaceOffsets, FacedPoints, face_transforms};
pub(crate) use free_motions::{joined_directions, without_free_motion};
pub(crate) use gicp::gicp_with;
pub use gicp::{GicpResult, GicpSettings, gicp};
pub use gicp_cloud::GicpCloud;
pub(crate) use gicp_cloud::{GicpTarget, plane_of};
pub(crate) use halves::{halves, systematic_covariance};
pub(crate) use independent_normals::{HeldLimits, IndependentNormals, PlaceNormals};
pub(crate) use least_squares::{LinearisedDistances, solve_determined};
pub use observability::{FreeDirection, free_directions};
pub(crate) use observability::{Motions, UNOBSERVABLE};
pub(crate) use open_covariance::{
    infinite_along, information_without, lengths, motions_beyond, orthonormal, unscaled,
};
pub(crate) use point_to_plane::{FACING_AWAY, OrientedSurface, cosine_towards, transformed};
pub(crate) use point_to_surface::PointToSurface;
pub use point_to_surface::PointToSurfaceSettings;
pub use rivals::{Alternative, RivalSettings};
pub(crate) use rivals::{FittedSurface, FittedTarget, Rivals, ScaleLimits};
pub(crate) use symmetry::{partial_symmetries, symmetries};
pub(crate) use target_surface::TargetSurface;
