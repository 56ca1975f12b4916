//! Numbers by chance that are always the same ones.

/// A number above 0 and at most 1 for each of a stream's draws (SplitMix64: Steele, Lea, Flood, Fast splittable
/// pseudorandom number generators, 2014).
pub(crate) fn uniform(draw: usize, stream: u64) -> f64 {
    let mut z = (draw as u64).wrapping_add(stream << 40).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 + f64::EPSILON / 4.0
}

/// Some of `count` numbers by chance, in ascending order; all of them where `most` is not less.
pub(crate) fn some_of(count: usize, most: usize) -> Vec<usize> {
    let mut numbers: Vec<usize> = (0..count).collect();
    if most < count {
        numbers
            .select_nth_unstable_by(most, |&a, &b| uniform(a, 0).total_cmp(&uniform(b, 0)).then(a.cmp(&b)));
        numbers.truncate(most);
        numbers.sort_unstable();
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_uniform() {
        let draws: Vec<f64> = (0..10_000).map(|i| uniform(i, 1)).collect();
        assert!(draws.iter().all(|&u| u > 0.0 && u <= 1.0));
        for tenth in 0..10 {
            let inside = draws.iter().filter(|&&u| (u * 10.0).ceil() as usize == tenth + 1).count();
            assert!((900..1100).contains(&inside), "{tenth}: {inside}");
        }
    }

    #[test]
    fn some_are_as_many_as_wanted_and_from_all_parts() {
        assert_eq!(some_of(5, 9), [0, 1, 2, 3, 4]);
        let some = some_of(10_000, 1000);
        assert_eq!(some.len(), 1000);
        assert!(some.is_sorted() && some.windows(2).all(|pair| pair[0] < pair[1]));
        assert!((400..600).contains(&some.iter().filter(|&&i| i < 5000).count()));
        assert_eq!(some_of(3, 0), [0_usize; 0]);
    }
}
