//! Cubes of the dyadic lattice, and what a distance between any two of their points must be.
//!
//! Whole numbers throughout: what is inside a ball, and what is outside, is the same on every machine,
//! in every tile and at every origin.

use crate::lattice::PARTS_PER_CELL;

/// Parts per radius: a cell is half a radius wide.
const RADIUS: i32 = 2 * PARTS_PER_CELL;

/// A cube, in parts of a cell, from the corner of the region that is worked on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cube {
    pub low: [i16; 3],
    pub size: i16,
}

/// Where the points of one cube are, for balls around the points of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Relation {
    /// In every ball. The exact test would say so too: its limit is 1e-5 above the square of the
    /// radius, and offsets from a row's middle are exact to 3e-6 of it.
    Inside,
    /// In no ball: the square of the distance is at least one part's above that of the radius, which is 6e-5
    /// of it, and the limit of the exact test below that.
    Outside,
    /// The exact test must say.
    Near,
}

impl Cube {
    /// One of the eight cubes of half the size, by the bits of its number: x, y, z from high to low.
    pub fn octant(self, number: usize) -> Self {
        let size = self.size / 2;
        let bits = [number >> 2 & 1, number >> 1 & 1, number & 1];
        Self { low: std::array::from_fn(|axis| self.low[axis] + bits[axis] as i16 * size), size }
    }

    /// Where the points of `other` are, for balls around the points of this cube.
    #[inline]
    pub fn relation(self, other: Self) -> Relation {
        let (size, other_size) = (i32::from(self.size), i32::from(other.size));
        let (mut nearest, mut farthest) = (0, 0);
        for axis in 0..3 {
            let between = i32::from(other.low[axis]) - i32::from(self.low[axis]);
            let gap = (between - size).max(-between - other_size).max(0);
            let span = (between + other_size).max(size - between);
            nearest += gap * gap;
            farthest += span * span;
        }
        if farthest <= RADIUS * RADIUS {
            Relation::Inside
        } else if nearest > RADIUS * RADIUS {
            Relation::Outside
        } else {
            Relation::Near
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CELL: i16 = PARTS_PER_CELL as i16;

    fn cube(low: [i16; 3], size: i16) -> Cube {
        Cube { low, size }
    }

    #[test]
    fn cubes_that_touch_the_sphere_are_told_apart_to_one_part() {
        let one = cube([0; 3], 1);
        // From the near side to the far side: 128 parts exactly, one more, one less.
        assert_eq!(one.relation(cube([129, 0, 0], 1)), Relation::Near);
        assert_eq!(one.relation(cube([130, 0, 0], 1)), Relation::Outside);
        assert_eq!(one.relation(cube([-129, 0, 0], 1)), Relation::Near);
        assert_eq!(one.relation(cube([-130, 0, 0], 1)), Relation::Outside);
        // The far corners are at (127, 1, 1) and (128, 1, 1).
        assert_eq!(one.relation(cube([0, 126, 0], 1)), Relation::Inside);
        assert_eq!(one.relation(cube([0, 127, 0], 1)), Relation::Near);
        // A cell is half a radius wide: with its diagonal neighbour the far corners are 1.7 radii away.
        assert_eq!(cube([0; 3], CELL).relation(cube([0; 3], CELL)), Relation::Inside);
        assert_eq!(cube([0; 3], CELL).relation(cube([CELL; 3], CELL)), Relation::Near);
        // Two cells between: a face and a corner that lie on the sphere.
        assert_eq!(cube([0; 3], CELL).relation(cube([3 * CELL, CELL, 0], CELL)), Relation::Near);
        assert_eq!(cube([0; 3], CELL).relation(cube([3 * CELL, 2 * CELL, 0], CELL)), Relation::Outside);
    }

    #[test]
    fn octants_fill_their_cube() {
        let octants: Vec<Cube> = (0..8).map(|number| cube([-8, 0, 8], 8).octant(number)).collect();
        assert_eq!(octants[0], cube([-8, 0, 8], 4));
        assert_eq!(octants[1], cube([-8, 0, 12], 4));
        assert_eq!(octants[6], cube([-4, 4, 8], 4));
    }

    proptest! {
        #[test]
        fn what_is_inside_or_outside_is_so_for_every_pair_of_points(
            a in prop::array::uniform3(-200_i16..200), b in prop::array::uniform3(-200_i16..200),
            size_a in prop::sample::select(vec![1_i16, 4, 16, 64]), size_b in prop::sample::select(vec![1_i16, 4, 16, 64]),
            p in prop::array::uniform3(0.0_f64..=1.0), q in prop::array::uniform3(0.0_f64..=1.0),
        ) {
            let square: f64 = (0..3)
                .map(|i| f64::from(a[i]) + p[i] * f64::from(size_a) - f64::from(b[i]) - q[i] * f64::from(size_b))
                .map(|d| d * d / f64::from(RADIUS * RADIUS))
                .sum();
            let (a, b) = (cube(a, size_a), cube(b, size_b));
            prop_assert_eq!(a.relation(b), b.relation(a));
            match a.relation(b) {
                Relation::Inside => prop_assert!(square <= 1.0),
                Relation::Outside => prop_assert!(square >= 1.0 + 6e-5),
                Relation::Near => {}
            }
        }
    }
}
