//! What is around each point: its neighbours, and the surface through its nearest points.

use super::graph::{Graph, NEIGHBOURS};
use crate::extract::extract_within;
use crate::fit::FitKind;
use crate::statistics::upper_median;
use crate::{Error, ExtractOptions, Extraction, Monitor, Neighborhood, PointCloud, Queries, Radius};

/// Linearity of the nearest points below which they extend to all sides alike.
const EVEN: f64 = 0.5;

/// Linearity of the nearest points from which they are a scanner's line, ...
const LINE: f64 = 0.9;

/// ... and so many times as many points are looked at.
const ACROSS: u8 = 5;

/// What is around each of some points.
pub(super) struct Surroundings {
    pub local: Extraction,
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
    pub fn new(positions: &[[f64; 3]], neighbours: usize, monitor: &Monitor) -> Result<Option<Self>, Error> {
        if positions.len() <= NEIGHBOURS.max(neighbours) {
            return Ok(None);
        }
        let cloud = PointCloud::new_f64(positions);
        let mut local = around(&cloud, neighbours, &Queries::All, &monitor.apart())?;
        // On a line of a lidar the nearest points tell nothing across it.
        let on_lines: Vec<u32> =
            (0..positions.len() as u32).filter(|&i| is_line(&local, i as usize)).collect();
        let is_even = local.linearity.iter().map(|&linearity| f64::from(linearity) < EVEN).collect();
        let wider =
            around(&cloud, neighbours * usize::from(ACROSS), &Queries::Indices(&on_lines), &monitor.apart())?;
        local.take_over(on_lines.iter().map(|&i| i as usize).zip(0..), &wider);
        let mut strides = vec![1_u8; positions.len()];
        on_lines.iter().for_each(|&i| strides[i as usize] = ACROSS);
        let typical = upper_median(local.radii.iter().map(|&r| f64::from(r)).filter(|r| *r > 0.0).collect());
        let Some(typical) = typical else { return Ok(None) };
        let graph = Graph::new(positions, &strides, Radius::new(typical)?, monitor)?;
        let spacing =
            upper_median(graph.nearest.iter().map(|&d| f64::from(d)).filter(|d| d.is_finite()).collect());
        Ok(Some(Self { local, graph, typical, spacing: spacing.unwrap_or(0.0), is_even }))
    }
}

/// Surfaces through so many nearest points; quadrics, for a paraboloid's bias would seem to be noise.
pub(super) fn around(
    cloud: &PointCloud<'_>,
    neighbours: usize,
    queries: &Queries<'_>,
    monitor: &Monitor,
) -> Result<Extraction, Error> {
    let options = ExtractOptions { fit: FitKind::Quadric, ..Default::default() };
    extract_within(cloud, Neighborhood::Nearest(neighbours), queries, &options, monitor)
}

/// Whether a point's nearest ones are a scanner's line.
pub(super) fn is_line(local: &Extraction, entry: usize) -> bool {
    f64::from(local.linearity[entry]) > LINE
}
