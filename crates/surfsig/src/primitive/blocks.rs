//! Blocks of neighbouring points.

use super::geometry::Vector;

/// Blocks that points may be cut into; of 32 a standard error is itself known to some 15 %.
const BLOCKS: [usize; 3] = [8, 16, 32];

/// Independent pieces that a block should hold at least, so that few of them lie across its border.
const PIECES: f64 = 6.0;

/// How many blocks to cut points into, 8 to 32: fewer, the more alike neighbours err.
pub(super) fn block_count(points: &[Vector], residuals: &[f64]) -> usize {
    let [fewest, .., most] = BLOCKS;
    let largest = BLOCKS.map(|count| design_effect(points, residuals, count)).into_iter().fold(1.0, f64::max);
    ((points.len() as f64 / largest / PIECES) as usize).clamp(fewest, most)
}

/// By what factor fewer pieces are independent than points: the sum of a block's independent residuals has as many times
/// the mean square of one as there are points in the block. Not a number where no residual is left.
pub(crate) fn design_effect(points: &[Vector], residuals: &[f64], blocks: usize) -> f64 {
    let mut sums = vec![0.0; blocks];
    for (block, residual) in spatial_blocks(points, blocks).iter().zip(residuals) {
        sums[*block] += residual;
    }
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    sums.iter().map(|sum| sum * sum).sum::<f64>() / squares
}

/// The number of each point's block: cut across the longest extent into blocks of nearly as many points each, no more
/// blocks than points.
pub(super) fn spatial_blocks(points: &[Vector], count: usize) -> Vec<usize> {
    let mut labels = vec![0; points.len()];
    let mut members: Vec<usize> = (0..points.len()).collect();
    cut(points, &mut members, 0, count.min(points.len()), &mut labels);
    labels
}

fn cut(points: &[Vector], members: &mut [usize], first: usize, count: usize, labels: &mut [usize]) {
    if count <= 1 {
        members.iter().for_each(|&member| labels[member] = first);
        return;
    }
    let far = Vector::repeat(f64::INFINITY);
    let bounds = |(low, high): (Vector, Vector), &member: &usize| {
        (points[member].inf(&low), points[member].sup(&high))
    };
    let (low, high) = members.iter().fold((far, -far), bounds);
    let axis = (high - low).imax();
    let half = count / 2;
    let middle = members.len() * half / count;
    // Of equal coordinates the one that comes first, so that the cut is always the same.
    members
        .select_nth_unstable_by(middle, |&a, &b| points[a][axis].total_cmp(&points[b][axis]).then(a.cmp(&b)));
    let (left, right) = members.split_at_mut(middle);
    cut(points, left, first, half, labels);
    cut(points, right, first + half, count - half, labels);
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
        let apart: Vec<f64> = points.iter().map(|_| draws.normal()).collect();
        assert_eq!(block_count(&points, &apart), 32);
        let of_patch: Vec<f64> = (0..50).map(|_| draws.normal()).collect();
        let alike: Vec<f64> = spatial_blocks(&points, 50).iter().map(|&patch| of_patch[patch]).collect();
        assert!(block_count(&points, &alike) < 12);
        assert_eq!(block_count(&points, &[0.0; 400]), 32);
    }
}
