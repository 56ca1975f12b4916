//! How far a model's shape is from the scene's: what residuals say in spite of noise.

/// Samples in a row, next to each other, whose residuals are compared.
const NEIGHBORS: usize = 8;

/// Standard deviation of that part of residuals which neighbours have in common: noise of the sensor differs from one to
/// the next. The residuals come in an order in which neighbours follow each other.
pub(super) fn shared_part(residuals: &[f64]) -> f64 {
    let (mut sum, mut pairs) = (0.0, 0.0);
    for neighbors in residuals.chunks_exact(NEIGHBORS) {
        let total: f64 = neighbors.iter().sum();
        let squares: f64 = neighbors.iter().map(|residual| residual * residual).sum();
        // The products of all pairs: their mean has no part of independent noise.
        sum += total * total - squares;
        pairs += (NEIGHBORS * (NEIGHBORS - 1)) as f64;
    }
    if pairs > 0.0 { (sum / pairs).max(0.0).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;
    use std::f64::consts::PI;

    #[test]
    fn what_neighbours_share_is_told_from_noise() {
        let noise = |i: usize| 2.0 * uniform(i, 3) - 1.0;
        let alone: Vec<f64> = (0..8000).map(noise).collect();
        assert!(shared_part(&alone) < 0.05, "{}", shared_part(&alone));
        let wave = |i: usize| 0.5 * (i as f64 * PI / 400.0).sin();
        let with_shape: Vec<f64> = (0..8000).map(|i| noise(i) + wave(i)).collect();
        // Root mean square of a sine of amplitude 0.5.
        let expected = 0.5 * 0.5_f64.sqrt();
        assert!((shared_part(&with_shape) - expected).abs() < 0.02, "{}", shared_part(&with_shape));
        assert_eq!(shared_part(&[1.0; 7]), 0.0, "too few");
    }
}
