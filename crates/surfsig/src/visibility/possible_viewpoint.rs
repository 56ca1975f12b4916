//! Whether all points of a cloud can have been seen from a viewpoint.

use super::hidden::hidden_from;
use crate::geometry::axes_across;
use crate::kd_tree::KdTree;
use crate::random::some_of;
use crate::statistics::median;
use nalgebra::Vector3;

/// Share of hidden points from which on nobody saw all from there: noise hides few (0.3 to 9 % on real scans from one
/// viewpoint), a closed surface half, and an eighth at least of scans from several viewpoints.
const HIDDEN: f64 = 0.1;
/// Share of hidden points from which on a default viewpoint is none: closed surfaces hide a quarter to a half, the side
/// of one that is seen, evenly sampled to its rim, up to a fifth.
const MOSTLY_HIDDEN: f64 = 0.25;
/// The same for the sum of the shares of hidden points and of depth steps, of points all around: rings, tubes and
/// assemblies of parts have 0.28 to 1.2, real scans up to 0.13.
const BROKEN_AROUND: f64 = 0.25;
/// The same of points to one side: models have 0.33 to 0.6, real scans up to 0.3.
const BROKEN_BESIDE: f64 = 0.32;
/// Share of hidden points up to which points in rows are a scan: a floor seen at a grazing angle has 0.3.
const HIDDEN_IN_ROWS: f64 = 0.4;
/// Radians between neighbouring elevations of one row, at most (float32 changes them by 1e-7).
const ROW_WIDTH: f64 = 1e-5;
/// The same in units of the mean distance of elevations: those of points in no rows differ more.
const ROW_SHARE: f64 = 0.02;
/// Points of a row at least: the faces of a box in a grid bring 8 points to the same elevation.
const ROW_POINTS: usize = 9;
/// Share of the points that are in rows from which on a sensor measured them: 0.84 and more in its frame.
const IN_ROWS: f64 = 0.8;
/// Share of points whose row has more than one distance: models of revolution have rows of one distance, too.
const UNEVEN_ROWS: f64 = 0.25;
/// How much distances differ relatively, at most, that are one.
const EVEN: f64 = 1e-4;
/// Points nearest to a viewpoint that tell whether it lies on the surface.
const NEAREST: usize = 8;
/// Their distance in units of that to their neighbours, below which (for half of them) it does: it is 1 to 4 on a
/// surface, 14 and more for sensors.
const ON_SURFACE: f64 = 6.0;
/// Lines of sight per median distance, at most: they must be few enough to be held.
const FINEST: f64 = 1000.0;
/// Distance of a viewpoint in units of the points' spread, beyond which it is none: a map's origin.
const FARTHEST: f64 = 1000.0;
/// Length of the mean direction to the points below which they are all around; it is 0.5 for half a ball.
const AMONG: f64 = 0.6;
/// Ratio of the distances in two neighbouring directions from which on one point stands before the other.
const DEPTH_STEP: f64 = 1.3;
/// Share of depth steps between neighbouring directions that every real scan has; a closed surface seen from within has
/// none, a lidar scan of a room or a street 0.007 to 0.06.
const STEPS: f64 = 0.002;
/// Points from which on neighbours are near enough for their depths and distances to mean something.
const DENSE: usize = 500;
/// Points that tell the share of depth steps.
const SAMPLE: usize = 4096;

/// Whether all points can have been seen from a viewpoint.
///
/// They cannot where many hide others, or from a thousand times as far away as they are wide. Nor does a sensor stand
/// amid points that are all around in one closed surface, of which nothing stands before anything else: such clouds are
/// models of whole objects. `points` are finite, `spacing` is that between neighbouring ones.
///
/// ```
/// // A ball: half of it is hidden from wherever it is seen.
/// let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
/// let ball: Vec<[f64; 3]> = (0..4000)
///     .map(|i| {
///         let z = 1.0 - (f64::from(i) + 0.5) / 2000.0;
///         let (sine, cosine) = (golden * f64::from(i)).sin_cos();
///         [(1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z]
///     })
///     .collect();
/// let front: Vec<[f64; 3]> = ball.iter().copied().filter(|point| point[2] > 0.3).collect();
/// assert!(surfsig::all_seen_from([0.0, 0.0, 10.0], &front, 0.05));
/// assert!(!surfsig::all_seen_from([0.0, 0.0, 10.0], &ball, 0.05));
/// assert!(!surfsig::all_seen_from([0.0; 3], &ball, 0.05));
/// ```
pub fn all_seen_from(viewpoint: [f64; 3], points: &[[f64; 3]], spacing: f64) -> bool {
    let Some(rays) = Rays::new(viewpoint, points) else { return false };
    !rays.are_far() && rays.hidden_share(spacing) < HIDDEN && !rays.are_closed()
}

/// Whether a sensor at the origin may have measured points, which are finite and all different.
///
/// Noise and steep surfaces hide more points of true scans than [`all_seen_from`] allows. On the other hand, points in
/// the rows of a sensor are a scan, even one of an empty room.
///
/// ```
/// let box_of_points: Vec<[f64; 3]> = (0..2400)
///     .map(|i| (f64::from(i / 6 % 20) / 10.0 - 0.93, f64::from(i / 120) / 10.0 - 0.97, i % 6))
///     .map(|(x, y, face)| {
///         let side = if face % 2 == 0 { 1.0 } else { -1.0 };
///         let mut point = [x, y, side];
///         point.rotate_left(face as usize / 2);
///         point
///     })
///     .collect();
/// assert!(!surfsig::measured_from_origin(&box_of_points, 0.1));
/// ```
pub fn measured_from_origin(points: &[[f64; 3]], spacing: f64) -> bool {
    measured_from([0.0; 3], points, spacing)
}

/// The same for a sensor at the origin of its coordinates, where the points are given about another place.
pub(crate) fn measured_from(viewpoint: [f64; 3], points: &[[f64; 3]], spacing: f64) -> bool {
    let Some(rays) = Rays::new(viewpoint, points) else { return false };
    if rays.are_far() || rays.start_on_surface() {
        return false;
    }
    let hidden = rays.hidden_share(spacing);
    if hidden < HIDDEN_IN_ROWS && rays.are_in_rows() {
        return true;
    }
    if hidden >= MOSTLY_HIDDEN || rays.are_closed() {
        return false;
    }
    let most = if rays.are_around() { BROKEN_AROUND } else { BROKEN_BESIDE };
    points.len() < DENSE || hidden + rays.step_share() < most
}

/// Whether points, about `spacing` apart, whose density is that of a scan from a viewpoint, can have been seen from there:
/// that is as good evidence as rows of points are, but some must stand before others.
pub(super) fn may_be_scan_from(viewpoint: [f64; 3], points: &[[f64; 3]], spacing: f64) -> bool {
    let Some(rays) = Rays::new(viewpoint, points) else { return false };
    !rays.are_far() && rays.hidden_share(spacing) < HIDDEN_IN_ROWS && rays.step_share() >= STEPS
}

/// From a viewpoint to points, none of which is there.
struct Rays {
    rays: Vec<Vector3<f64>>,
    distances: Vec<f64>,
}

impl Rays {
    /// `None` where there is no point, one is at the viewpoint, or one is too far away for its distance to be finite.
    fn new(viewpoint: [f64; 3], points: &[[f64; 3]]) -> Option<Self> {
        let viewpoint = Vector3::from(viewpoint);
        let rays: Vec<Vector3<f64>> = points.iter().map(|&point| Vector3::from(point) - viewpoint).collect();
        let distances: Vec<f64> = rays.iter().map(|ray| ray.norm()).collect();
        let is_good = distances.iter().all(|distance| *distance > 0.0 && distance.is_finite());
        (is_good && !rays.is_empty()).then_some(Self { rays, distances })
    }

    fn middle(&self) -> f64 {
        median(self.distances.clone()).unwrap_or(0.0)
    }

    fn are_far(&self) -> bool {
        let middle =
            Vector3::from_fn(|k, _| median(self.rays.iter().map(|ray| ray[k]).collect()).unwrap_or(0.0));
        let spread = median(self.rays.iter().map(|ray| (ray - middle).norm()).collect()).unwrap_or(0.0);
        self.middle() > FARTHEST * spread
    }

    /// Whether the viewpoint is as near to points as these are to each other.
    fn start_on_surface(&self) -> bool {
        if self.rays.len() < DENSE {
            return false;
        }
        let mut numbers: Vec<usize> = (0..self.rays.len()).collect();
        numbers.select_nth_unstable_by(NEAREST, |&a, &b| self.distances[a].total_cmp(&self.distances[b]));
        let points: Vec<[f64; 3]> = self.rays.iter().map(|&ray| ray.into()).collect();
        let tree = KdTree::new(&points);
        let ratio = |&number: &usize| {
            let nearest = tree.nearest_where(points[number], f64::INFINITY, |other| other as usize != number);
            self.distances[number] / nearest.map_or(f64::INFINITY, |(_, square)| square.sqrt())
        };
        median(numbers[..NEAREST].iter().map(ratio).collect()).is_some_and(|ratio| ratio < ON_SURFACE)
    }

    /// Whether points share their elevations, as a lidar's do, or their lines of an image.
    fn are_in_rows(&self) -> bool {
        let pairs = || self.rays.iter().zip(&self.distances);
        let mut angles: Vec<Vec<f64>> =
            vec![pairs().map(|(ray, distance)| (ray.z / distance).clamp(-1.0, 1.0).asin()).collect()];
        if self.rays.iter().all(|ray| ray.z > 0.0) || self.rays.iter().all(|ray| ray.z < 0.0) {
            angles.extend([0, 1].map(|k| self.rays.iter().map(|ray| (ray[1 - k] / ray.z).atan()).collect()));
        }
        angles.iter().any(|angles| self.are_rows_of(angles))
    }

    /// Whether most points have angles that many others have, too, at different distances.
    fn are_rows_of(&self, angles: &[f64]) -> bool {
        let count = angles.len() as f64;
        let mut order: Vec<usize> = (0..angles.len()).collect();
        order.sort_unstable_by(|&a, &b| angles[a].total_cmp(&angles[b]));
        let range = angles[order[order.len() - 1]] - angles[order[0]];
        let width = ROW_WIDTH.min(ROW_SHARE * range / count);
        let (mut in_rows, mut uneven) = (0, 0);
        for row in order.chunk_by(|&a, &b| angles[b] - angles[a] <= width) {
            if row.len() >= ROW_POINTS {
                let distances = || row.iter().map(|&number| self.distances[number]);
                let (near, far) =
                    (distances().fold(f64::INFINITY, f64::min), distances().fold(0.0, f64::max));
                in_rows += row.len();
                uneven += if far - near > EVEN * far { row.len() } else { 0 };
            }
        }
        in_rows as f64 >= IN_ROWS * count && uneven as f64 >= UNEVEN_ROWS * count
    }

    /// Share of the points that others hide.
    fn hidden_share(&self, spacing: f64) -> f64 {
        let mean = self.rays.iter().sum::<Vector3<f64>>() / self.rays.len() as f64;
        let length = mean.norm();
        if length == 0.0 {
            // The viewpoint is the very centre of the points: that of a model, not a sensor's.
            return 1.0;
        }
        // Angles about an axis square to the mean ray, as lengths at the median distance: parallel lines of sight.
        let ahead = mean / length;
        let [pole, across] = axes_across(&ahead);
        let middle = self.middle();
        let sight = |(ray, distance): (&Vector3<f64>, &f64)| {
            let azimuth = (-ray.dot(&across)).atan2(ray.dot(&ahead));
            let elevation = (ray.dot(&pole) / distance).clamp(-1.0, 1.0).asin();
            // Of the distance the logarithm, as spacing and noise grow with it.
            [middle * azimuth, middle * elevation, -middle * (distance / middle).ln()]
        };
        let sights: Vec<[f64; 3]> = self.rays.iter().zip(&self.distances).map(sight).collect();
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(<[f64; 3]>::from);
        let hidden = hidden_from(z, [x, y], &sights, &sights, spacing.max(middle / FINEST));
        hidden.iter().filter(|&&is_hidden| is_hidden).count() as f64 / hidden.len() as f64
    }

    fn are_around(&self) -> bool {
        let directions = self.rays.iter().zip(&self.distances).map(|(ray, distance)| ray / *distance);
        (directions.sum::<Vector3<f64>>() / self.rays.len() as f64).norm() < AMONG
    }

    fn are_closed(&self) -> bool {
        self.rays.len() >= 3 && self.are_around() && self.step_share() < STEPS
    }

    /// Share of the points that stand before or behind that in the next direction.
    fn step_share(&self) -> f64 {
        let chosen = some_of(self.rays.len(), SAMPLE);
        let directions: Vec<[f64; 3]> =
            chosen.iter().map(|&number| (self.rays[number] / self.distances[number]).into()).collect();
        let tree = KdTree::new(&directions);
        let is_step = |number: &usize| {
            let is_other = |other: u32| other as usize != *number;
            let next = tree.nearest_where(directions[*number], f64::INFINITY, is_other);
            let [first, second] =
                [*number, next.map_or(*number, |(next, _)| next as usize)].map(|i| self.distances[chosen[i]]);
            first.max(second) > DEPTH_STEP * first.min(second)
        };
        (0..chosen.len()).filter(is_step).count() as f64 / chosen.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;
    use std::f64::consts::PI;

    /// Directions by chance, evenly all around.
    fn directions(count: usize) -> Vec<[f64; 3]> {
        let direction = |i: usize| {
            let (z, (sine, cosine)) = (2.0 * uniform(i, 3) - 1.0, (2.0 * PI * uniform(i, 4)).sin_cos());
            [(1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z]
        };
        (0..count).map(direction).collect()
    }

    #[test]
    fn a_closed_surface_is_not_seen_from_one_place() {
        let ball = directions(20_000);
        let front: Vec<[f64; 3]> = ball.iter().copied().filter(|point| point[2] > 0.3).collect();
        let viewpoint = [0.0, 0.0, 10.0];
        assert!(!all_seen_from(viewpoint, &ball, 0.02));
        assert!(all_seen_from(viewpoint, &front, 0.02));
        assert!(
            !all_seen_from([0.0, 0.0, 2e3], &front, 0.02),
            "it is a thousand times as far as they are wide"
        );
        assert!(!all_seen_from(front[7], &front, 0.02), "a point is there");
        assert!(!all_seen_from([0.0; 3], &ball, 0.02), "nothing stands before anything else");
    }

    #[test]
    fn the_very_centre_of_points_is_no_viewpoint() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let both: Vec<[f64; 3]> = axes.into_iter().chain(axes.map(|axis| axis.map(|x| -x))).collect();
        assert!(!all_seen_from([0.0; 3], &both, 1.0));
    }

    #[test]
    fn a_room_with_a_pillar_is_seen_from_within() {
        let to_wall = |ray: [f64; 3]| {
            let walls = (0..3).map(|k| [4.0, 3.0, 1.5][k] / ray[k].abs());
            let distance = walls.fold(f64::INFINITY, f64::min);
            // A pillar to the side, before the wall.
            let is_pillar = ray[0] > 0.0 && (ray[1] / ray[0]).abs() < 0.15;
            let distance = if is_pillar { distance.min(1.5 / ray[0]) } else { distance };
            ray.map(|x| x * distance)
        };
        let room: Vec<[f64; 3]> = directions(20_000).into_iter().map(to_wall).collect();
        assert!(all_seen_from([0.0; 3], &room, 0.05));
        assert!(!all_seen_from([3.0, 0.0, 0.0], &room, 0.05), "from there the pillar hides much");
    }

    #[test]
    fn no_number_is_too_large() {
        for points in [vec![], vec![[1.0; 3]], vec![[1e300, 0.0, 0.0]; 9], vec![[1e-300; 3]; 9]] {
            for viewpoint in [[0.0; 3], [1e308; 3], [1.0; 3]] {
                assert!(!all_seen_from(viewpoint, &points, 0.0) || points.len() == 1);
            }
            assert!(!measured_from_origin(&points, 0.0) || points.len() == 1);
        }
    }

    #[test]
    fn what_is_hidden_is_what_a_slow_search_finds() {
        let points = directions(3000);
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let spacing = 0.05;
        let hidden = hidden_from(z, [x, y], &points, &points, spacing);
        let cell = |point: &[f64; 3]| [0, 1].map(|k| (point[k] / (1.5 * spacing)).floor());
        for (point, is_hidden) in points.iter().zip(hidden) {
            let before = |other: &[f64; 3]| cell(other) == cell(point) && other[2] > point[2] + 4.0 * spacing;
            assert_eq!(is_hidden, points.iter().any(before));
        }
    }
}
