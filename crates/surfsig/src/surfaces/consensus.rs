//! Planes through few points among others, where there is no noise.
//!
//! A face may have so few points that each one's nearest are partly those of the next faces, and no surface goes through
//! them. Without noise three of its points are enough: others lie in their plane by chance hardly ever.

use super::growth::{Grower, Region};
use super::scene::Scene;
use super::stamps::Stamps;
use crate::primitive::{Primitive, SurfaceKind, Vector};

/// Points around a seed, the nearest first, two of which are taken with it, ...
const TAKEN: usize = 10;

/// ... and so many that may lie in their plane, ...
const AROUND: usize = 24;

/// ... of which so many must, with the three: none of these is in its plane by chance.
const IN_PLANE: usize = 8;

/// Of these, points that are not in one line: a line, and any point beside it, are always in a plane.
const BESIDE_LINE: usize = 3;

/// Sine of the angle between the directions to two points from which they and the seed tell a plane.
const LEAST_SINE: f64 = 0.2;

impl Scene {
    /// The normal of the plane through a point and two of the next ones that most others are in, and all of these.
    fn exact_plane_around(&self, seed: u32, seen: &mut Stamps) -> Option<(Vector, Vec<u32>)> {
        let around = self.around(seed, AROUND, seen);
        let origin = self.points[seed as usize];
        let from: Vec<Vector> = around.iter().map(|&point| self.points[point as usize] - origin).collect();
        let reach = self.exact_reach();
        let taken = TAKEN.min(around.len());
        let mut best: (usize, Vector) = (IN_PLANE - 1, Vector::zeros());
        for first in 1..taken {
            for second in first + 1..taken {
                let across = from[first].cross(&from[second]);
                let length = across.norm();
                if length == 0.0 || length < LEAST_SINE * from[first].norm() * from[second].norm() {
                    continue;
                }
                let normal = across / length;
                let in_plane = from.iter().filter(|q| q.dot(&normal).abs() <= reach).count();
                if in_plane > best.0 {
                    best = (in_plane, normal);
                }
            }
        }
        let (_, normal) = best;
        if normal == Vector::zeros() {
            return None;
        }
        let members = (0..around.len()).filter(|&i| from[i].dot(&normal).abs() <= reach);
        let (members, places): (Vec<u32>, Vec<Vector>) = members.map(|i| (around[i], from[i])).unzip();
        (beside_line(&places, reach) >= BESIDE_LINE).then_some((normal, members))
    }
}

impl Grower<'_> {
    /// The plane that grows from a seed and the points next to it that are in a plane with it.
    pub fn plane_around(&mut self, seed: u32) -> Option<Region> {
        let (axis, members) = self.scene.exact_plane_around(seed, self.seen)?;
        let plane = Primitive {
            kind: SurfaceKind::Plane,
            point: self.scene.points[seed as usize],
            axis,
            radius: 0.0,
            major_radius: 0.0,
            half_angle: 0.0,
        };
        let region = self.grow(plane, &members, self.scene.floor)?;
        self.counts(&region).then_some(region)
    }
}

/// Points that are not in the line in which most are.
fn beside_line(points: &[Vector], reach: f64) -> usize {
    let beside = |a: &Vector, b: &Vector| {
        let along = (b - a).normalize();
        points.iter().filter(|p| (*p - a).cross(&along).norm() > reach).count()
    };
    let pairs = points.iter().enumerate().flat_map(|(i, a)| points[..i].iter().map(move |b| (a, b)));
    pairs.filter(|(a, b)| a != b).map(|(a, b)| beside(a, b)).min().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_beside_a_line_are_counted() {
        let line = (0..5).map(|i| f64::from(i) * Vector::new(1.0, 2.0, 0.0));
        let beside = [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0)];
        let points: Vec<Vector> = line.chain(beside).collect();
        assert_eq!(beside_line(&points, 1e-9), 2);
        assert_eq!(beside_line(&points[..5], 1e-9), 0);
        assert_eq!(beside_line(&points[..1], 1e-9), 0);
    }
}
