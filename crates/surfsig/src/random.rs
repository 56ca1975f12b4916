//! Numbers by chance that are always the same ones.

/// What the states of SplitMix64 differ by (Steele, Lea, Flood, Fast splittable pseudorandom number generators, 2014).
const INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

/// A number above 0 and at most 1 for each of a stream's draws, by SplitMix64.
pub(crate) fn uniform(draw: usize, stream: u64) -> f64 {
    let state = (draw as u64).wrapping_add(stream << 40).wrapping_add(1).wrapping_mul(INCREMENT);
    fraction(mixed(state))
}

/// The bits of a state, of which each depends on all of the state's.
fn mixed(state: u64) -> u64 {
    let mut z = state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Above 0 and at most 1.
fn fraction(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64 + f64::EPSILON / 4.0
}

/// Draws one after the other; equal keys give the same ones.
#[derive(Debug, Clone)]
pub(crate) struct Generator {
    state: u64,
    /// A draw from a normal distribution that is left: they are made two at a time.
    normal: Option<f64>,
}

impl Generator {
    /// A generator for a key: a seed, and the numbers of what it is for.
    pub fn new(key: &[u64]) -> Self {
        let state = key.iter().fold(0, |state, part| mixed(part.wrapping_add(INCREMENT) ^ mixed(state)));
        Self { state, normal: None }
    }

    fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(INCREMENT);
        mixed(self.state)
    }

    /// A number below `count`, which is at least 1.
    pub fn below(&mut self, count: usize) -> usize {
        // A product with a fraction would be off by rounding; the bias of this one is below 2^-32 for any table.
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }

    /// A draw from the normal distribution of mean 0 and standard deviation 1 (Box and Muller, A note on the generation
    /// of random normal deviates, 1958).
    pub fn normal(&mut self) -> f64 {
        if let Some(left) = self.normal.take() {
            return left;
        }
        let radius = (-2.0 * fraction(self.bits()).ln()).sqrt();
        let (sine, cosine) = (std::f64::consts::TAU * fraction(self.bits())).sin_cos();
        self.normal = Some(radius * sine);
        radius * cosine
    }

    /// Brings some items, chosen at random, to the front, each order equally likely, and gives them; all of them where
    /// there are fewer.
    pub fn shuffled<'a, T>(&mut self, items: &'a mut [T], most: usize) -> &'a mut [T] {
        let count = most.min(items.len());
        for i in 0..count {
            // Fisher and Yates.
            items.swap(i, i + self.below(items.len() - i));
        }
        &mut items[..count]
    }
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

    #[test]
    fn normal_draws_have_the_moments_of_their_distribution() {
        let mut random = Generator::new(&[7, 1, 2]);
        let draws: Vec<f64> = (0..100_000).map(|_| random.normal()).collect();
        let moment = |power| draws.iter().map(|x: &f64| x.powi(power)).sum::<f64>() / draws.len() as f64;
        // Standard errors are 0.003, 0.004, 0.012 and 0.03.
        for (power, expected, error) in [(1, 0.0, 0.01), (2, 1.0, 0.015), (3, 0.0, 0.04), (4, 3.0, 0.1)] {
            assert!((moment(power) - expected).abs() < error, "{power}: {}", moment(power));
        }
    }

    #[test]
    fn shuffles_take_each_item_equally_often_and_depend_on_the_key_alone() {
        let mut counts = [0; 10];
        for key in 0..10_000 {
            let mut items: Vec<usize> = (0..10).collect();
            Generator::new(&[3, key]).shuffled(&mut items, 3).iter().for_each(|&item| counts[item] += 1);
            let mut again: Vec<usize> = (0..10).collect();
            Generator::new(&[3, key]).shuffled(&mut again, 3);
            assert_eq!(items, again);
        }
        assert!(counts.iter().all(|count| (2800..3200).contains(count)), "{counts:?}");
        assert_ne!(Generator::new(&[1, 2]).bits(), Generator::new(&[2, 1]).bits());
        assert_eq!(Generator::new(&[1]).shuffled(&mut [4, 5], 9).len(), 2);
    }
}
