//! Two axes across a direction.

use nalgebra::{RealField, Vector3};

/// Two unit vectors u and v square to a unit direction d and to each other, right-handed: u x v = d.
///
/// u is d x e, scaled to length 1, where e is the coordinate axis that is farthest from d (the first of several), and
/// v is d x u. So the same direction always gives the same bits, and no direction is badly conditioned: |d x e| is at
/// least sqrt(2/3). Where another coordinate becomes the smallest the axes jump, near a coordinate axis by a quarter
/// turn; no choice is continuous for all directions. Python's `surfsig.geometry.axes_across` makes the same choice.
pub(crate) fn axes_across<T: RealField + Copy>(direction: &Vector3<T>) -> [Vector3<T>; 2] {
    let u = direction.cross(&Vector3::ith(direction.iamin(), T::one())).normalize();
    [u, direction.cross(&u)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: prop::test_runner::RngSeed::Fixed(5), ..Default::default() })]

        #[test]
        fn axes_are_unit_square_and_right_handed(raw in prop::array::uniform3(-1.0_f64..1.0)) {
            let direction = Vector3::from(raw);
            prop_assume!(direction.norm() > 1e-3);
            let direction = direction.normalize();
            let [u, v] = axes_across(&direction);
            prop_assert!((u.norm() - 1.0).abs() < 1e-15 && (v.norm() - 1.0).abs() < 1e-15);
            prop_assert!(u.dot(&direction).abs() < 1e-15 && u.dot(&v).abs() < 1e-15);
            prop_assert!((u.cross(&v) - direction).norm() < 1e-15);
        }

        /// The tangents of field signatures are stored in libraries of models, so their bits are part of the format.
        #[test]
        fn single_precision_has_the_bits_of_stored_tangents(raw in prop::array::uniform3(-1.0_f32..1.0)) {
            prop_assume!(raw.iter().any(|c| c.abs() > 1e-3));
            let a: [f32; 3] = Vector3::from(raw).normalize().into();
            let mut e = [0.0_f32; 3];
            e[(0..3).min_by(|&i, &k| a[i].abs().total_cmp(&a[k].abs())).unwrap()] = 1.0;
            let across = [a[1] * e[2] - a[2] * e[1], a[2] * e[0] - a[0] * e[2], a[0] * e[1] - a[1] * e[0]];
            let length = across.iter().map(|c| c * c).sum::<f32>().sqrt();
            let [u, _] = axes_across(&Vector3::from(a));
            prop_assert_eq!(<[f32; 3]>::from(u), across.map(|c| c / length));
        }
    }

    #[test]
    fn axes_across_coordinate_axes_are_coordinate_axes() {
        let [u, v] = axes_across(&Vector3::<f64>::z());
        assert_eq!((u, v), (Vector3::y(), -Vector3::x()));
        let [u, v] = axes_across(&-Vector3::<f64>::x());
        assert_eq!((u, v), (-Vector3::z(), -Vector3::y()));
    }
}
