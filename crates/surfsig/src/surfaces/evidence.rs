//! Which small surfaces count: those that end at edges.
//!
//! Any small patch of a free form is nearly a sphere or a torus. Beyond its border the points leave it little by little.
//! A surface of its own ends at edges: the next points are far from it or lie across it, or there are none.

use super::growth::{ALONG, Region};
use super::scene::Scene;
use super::stamps::Stamps;

/// Fewer points are no surface, unless somebody says so.
pub const FEWEST_SURFACE_POINTS: usize = 20;

/// The same without noise: seven more than determine a plane are in it by chance hardly ever.
const FEWEST_EXACT: usize = 10;

/// Points more that a small surface must have for each parameter that a plane has not: what bends lies near any few
/// points. 36 points of a torus leave as many degrees of freedom for each parameter as 20 of a plane do, nearly.
const POINTS_PER_PARAMETER: usize = 4;

/// One point in so many is enough for a surface whatever its border is, ...
const LARGE_SHARE: usize = 500;

/// ... and so many points are enough in any scan.
const LARGE: usize = 1000;

/// Distance from a surface, in its tolerances, up to which points beyond its border go on with it. What leaves a surface
/// as the third power of the distance from its middle is two or three tolerances off at the next point.
const BEYOND: f64 = 4.0;

/// Points of a disc, for the root of their number, that have a neighbour outside: a rim as wide as one and a half
/// distances between points, as far as neighbours reach across a border (1.5 * 2 sqrt(pi)).
const RIM: f64 = 5.3;

/// Part of such a rim at which the points may go on beyond the border.
const OPEN_SHARE: f64 = 0.5;

/// Which surfaces count.
#[derive(Clone, Copy)]
pub(super) struct Evidence {
    /// Points of which a surface counts, whatever its border is.
    large: usize,
    /// Points of which a plane counts that ends at edges.
    pub small: usize,
}

impl Evidence {
    /// With the fewest points that somebody asked for.
    pub fn new(asked: Option<usize>, scene: &Scene) -> Self {
        let large = (scene.points.len() / LARGE_SHARE).clamp(FEWEST_SURFACE_POINTS, LARGE);
        let small = if scene.is_exact { FEWEST_EXACT } else { FEWEST_SURFACE_POINTS };
        Self { large: asked.unwrap_or(large), small: asked.unwrap_or(small) }
    }

    /// Surfaces of so many points count.
    pub fn of(points: usize) -> Self {
        Self { large: points, small: points }
    }

    /// Whether a surface counts.
    pub fn counts(&self, region: &Region, scene: &Scene, inside: &mut Stamps) -> bool {
        let count = region.members.len();
        count >= self.large || count >= self.small && self.ends_at_edges(region, scene, inside)
    }

    /// Whether a surface has points enough to be no chance, and ends at edges around most of its border.
    fn ends_at_edges(&self, region: &Region, scene: &Scene, inside: &mut Stamps) -> bool {
        let count = region.members.len() as f64;
        let parameters = region.primitive.kind.parameters();
        let fewest =
            if scene.is_noiseless(region.noise) { self.small } else { self.small.max(FEWEST_SURFACE_POINTS) };
        let enough = fewest + POINTS_PER_PARAMETER * (parameters - 3);
        if count < enough as f64 * scene.likeness.alike {
            return false;
        }
        inside.clear();
        region.members.iter().for_each(|&member| {
            inside.set(member);
        });
        let chart = region.primitive.chart();
        let beyond = BEYOND * region.tolerance(scene);
        let goes_on = |other: u32| {
            let place = &scene.points[other as usize];
            !inside.has(other)
                && chart.distance(place).abs() <= beyond
                && chart.normal(place).dot(&scene.normals[other as usize]).abs() >= ALONG
        };
        let open = region.members.iter().filter(|&&member| scene.graph.of(member).any(goes_on)).count();
        open as f64 <= OPEN_SHARE * count.min(RIM * count.sqrt())
    }
}
