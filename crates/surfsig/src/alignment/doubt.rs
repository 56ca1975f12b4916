//! Why a transform is not trusted.

use std::fmt;

/// A test that a transform has not survived.
///
/// ```
/// let doubt = surfsig::Doubt::LittleOverlap { overlap: 0.02 };
/// assert_eq!(doubt.to_string(), "only 2 % of the source lie on the target");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Doubt {
    /// Nothing was found.
    NotFound,
    /// Few matches agree with it.
    FewMatches {
        /// Those that do.
        inliers: usize,
        /// Those that must.
        needed: usize,
    },
    /// Little of the source lies on the target.
    LittleOverlap {
        /// The share that does.
        overlap: f64,
    },
    /// The overlap does not determine all of it; the free directions say what is left open.
    FreeDirections {
        /// Their number.
        count: usize,
    },
    /// Points of one scan lie where the other's sensor looked through.
    FreeSpace {
        /// Their share of those that the sensor would have measured.
        share: f64,
    },
    /// Other transforms explain as much.
    Ambiguous {
        /// Their number.
        alternatives: usize,
    },
    /// The source's mirror image fits better: one of both has left-handed axes.
    Mirrored {
        /// Matches of the mirror image that agree.
        inliers: usize,
    },
    /// The source is larger or smaller than the target.
    Scale {
        /// How many times as large as the target the source is.
        scale: f64,
        /// Its standard error.
        standard_error: f64,
    },
}

impl Doubt {
    /// Its name, for programs.
    ///
    /// ```
    /// assert_eq!(surfsig::Doubt::Ambiguous { alternatives: 3 }.name(), "ambiguous");
    /// ```
    pub fn name(&self) -> &'static str {
        match self {
            Self::NotFound => "not_found",
            Self::FewMatches { .. } => "few_matches",
            Self::LittleOverlap { .. } => "little_overlap",
            Self::FreeDirections { .. } => "free_directions",
            Self::FreeSpace { .. } => "free_space",
            Self::Ambiguous { .. } => "ambiguous",
            Self::Mirrored { .. } => "mirrored",
            Self::Scale { .. } => "scale",
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |count: usize| if count == 1 { "" } else { "s" };
        match *self {
            Self::NotFound => write!(f, "no transform was found"),
            Self::FewMatches { inliers, needed } => {
                write!(f, "only {inliers} matches agree, fewer than {needed}")
            }
            Self::LittleOverlap { overlap } => {
                write!(f, "only {:.0} % of the source lie on the target", 100.0 * overlap)
            }
            Self::FreeDirections { count } => {
                write!(f, "the overlap does not determine {count} motion{}", plural(count))
            }
            Self::FreeSpace { share } => write!(
                f,
                "{:.0} % of the points lie where the other scan's sensor looked through",
                100.0 * share
            ),
            Self::Ambiguous { alternatives } => {
                let verb = if alternatives == 1 { "explains" } else { "explain" };
                write!(f, "{alternatives} other transform{} {verb} as much", plural(alternatives))
            }
            Self::Mirrored { inliers } => {
                write!(f, "the source's mirror image fits better: {inliers} of its matches agree")
            }
            Self::Scale { scale, standard_error } => {
                write!(f, "the source is {scale:.4} +- {standard_error:.4} times as large as the target")
            }
        }
    }
}
