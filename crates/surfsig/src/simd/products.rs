//! Scalar products of many vectors with many others: the one kernel for tiles of both.

use super::{InstructionSet, for_each_instruction_set};
use crate::multiply_add::MultiplyAdd;

/// Vectors of one side of a tile, which are read one after the other.
pub(crate) const ROWS: usize = 8;

/// Vectors of the other side, whose products are made side by side.
pub(crate) const COLUMNS: usize = 16;

/// For each number of a vector, that of [`COLUMNS`] vectors.
#[repr(align(64))]
pub(crate) struct Panel<const N: usize>(pub [[f32; COLUMNS]; N]);

impl<const N: usize> Panel<N> {
    /// Some vectors, at most [`COLUMNS`], side by side; zeros in the place of those that are missing.
    pub fn of(vectors: &[[f32; N]]) -> Self {
        let mut panel = Self([[0.0; COLUMNS]; N]);
        for (column, vector) in vectors.iter().enumerate() {
            for (row, &value) in panel.0.iter_mut().zip(vector) {
                row[column] = value;
            }
        }
        panel
    }
}

/// The products of eight vectors with those of a panel, each summed in the order of its numbers.
pub(crate) fn products<const N: usize>(
    set: InstructionSet,
    rows: &[&[f32; N]; ROWS],
    panel: &Panel<N>,
) -> [[f32; COLUMNS]; ROWS] {
    tile(set, &rows.map(|row| row.as_slice()), &panel.0)
}

for_each_instruction_set! {
    fn tile(rows: &[&[f32]; ROWS], panel: &[[f32; COLUMNS]]) -> [[f32; COLUMNS]; ROWS] {
        plain: tile_in::<2>,
        wide: tile_in::<4>,
        widest: tile_in::<8>,
    }
}

/// `TOGETHER` rows at a time: as many as there are registers for.
#[inline(always)]
fn tile_in<const TOGETHER: usize>(rows: &[&[f32]; ROWS], panel: &[[f32; COLUMNS]]) -> [[f32; COLUMNS]; ROWS] {
    let mut products = [[0.0; COLUMNS]; ROWS];
    for first in (0..ROWS).step_by(TOGETHER) {
        let mut sums = [[0.0_f32; COLUMNS]; TOGETHER];
        // All of one length, so that no bound is checked within the loop.
        let mut some: [&[f32]; TOGETHER] = [&[]; TOGETHER];
        for r in 0..TOGETHER {
            some[r] = &rows[first + r][..panel.len()];
        }
        for n in 0..panel.len() {
            for r in 0..TOGETHER {
                let value = some[r][n];
                for c in 0..COLUMNS {
                    sums[r][c] = value.times_plus(panel[n][c], sums[r][c]);
                }
            }
        }
        products[first..first + TOGETHER].copy_from_slice(&sums);
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_gives_the_same_bits_and_the_products_of_float64() {
        let number = |i: usize, k: usize| ((i * 7 + k * 3) as f32 * 0.37).sin();
        let vectors: [[f32; 40]; 30] = std::array::from_fn(|i| std::array::from_fn(|k| number(i, k)));
        let rows: [&[f32; 40]; ROWS] = std::array::from_fn(|r| &vectors[r]);
        let panel = Panel::of(&vectors[ROWS..ROWS + 15]);
        let plain = products(InstructionSet::available()[0], &rows, &panel);
        for set in InstructionSet::available() {
            assert_eq!(products(set, &rows, &panel), plain, "{}", set.name());
        }
        for r in 0..ROWS {
            for c in 0..15 {
                let pairs = vectors[r].iter().zip(&vectors[ROWS + c]);
                let expected: f64 = pairs.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum();
                assert!((f64::from(plain[r][c]) - expected).abs() < 1e-5, "{r} {c}");
            }
            assert_eq!(plain[r][15], 0.0);
        }
    }
}
