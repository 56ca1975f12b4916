//! Some points of a surface, spread evenly over it however dense its parts are.

use crate::kd_tree::KdTree;
use crate::random::uniform;
use crate::voxels::Voxels;
use rayon::prelude::*;

/// Points that are drawn first by the density of their voxels, in those that are wanted: the neighbours among them
/// tell the area around each.
const DRAWN: usize = 2;
/// Nearest points that tell the area around one.
const NEIGHBORS: usize = 8;
/// Of the largest area, what a point stands for at least: equal points have none.
const SMALLEST_AREA: f64 = 1e-9;

/// Chooses `count` points by chance, each with a probability in proportion to the area around it; the same points
/// always give the same ones.
///
/// One of each voxel would not do: of a voxel that the surface just touches, it would give only those points that
/// noise has lifted. `voxel` is about the distance between those that are wanted.
pub(crate) fn even_sample(points: &[[f64; 3]], count: usize, voxel: f64) -> Vec<[f64; 3]> {
    let mut drawn: Vec<usize> = (0..points.len()).collect();
    if points.len() > DRAWN * count {
        let voxels = Voxels::new(points, voxel);
        let in_voxel = |i: usize| f64::from(voxels.counts[voxels.numbers[i] as usize]);
        drawn = smallest(drawn, DRAWN * count, |i| -uniform(i, 0).ln() * in_voxel(i));
    }
    let drawn: Vec<[f64; 3]> = drawn.into_iter().map(|i| points[i]).collect();
    if drawn.len() <= count {
        return drawn;
    }
    let tree = KdTree::new(&drawn);
    let area = |found: &mut Vec<(f64, u32)>, point: &[f64; 3]| {
        tree.nearest_k(*point, NEIGHBORS, found);
        found.last().map_or(0.0, |farthest| farthest.0)
    };
    let areas: Vec<f64> = drawn.par_iter().with_min_len(256).map_init(Vec::new, area).collect();
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let weight = |i: usize| if largest > 0.0 { areas[i].max(SMALLEST_AREA * largest) } else { 1.0 };
    // The keys -ln(u) / weight, the smallest ones: Efraimidis and Spirakis, Weighted random sampling (2006).
    let chosen = smallest((0..drawn.len()).collect(), count, |i| -uniform(i, 1).ln() / weight(i));
    chosen.into_iter().map(|i| drawn[i]).collect()
}

/// The `count` numbers of the smallest keys, in ascending order.
fn smallest(numbers: Vec<usize>, count: usize, key: impl Fn(usize) -> f64) -> Vec<usize> {
    let mut keyed: Vec<(f64, usize)> = numbers.into_iter().map(|i| (key(i), i)).collect();
    if count < keyed.len() {
        keyed.select_nth_unstable_by(count, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        keyed.truncate(count);
    }
    let mut chosen: Vec<usize> = keyed.into_iter().map(|(_, i)| i).collect();
    chosen.sort_unstable();
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dense_half_gets_no_more_than_its_area() {
        // Two squares side by side, the second one a hundred times as dense.
        let square = |step: usize, x0: f64| {
            (0..step * step).map(move |i| {
                let at = |k: usize| (k as f64 + 0.5) / step as f64;
                [x0 + at(i % step), at(i / step), 0.0]
            })
        };
        let points: Vec<[f64; 3]> = square(30, 0.0).chain(square(300, 1.0)).collect();
        let chosen = even_sample(&points, 600, 0.06);
        assert_eq!(chosen.len(), 600);
        let dense = chosen.iter().filter(|point| point[0] > 1.0).count();
        assert!((180..=420).contains(&dense), "{dense} of 600 are in the dense half");
        assert_eq!(chosen, even_sample(&points, 600, 0.06));
    }

    #[test]
    fn few_and_equal_points() {
        assert_eq!(even_sample(&[[1.0; 3]; 5], 10, 0.1).len(), 5);
        assert_eq!(even_sample(&[[1.0; 3]; 50], 10, 0.1).len(), 10);
        assert_eq!(even_sample(&[], 10, 0.1).len(), 0);
    }
}
