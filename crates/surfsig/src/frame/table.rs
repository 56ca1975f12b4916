//! w over (k1, k2), for surfaces in their own axes.
//!
//! There K and H are even along both axes of the grid, and so is w: 2 x 6 x 6 of its 242 numbers are
//! free. The table holds those at each node, and a row is made by cubic interpolation.

use super::symmetry::{EVEN, Part};
use super::{Frame, SIGNATURE, VOCABULARY_END};
use crate::curvature::{GRID, Paraboloid, grid_coordinate};
use crate::multiply_add::MultiplyAdd;
use crate::simd::{InstructionSet, for_each_instruction_set};
use nalgebra::DVector;
use rayon::prelude::*;

/// Free numbers of a signature in its own axes.
const FREE: usize = 2 * EVEN * EVEN;

/// Distance of the nodes, patch units: 1.5 per metre for a patch of 40 mm.
const STEP: f64 = 0.06;

/// Nodes on each side of 0: beyond 4.6 a sphere is outside the vocabulary. What is not is
/// computed without the table.
const NODES_A_SIDE: usize = 80;

const NODES: usize = 2 * NODES_A_SIDE + 1;

/// Signatures at the nodes.
#[derive(Debug)]
pub(super) struct Table {
    /// At k1 = (i - NODES_A_SIDE) STEP, k2 = (j - NODES_A_SIDE) STEP, in place i NODES + j.
    nodes: Vec<[f32; FREE]>,
    set: InstructionSet,
}

impl Table {
    pub fn new(frame: &Frame) -> Self {
        let mut nodes = vec![[0.0; FREE]; NODES * NODES];
        let curvature = |i: usize| (i as f64 - NODES_A_SIDE as f64) * STEP;
        nodes.par_chunks_mut(NODES).enumerate().for_each(|(i, row)| {
            for (j, node) in row.iter_mut().enumerate() {
                *node = free_signature(frame, curvature(i), curvature(j)).map(|v| v as f32);
            }
        });
        Self { nodes, set: InstructionSet::detect() }
    }

    /// Fills a row, with NaN beyond the vocabulary's end; `false` where the table does not reach.
    pub fn interpolate(&self, k1: f64, k2: f64, row: &mut [f32; SIGNATURE]) -> bool {
        let locate = |k: f64| {
            let place = k / STEP + NODES_A_SIDE as f64;
            let first = place.floor() - 1.0;
            let inside = first >= 0.0 && first + 3.0 < NODES as f64;
            inside.then_some((first as usize, place - first - 1.0))
        };
        let (Some((i, s)), Some((j, t))) = (locate(k1), locate(k2)) else {
            return false;
        };
        let weights: [[f32; 4]; 4] = {
            let (across, along) = (cubic_weights(s), cubic_weights(t));
            across.map(|a| along.map(|b| (a * b) as f32))
        };
        let window = &self.nodes[i * NODES + j..];
        let free = combine(self.set, window, &weights);
        let square: f64 = free.iter().zip(COPIES).map(|(v, n)| f64::from(*v) * f64::from(*v) * n).sum();
        if square.sqrt() <= VOCABULARY_END {
            for (value, free_place) in row.iter_mut().zip(FREE_OF_PLACE) {
                *value = free[free_place];
            }
        } else {
            row.fill(f32::NAN);
        }
        true
    }
}

/// The free numbers of w. Only the two parts that are even along both axes take part, and a basis
/// vector of theirs is spread evenly over a number's copies.
fn free_signature(frame: &Frame, k1: f64, k2: f64) -> [f64; FREE] {
    let surface = Paraboloid { a: 0.5 * k1, b: 0.5 * k2, ..Paraboloid::default() };
    let half = EVEN * EVEN;
    let mut free = [0.0; FREE];
    for (mean, values) in [false, true].into_iter().zip(free.chunks_exact_mut(half)) {
        let part = Part { mean, odd_x: false, odd_y: false };
        let field = DVector::from_fn(half, |i, _| {
            let (x, y) = (grid_coordinate(GRID / 2 + i / EVEN), grid_coordinate(GRID / 2 + i % EVEN));
            let value = if mean {
                surface.mean_curvature(x, y, frame.parameters.formula)
            } else {
                surface.gaussian_curvature(x, y)
            };
            value * COPIES[i].sqrt()
        });
        let product = frame.inverse_root_of(part) * field;
        for (i, value) in values.iter_mut().enumerate() {
            *value = product[i] / COPIES[i].sqrt();
        }
    }
    free
}

for_each_instruction_set! {
    /// The weighted sum of 4 x 4 nodes.
    fn combine(window: &[[f32; FREE]], weights: &[[f32; 4]; 4]) -> [f32; FREE] {
        plain: combine_in,
        wide: combine_in,
        widest: combine_in,
    }
}

#[inline(always)]
fn combine_in(window: &[[f32; FREE]], weights: &[[f32; 4]; 4]) -> [f32; FREE] {
    let mut sum = [0.0; FREE];
    for (i, weights) in weights.iter().enumerate() {
        for (j, &weight) in weights.iter().enumerate() {
            let node = &window[i * NODES + j];
            for l in 0..FREE {
                sum[l] = node[l].times_plus(weight, sum[l]);
            }
        }
    }
    sum
}

/// Weights of the nodes at -1, 0, 1, 2 of the cubic through them, at 0 <= t < 1.
fn cubic_weights(t: f64) -> [f64; 4] {
    let (before, after, last) = (t + 1.0, t - 1.0, t - 2.0);
    [t * after * last / -6.0, before * after * last / 2.0, before * t * last / -2.0, before * t * after / 6.0]
}

/// Which free number stands at each place of a signature.
const FREE_OF_PLACE: [usize; SIGNATURE] = {
    let mut table = [0; SIGNATURE];
    let mut place = 0;
    while place < SIGNATURE {
        let (field, rest) = (place / (GRID * GRID), place % (GRID * GRID));
        let (column, row) = ((rest / GRID).abs_diff(GRID / 2), (rest % GRID).abs_diff(GRID / 2));
        table[place] = (field * EVEN + column) * EVEN + row;
        place += 1;
    }
    table
};

/// At how many places each free number stands.
const COPIES: [f64; FREE] = {
    let mut table = [0.0; FREE];
    let mut place = 0;
    while place < SIGNATURE {
        table[FREE_OF_PLACE[place]] += 1.0;
        place += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_table_agrees_with_the_product(k1 in -6.0_f64..6.0, k2 in -6.0_f64..6.0) {
            let frame = Frame::shared();
            let mut row = [[0.0; SIGNATURE]];
            frame.signatures_of_curvatures(1.0, &[[k1 as f32, k2 as f32]], &mut row, &mut [crate::Status::Ok]);
            let surface = Paraboloid::of_principal_curvatures(k1 as f32, k2 as f32, 1.0);
            let exact = frame.times_inverse_root(&surface.curvature_fields(frame.parameters.formula));
            let length = exact.iter().map(|v| v * v).sum::<f64>().sqrt();
            prop_assume!((length - VOCABULARY_END).abs() > 1e-4);
            if length > VOCABULARY_END {
                prop_assert!(row[0].iter().all(|v| v.is_nan()));
            } else {
                let error = row[0].iter().zip(exact).map(|(v, e)| (f64::from(*v) - e).powi(2)).sum::<f64>().sqrt();
                // Beyond the atoms' own curvature w grows steeply.
                let within = k1.abs().max(k2.abs()) <= 4.0;
                prop_assert!(error < 2e-6 + if within { 2e-5 } else { 2e-4 } * length, "{error} of {length}");
            }
        }
    }
}
