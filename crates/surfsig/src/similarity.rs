//! How alike two signatures are: eqs. (11) and (12), and the paper's three classes.

/// zeta from here on is optimal similarity.
pub const OPTIMAL: f64 = 0.9;

/// zeta from here on is good similarity; below, dissimilarity.
pub const GOOD: f64 = 0.5;

/// The paper's three classes of zeta, section III.
///
/// ```
/// use surfsig::SimilarityClass;
/// assert_eq!(SimilarityClass::of(0.9), Some(SimilarityClass::Optimal));
/// assert_eq!(SimilarityClass::of(0.7), Some(SimilarityClass::Good));
/// assert_eq!(SimilarityClass::of(0.49), Some(SimilarityClass::Dissimilar));
/// assert_eq!(SimilarityClass::of(f64::NAN), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SimilarityClass {
    /// zeta >= 0.9.
    Optimal,
    /// 0.5 <= zeta < 0.9.
    Good,
    /// zeta < 0.5.
    Dissimilar,
}

impl SimilarityClass {
    /// The class of a zeta; `None` for one that is not a number.
    pub fn of(zeta: f64) -> Option<Self> {
        match zeta {
            _ if zeta >= OPTIMAL => Some(Self::Optimal),
            _ if zeta >= GOOD => Some(Self::Good),
            _ if zeta < GOOD => Some(Self::Dissimilar),
            _ => None,
        }
    }
}

/// zeta = |v1 . v2| / (|v1| |v2|), eq. (12), summed in float64.
///
/// NaN where a signature is missing or zero: a perfect plane without noise has no direction to
/// compare, unless a flat atom gives it one.
///
/// ```
/// assert_eq!(surfsig::similarity(&[1.0, 0.0], &[-2.0, 0.0]), 1.0);
/// assert!(surfsig::similarity(&[0.0, 0.0], &[1.0, 0.0]).is_nan());
/// ```
///
/// # Panics
/// If the signatures differ in length.
pub fn similarity(v1: &[f32], v2: &[f32]) -> f64 {
    assert_eq!(v1.len(), v2.len(), "signatures of one kind have one length");
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum::<f64>();
    // Equation (12); rounding must not lift it above 1.
    let zeta = dot(v1, v2).abs() / (dot(v1, v1) * dot(v2, v2)).sqrt();
    if zeta > 1.0 { 1.0 } else { zeta }
}
