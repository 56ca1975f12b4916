//! Two sheets so near each other that the nearest points of one are partly the other's: both sides of a metal sheet, or two
//! scans that do not quite fit.
//!
//! Such points are on two parallel planes. Where these are told apart, each point's noise and normal are those of its own
//! sheet.

use super::likeness::Likeness;
use super::scene::Scene;
use super::stamps::Stamps;
use crate::primitive::{Vector, smallest};
use nalgebra::Matrix3;
use rustc_hash::FxHashMap;

/// Points around a place that are looked at: neighbours and their neighbours.
const AROUND: usize = 40;

/// Points that each sheet must have of them.
const FEWEST: usize = 8;

/// Distance of the sheets in units of the noise of each from which they are told apart. At 5, one point in 160 lies beyond
/// the middle; the halves into which noise alone is cut are 2.6 apart.
const APART: f64 = 5.0;

/// Distance from a point along its normal, in units of noise, up to which others are on its
/// sheet: half of what tells sheets apart.
const REACH: f64 = 2.5;

/// Distance of the groups' means along the planes, in units of the points' spread there, up to which the sheets lie over each
/// other. The groups of a step, which lie side by side, are 1.5 apart, those of two sheets of 20 points each 0.3.
pub(super) const OVERLAP: f64 = 0.8;

/// Times that points are shared out between two planes and these fitted.
const ROUNDS: usize = 3;

/// One point in so many begins the search; around each that is on one of two sheets all others are looked at.
const EVERY: usize = 16;

/// Ratio of the separations of two neighbouring places, and cosine of the angle between their normals (15 degrees), up to
/// which their sheets are the same.
const SAME_SEPARATION: f64 = 1.3;
const SAME_DIRECTION: f64 = 0.966;

/// Two parallel planes through the points around a place.
pub(super) struct Sheets {
    pub normal: Vector,
    /// Standard deviation of the points from their plane.
    pub noise: f64,
    separation: f64,
}

/// Takes over noise and normals of sheets, where there are two.
pub(super) fn tell_apart(scene: &mut Scene) {
    let mut seen = Stamps::new(scene.points.len());
    let mut is_queued = vec![false; scene.points.len()];
    let mut queue: Vec<u32> = scene.chosen.iter().copied().step_by(EVERY).collect();
    queue.iter().for_each(|&point| is_queued[point as usize] = true);
    let mut found = Found::default();
    let mut next = 0;
    while next < queue.len() {
        let point = queue[next];
        next += 1;
        let around = scene.around(point, AROUND, &mut seen);
        let places: Vec<Vector> = around.iter().map(|&other| scene.points[other as usize]).collect();
        let Some(sheets) = Sheets::of(&places) else { continue };
        found.add(point, sheets);
        for other in scene.graph.of(point) {
            if !std::mem::replace(&mut is_queued[other as usize], true) {
                queue.push(other);
            }
        }
    }
    for (point, sheets) in &found.all {
        // All neighbours of a point that is on one of two sheets have been looked at.
        let (mut alike, mut all) = (0, 0);
        for next in scene.graph.of(*point) {
            all += 1;
            let other = found.of(next);
            alike += usize::from(other.is_some_and(|other| sheets.are_those_of(other)));
        }
        if 2 * alike >= all {
            scene.set_sheet(*point, sheets);
        }
    }
}

impl Scene {
    /// Takes over the normal and the noise of a point's own sheet, of two that are farther apart than noise.
    pub fn set_sheet(&mut self, point: u32, sheets: &Sheets) {
        let noise = self.known.unwrap_or(sheets.noise);
        if sheets.are_apart(noise) && (!self.is_exact || self.is_noiseless(noise)) {
            let index = point as usize;
            self.before_sheets.push((point, self.noise[index], self.normals[index]));
            self.noise[index] = noise;
            self.normals[index] = sheets.normal;
            self.is_on_sheet[index] = true;
        }
    }

    /// Takes sheets for one surface again, and nothing as learnt; tells whether there were any.
    pub fn forget_sheets(&mut self) -> bool {
        let before = std::mem::take(&mut self.before_sheets);
        for &(point, noise, normal) in &before {
            let index = point as usize;
            self.noise[index] = noise;
            self.normals[index] = normal;
            self.is_on_sheet[index] = false;
        }
        if !before.is_empty() {
            (self.likeness, self.common_noise) = (Likeness::NONE, f64::INFINITY);
        }
        !before.is_empty()
    }

    /// So many unlabelled points around a seed from which a surface begins, of its own sheet only where there are two.
    pub fn first_around(&self, seed: u32, most: usize, seen: &mut Stamps) -> Vec<u32> {
        let index = seed as usize;
        if !self.is_on_sheet[index] {
            return self.around(seed, most, seen);
        }
        let of_both = self.around(seed, 2 * most, seen);
        let from =
            |&point: &u32| (self.points[point as usize] - self.points[index]).dot(&self.normals[index]);
        let reach = REACH * self.noise[index] + self.floor;
        of_both.into_iter().filter(|point| from(point).abs() <= reach).collect()
    }
}

/// Sheets around points, and where each point's are.
#[derive(Default)]
struct Found {
    all: Vec<(u32, Sheets)>,
    places: FxHashMap<u32, usize>,
}

impl Found {
    fn add(&mut self, point: u32, sheets: Sheets) {
        self.places.insert(point, self.all.len());
        self.all.push((point, sheets));
    }

    fn of(&self, point: u32) -> Option<&Sheets> {
        self.places.get(&point).map(|&place| &self.all[place].1)
    }
}

impl Sheets {
    /// Whether sheets next to these are the same two: clumps of points have a distance and a direction each.
    fn are_those_of(&self, other: &Self) -> bool {
        let is_as_far = self.separation <= SAME_SEPARATION * other.separation
            && other.separation <= SAME_SEPARATION * self.separation;
        is_as_far && self.normal.dot(&other.normal).abs() >= SAME_DIRECTION
    }

    /// Whether they are told apart among noise.
    pub fn are_apart(&self, noise: f64) -> bool {
        self.separation > APART * noise
    }

    /// `None` where the points are on one surface, or on none.
    fn of(points: &[Vector]) -> Option<Self> {
        let count = points.len();
        if count < 2 * FEWEST {
            return None;
        }
        let centre = points.iter().sum::<Vector>() / count as f64;
        let spread: Matrix3<f64> = points.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
        let mut normal = smallest(&spread)?;
        let mut is_upper = upper_half(&points.iter().map(|p| p.dot(&normal)).collect::<Vec<_>>())?;
        let mut found = None;
        for _ in 0..ROUNDS {
            let upper = is_upper.iter().filter(|&&is_upper| is_upper).count();
            if upper < FEWEST || count - upper < FEWEST {
                return None;
            }
            // The planes' normal is that in which points deviate least from the means of both.
            let mean = |side: bool, of: usize| {
                let own = points.iter().zip(&is_upper).filter(|(_, is_upper)| **is_upper == side);
                own.map(|(point, _)| point).sum::<Vector>() / of as f64
            };
            let means = [mean(false, count - upper), mean(true, upper)];
            let from_mean =
                points.iter().zip(&is_upper).map(|(p, &is_upper)| p - means[usize::from(is_upper)]);
            let spread: Matrix3<f64> = from_mean.clone().map(|q| q * q.transpose()).sum();
            normal = smallest(&spread)?;
            let squares: f64 = from_mean.map(|q| q.dot(&normal).powi(2)).sum();
            let noise = (squares / (count - 4) as f64).sqrt();
            let heights = means.map(|mean| mean.dot(&normal));
            let sheets = Self { normal, noise, separation: (heights[1] - heights[0]).abs() };
            let along = means[1] - means[0] - (heights[1] - heights[0]) * normal;
            let spread = spread.trace() / count as f64;
            let overlap = along.norm_squared() <= OVERLAP * OVERLAP * spread;
            found = (overlap && sheets.are_apart(noise)).then_some(sheets);
            let middle = 0.5 * (heights[0] + heights[1]);
            let again: Vec<bool> =
                points.iter().map(|p| (p.dot(&normal) > middle) == (heights[1] > heights[0])).collect();
            if again == is_upper {
                break;
            }
            is_upper = again;
        }
        found
    }
}

/// Which of some numbers are in the upper of two groups: those for which the sum of squares within both is least.
fn upper_half(values: &[f64]) -> Option<Vec<bool>> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    let total: f64 = sorted.iter().sum();
    let mut below = 0.0;
    let mut best = (0.0, f64::NAN);
    for (number, pair) in sorted.windows(2).enumerate() {
        below += pair[0];
        let (lower, upper) = ((number + 1) as f64, (count - number - 1) as f64);
        let between = lower * upper * ((total - below) / upper - below / lower).powi(2);
        if between > best.0 {
            best = (between, 0.5 * (pair[0] + pair[1]));
        }
    }
    best.1.is_finite().then(|| values.iter().map(|&value| value > best.1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::samples::Draws;

    /// Points of two planes across z, the upper one that far above, which lie over each other or side by side.
    fn points(separation: f64, is_step: bool) -> Vec<Vector> {
        let mut draws = Draws(5);
        let place = |i: usize| {
            let x = draws.between(-1.0, 1.0);
            let is_upper = if is_step { x > 0.0 } else { i.is_multiple_of(2) };
            let z = 0.01 * draws.normal() + if is_upper { separation } else { 0.0 };
            Vector::new(x, draws.between(-1.0, 1.0), z)
        };
        (0..AROUND).map(place).collect()
    }

    #[test]
    fn sheets_are_told_apart_from_five_deviations_on() {
        let sheets = Sheets::of(&points(0.1, false)).unwrap();
        assert!(sheets.normal.z.abs() > 0.999 && (0.007..0.013).contains(&sheets.noise));
        assert!((sheets.separation - 0.1).abs() < 0.01);
        assert!(Sheets::of(&points(0.02, false)).is_none());
        assert!(Sheets::of(&points(0.0, false)).is_none());
    }

    #[test]
    fn a_step_is_no_pair_of_sheets() {
        assert!(Sheets::of(&points(0.1, true)).is_none());
    }

    #[test]
    fn the_halves_are_those_with_the_least_squares() {
        assert_eq!(upper_half(&[3.0, 0.0, 3.2, 0.1]), Some(vec![true, false, true, false]));
        assert_eq!(upper_half(&[1.0, 1.0]), None);
    }
}
