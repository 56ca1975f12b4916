//! What is around each point: its neighbours, and the surface through its nearest points.

use super::graph::{Graph, NEIGHBOURS, Neighbours};
use super::local_fits::{FitAt, LocalFit, fit_nearest};
use crate::kd_tree::KdTree;
use crate::statistics::upper_median;
use crate::{Error, Monitor};

/// Linearity of the nearest points below which they extend to all sides alike.
const EVEN: f32 = 0.5;

/// So many times as many points are looked at on a scanner's line.
const ACROSS: usize = 5;

/// What is around each of some points.
pub(super) struct Surroundings {
    pub fits: Vec<LocalFit>,
    pub graph: Graph,
    /// Typical distance to the last of the nearest points.
    pub typical: f64,
    /// Typical distance to the nearest one.
    pub spacing: f64,
    /// Whether the nearest points extend to all sides alike.
    pub is_even: Vec<bool>,
}

impl Surroundings {
    /// `None` where there are too few points, or all are one.
    pub fn new(
        tree: &KdTree,
        positions: &[[f64; 3]],
        neighbours: usize,
        monitor: &Monitor,
    ) -> Result<Option<Self>, Error> {
        if positions.len() <= NEIGHBOURS.max(neighbours) {
            return Ok(None);
        }
        let mut graph = Graph::unconnected(positions.len());
        let mut fits = vec![LocalFit::MISSING; positions.len()];
        let mut look = |fits: &mut [LocalFit], stride: usize, is_asked: &(dyn Fn(u32) -> bool + Sync)| {
            // One more, for the point itself is among them.
            let fewest = NEIGHBOURS * stride + 1;
            let take = |point: u32, nearest: &[(f64, u32)]| Neighbours::of(point, nearest, stride);
            let found = fit_nearest(tree, positions, &is_asked, neighbours * stride, fewest, &take, monitor)?;
            for FitAt { point, fit, taken: neighbours } in found.into_iter().flatten() {
                fits[point as usize] = fit;
                graph.connect(point, neighbours);
            }
            Ok::<(), Error>(())
        };
        look(&mut fits, 1, &|_| true)?;
        let is_even = fits.iter().map(|fit| fit.linearity < EVEN).collect();
        // On a line of a lidar the nearest points tell nothing across it, and every n-th of them is a neighbour.
        let is_on_line: Vec<bool> = fits.iter().map(LocalFit::is_line).collect();
        if is_on_line.contains(&true) {
            look(&mut fits, ACROSS, &|point| is_on_line[point as usize])?;
        }
        let typical =
            upper_median(fits.iter().map(|fit| f64::from(fit.radius)).filter(|r| *r > 0.0).collect());
        let Some(typical) = typical else { return Ok(None) };
        let spacing = graph.nearest.iter().map(|&d| f64::from(d)).filter(|d| d.is_finite()).collect();
        let spacing = upper_median(spacing).unwrap_or(0.0);
        Ok(Some(Self { fits, graph, typical, spacing, is_even }))
    }
}

/// Surfaces through so many nearest points of some points, ascending.
pub(super) fn fits_at(
    positions: &[[f64; 3]],
    some: &[u32],
    neighbours: usize,
    monitor: &Monitor,
) -> Result<Vec<LocalFit>, Error> {
    if some.is_empty() {
        return Ok(Vec::new());
    }
    let tree = KdTree::new(positions);
    let mut is_asked = vec![false; positions.len()];
    some.iter().for_each(|&point| is_asked[point as usize] = true);
    let is_asked = |point: u32| is_asked[point as usize];
    let found = fit_nearest(&tree, positions, &is_asked, neighbours, 0, &|_, _| (), monitor)?;
    let mut fits = vec![LocalFit::MISSING; some.len()];
    for FitAt { point, fit, .. } in found.into_iter().flatten() {
        fits[some.partition_point(|&other| other < point)] = fit;
    }
    Ok(fits)
}
