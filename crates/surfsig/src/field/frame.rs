//! The learned frame: what of a pool differs from place to place more than from scan to scan.

use super::FieldSignature;
use crate::simd::InstructionSet;
use crate::simd::field::{ATOMS, AtomBlock, FEATURES, ORDERS, Pool, project};
use std::sync::OnceLock;

/// Numbers of a field signature.
pub const FIELD_SIGNATURE: usize = 256;

/// Of each order from 1 on, atoms whose coefficients are kept with their phases: the clearest.
pub const FIELD_PHASES: usize = 8;

/// Coefficients of one place: for each order from 1 on, real and imaginary parts.
pub type FieldPhases = [[[f32; 2]; FIELD_PHASES]; ORDERS - 1];

/// Written by `scripts/learn_field_frame.py`: the number of atoms of each order, little-endian; then for each order
/// its atoms, feature by feature, real and imaginary parts (order 0: the offsets of the coefficients, then real
/// parts), as the upper halves of float32.
static TABLE: &[u8] = include_bytes!("frame.bin");

/// Atoms in the harmonics of each order.
pub(super) struct FieldFrame {
    orders: Vec<Atoms>,
    /// Of the coefficients of order 0, which alone have a mean.
    offsets: Vec<f32>,
}

struct Atoms {
    count: usize,
    blocks: Vec<Box<AtomBlock>>,
}

impl FieldFrame {
    /// The frame that comes with the library.
    pub fn shared() -> &'static Self {
        static FRAME: OnceLock<FieldFrame> = OnceLock::new();
        FRAME.get_or_init(|| Self::read(TABLE))
    }

    fn read(table: &[u8]) -> Self {
        let mut halves = table.chunks_exact(2).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]));
        let mut half = || halves.next().expect("the table is complete");
        let counts: Vec<usize> = (0..ORDERS).map(|_| usize::from(half())).collect();
        assert_eq!(counts.iter().sum::<usize>(), FIELD_SIGNATURE, "one atom for each number of a signature");
        let mut number = || f32::from_bits(u32::from(half()) << 16);
        let offsets = (0..counts[0]).map(|_| number()).collect();
        let orders = counts.iter().enumerate().map(|(order, &count)| {
            let mut blocks = vec![Box::new([[[0.0; ATOMS]; 2]; FEATURES]); count.div_ceil(ATOMS)];
            for feature in 0..FEATURES {
                for part in 0..if order == 0 { 1 } else { 2 } {
                    for atom in 0..count {
                        blocks[atom / ATOMS][feature][part][atom % ATOMS] = number();
                    }
                }
            }
            Atoms { count, blocks }
        });
        Self { orders: orders.collect(), offsets }
    }

    /// The signatures of some places, of length 1: coefficients of order 0, and magnitudes of the others, which do
    /// not change when a patch is turned about its axis; and the phases, which do. `None` where nothing was pooled.
    ///
    /// Some at a time, so that atoms are fetched once for all.
    pub fn signatures(&self, set: InstructionSet, pools: &[Pool]) -> Vec<Option<FieldSignature>> {
        let mut found = vec![FieldSignature::of(0.0); pools.len()];
        let size = |pool: &Pool| {
            pool.features().iter().flatten().map(|&sum| f64::from(sum).powi(2)).sum::<f64>().sqrt()
        };
        let sizes: Vec<f64> = pools.iter().map(size).collect();
        let mut filled = 0;
        for (order, atoms) in self.orders.iter().enumerate() {
            for (first, block) in (0..).step_by(ATOMS).zip(&atoms.blocks) {
                let count = ATOMS.min(atoms.count - first);
                for ((pool, size), signature) in pools.iter().zip(&sizes).zip(&mut found) {
                    let [real, imaginary] = project(set, pool, order, block);
                    for l in 0..count {
                        let [re, im] = [real[l], imaginary[l]].map(|part| (f64::from(part) / size) as f32);
                        let atom = first + l;
                        signature.vector[filled + l] =
                            if order == 0 { re - self.offsets[atom] } else { im.mul_add(im, re * re).sqrt() };
                        if order > 0 && atom < FIELD_PHASES {
                            signature.phases[order - 1][atom] = [re, im];
                        }
                    }
                }
                filled += count;
            }
        }
        found.into_iter().map(FieldSignature::of_unit_length).collect()
    }
}
