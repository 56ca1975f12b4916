//! What goes wrong by the caller's doing.

/// A mistake that the caller can mend. Its text is one line and says what to do.
///
/// ```
/// use surfsig::{Error, Radius};
/// assert!(matches!(Radius::new(0.0), Err(Error::InvalidRadius(_))));
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The radius is zero, negative, infinite, not a number, or of no use in float32.
    #[error("a radius or voxel must be a finite number from 1e-18 to 1e18, not {0:e}")]
    InvalidRadius(f64),
    /// A length that is set is zero, negative, infinite or not a number.
    #[error("{name} must be a finite number above 0, not {length}")]
    InvalidLength {
        /// What was set.
        name: &'static str,
        /// To what.
        length: f64,
    },
    /// The lattice of a radius this small cannot be numbered at coordinates this large.
    #[error(
        "a radius or voxel of {radius:e} is too small for a coordinate of {coordinate:e}: float64 cannot tell its cells apart"
    )]
    RadiusBelowResolution {
        /// The radius that was asked for.
        radius: f64,
        /// The coordinate that cannot be placed.
        coordinate: f64,
    },
    /// An index names a point that the cloud does not have.
    #[error("index {index} is outside a cloud of {len} points")]
    IndexOutOfRange {
        /// The index that was asked for.
        index: usize,
        /// The number of points.
        len: usize,
    },
    /// A number names a piece that is not among those given.
    #[error("piece {piece} is not among {len} pieces")]
    PieceOutOfRange {
        /// The number that was asked for.
        piece: usize,
        /// The number of pieces.
        len: usize,
    },
    /// A neighbourhood of no points.
    #[error("at least one neighbour must be asked for")]
    NoNeighbors,
    /// There are not as many times as points.
    #[error("{times} times for {points} points")]
    TimesMismatch {
        /// Number of times.
        times: usize,
        /// Number of points.
        points: usize,
    },
    /// A direction must be given for every query, or for none.
    #[error("{directions} directions for {queries} queries")]
    DirectionsMismatch {
        /// The number of directions.
        directions: usize,
        /// The number of queries.
        queries: usize,
    },
    /// An implicit quadric has no sensor's axes.
    #[error("only a paraboloid is fitted in the sensor's axes")]
    QuadricInSensorAxes,
    /// Radii are chosen by standard errors, which the sensor's axes do not have.
    #[error("a radius is chosen in the surface's axes only; give one for the sensor's")]
    AutoRadiusInSensorAxes,
    /// More points than 32-bit ranks can number.
    #[error("a cloud of {0} points is too large: at most 4294967295 are numbered; cut it into tiles")]
    TooManyPoints(usize),
    /// A frame's parameters have no meaning.
    #[error("frame: {0}")]
    InvalidFrame(String),
    /// The check of section II.A: F F^T has an eigenvalue that is zero within rounding.
    #[error(
        "these atoms are no frame: {atoms} atoms leave F F^T with rank {rank} of {dimension} \
         (smallest singular value {smallest:e}, largest {largest:e}); use more levels or wider ranges"
    )]
    NotAFrame {
        /// Number of atoms that stayed inside the sphere.
        atoms: usize,
        /// Numerical rank of F.
        rank: usize,
        /// Number of rows of F.
        dimension: usize,
        /// Smallest singular value of F, patch units.
        smallest: f64,
        /// Largest singular value of F, patch units.
        largest: f64,
    },
    /// What is looked for is no model: its text says why.
    #[error("{0}")]
    InvalidModel(String),
    /// The caller asked to stop.
    #[error("stopped by the caller")]
    Cancelled,
    /// The operating system refused the worker threads.
    #[error("cannot start {threads} threads: {reason}")]
    Threads {
        /// Number of threads that was asked for.
        threads: usize,
        /// The system's words.
        reason: String,
    },
}
