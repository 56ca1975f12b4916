//! The flat atom: one more coordinate, the same for all surfaces, by which what is flat within its error is alike.

use super::{Frame, SIGNATURE};
use crate::Status;

/// Length of the flat atom, in lengths of a signature of pure noise: 2.576 sqrt(2) / acos(0.9).
///
/// The signatures of two planes, of noise n and flat atom L, make the angle atan(h1 / L) - atan(h2 / L) with normal
/// h1, h2 of standard deviation n; with this length it is within acos(0.9), zeta 0.9 or more, in 99 of 100 pairs.
pub const FLAT_ATOM_NOISES: f64 = 8.077_156_482_481_387;

/// Noise of the mean curvature, in patch units, that heights in float32 have at least.
const ROUNDING: f64 = f32::EPSILON as f64;

impl Frame {
    /// The flat atom's length for signatures whose mean curvature, where the patch's side is 1, has this standard error;
    /// `None` where the noise is beyond the vocabulary's end.
    ///
    /// ```
    /// let frame = surfsig::Frame::shared();
    /// let (one, two) = (frame.flat_atom_length(0.01).unwrap(), frame.flat_atom_length(0.02).unwrap());
    /// assert!(one < two && two < 2.1 * one);
    /// assert_eq!(frame.flat_atom_length(f64::NAN), None);
    /// ```
    pub fn flat_atom_length(&self, noise: f64) -> Option<f64> {
        if noise.is_nan() {
            return None;
        }
        let noise = noise.max(ROUNDING) as f32;
        // A paraboloid that is bent by noise: its signature is linear in a small H, and does not notice K.
        let mut row = [[0.0; SIGNATURE]];
        self.signatures_of_curvatures(1.0, &[[noise, noise]], &mut row, &mut [Status::Ok]);
        let square: f64 = row[0].iter().map(|&value| f64::from(value).powi(2)).sum();
        let length = FLAT_ATOM_NOISES * square.sqrt();
        length.is_finite().then_some(length)
    }
}
