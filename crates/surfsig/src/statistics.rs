//! Medians and quantiles.

/// Standard deviations of a normal distribution for each median of its absolute values.
pub(crate) const DEVIATIONS_PER_MEDIAN: f64 = 1.4826;

/// The middle one of numbers, or the mean of the middle two; `None` of none.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    if values.is_empty() {
        return None;
    }
    let even = values.len().is_multiple_of(2);
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    let lower = if even { below.iter().copied().fold(f64::NEG_INFINITY, f64::max) } else { upper };
    Some(0.5 * (lower + upper))
}

/// The middle one of numbers, or the larger of the middle two; `None` of none.
pub(crate) fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    let half = values.len() / 2;
    if values.is_empty() { None } else { Some(*values.select_nth_unstable_by(half, f64::total_cmp).1) }
}

/// The value below which a share of the values lies, linear between two of them; NaN where there is none. The values
/// are put into another order.
pub(crate) fn quantile(values: &mut [f64], share: f64) -> f64 {
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
    fn medians_of_odd_and_even_counts() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(vec![]), None);
        assert_eq!(
            [4.0, 1.0, 2.0, 3.0].map(|last| upper_median(vec![1.0, 3.0, last])),
            [Some(3.0), Some(1.0), Some(2.0), Some(3.0)]
        );
        assert_eq!((upper_median(vec![4.0, 1.0, 2.0, 3.0]), upper_median(vec![])), (Some(3.0), None));
    }

    #[test]
    fn quantiles_are_linear_between_sorted_values() {
        let mut values = [5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!([0.0, 0.25, 0.6, 1.0].map(|share| quantile(&mut values, share)), [1.0, 2.0, 3.4, 5.0]);
        assert_eq!(quantile(&mut [4.0, 1.0, 2.0, 10.0], 0.5), 3.0);
        assert!(quantile(&mut [], 0.5).is_nan());
    }
}
