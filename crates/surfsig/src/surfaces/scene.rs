//! The points among which surfaces grow, and what is known about each.

use super::graph::Graph;
use super::likeness::Likeness;
use super::local_fits::LocalFit;
use super::sheets;
use super::stamps::Stamps;
use super::surroundings::{Surroundings, fits_at};
use crate::kd_tree::KdTree;
use crate::primitive::{Chart, Vector};
use crate::statistics::upper_median;
use crate::{Error, Monitor, PointCloud, Radius, voxel_representatives};

/// Nearest points to which a surface is fitted for a point's normal and noise.
pub(super) const LOCAL: usize = 24;

/// The same where surfaces are sparse and there is no noise: three more than the parameters of a quadric.
pub(super) const FEW_LOCAL: usize = 12;

/// One point in so many must lie on a surface through its nearest ones for a cloud to be without noise. Of Fit4CAD's clouds
/// more than half do, of tenths of them 4 to 43 in a hundred; of scans at most 12, where depth comes in steps or points
/// in lines.
const EXACT_SHARE: usize = 5;

/// If one in so many of these places is on two parallel planes side by side, these are the steps in which a sensor measures
/// depth: of simulated sensors with steps and no other noise 27 to 72 in a hundred, of Fit4CAD's clouds at most 6.
const STEPS_SHARE: usize = 8;

/// Distances that tell nothing, in typical distances between points.
const FLOOR: f64 = 1e-4;

/// Points around a place that tell its noise.
const SURROUNDINGS: usize = 1000;

/// Noise in units of what a quarter of all estimates stay below, each of [`LOCAL`] points.
const QUARTER: f64 = 1.15;

/// Noise in units of the typical noise below which a point lies on one step of a sensor that measures depth in steps, ...
const STEP: f64 = 0.1;

/// ... and so many times as many points are looked at.
const FARTHER: usize = 4;

/// Points that look farther are not many more than this, ...
const FARTHER_AT: usize = 20_000;

/// ... but at least one in as many times as they look at so many points.
const IN_COMMON: usize = 48;

/// Noise of so many floors is none.
const NOISELESS: f64 = 20.0;

/// Label of a point that belongs to no surface.
pub(super) const NONE: i32 = -1;

/// Distance to the 24th neighbour in units of that to the nearest from which points are clumps, seen many times over:
/// along the lines of a lidar it is 10, elsewhere 3 to 6. ...
const CLUMPED: f64 = 15.0;

/// ... Then voxels hold a point each, as wide as this part of that distance.
const VOXELS: f64 = 4.0;

/// Finite points about their middle, with what is known about each.
pub(super) struct Scene {
    pub points: Vec<Vector>,
    /// Numbers of these points in the cloud.
    pub numbers: Vec<u32>,
    pub origin: Vector,
    /// Normals of the surfaces through the nearest points; not a number where there is none.
    pub normals: Vec<Vector>,
    /// Noise that somebody knows.
    pub known: Option<f64>,
    /// Whether there is no noise, so that surfaces hold points on them and no others.
    pub is_exact: bool,
    /// Standard deviations of the nearest points from those surfaces; infinite where there is none.
    pub noise: Vec<f64>,
    /// Whether they are known of the point's own sheet, of two that are near each other.
    pub is_on_sheet: Vec<bool>,
    /// Noise and normals that points on sheets had before.
    pub before_sheets: Vec<(u32, f64, Vector)>,
    pub graph: Graph,
    /// Points among which surfaces grow, ascending: all, or one of each clump.
    pub chosen: Vec<u32>,
    /// Distances below this are rounding, whatever the noise seems to be.
    pub floor: f64,
    pub labels: Vec<i32>,
    pub likeness: Likeness,
    /// Noise that is the same everywhere; infinite where none is known. Where faces are small, the nearest points of all
    /// are partly another face's, and noise around them seems larger.
    pub common_noise: f64,
}

impl Scene {
    /// `None` where there are too few points. Noise that somebody knows is that of every point; otherwise it is told by so
    /// many neighbours. Whether there is none is told by the points, too, unless it is known.
    pub fn new(
        cloud: &PointCloud<'_>,
        noise: Option<f64>,
        neighbours: usize,
        is_exact: Option<bool>,
        monitor: &Monitor,
    ) -> Result<Option<Self>, Error> {
        let (tree, numbers) = sorted(cloud)?;
        let positions = tree.points();
        let Some(mut around) = Surroundings::new(&tree, positions, neighbours, monitor)? else {
            return Ok(None);
        };
        let count = positions.len() as f64;
        let origin = positions.iter().map(|p| Vector::from(*p)).sum::<Vector>() / count;
        let points: Vec<Vector> = positions.iter().map(|p| Vector::from(*p) - origin).collect();
        let mut chosen: Vec<u32> = (0..positions.len() as u32).collect();
        if around.typical > CLUMPED * around.spacing {
            let edge = around.typical / VOXELS;
            // About the middle, so that the same voxels are taken wherever the cloud lies.
            let centered: Vec<[f64; 3]> = points.iter().map(|&point| point.into()).collect();
            chosen = voxel_representatives(&PointCloud::new_f64(&centered), Radius::new(edge)?)?;
            let places: Vec<[f64; 3]> = chosen.iter().map(|&i| centered[i as usize]).collect();
            let of_chosen = KdTree::new(&places);
            let Some(thinned) = Surroundings::new(&of_chosen, &places, neighbours, monitor)? else {
                return Ok(None);
            };
            around = thinned;
            around.graph = around.graph.with_left_out(&centered, &chosen, edge);
        }
        let Surroundings { fits, graph, typical, spacing, is_even } = around;
        drop(tree);
        let mut scene = Self {
            known: noise,
            is_exact: false,
            noise: vec![f64::INFINITY; points.len()],
            is_on_sheet: vec![false; points.len()],
            before_sheets: Vec::new(),
            normals: vec![Vector::repeat(f64::NAN); points.len()],
            labels: vec![NONE; points.len()],
            points,
            numbers,
            origin,
            graph,
            chosen,
            floor: FLOOR * spacing.max(1e-2 * typical),
            likeness: Likeness::NONE,
            common_noise: f64::INFINITY,
        };
        let chosen = scene.chosen.clone();
        scene.is_exact = is_exact.unwrap_or_else(|| scene.is_without_noise(&fits, &is_even));
        scene.learn(&fits, &chosen);
        drop(fits);
        if noise.is_none() && !scene.is_exact {
            scene.look_across_steps(monitor)?;
        }
        sheets::tell_apart(&mut scene);
        Ok(Some(scene))
    }

    /// Estimates noise anew, from so many nearest points, for points without a label: for one in every few of them, since
    /// neighbours have most of their nearest points in common. The noise of the others counts as unknown.
    pub fn look_farther(&mut self, neighbours: usize, monitor: &Monitor) -> Result<(), Error> {
        let left: Vec<u32> =
            self.chosen.iter().copied().filter(|&point| self.labels[point as usize] == NONE).collect();
        left.iter().for_each(|&point| self.noise[point as usize] = f64::INFINITY);
        let step = left.len().div_ceil(FARTHER_AT).clamp(1, (neighbours / IN_COMMON).max(1));
        let some: Vec<u32> = left.into_iter().step_by(step).collect();
        self.look_around(&some, neighbours, monitor)
    }

    /// Estimates noise from more neighbours for points whose own noise is far below the typical one: they lie on one step
    /// of a sensor that measures depth in steps.
    fn look_across_steps(&mut self, monitor: &Monitor) -> Result<(), Error> {
        // Of points on one step there may be more than of others.
        let is_known = |noise: &f64| noise.is_finite() && !self.is_noiseless(*noise);
        match upper_median(self.noise.iter().copied().filter(is_known).collect()) {
            Some(typical) => {
                let smooth = |&point: &u32| self.noise[point as usize] < STEP * typical;
                let smooth: Vec<u32> = self.chosen.iter().copied().filter(smooth).collect();
                self.look_around(&smooth, FARTHER * LOCAL, monitor)
            }
            None => Ok(()),
        }
    }

    /// Of some of the chosen points, ascending.
    fn look_around(&mut self, some: &[u32], neighbours: usize, monitor: &Monitor) -> Result<(), Error> {
        let places: Vec<[f64; 3]> = self.chosen.iter().map(|&i| self.points[i as usize].into()).collect();
        let rank = |point: &u32| self.chosen.partition_point(|chosen| chosen < point) as u32;
        let some_ranks: Vec<u32> = some.iter().map(rank).collect();
        let fits = fits_at(&places, &some_ranks, neighbours, monitor)?;
        self.learn(&fits, some);
        Ok(())
    }

    /// Whether it is left to the scan to tell its noise.
    pub fn is_noise_unknown(&self) -> bool {
        self.known.is_none() && !self.is_exact
    }

    /// Whether many points lie on a surface through their nearest ones but for rounding, as those of a model do, and
    /// measured ones do not. It must be known of each of the chosen points whether its nearest ones are even: some quadric
    /// goes through any few lines of a scanner.
    fn is_without_noise(&self, fits: &[LocalFit], is_even: &[bool]) -> bool {
        if let Some(noise) = self.known {
            return self.is_noiseless(noise);
        }
        let is_exact =
            |fit: &LocalFit| fit.is_known(&fit.best) && self.is_noiseless(f64::from(fit.best.deviation));
        let exact = || fits.iter().zip(is_even).filter(|&(fit, &is_even)| is_even && is_exact(fit));
        let (all, steps) = (exact().count(), exact().filter(|(fit, _)| fit.is_step).count());
        EXACT_SHARE * all >= self.chosen.len() && STEPS_SHARE * steps <= all
    }

    /// Some points alone, whose nearest points are then only those of them, with so many of these for normals and noise;
    /// `None` where they are too few. Their numbers are places in `points`.
    pub fn apart(
        &self,
        points: &[u32],
        neighbours: usize,
        is_exact: bool,
        monitor: &Monitor,
    ) -> Result<Option<Self>, Error> {
        let positions: Vec<[f64; 3]> =
            points.iter().map(|&point| self.points[point as usize].into()).collect();
        Self::new(&PointCloud::new_f64(&positions), self.known, neighbours, Some(is_exact), monitor)
    }

    /// Distance up to which points without noise are on a surface.
    pub fn exact_reach(&self) -> f64 {
        NOISELESS * self.floor
    }

    pub fn is_noiseless(&self, noise: f64) -> bool {
        noise <= self.exact_reach()
    }

    /// Takes over normals and noise of some points.
    fn learn(&mut self, fits: &[LocalFit], points: &[u32]) {
        for (fit, point) in fits.iter().zip(points.iter().map(|&point| point as usize)) {
            let sheet = if self.is_exact { &fit.best } else { &fit.one };
            let known = fit.is_known(sheet);
            self.noise[point] =
                if known { self.known.unwrap_or(f64::from(sheet.deviation)) } else { f64::INFINITY };
            let normal = sheet.normal.map(f64::from);
            self.normals[point] = if known { Vector::from(normal) } else { Vector::repeat(f64::NAN) };
        }
    }

    /// At most so many unlabelled points from which surfaces grow, those with the least noise first.
    pub fn seeds(&self, most: usize) -> Vec<u32> {
        let is_seed = |&point: &u32| {
            let index = point as usize;
            self.labels[index] == NONE && self.noise[index].is_finite()
        };
        let left = self.chosen.iter().copied().filter(is_seed);
        let mut seeds: Vec<u32> = left.step_by(self.chosen.len().div_ceil(most)).collect();
        seeds.sort_by(|&a, &b| self.noise[a as usize].total_cmp(&self.noise[b as usize]));
        seeds
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

    /// Points and normals of some points, evenly thinned to at most so many; those are left out whose noise and normal are not
    /// known.
    pub fn sample(&self, points: &[u32], most: usize) -> (Vec<Vector>, Vec<Vector>) {
        let step = points.len().div_ceil(most).max(1);
        let known = |point: &&u32| self.noise[**point as usize].is_finite();
        let chosen = points.iter().step_by(step).filter(known).map(|&point| point as usize);
        chosen.map(|point| (self.points[point], self.normals[point])).unzip()
    }

    /// The noise around a point. Edges make noise seem larger, so of the many points around it takes that of the
    /// smoothest quarter.
    pub fn noise_around(&self, point: u32, seen: &mut Stamps) -> f64 {
        if self.is_exact {
            return self.known.unwrap_or(self.floor);
        }
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
        let around =
            self.likeness.spread * QUARTER * *noise.select_nth_unstable_by(quarter, f64::total_cmp).1;
        around.min(self.common_noise)
    }
}

/// A cloud's finite points in the order of a tree's leaves, so that points near each other are near in memory, and their
/// numbers in the cloud.
fn sorted(cloud: &PointCloud<'_>) -> Result<(KdTree, Vec<u32>), Error> {
    if u32::try_from(cloud.len()).is_err() {
        return Err(Error::TooManyPoints(cloud.len()));
    }
    let finite = |&i: &u32| cloud.position(i as usize).is_some();
    let finite: Vec<u32> = (0..cloud.len() as u32).filter(finite).collect();
    let positions: Vec<[f64; 3]> = finite.iter().filter_map(|&i| cloud.position(i as usize)).collect();
    let mut tree = KdTree::new(&positions);
    let numbers = tree.renumber().into_iter().map(|i| finite[i as usize]).collect();
    Ok((tree, numbers))
}
