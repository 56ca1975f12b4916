//! Against formulas, a general eigen-decomposition, and draws of noise.

use super::*;
use crate::fit::paraboloid::{FitAxes, fit_paraboloids};
use crate::fit::samples::{Draws, Point, Shape, turned};
use crate::fit::taubin;
use crate::moments::Moments;
use crate::simd::InstructionSet;
use crate::simd::lanes::LANES;
use crate::tensor::MomentBatch;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;

fn fit_batch(moments: &[Moments<f64>], to_sensor: Vector3<f64>) -> Quadrics {
    let to_sensor = Some([to_sensor.x, to_sensor.y, to_sensor.z].map(Lanes::splat));
    let task = Task { moments: &MomentBatch::new(moments), axes: FitAxes::Surface, to_sensor, start: None };
    fit_quadrics(InstructionSet::detect(), &task)
}

fn rotation() -> impl Strategy<Value = Rotation3<f64>> {
    prop::array::uniform3(-4.0_f64..4.0).prop_map(|v| Rotation3::new(Vector3::from(v)))
}

/// Surfaces between a tenth of their patch and twenty times as large as it.
fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        (0.45_f64..20.0).prop_map(Shape::Sphere),
        (0.3_f64..20.0).prop_map(Shape::Cylinder),
        (0.2_f64..1.2, 0.5_f64..3.0).prop_map(|(half, distance)| Shape::Cone(half, distance)),
        prop::array::uniform3(0.6_f64..3.0).prop_map(Shape::Ellipsoid),
    ]
}

/// All that is said of one lane, as bits.
fn bits(fits: &Quadrics, lane: usize) -> Vec<u64> {
    let Quadrics {
        principal,
        foot,
        coefficients,
        residual,
        gap,
        errors,
        solved,
        converged,
        trusted,
        preferred,
    } = fits;
    let vectors = [principal.normal, principal.direction, *foot, *errors];
    let scalars = [principal.k1, principal.k2, *residual, *gap];
    let numbers = vectors.iter().flatten().chain(coefficients).chain(&scalars);
    numbers
        .map(|v| v.0[lane].to_bits())
        .chain([solved, converged, trusted, preferred].map(|m| m.get(lane).into()))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, rng_seed: prop::test_runner::RngSeed::Fixed(3), ..Default::default() })]

    #[test]
    fn is_exact_on_quadrics_of_any_size_and_pose(
        shape in shape(), rotation in rotation(), inside in any::<bool>(), height in -0.02_f64..0.02,
    ) {
        let points = shape.points(300, -1.0, 0.0, &mut Draws(7));
        let lifted: Vec<Point> = points.iter().map(|p| [p[0], p[1], p[2] - height]).collect();
        let moments = Moments::of_points(&turned(&lifted, &rotation));
        let sign = if inside { -1.0 } else { 1.0 };
        let up = rotation * Vector3::z();
        let fits = fit_batch(&[moments], up * sign);
        prop_assert!(fits.converged.get(0) && fits.gap.0[0] > 100.0, "{}", fits.gap.0[0]);
        prop_assert!(fits.residual.0[0] < 1e-7);
        let [k1, k2] = shape.curvatures();
        let expected = if inside { [-k2, -k1] } else { [k1, k2] };
        for (found, expected) in [fits.principal.k1, fits.principal.k2].iter().zip(expected) {
            prop_assert!((found.0[0] - expected).abs() < 1e-5 * k1, "{} {expected}", found.0[0]);
        }
        let normal = Vector3::from(fits.principal.normal.map(|v| v.0[0]));
        prop_assert!((normal - up * sign).norm() < 1e-5);
        let foot = Vector3::from(fits.foot.map(|v| v.0[0]));
        prop_assert!((foot + up * height).norm() < 1e-5);
        let direction = rotation.inverse() * Vector3::from(fits.principal.direction.map(|v| v.0[0]));
        prop_assert!((direction.norm() - 1.0).abs() < 1e-12 && direction.z.abs() < 1e-5);
        if let Shape::Cylinder(_) | Shape::Cone(..) = shape {
            let along_k1 = if inside { direction.y } else { direction.x };
            prop_assert!(along_k1.abs() > 1.0 - 1e-9);
        }
    }

    #[test]
    fn is_the_smallest_eigenvector_of_taubins_problem(
        shape in shape(), rotation in rotation(), noise in prop::sample::select(vec![1e-3, 1e-2]),
    ) {
        let moments = Moments::of_points(&turned(&shape.points(300, -1.0, noise, &mut Draws(11)), &rotation));
        let fits = fit_batch(&[moments], rotation * Vector3::z());
        let whole = taubin::Family::identity(TERMS);
        let best = taubin::Pencil::new(&moments).best(&whole).unwrap();
        if fits.gap.0[0] > 4.0 {
            let value = fits.residual.0[0].powi(2);
            prop_assert!((value - best.mean_square).abs() < 1e-9 * best.mean_square + 1e-16);
            prop_assert!(fits.solved.get(0));
            let found = fits.coefficients.map(|c| c.0[0]);
            let sign: f64 = found.iter().zip(best.coefficients).map(|(a, b)| a * b).sum::<f64>().signum();
            for (found, expected) in found.iter().zip(best.coefficients) {
                prop_assert!((found - sign * expected).abs() < 1e-5, "{found} {expected}");
            }
        }
    }
}

#[test]
fn a_lane_knows_nothing_of_its_neighbours() {
    let mut draws = Draws(1);
    let shapes = [Shape::Plane, Shape::Sphere(0.7), Shape::Cylinder(0.5), Shape::Sphere(8.0)];
    let mut moments: Vec<Moments<f64>> = (0..LANES)
        .map(|lane| Moments::of_points(&shapes[lane % 4].points(6 * (lane + 1), -1.0, 0.01, &mut draws)))
        .collect();
    moments[4] = Moments::default();
    let together = fit_batch(&moments, Vector3::z());
    for lane in 0..LANES {
        let alone = fit_batch(&moments[lane..=lane], Vector3::z());
        assert_eq!(bits(&alone, 5), bits(&together, lane), "{lane}");
    }
    for set in InstructionSet::available() {
        let batch = MomentBatch::new(&moments);
        let to_sensor = Some([Lanes::ZERO, Lanes::ZERO, Lanes::ONE]);
        let fits =
            fit_quadrics(set, &Task { moments: &batch, axes: FitAxes::Surface, to_sensor, start: None });
        assert!((0..LANES).all(|lane| bits(&fits, lane) == bits(&together, lane)), "{}", set.name());
    }
    assert!(!together.converged.get(0) && !together.converged.get(4));
}

/// Over the draws that are trusted: mean and standard deviation of k1, k2 and H, and the root mean
/// square of the errors said.
struct Study {
    mean: [f64; 3],
    deviation: [f64; 3],
    error: [f64; 3],
    /// 5th percentile, median and 95th percentile, of all draws.
    gap: [f64; 3],
    trusted: f64,
    preferred: f64,
    /// Root mean square deviation of the paraboloid's H from the true one.
    paraboloid: f64,
    /// The same of the preferred of both.
    better: f64,
}

fn study(shape: Shape, count: usize, from: f64, noise: f64, batches: usize) -> Study {
    let mut draws = Draws(count as u64);
    let (mut values, mut squares, mut gaps) = (Vec::new(), [0.0; 3], Vec::new());
    let (mut preferred, mut paraboloid, mut better) = (0.0, 0.0, 0.0);
    let all = (batches * LANES) as f64;
    let expected = 0.5 * shape.curvatures().iter().sum::<f64>();
    for _ in 0..batches {
        let moments: [_; LANES] =
            std::array::from_fn(|_| Moments::of_points(&shape.points(count, from, noise, &mut draws)));
        let to_sensor = Some([Lanes::ZERO, Lanes::ZERO, Lanes::ONE]);
        let batch = MomentBatch::new(&moments);
        let task = Task { moments: &batch, axes: FitAxes::Surface, to_sensor, start: None };
        let fits = fit_quadrics(InstructionSet::detect(), &task);
        let rival = fit_paraboloids(InstructionSet::detect(), &task).principal;
        for lane in 0..LANES {
            let mean = 0.5 * (rival.k1.0[lane] + rival.k2.0[lane]);
            let own = 0.5 * (fits.principal.k1.0[lane] + fits.principal.k2.0[lane]);
            let prefer = fits.preferred.get(lane);
            preferred += f64::from(prefer) / all;
            paraboloid += (mean - expected).powi(2) / all;
            better += (if prefer { own } else { mean } - expected).powi(2) / all;
            gaps.push(fits.gap.0[lane]);
            if fits.trusted.get(lane) {
                let [k1, k2] = [fits.principal.k1, fits.principal.k2].map(|k| k.0[lane]);
                values.push([k1, k2, own]);
                for (square, error) in squares.iter_mut().zip(fits.errors) {
                    *square += error.0[lane].powi(2);
                }
            }
        }
    }
    let n = values.len() as f64;
    let mean = [0, 1, 2].map(|k| values.iter().map(|v| v[k]).sum::<f64>() / n);
    let deviation =
        [0, 1, 2].map(|k| (values.iter().map(|v| (v[k] - mean[k]).powi(2)).sum::<f64>() / n).sqrt());
    gaps.sort_by(f64::total_cmp);
    let gap = [0.05, 0.5, 0.95].map(|q| gaps[(q * all) as usize]);
    let error = squares.map(|s| (s / n).sqrt());
    let [paraboloid, better] = [paraboloid, better].map(f64::sqrt);
    Study { mean, deviation, error, gap, trusted: n / all, preferred, paraboloid, better }
}

#[test]
fn noise_does_not_bias_it_and_its_errors_are_said() {
    // Radius of curvature over that of the ball; noise 0.1 mm in a ball of 20 mm.
    for shape in [Shape::Sphere(29.15 / 20.0), Shape::Sphere(14.15 / 20.0), Shape::Cylinder(14.15 / 20.0)] {
        let found = study(shape, 500, -1.0, 0.1 / 20.0, 75);
        let [k1, k2] = shape.curvatures();
        let bias = found.mean[2] / (0.5 * (k1 + k2)) - 1.0;
        assert!(bias.abs() < 3e-3, "{shape:?}: {bias}");
        assert_eq!(found.trusted, 1.0);
        let ratio = found.error[2] / found.deviation[2];
        assert!((0.85..1.2).contains(&ratio), "{shape:?}: {ratio}");
    }
}

#[test]
fn a_plane_has_no_gap() {
    for count in [20, 50, 200] {
        let found = study(Shape::Plane, count, -1.0, 0.01, 40);
        assert!(found.gap[2] < 4.0, "{:?}", found.gap);
    }
    let exact =
        fit_batch(&[Moments::of_points(&Shape::Plane.points(100, -1.0, 0.0, &mut Draws(2)))], Vector3::z());
    assert!(exact.gap.0[0] < 4.0);
}

/// Run by hand, in release, with `--nocapture`: what the documents say of when a quadric is to be trusted.
#[test]
#[ignore = "a study, not a test"]
fn study_of_trust() {
    let report = |name: String, shape: Shape, count, from, noise| {
        let s = study(shape, count, from, noise, 64);
        let [k1, k2, h] =
            [0, 1, 2].map(|k| format!("{:.3}+-{:.3} ({:.3})", s.mean[k], s.deviation[k], s.error[k]));
        let [low, middle, high] = s.gap;
        let true_h = 0.5 * shape.curvatures().iter().sum::<f64>();
        let rms = (s.mean[2] - true_h).hypot(s.deviation[2]);
        println!(
            "{name:36} gap {low:6.2} {middle:6.2} {high:6.2} trusted {:.2} preferred {:.2} k1 {k1} k2 {k2} H {h} rms of H {rms:.4}, paraboloid {:.4}, better {:.4}",
            s.trusted, s.preferred, s.paraboloid, s.better
        );
    };
    for (name, r) in [("sphere 29.15", 1.4575), ("sphere 14.15", 0.7075)] {
        report(name.into(), Shape::Sphere(r), 500, -1.0, 0.005);
    }
    report("cylinder 14.15".into(), Shape::Cylinder(0.7075), 500, -1.0, 0.005);
    for count in [12, 15, 20, 30, 60, 235, 1000] {
        report(format!("plane n={count}"), Shape::Plane, count, -1.0, 0.01);
    }
    for r in [0.7, 2.0, 10.0] {
        for from in [-1.0, 0.0] {
            for ratio in [4.0, 8.0, 10.0, 12.0, 15.0, 20.0, 40.0, 80.0] {
                let noise = 0.5 / r / ratio;
                report(format!("sphere r={r} from={from} s/n={ratio}"), Shape::Sphere(r), 235, from, noise);
                report(
                    format!("cylinder r={r} from={from} s/n={ratio}"),
                    Shape::Cylinder(r),
                    235,
                    from,
                    noise,
                );
            }
        }
    }
    for count in [15, 20, 40, 80] {
        for ratio in [6.0, 10.0, 20.0, 40.0] {
            report(
                format!("sphere r=2 n={count} s/n={ratio}"),
                Shape::Sphere(2.0),
                count,
                -1.0,
                0.25 / ratio,
            );
        }
    }
}

/// Run by hand, in release, with `--nocapture`.
#[test]
#[ignore = "a measurement, not a test"]
fn cost_per_point() {
    let mut draws = Draws(5);
    for (shape, noise) in [(Shape::Sphere(2.0), 0.01), (Shape::Sphere(0.7), 0.0), (Shape::Plane, 0.01)] {
        let moments: [_; LANES] =
            std::array::from_fn(|_| Moments::of_points(&shape.points(235, -1.0, noise, &mut draws)));
        let batch = MomentBatch::new(&moments);
        for set in InstructionSet::available().into_iter().skip(1) {
            let task = Task { moments: &batch, axes: FitAxes::Surface, to_sensor: None, start: None };
            let times = [true, false].map(|quadric| {
                let start = std::time::Instant::now();
                for _ in 0..20_000 {
                    if quadric {
                        std::hint::black_box(fit_quadrics(set, std::hint::black_box(&task)));
                    } else {
                        std::hint::black_box(fit_paraboloids(set, std::hint::black_box(&task)));
                    }
                }
                start.elapsed().as_secs_f64() / 20_000.0 / LANES as f64 * 1e9
            });
            println!("{shape:?} {}: quadric {:.0} ns, paraboloid {:.0} ns", set.name(), times[0], times[1]);
        }
    }
}
