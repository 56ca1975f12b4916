//! Why a point has the values that it has.

/// What became of a point. Everything but [`Status::Ok`] says why values are missing or weak.
///
/// ```
/// use surfsig::Status;
/// assert_eq!(Status::Ok as u8, 0);
/// assert_eq!(Status::Degenerate.name(), "degenerate");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Status {
    /// All values are there.
    Ok = 0,
    /// A coordinate of the point is not finite: no values.
    NotFinite = 1,
    /// Fewer than six points in the ball: no curvature; a normal where three points span a plane.
    TooFewPoints = 2,
    /// The points lie on a line, or on a conic, and determine no paraboloid: no curvature.
    Degenerate = 3,
    /// The axes did not converge: the values are those of the last iteration. Typical of edges, corners and
    /// patches that are large against the radius of curvature.
    NotConverged = 4,
    /// The surface is more curved than any atom of the frame: curvature, but no signature.
    OutsideVocabulary = 5,
    /// The points lie mostly on one side, as at the rim of a scan: all values are there, with the standard
    /// errors of such a patch, and a bias where the surface is not a paraboloid.
    OneSided = 6,
    /// Coordinates come in steps too large for the radius: no curvature, and a normal of the points as they are.
    TooCoarse = 7,
}

impl Status {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 8] = [
        Self::Ok,
        Self::NotFinite,
        Self::TooFewPoints,
        Self::Degenerate,
        Self::NotConverged,
        Self::OutsideVocabulary,
        Self::OneSided,
        Self::TooCoarse,
    ];

    /// The name, in lower case with underscores.
    ///
    /// ```
    /// assert_eq!(surfsig::Status::TooFewPoints.name(), "too_few_points");
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::NotFinite => "not_finite",
            Self::TooFewPoints => "too_few_points",
            Self::Degenerate => "degenerate",
            Self::NotConverged => "not_converged",
            Self::OutsideVocabulary => "outside_vocabulary",
            Self::OneSided => "one_sided",
            Self::TooCoarse => "too_coarse",
        }
    }
}
