//! Nearest neighbours among points: a balanced k-d tree.

use rayon::prelude::*;
use std::ops::Range;

/// Points of a leaf: so few that looking at all of them costs less than another split.
const LEAF: usize = 12;
/// Points from which on the two halves of a node are built side by side.
const PARALLEL: usize = 8192;

/// A node: the axis along which its points are split, and the coordinate at the split.
#[derive(Debug, Clone, Copy, Default)]
struct Split {
    axis: u8,
    value: f64,
}

/// Factor beyond what the sum of two distances can lose in float64.
const ROUNDING: f64 = 1.0 + 1e-12;

/// The distance from a point to the farthest of so many nearest ones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Farthest<const N: usize> {
    point: [f64; N],
    count: usize,
    distance: f64,
}

/// Points of `N` coordinates, three unless said otherwise, sorted for searches of nearest neighbours. Of equally near
/// ones the first in the caller's order counts.
///
/// ```
/// use surfsig::KdTree;
///
/// let points: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i % 10), f64::from(i / 10), 0.0]).collect();
/// let tree = KdTree::new(&points);
/// assert_eq!(tree.nearest([3.2, 2.1, 0.0], 1.0).map(|(index, _)| index), Some(23));
/// assert_eq!(tree.nearest([3.2, 2.1, 5.0], 1.0), None);
/// let mut found = Vec::new();
/// tree.nearest_k([0.0, 0.0, 0.0], 3, &mut found);
/// assert_eq!(found, [(0.0, 0), (1.0, 1), (1.0, 10)]);
/// ```
#[derive(Debug, Clone)]
pub struct KdTree<const N: usize = 3> {
    /// In the order of the leaves.
    points: Vec<[f64; N]>,
    /// The caller's number of each.
    indices: Vec<u32>,
    /// Node i has the children 2 i + 1 and 2 i + 2. Each has half of its points, so ranges need not be kept.
    splits: Vec<Split>,
}

impl<const N: usize> KdTree<N> {
    /// Sorts points, whose coordinates are finite.
    ///
    /// # Panics
    /// If there are 2^32 points or more.
    ///
    /// ```
    /// assert!(surfsig::KdTree::<3>::new(&[]).is_empty());
    /// ```
    pub fn new(points: &[[f64; N]]) -> Self {
        let count = u32::try_from(points.len()).expect("fewer than 2^32 points");
        let mut entries: Vec<([f64; N], u32)> = points.iter().copied().zip(0..count).collect();
        let mut levels = 0;
        while points.len().div_ceil(1 << levels) > LEAF {
            levels += 1;
        }
        let mut splits = vec![Split::default(); (1 << levels) - 1];
        for level in 0..levels {
            let nodes = &mut splits[(1 << level) - 1..(1 << (level + 1)) - 1];
            // The points of a level's nodes follow each other.
            let mut parts = Vec::with_capacity(nodes.len());
            let mut rest = entries.as_mut_slice();
            for node in 0..nodes.len() {
                let range = range_of(points.len(), level, node);
                let (part, others) = rest.split_at_mut(range.len());
                parts.push(part);
                rest = others;
            }
            if points.len() >= PARALLEL {
                nodes.par_iter_mut().zip(parts).for_each(|(node, part)| *node = split(part));
            } else {
                nodes.iter_mut().zip(parts).for_each(|(node, part)| *node = split(part));
            }
        }
        let (points, indices) = entries.into_iter().unzip();
        Self { points, indices, splits }
    }

    /// Number of points.
    ///
    /// ```
    /// assert_eq!(surfsig::KdTree::new(&[[0.0; 3]]).len(), 1);
    /// ```
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    ///
    /// ```
    /// assert!(!surfsig::KdTree::new(&[[0.0; 3]]).is_empty());
    /// ```
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The caller's numbers of the points in the order of the leaves: those near each other are near in it.
    pub(crate) fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Numbers the points in the order of the leaves from now on; returns the numbers that they had, in this order.
    pub(crate) fn renumber(&mut self) -> Vec<u32> {
        let leaves = 0..self.indices.len() as u32;
        std::mem::replace(&mut self.indices, leaves.collect())
    }

    /// The points in the order of the leaves.
    pub(crate) fn points(&self) -> &[[f64; N]] {
        &self.points
    }

    /// The number of the nearest point within `reach`, and its squared distance.
    ///
    /// ```
    /// let tree = surfsig::KdTree::new(&[[0.0; 3], [2.0, 0.0, 0.0]]);
    /// assert_eq!(tree.nearest([1.5, 0.0, 0.0], 1.0), Some((1, 0.25)));
    /// ```
    pub fn nearest(&self, point: [f64; N], reach: f64) -> Option<(u32, f64)> {
        self.nearest_where(point, reach, |_| true)
    }

    /// The same among those points whose number `is_wanted`.
    ///
    /// ```
    /// let tree = surfsig::KdTree::new(&[[0.0; 3], [2.0, 0.0, 0.0]]);
    /// assert_eq!(tree.nearest_where([1.5, 0.0, 0.0], 2.0, |index| index != 1), Some((0, 2.25)));
    /// ```
    pub fn nearest_where(
        &self,
        point: [f64; N],
        reach: f64,
        is_wanted: impl Fn(u32) -> bool,
    ) -> Option<(u32, f64)> {
        let mut best = (reach * reach, u32::MAX);
        let mut take = |distance, index| {
            if (distance, index) < best && is_wanted(index) {
                best = (distance, index);
            }
            best.0
        };
        self.descend(point, 0, 0..self.len(), [0.0; N], &mut take, &mut { reach * reach });
        (best.1 < u32::MAX).then_some((best.1, best.0))
    }

    /// Squared distances and numbers of the `count` nearest points, or of all where there are fewer, in ascending
    /// order. `found` is overwritten.
    ///
    /// ```
    /// let tree = surfsig::KdTree::new(&[[0.0; 3], [2.0, 0.0, 0.0]]);
    /// let mut found = Vec::new();
    /// tree.nearest_k([2.0, 0.0, 0.0], 5, &mut found);
    /// assert_eq!(found, [(0.0, 1), (4.0, 0)]);
    /// ```
    pub fn nearest_k(&self, point: [f64; N], count: usize, found: &mut Vec<(f64, u32)>) {
        self.nearest_k_within(point, count, f64::INFINITY, found);
    }

    /// The same among those within a distance.
    ///
    /// ```
    /// let tree = surfsig::KdTree::new(&[[0.0; 3], [2.0, 0.0, 0.0]]);
    /// let mut found = Vec::new();
    /// tree.nearest_k_within([2.0, 0.0, 0.0], 5, 1.0, &mut found);
    /// assert_eq!(found, [(0.0, 1)]);
    /// ```
    pub fn nearest_k_within(&self, point: [f64; N], count: usize, reach: f64, found: &mut Vec<(f64, u32)>) {
        found.clear();
        let farthest = reach * reach;
        if count == 0 {
            return;
        }
        self.descend(
            point,
            0,
            0..self.len(),
            [0.0; N],
            &mut |distance, index| {
                let entry = (distance, index);
                let full = found.len() == count;
                if !full || entry < found[count - 1] {
                    if full {
                        found.pop();
                    }
                    let position = found.iter().rposition(|other| *other < entry).map_or(0, |last| last + 1);
                    found.insert(position, entry);
                }
                if found.len() == count { found[count - 1].0 } else { farthest }
            },
            &mut { farthest },
        );
    }

    /// The same as [`nearest_k`](Self::nearest_k), for searches one after the other at points that are near to each other:
    /// the nearest points of the one before are no farther than their own distance and the way between the two.
    pub(crate) fn nearest_k_after(
        &self,
        previous: &mut Option<Farthest<N>>,
        point: [f64; N],
        count: usize,
        found: &mut Vec<(f64, u32)>,
    ) {
        let between = |other: &[f64; N]| squared_distance(other, &point).sqrt();
        let reach = previous.as_ref().filter(|last| last.count >= count);
        let reach = reach.map_or(f64::INFINITY, |last| (last.distance + between(&last.point)) * ROUNDING);
        self.nearest_k_within(point, count, reach, found);
        // Fewer are all that there are.
        let last = found.last().filter(|_| found.len() == count);
        *previous = last.map(|&(square, _)| Farthest { point, count, distance: square.sqrt() });
    }

    /// Numbers of all points within a distance, in ascending order. `found` is overwritten.
    ///
    /// ```
    /// let tree = surfsig::KdTree::new(&[[0.0; 3], [2.0, 0.0, 0.0], [0.5, 0.0, 0.0]]);
    /// let mut found = Vec::new();
    /// tree.within([0.0; 3], 1.0, &mut found);
    /// assert_eq!(found, [0, 2]);
    /// ```
    pub fn within(&self, point: [f64; N], reach: f64, found: &mut Vec<u32>) {
        found.clear();
        self.each_within(point, reach, |index| found.push(index));
        found.sort_unstable();
    }

    /// Shows the same points in the order of the tree.
    pub fn each_within(&self, point: [f64; N], reach: f64, mut take: impl FnMut(u32)) {
        let limit = reach * reach;
        self.descend(
            point,
            0,
            0..self.len(),
            [0.0; N],
            &mut |distance, index| {
                if distance <= limit {
                    take(index);
                }
                limit
            },
            &mut { limit },
        );
    }

    /// Shows points with their squared distances to `take`, which gives the distance up to which it wants more.
    ///
    /// `gaps` are the distances to the node's box along each axis (Arya and Mount, Algorithms for fast vector
    /// quantization, 1993).
    fn descend(
        &self,
        point: [f64; N],
        node: usize,
        range: Range<usize>,
        gaps: [f64; N],
        take: &mut impl FnMut(f64, u32) -> f64,
        limit: &mut f64,
    ) {
        let Some(&Split { axis, value }) = self.splits.get(node) else {
            for (other, &index) in self.points[range.clone()].iter().zip(&self.indices[range]) {
                let distance = squared_distance(&point, other);
                if distance <= *limit {
                    *limit = take(distance, index);
                }
            }
            return;
        };
        let middle = range.start + range.len() / 2;
        let axis = usize::from(axis);
        let signed = point[axis] - value;
        let halves = [(2 * node + 1, range.start..middle), (2 * node + 2, middle..range.end)];
        let [low, high] = halves;
        let (near, far) = if signed < 0.0 { (low, high) } else { (high, low) };
        self.descend(point, near.0, near.1, gaps, take, limit);
        let mut beyond = gaps;
        beyond[axis] = signed.abs();
        if beyond.iter().map(|gap| gap * gap).sum::<f64>() <= *limit {
            self.descend(point, far.0, far.1, beyond, take, limit);
        }
    }
}

/// The points of a node, counted from the left on its level.
fn range_of(len: usize, level: usize, node: usize) -> Range<usize> {
    let mut range = 0..len;
    for step in (0..level).rev() {
        let middle = range.start + range.len() / 2;
        range = if node >> step & 1 == 0 { range.start..middle } else { middle..range.end };
    }
    range
}

/// Splits points at the median along the axis in which they extend farthest.
fn split<const N: usize>(entries: &mut [([f64; N], u32)]) -> Split {
    let Some(&(first, _)) = entries.first() else { return Split::default() };
    let (mut low, mut high) = (first, first);
    for (point, _) in entries.iter() {
        for k in 0..N {
            low[k] = low[k].min(point[k]);
            high[k] = high[k].max(point[k]);
        }
    }
    let extent = |k: usize| high[k] - low[k];
    let axis = (1..N).fold(0, |best, k| if extent(k) > extent(best) { k } else { best });
    let middle = entries.len() / 2;
    let order =
        |a: &([f64; N], u32), b: &([f64; N], u32)| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1));
    let (_, at, _) = entries.select_nth_unstable_by(middle, order);
    Split { axis: axis as u8, value: at.0[axis] }
}

fn squared_distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// On a coarse grid, so that many distances are equal.
    fn coarse_points() -> impl Strategy<Value = Vec<[f64; 3]>> {
        prop::collection::vec(
            [-8_i8..8, -8_i8..8, -2_i8..2].prop_map(|p| p.map(|c| f64::from(c) * 0.5)),
            0..300,
        )
    }

    fn slow<const N: usize>(points: &[[f64; N]], point: [f64; N]) -> Vec<(f64, u32)> {
        let mut all: Vec<(f64, u32)> = points.iter().map(|p| squared_distance(p, &point)).zip(0..).collect();
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all
    }

    proptest! {
        #[test]
        fn neighbours_are_those_of_a_search_through_all(points in coarse_points(), at in [-10_i8..10, -10_i8..10, -4_i8..4]) {
            let tree = KdTree::new(&points);
            let at = at.map(|c| f64::from(c) * 0.45);
            let expected = slow(&points, at);
            for reach in [0.7, 3.0] {
                let nearest = expected.first().filter(|(d, _)| *d < reach * reach);
                prop_assert_eq!(tree.nearest(at, reach).map(|(index, d)| (d, index)), nearest.copied());
                let mut inside: Vec<u32> = expected.iter().filter(|(d, _)| *d <= reach * reach).map(|e| e.1).collect();
                inside.sort_unstable();
                let mut found = Vec::new();
                tree.within(at, reach, &mut found);
                prop_assert_eq!(&found, &inside);
                let mut nearest = Vec::new();
                tree.nearest_k_within(at, 7, reach, &mut nearest);
                prop_assert_eq!(&nearest, &expected[..inside.len().min(7)]);
            }
            let mut found = Vec::new();
            let mut previous = None;
            for (number, &from) in points.iter().take(30).enumerate() {
                tree.nearest_k_after(&mut previous, from, 3 + number / 10, &mut found);
                prop_assert_eq!(&found, &slow(&points, from)[..points.len().min(3 + number / 10)]);
            }
            for count in [0, 1, 7, 400] {
                tree.nearest_k(at, count, &mut found);
                prop_assert_eq!(&found, &expected[..count.min(expected.len())]);
            }
        }
    }

    #[test]
    fn neighbours_in_four_dimensions_are_those_of_a_search_through_all() {
        let number = |i: usize| (crate::random::uniform(i, 3) * 20.0).floor();
        let points: Vec<[f64; 4]> = (0..2000).map(|i| [0, 1, 2, 3].map(|k| number(4 * i + k))).collect();
        let tree = KdTree::new(&points);
        let mut found = Vec::new();
        for i in 0..100 {
            let at = [0, 1, 2, 3].map(|k| 20.0 * crate::random::uniform(4 * i + k, 4));
            tree.nearest_k(at, 16, &mut found);
            assert_eq!(found, slow(&points, at)[..16]);
        }
    }

    #[test]
    fn many_points_on_any_number_of_threads() {
        let number = |i: u32, k: u32| f64::from((i * 7919 + k * 104_729) % 10_007) / 10_007.0;
        let points: Vec<[f64; 3]> = (0..20_000).map(|i| [0, 1, 2].map(|k| number(i, k))).collect();
        let trees =
            [1, 2].map(|threads| crate::with_threads(Some(threads), || KdTree::new(&points)).unwrap());
        assert_eq!(trees[0].indices, trees[1].indices);
        let mut found = Vec::new();
        for i in 0..50 {
            let at = [0, 1, 2].map(|k| number(i * 31 + 5, k + 3));
            trees[0].nearest_k(at, 20, &mut found);
            assert_eq!(found, slow(&points, at)[..20]);
        }
    }
}
