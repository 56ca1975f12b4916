//! The frame's symmetry, by which a 242 x 242 problem falls into eight of at most 36 x 36.
//!
//! With an atom, its mirror images along x, along y and along z are atoms too. Mirroring along x or y
//! mirrors the fields of K and H on the grid; along z it leaves K and inverts H. So F F^T couples
//! neither K with H nor fields that are even along an axis with fields that are odd.

use crate::curvature::{ALPHA, GRID};

/// Places on one side of the grid's middle.
const SIDE: usize = GRID / 2;

/// Fields that are even along an axis have this many free values, ...
pub(super) const EVEN: usize = SIDE + 1;

/// A part of alpha that the frame couples to no other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// The field of H rather than that of K.
    pub mean: bool,
    pub odd_x: bool,
    pub odd_y: bool,
}

impl Part {
    pub const ALL: [Self; 8] = {
        let mut parts = [Self { mean: false, odd_x: false, odd_y: false }; 8];
        let mut i = 0;
        while i < 8 {
            parts[i] = Self { mean: i & 4 != 0, odd_x: i & 2 != 0, odd_y: i & 1 != 0 };
            i += 1;
        }
        parts
    };

    /// ... and odd ones one less: nothing in the middle.
    fn distances(odd: bool) -> std::ops::RangeInclusive<usize> {
        usize::from(odd)..=SIDE
    }

    pub fn dimension(&self) -> usize {
        Self::distances(self.odd_x).count() * Self::distances(self.odd_y).count()
    }

    /// The part of a vector, in an orthonormal basis.
    pub fn project(&self, alpha: &[f64; ALPHA]) -> Vec<f64> {
        let mut part = Vec::with_capacity(self.dimension());
        for x in Self::distances(self.odd_x) {
            for y in Self::distances(self.odd_y) {
                part.push(self.weights(x, y).map(|(place, weight)| weight * alpha[place]).sum());
            }
        }
        part
    }

    /// Adds the part to a vector: the transpose of [`Self::project`].
    pub fn add_to(&self, part: &[f64], alpha: &mut [f64; ALPHA]) {
        let mut values = part.iter();
        for x in Self::distances(self.odd_x) {
            for y in Self::distances(self.odd_y) {
                let value = values.next().expect("one value for each pair of distances");
                for (place, weight) in self.weights(x, y) {
                    alpha[place] += weight * value;
                }
            }
        }
    }

    /// The places of the grid at these distances from its middle, and the basis vector's value there.
    fn weights(&self, x: usize, y: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let first = if self.mean { GRID * GRID } else { 0 };
        let (odd_x, odd_y) = (self.odd_x, self.odd_y);
        axis_weights(x, odd_x).flat_map(move |(column, wx)| {
            axis_weights(y, odd_y).map(move |(row, wy)| (first + column * GRID + row, wx * wy))
        })
    }
}

/// One axis: the middle alone, or the two places at a distance.
fn axis_weights(distance: usize, odd: bool) -> impl Iterator<Item = (usize, f64)> + Clone {
    let weight = if distance == 0 { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 };
    let near = (SIDE + distance, weight);
    let far = (distance > 0).then(|| (SIDE - distance, if odd { -weight } else { weight }));
    std::iter::once(near).chain(far)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_are_an_orthonormal_basis() {
        assert_eq!(Part::ALL.iter().map(Part::dimension).sum::<usize>(), ALPHA);
        let alpha: [f64; ALPHA] = std::array::from_fn(|i| (0.37 * (i * i) as f64).sin());
        let mut again = [0.0; ALPHA];
        let mut square = 0.0;
        for part in Part::ALL {
            let values = part.project(&alpha);
            square += values.iter().map(|v| v * v).sum::<f64>();
            part.add_to(&values, &mut again);
        }
        assert!(alpha.iter().zip(again).all(|(a, b)| (a - b).abs() < 1e-14));
        assert!((square - alpha.iter().map(|v| v * v).sum::<f64>()).abs() < 1e-12);
    }
}
