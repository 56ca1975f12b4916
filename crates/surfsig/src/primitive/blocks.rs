//! Blocks of neighbouring points.

use super::geometry::Vector;

/// Fewest blocks that points are cut into, and most; of 32 a standard error is itself known to some 15 %.
const FEWEST: usize = 8;
const MOST: usize = 32;

/// Independent pieces that a block should hold at least, so that few of them lie across its border.
const PIECES: f64 = 6.0;

/// Most blocks by which what neighbours have in common is measured, ...
const MOST_SMALL: usize = 256;

/// ... and fewest points in one.
const FEWEST_POINTS: usize = 2;

/// A variance grows at most so many times by what crosses the borders of blocks: more is told by too few blocks.
const MOST_CROSSING: f64 = 3.0;

/// Standard errors by which small blocks must tell more than large ones for anything to cross the borders: of independent
/// residuals of 400 points, what is told is then 1.02 on average, and without it 1.14.
const SURELY: f64 = 2.0;

/// Points cut into blocks of neighbours, of which only whole ones count as independent.
pub(crate) struct Blocks {
    /// The number of each point's block.
    pub labels: Vec<usize>,
    /// How many times as large a variance is as these blocks tell, by what points on either side of their borders have in
    /// common.
    pub crossing: f64,
}

impl Blocks {
    /// 8 to 32 blocks, fewer, the more alike neighbours err, of the residuals that so many parameters leave.
    pub fn of_residuals(points: &[Vector], residuals: &[f64], parameters: usize) -> Self {
        let count = points.len();
        if count < MOST {
            return Self { labels: spatial_blocks(points, FEWEST), crossing: 1.0 };
        }
        let enough = |&blocks: &usize| blocks * FEWEST_POINTS <= count;
        let smallest = doubled(MOST, MOST_SMALL).filter(enough).last().unwrap_or(MOST);
        let finest = spatial_blocks(points, smallest);
        // Blocks are cut into halves, and the halves again, so that the coarser ones are made of the finer ones.
        let squares = sum_of_squares(residuals);
        let mut sums = sums_of_blocks(&finest, residuals, smallest);
        let mut effects = vec![(smallest, sum_of_squares(&sums) / squares)];
        while sums.len() > FEWEST {
            sums = sums.chunks_exact(2).map(|halves| halves[0] + halves[1]).collect();
            effects.push((sums.len(), sum_of_squares(&sums) / squares));
        }
        let of_chosen = effects.iter().filter(|(blocks, _)| *blocks <= MOST);
        let largest = of_chosen.map(|(_, effect)| *effect).fold(1.0, f64::max);
        let chosen = ((count as f64 / largest / PIECES) as usize).clamp(FEWEST, MOST);
        let labels = if chosen == MOST {
            let halvings = (smallest / MOST).trailing_zeros();
            finest.iter().map(|label| label >> halvings).collect()
        } else {
            spatial_blocks(points, chosen)
        };
        effects.retain(|(blocks, _)| *blocks >= MOST);
        // The parameters take their part of the sums of blocks, but hardly of the points.
        for (blocks, effect) in &mut effects {
            *effect *= *blocks as f64 / blocks.saturating_sub(parameters).max(1) as f64;
        }
        Self { labels, crossing: crossing(count, chosen, &effects) }
    }
}

/// Twice as much each time, from a number up to another.
fn doubled(first: usize, last: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(first), |number| Some(2 * number)).take_while(move |&number| number <= last)
}

/// How many times as large an effect is as that of so many blocks, by those of the numbers of blocks that there are.
///
/// What neighbours have in common ends at a block's border, beside which lies a part of its points that is as large as
/// one over the root of their number m: the inverse of the effect is nearly a + b / sqrt(m), and 1 / a the whole effect.
fn crossing(count: usize, blocks: usize, effects: &[(usize, f64)]) -> f64 {
    let border = |blocks: usize| (blocks as f64 / count as f64).sqrt();
    let (mut whole, mut slope, mut error) = (1.0, 0.0, 0.0);
    // An effect is known to a part of itself, the root of 2 over the number of blocks: the weights of the first line are
    // those of equal effects, of the next ones those of the line before.
    for _ in 0..3 {
        let mut sums = [0.0; 5];
        for &(blocks, effect) in effects {
            let (x, y) = (border(blocks), 1.0 / effect);
            let weight = blocks as f64 / (2.0 * f64::max(whole + slope * x, 1e-3 * y).powi(2));
            for (sum, term) in sums.iter_mut().zip([1.0, x, x * x, y, x * y]) {
                *sum += weight * term;
            }
        }
        let [n, x, xx, y, xy] = sums;
        let determinant = n * xx - x * x;
        // Not a number where no residual is left.
        if determinant.is_nan() || determinant <= 1e-9 * n * xx {
            return 1.0;
        }
        (whole, slope) = ((xx * y - x * xy) / determinant, (n * xy - x * y) / determinant);
        error = (n / determinant).sqrt();
    }
    if slope < SURELY * error {
        return 1.0;
    }
    let factor = 1.0 + slope * border(blocks) / whole;
    if whole <= 0.0 { MOST_CROSSING } else { factor.clamp(1.0, MOST_CROSSING) }
}

/// By what factor fewer pieces are independent than points: the sum of a block's independent residuals has as many times
/// the mean square of one as there are points in the block. Not a number where no residual is left.
pub(crate) fn design_effect(points: &[Vector], residuals: &[f64], blocks: usize) -> f64 {
    let sums = sums_of_blocks(&spatial_blocks(points, blocks), residuals, blocks);
    sum_of_squares(&sums) / sum_of_squares(residuals)
}

/// The residuals' sum in each block, by the number of each point's.
fn sums_of_blocks(labels: &[usize], residuals: &[f64], blocks: usize) -> Vec<f64> {
    let mut sums = vec![0.0; blocks];
    for (&block, residual) in labels.iter().zip(residuals) {
        sums[block] += residual;
    }
    sums
}

fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// A point that is cut off from others, with its number. Its coordinates are parts of the points' extent: single
/// precision is enough, and half of the memory is moved.
struct Placed {
    position: [f32; 3],
    number: u32,
}

/// The number of each point's block: cut across the longest extent into blocks of nearly as many points each, no more
/// blocks than points.
pub(super) fn spatial_blocks(points: &[Vector], count: usize) -> Vec<usize> {
    let far = Vector::repeat(f64::INFINITY);
    let (low, high) = points.iter().fold((far, -far), |(low, high), p| (low.inf(p), high.sup(p)));
    let scale = 1.0 / (high - low).max().max(f64::MIN_POSITIVE);
    let placed = |(point, number): (&Vector, u32)| {
        let part = scale * (point - low);
        Placed { position: [part.x as f32, part.y as f32, part.z as f32], number }
    };
    let mut members: Vec<Placed> = points.iter().zip(0..).map(placed).collect();
    let mut labels = vec![0; points.len()];
    cut(&mut members, 0, count.min(points.len()), &mut labels);
    labels
}

fn cut(members: &mut [Placed], first: usize, count: usize, labels: &mut [usize]) {
    if count <= 1 {
        members.iter().for_each(|member| labels[member.number as usize] = first);
        return;
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for member in members.iter() {
        for axis in 0..3 {
            low[axis] = low[axis].min(member.position[axis]);
            high[axis] = high[axis].max(member.position[axis]);
        }
    }
    let extent: [f32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
    let longest = if extent[0] >= extent[1] && extent[0] >= extent[2] {
        0
    } else if extent[1] >= extent[2] {
        1
    } else {
        2
    };
    let half = count / 2;
    let middle = members.len() * half / count;
    // Of equal coordinates the one that comes first, so that the cut is always the same.
    members.select_nth_unstable_by(middle, |a, b| {
        a.position[longest].total_cmp(&b.position[longest]).then(a.number.cmp(&b.number))
    });
    let (left, right) = members.split_at_mut(middle);
    cut(left, first, half, labels);
    cut(right, first + half, count - half, labels);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::samples::Draws;

    fn cube(count: usize, draws: &mut Draws) -> Vec<Vector> {
        (0..count).map(|_| Vector::from_fn(|_, _| draws.between(0.0, 1.0))).collect()
    }

    #[test]
    fn blocks_are_neighbours_of_equal_number() {
        let points = cube(1000, &mut Draws(10));
        let labels = spatial_blocks(&points, 32);
        for block in 0..32 {
            let of_block = |(point, label): (&Vector, &usize)| (*label == block).then_some(*point);
            let members: Vec<Vector> = points.iter().zip(&labels).filter_map(of_block).collect();
            assert!([31, 32].contains(&members.len()));
            let far = Vector::repeat(f64::INFINITY);
            let (low, high) = members.iter().fold((far, -far), |(low, high), p| (low.inf(p), high.sup(p)));
            assert!((high - low).max() < 0.6);
        }
        let mut few = spatial_blocks(&points[..7], 32);
        few.sort_unstable();
        assert_eq!(few, [0, 1, 2, 3, 4, 5, 6]);
        assert!(spatial_blocks(&[], 32).is_empty());
    }

    #[test]
    fn there_are_fewer_blocks_where_neighbours_err_alike() {
        let mut draws = Draws(16);
        let points = cube(400, &mut draws);
        let count =
            |residuals: &[f64]| 1 + *Blocks::of_residuals(&points, residuals, 3).labels.iter().max().unwrap();
        let apart: Vec<f64> = points.iter().map(|_| draws.normal()).collect();
        assert_eq!(count(&apart), 32);
        let of_patch: Vec<f64> = (0..50).map(|_| draws.normal()).collect();
        let alike: Vec<f64> = spatial_blocks(&points, 50).iter().map(|&patch| of_patch[patch]).collect();
        assert!(count(&alike) < 12);
        assert_eq!(count(&[0.0; 400]), 32);
    }

    #[test]
    fn coarser_blocks_are_made_of_finer_ones() {
        for count in [32, 33, 100, 1023] {
            let points = cube(count, &mut Draws(17));
            let finest = spatial_blocks(&points, 32);
            for coarser in [16, 8] {
                let joined: Vec<usize> = finest.iter().map(|label| label * coarser / 32).collect();
                assert_eq!(spatial_blocks(&points, coarser), joined);
            }
        }
    }

    #[test]
    fn what_crosses_borders_is_told_by_smaller_blocks() {
        let mut draws = Draws(18);
        let (side, runs) = (64, 30);
        let points: Vec<Vector> =
            (0..side * side).map(|i| Vector::new((i % side) as f64, (i / side) as f64, 0.0)).collect();
        let mean = |draws: &mut Draws, decay: f64| {
            let of_run = |_| {
                let mut last = draws.normal();
                let residuals = points.iter().map(|point| {
                    let begins = point.x == 0.0;
                    last = if begins { draws.normal() } else { decay * last }
                        + if begins { 0.0 } else { (1.0 - decay * decay).sqrt() * draws.normal() };
                    last
                });
                Blocks::of_residuals(&points, &residuals.collect::<Vec<_>>(), 0).crossing
            };
            (0..runs).map(of_run).sum::<f64>() / f64::from(runs)
        };
        assert!((1.0..1.1).contains(&mean(&mut draws, 0.0)));
        // Rows of 64 have 17 times the variance of one point, and pieces of 11 of them 9 times.
        let found = mean(&mut draws, 0.9);
        assert!((1.4..2.6).contains(&found), "{found}");
    }
}
