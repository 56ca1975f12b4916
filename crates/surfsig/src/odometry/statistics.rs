//! Quantiles.

/// The value below which a share of the values lies, linear between two of them; NaN where there is none. The values
/// are put into another order.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let position = share * (values.len() - 1) as f64;
    let (_, low, above) = values.select_nth_unstable_by(position.floor() as usize, f64::total_cmp);
    let next = above.iter().copied().fold(f64::INFINITY, f64::min);
    let part = position - position.floor();
    if part > 0.0 { *low + part * (next - *low) } else { *low }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_linear_between_sorted_values() {
        let mut values = [5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!([0.0, 0.25, 0.6, 1.0].map(|share| quantile(&mut values, share)), [1.0, 2.0, 3.4, 5.0]);
        assert_eq!(quantile(&mut [4.0, 1.0, 2.0, 10.0], 0.5), 3.0);
        assert!(quantile(&mut [], 0.5).is_nan());
    }
}
