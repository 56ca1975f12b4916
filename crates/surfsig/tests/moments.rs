//! The 35 sums through the public face: they add, shift, turn and scale as the points do.

use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use surfsig::{EXPONENTS, MOMENTS, Moments, slot};

type Point = [f64; 3];

fn points() -> impl Strategy<Value = Vec<Point>> {
    prop::collection::vec(prop::array::uniform3(-1.0_f64..1.0), 0..60)
}

fn rotation() -> impl Strategy<Value = Rotation3<f64>> {
    prop::array::uniform3(-4.0_f64..4.0).prop_map(|v| Rotation3::new(Vector3::from(v)))
}

fn rows(rotation: &Rotation3<f64>) -> [Point; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation.matrix()[(i, j)]))
}

/// The sum of x^i y^j z^k, by powers.
fn sum(points: &[Point], [i, j, k]: [u8; 3]) -> f64 {
    points.iter().map(|p| p[0].powi(i.into()) * p[1].powi(j.into()) * p[2].powi(k.into())).sum()
}

fn assert_close(found: &Moments<f64>, expected: &Moments<f64>, tolerance: f64) {
    for (e, (a, b)) in EXPONENTS.iter().zip(found.sums.iter().zip(expected.sums)) {
        assert!((a - b).abs() <= tolerance * (1.0 + b.abs()), "{e:?}: {a} {b}");
    }
}

#[test]
fn every_monomial_up_to_order_four_has_a_slot_of_its_own() {
    assert_eq!(EXPONENTS.len(), MOMENTS);
    let mut seen = [false; MOMENTS];
    for i in 0..=4 {
        for j in 0..=4 - i {
            for k in 0..=4 - i - j {
                assert_eq!(EXPONENTS[slot(i, j, k)].map(usize::from), [i, j, k]);
                seen[slot(i, j, k)] = true;
            }
        }
    }
    assert!(seen.iter().all(|s| *s));
}

#[test]
#[should_panic(expected = "order 4")]
fn there_is_no_slot_of_order_five() {
    Moments::<f64>::default().get(2, 2, 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: prop::test_runner::RngSeed::Fixed(5), ..Default::default() })]

    #[test]
    fn sums_are_the_sums(points in points()) {
        let m = Moments::<f64>::of_points(&points);
        prop_assert_eq!(m.count(), points.len() as f64);
        for e in EXPONENTS {
            let [i, j, k] = e.map(usize::from);
            prop_assert!((m.get(i, j, k) - sum(&points, e)).abs() < 1e-12 * (1.0 + points.len() as f64));
        }
        let single = Moments::<f32>::of_points(&points);
        for (a, b) in single.sums.iter().zip(m.sums) {
            prop_assert!((f64::from(*a) - b).abs() <= 1e-6 * (1.0 + b.abs()));
        }
    }

    #[test]
    fn two_sets_add(a in points(), b in points()) {
        let both: Vec<Point> = a.iter().chain(&b).copied().collect();
        let mut sum = Moments::<f64>::of_points(&a);
        sum += Moments::of_points(&b);
        assert_close(&sum, &Moments::of_points(&both), 1e-12);
        assert_close(&(Moments::of_points(&b) + Moments::of_points(&a)), &sum, 1e-12);
    }

    #[test]
    fn a_shift_shifts_every_point(points in points(), t in prop::array::uniform3(-3.0_f64..3.0)) {
        let moved: Vec<Point> = points.iter().map(|p| [0, 1, 2].map(|a| p[a] + t[a])).collect();
        let shifted = Moments::<f64>::of_points(&points).shifted(t);
        assert_close(&shifted, &Moments::of_points(&moved), 1e-11);
        assert_close(&shifted.shifted(t.map(|c| -c)), &Moments::of_points(&points), 1e-9);
    }

    #[test]
    fn a_rotation_turns_every_point(points in points(), rotation in rotation()) {
        let turned: Vec<Point> = points.iter().map(|p| (rotation * Vector3::from(*p)).into()).collect();
        let m = Moments::<f64>::of_points(&points).rotated(&rows(&rotation));
        assert_close(&m, &Moments::of_points(&turned), 1e-12);
        assert_close(&m.rotated(&rows(&rotation.inverse())), &Moments::of_points(&points), 1e-11);
    }

    #[test]
    fn a_scale_scales_every_point(points in points(), s in prop::sample::select(vec![-2.0, 0.0, 1e-3, 0.7, 50.0])) {
        let scaled: Vec<Point> = points.iter().map(|p| p.map(|c| s * c)).collect();
        assert_close(&Moments::<f64>::of_points(&points).scaled(s), &Moments::of_points(&scaled), 1e-12);
    }

    #[test]
    fn an_affine_map_is_its_parts(
        points in points(),
        linear in prop::array::uniform3(prop::array::uniform3(-1.5_f64..1.5)),
        t in prop::array::uniform3(-1.0_f64..1.0),
    ) {
        let mapped: Vec<Point> = points
            .iter()
            .map(|p| [0, 1, 2].map(|i| (0..3).map(|j| linear[i][j] * p[j]).sum::<f64>() + t[i]))
            .collect();
        let m = Moments::<f64>::of_points(&points);
        assert_close(&m.transformed(&linear, t), &Moments::of_points(&mapped), 1e-10);
        assert_close(&m.rotated(&linear).shifted(t), &m.transformed(&linear, t), 1e-10);
    }
}
