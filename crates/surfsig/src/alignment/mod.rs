//! What registration, finding, odometry and recurrences share: how one surface lies on another, and how sure that is.

mod clustered_covariance;
mod gicp;

pub(crate) use clustered_covariance::{blocks, clustered_covariance};
pub use gicp::{GicpCloud, GicpResult, GicpSettings, gicp};
pub(crate) use gicp::{GicpTarget, gicp_with, normal_of};
