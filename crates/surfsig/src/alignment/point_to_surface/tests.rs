//! Errors against covariances.

use super::*;

/// From -1 to 1.
fn number(i: usize) -> f64 {
    2.0 * crate::random::uniform(i, 2) - 1.0
}

/// Points of a hilly terrain of 40 x 40 voxels, each off it by a normally distributed error.
fn terrain(count: usize, noise: f64, seed: usize) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| seed * 1_000_003 + i * 17)
        .map(|i| {
            let (x, y) = (20.0 * number(i), 20.0 * number(i + 1));
            let error: f64 = (2..14).map(|k| number(i + k)).sum::<f64>() / 2.0;
            [x, y, 3.0 * (0.3 * x).sin() + 2.0 * (0.25 * y).cos() + noise * error]
        })
        .collect()
}

#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let truth = RigidTransform::from_rotation_vector([0.01, -0.02, 0.015], [0.3, -0.2, 0.25]);
    let mut squares = Vec::new();
    for seed in 0..12 {
        let surface = TargetSurface::new(terrain(1600, 0.1, 2 * seed), 1.0);
        let source = truth.inverse().transform_points(&terrain(1600, 0.1, 2 * seed + 1));
        let found = surface.align(&source, RigidTransform::identity(), &Default::default()).unwrap();
        assert!(found.overlap > 0.8 && (found.rms - 0.11).abs() < 0.03, "{} {}", found.overlap, found.rms);
        // About the centre: the twist that takes the found transform to the true one.
        let about = RigidTransform::from_rotation_vector([0.0; 3], found.center);
        let off = about.inverse() * truth * found.T_target_source.inverse() * about;
        let twist = Vector6::from(off.log());
        squares.push(twist.dot(&(found.covariance.try_inverse().unwrap() * twist)) / 6.0);
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((0.5..1.6).contains(&mean), "{mean}");
}

#[test]
fn the_result_moves_with_both_and_is_the_same_on_any_number_of_threads() {
    let source = terrain(1500, 0.05, 3);
    let target = terrain(1500, 0.05, 4);
    let start = RigidTransform::from_rotation_vector([0.005, 0.0, -0.01], [0.2, 0.1, -0.1]);
    let common = RigidTransform::from_rotation_vector([0.4, -0.8, 1.1], [50.0, -30.0, 20.0]);
    let settings = PointToSurfaceSettings::default();
    let align = |threads, target: Vec<[f64; 3]>, start| {
        let work =
            || TargetSurface::new(target, 1.0).align(&source, start, &settings).unwrap().T_target_source;
        crate::with_threads(Some(threads), work).unwrap()
    };
    let found = align(1, target.clone(), start);
    assert_eq!(found, align(3, target.clone(), start));
    let moved = align(2, common.transform_points(&target), common * start);
    let off = (found.inverse() * common.inverse() * moved).log();
    assert!(off.iter().all(|component| component.abs() < 1e-6), "{off:?}");
}

#[test]
fn what_does_not_meet_gives_nothing() {
    let far = RigidTransform::from_rotation_vector([0.0; 3], [1000.0, 0.0, 0.0]);
    let (surface, settings) =
        (TargetSurface::new(terrain(500, 0.0, 1), 1.0), PointToSurfaceSettings::default());
    assert!(surface.align(&terrain(500, 0.0, 2), far, &settings).is_none());
    let same = TargetSurface::new(vec![[1.0; 3]; 100], 1.0);
    assert!(same.align(&[[1.0; 3]; 100], RigidTransform::identity(), &settings).is_none());
    assert!(TargetSurface::new(Vec::new(), 1.0).align(&[], RigidTransform::identity(), &settings).is_none());
}
