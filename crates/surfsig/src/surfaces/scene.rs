//! The points among which surfaces grow, and what is known about each.

use super::graph::{Graph, NEIGHBOURS};
use crate::extract::extract_within;
use crate::fit::{FitKind, FitUsed};
use crate::primitive::{Chart, Vector};
use crate::{Error, ExtractOptions, Extraction, Monitor, Neighborhood, PointCloud, Queries, Radius};

/// Nearest points to which a surface is fitted for a point's normal and noise.
pub(super) const LOCAL: usize = 24;

/// Linearity of the nearest points from which they are a scanner's line, ...
const LINE: f64 = 0.9;

/// ... and so many times as many points are looked at.
const ACROSS: u8 = 5;

/// Distances that tell nothing, in typical distances between points.
const FLOOR: f64 = 1e-4;

/// Points around a place that tell its noise.
const SURROUNDINGS: usize = 1000;

/// Noise in units of what a quarter of all estimates stay below, each of [`LOCAL`] points.
const QUARTER: f64 = 1.15;

/// Standard deviation of points that fill a ball instead of a surface in it, in units of its radius, and more.
const THICK: f64 = 0.32;

/// Label of a point that belongs to no surface.
pub(super) const NONE: i32 = -1;

/// Finite points about their middle, with what is known about each.
pub(super) struct Scene {
    pub points: Vec<Vector>,
    /// Numbers of these points in the cloud.
    pub numbers: Vec<u32>,
    pub origin: Vector,
    /// Normals of the surfaces through the nearest points; not a number where there is none.
    pub normals: Vec<Vector>,
    /// Noise that somebody knows.
    known: Option<f64>,
    /// Standard deviations of the nearest points from those surfaces; infinite where there is none.
    pub noise: Vec<f64>,
    pub graph: Graph,
    /// Distances below this are rounding, whatever the noise seems to be.
    pub floor: f64,
    pub labels: Vec<i32>,
}

impl Scene {
    /// `None` where there are too few points. Noise that somebody knows is that of every point.
    pub fn new(cloud: &PointCloud<'_>, noise: Option<f64>, monitor: &Monitor) -> Result<Option<Self>, Error> {
        let numbers: Vec<u32> =
            (0..cloud.len() as u32).filter(|&i| cloud.position(i as usize).is_some()).collect();
        let positions: Vec<[f64; 3]> = numbers.iter().filter_map(|&i| cloud.position(i as usize)).collect();
        if positions.len() <= NEIGHBOURS {
            return Ok(None);
        }
        let finite = PointCloud::new_f64(&positions);
        let queries = Queries::All;
        let mut local = around(&finite, LOCAL, &queries, &monitor.apart())?;
        // On a line of a lidar the nearest points tell nothing across it.
        let on_lines: Vec<u32> =
            (0..positions.len() as u32).filter(|&i| is_line(&local, i as usize)).collect();
        let wider =
            around(&finite, LOCAL * usize::from(ACROSS), &Queries::Indices(&on_lines), &monitor.apart())?;
        local.take_over(on_lines.iter().map(|&i| i as usize).zip(0..), &wider);
        let mut strides = vec![1_u8; positions.len()];
        on_lines.iter().for_each(|&i| strides[i as usize] = ACROSS);
        let typical = middle(local.radii.iter().map(|&r| f64::from(r)).filter(|r| *r > 0.0).collect());
        let Some(typical) = typical else { return Ok(None) };
        let graph = Graph::new(&positions, &strides, Radius::new(typical)?, monitor)?;
        let spacing = middle(graph.nearest.iter().map(|&d| f64::from(d)).filter(|d| d.is_finite()).collect());
        let count = positions.len() as f64;
        let origin = positions.iter().map(|p| Vector::from(*p)).sum::<Vector>() / count;
        let points: Vec<Vector> = positions.iter().map(|p| Vector::from(*p) - origin).collect();
        let spacing = spacing.unwrap_or(0.0).max(1e-2 * typical);
        let mut scene = Self {
            known: noise,
            noise: vec![f64::INFINITY; points.len()],
            normals: vec![Vector::repeat(f64::NAN); points.len()],
            labels: vec![NONE; points.len()],
            points,
            numbers,
            origin,
            graph,
            floor: FLOOR * spacing,
        };
        scene.learn(&local, 0..scene.points.len());
        Ok(Some(scene))
    }

    /// Looks at so many nearest points of each that has no label.
    pub fn look_farther(&mut self, neighbours: usize, monitor: &Monitor) -> Result<(), Error> {
        let positions: Vec<[f64; 3]> = self.points.iter().map(|p| (*p).into()).collect();
        let left = (0..self.points.len() as u32).filter(|&i| self.labels[i as usize] == NONE);
        let left: Vec<u32> = left.collect();
        let cloud = PointCloud::new_f64(&positions);
        let local = around(&cloud, neighbours, &Queries::Indices(&left), &monitor.apart())?;
        self.learn(&local, left.iter().map(|&i| i as usize));
        Ok(())
    }

    /// Takes over normals and noise of some points.
    fn learn(&mut self, local: &Extraction, points: impl Iterator<Item = usize>) {
        for (entry, point) in points.enumerate() {
            let unknowns = if local.fit_used[entry] == FitUsed::Quadric { 9.0 } else { 6.0 };
            let freedom = f64::from(local.count[entry]) - unknowns;
            let noise = f64::from(local.residual[entry]) * (f64::from(local.count[entry]) / freedom).sqrt();
            let thin = noise <= THICK * f64::from(local.radii[entry]);
            let known = freedom > 0.0 && thin && !is_line(local, entry);
            self.noise[point] = if known { self.known.unwrap_or(noise) } else { f64::INFINITY };
            let normal = local.normals[entry].map(f64::from);
            self.normals[point] = if known { Vector::from(normal) } else { Vector::repeat(f64::NAN) };
        }
    }

    /// The first unlabelled points that are found from one on, over neighbours: at most so many.
    pub fn around(&self, seed: u32, most: usize, seen: &mut Stamps) -> Vec<u32> {
        seen.clear();
        let mut found = vec![seed];
        seen.set(seed);
        let mut next = 0;
        while next < found.len() && found.len() < most {
            for other in self.graph.of(found[next]) {
                if found.len() < most && self.labels[other as usize] == NONE && seen.set(other) {
                    found.push(other);
                }
            }
            next += 1;
        }
        found
    }

    /// Those of some points that are near to a surface and lie along it (a cosine), and the unlabelled points that hang
    /// together with them there: at most so many.
    pub fn reached(
        &self,
        chart: &Chart,
        tolerance: f64,
        along: f64,
        from: &[u32],
        most: usize,
        seen: &mut Stamps,
    ) -> Vec<u32> {
        seen.clear();
        let near = |point: u32| {
            let place = &self.points[point as usize];
            chart.distance(place).abs() <= tolerance
                && (along <= 0.0 || chart.normal(place).dot(&self.normals[point as usize]).abs() >= along)
        };
        let mut found: Vec<u32> =
            from.iter().copied().filter(|&point| near(point) && seen.set(point)).collect();
        let mut next = 0;
        while next < found.len() && found.len() < most {
            for other in self.graph.of(found[next]) {
                if self.labels[other as usize] == NONE && seen.set(other) && near(other) {
                    found.push(other);
                }
            }
            next += 1;
        }
        found
    }

    /// The largest part of some points that hangs together.
    pub fn largest_part(&self, points: &[u32], seen: &mut Stamps, inside: &mut Stamps) -> Vec<u32> {
        inside.clear();
        seen.clear();
        points.iter().for_each(|&point| {
            inside.set(point);
        });
        let mut largest = Vec::new();
        for &point in points {
            if !seen.set(point) {
                continue;
            }
            let mut part = vec![point];
            let mut next = 0;
            while next < part.len() {
                for other in self.graph.of(part[next]) {
                    if inside.has(other) && seen.set(other) {
                        part.push(other);
                    }
                }
                next += 1;
            }
            if part.len() > largest.len() {
                largest = part;
            }
        }
        largest
    }

    /// Points and normals of some points, evenly thinned to at most so many; those without a normal are left out.
    pub fn sample(&self, points: &[u32], most: usize) -> (Vec<Vector>, Vec<Vector>) {
        let step = points.len().div_ceil(most).max(1);
        let with_normal = |point: &&u32| self.normals[**point as usize].x.is_finite();
        let chosen = points.iter().step_by(step).filter(with_normal).map(|&point| point as usize);
        chosen.map(|point| (self.points[point], self.normals[point])).unzip()
    }

    /// The noise around a point. Edges make noise seem larger, so of the many points around it takes that of the
    /// smoothest quarter.
    pub fn noise_around(&self, point: u32, seen: &mut Stamps) -> f64 {
        seen.clear();
        let mut around = vec![point];
        seen.set(point);
        let mut next = 0;
        while next < around.len() && around.len() < SURROUNDINGS {
            around.extend(self.graph.of(around[next]).filter(|&other| seen.set(other)));
            next += 1;
        }
        let noise = around.iter().map(|&other| self.noise[other as usize]);
        let mut noise: Vec<f64> = noise.filter(|noise| noise.is_finite()).collect();
        if noise.is_empty() {
            return f64::INFINITY;
        }
        let quarter = noise.len() / 4;
        QUARTER * *noise.select_nth_unstable_by(quarter, f64::total_cmp).1
    }
}

/// Surfaces through so many nearest points; quadrics, for a paraboloid's bias would seem to be noise.
fn around(
    cloud: &PointCloud<'_>,
    neighbours: usize,
    queries: &Queries<'_>,
    monitor: &Monitor,
) -> Result<Extraction, Error> {
    let options = ExtractOptions { fit: FitKind::Quadric, ..Default::default() };
    extract_within(cloud, Neighborhood::Nearest(neighbours), queries, &options, monitor)
}

fn is_line(local: &Extraction, entry: usize) -> bool {
    f64::from(local.linearity[entry]) > LINE
}

/// The median, or `None` of nothing.
pub(super) fn middle(mut values: Vec<f64>) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let half = values.len() / 2;
    Some(*values.select_nth_unstable_by(half, f64::total_cmp).1)
}

/// Which points have been seen; cleared in no time.
pub(super) struct Stamps {
    stamps: Vec<u32>,
    now: u32,
}

impl Stamps {
    pub fn new(len: usize) -> Self {
        Self { stamps: vec![0; len], now: 0 }
    }

    pub fn clear(&mut self) {
        self.now += 1;
    }

    /// Notes a point; says whether it is new.
    pub fn set(&mut self, point: u32) -> bool {
        let stamp = &mut self.stamps[point as usize];
        let new = *stamp != self.now;
        *stamp = self.now;
        new
    }

    pub fn has(&self, point: u32) -> bool {
        self.stamps[point as usize] == self.now
    }
}
