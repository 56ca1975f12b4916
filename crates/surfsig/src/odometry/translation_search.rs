//! A scan that a way around has carried off by an unknown drift: the translations by which it lies on the map.

use super::local_map::LocalMap;
use super::rotation_search::{points_near, some_points};
use super::settings::RelocalisationSettings;
use crate::RigidTransform;
use nalgebra::Vector3;
use rayon::prelude::*;

/// The poses on a grid around an expected one, with its rotation, at which most of a scan's points come near the map: the
/// best first, none next to a better one.
pub(super) fn translations_on_map(
    points: &[[f64; 3]],
    map: &LocalMap,
    expected: &RigidTransform,
    settings: &RelocalisationSettings,
) -> Vec<RigidTransform> {
    let some = some_points(points, settings.rotation_points);
    let side = 2 * settings.drift_steps + 1;
    let place = |number: usize| {
        [number / (side * side), number / side % side, number % side]
            .map(|k| k as isize - settings.drift_steps as isize)
    };
    let pose = |number: usize| {
        let mut pose = *expected;
        pose.translation += Vector3::from(place(number).map(|k| k as f64 * settings.drift_step));
        pose
    };
    let near = |number: usize| points_near(&some, map, &pose(number), settings.rotation_distance);
    let counts: Vec<usize> = (0..side * side * side).into_par_iter().map(near).collect();
    // Of equal ones the least drift, and of these the first.
    let size = |number: usize| place(number).iter().map(|k| k * k).sum::<isize>();
    let mut order: Vec<usize> = (0..counts.len()).collect();
    order.sort_by_key(|&number| (std::cmp::Reverse(counts[number]), size(number), number));
    let mut chosen: Vec<usize> = Vec::new();
    for number in order {
        if chosen.len() == settings.drift_trials {
            break;
        }
        let is_beside = |&other: &usize| (0..3).all(|k| (place(number)[k] - place(other)[k]).abs() <= 1);
        if !chosen.iter().any(is_beside) {
            chosen.push(number);
        }
    }
    chosen.into_iter().map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::super::settings::MapSettings;
    use super::*;

    #[test]
    fn a_scan_that_has_drifted_is_carried_back() {
        // Two walls that meet, a floor, and a cupboard, a point for each voxel.
        let is_on = |x: i32, y: i32, z: i32| {
            x == -20 || y == -12 || z == -5 || (4..9).contains(&x) && (0..5).contains(&y) && z < 2
        };
        let place = |x, y, z| is_on(x, y, z).then(|| [x, y, z].map(f64::from));
        let scene: Vec<[f64; 3]> = (-20..=30)
            .flat_map(|x| (-12..=17).flat_map(move |y| (-5..=6).filter_map(move |z| place(x, y, z))))
            .collect();
        let mut map = LocalMap::new(&MapSettings::default());
        map.add(scene.iter().copied(), 0);
        let truth = RigidTransform::from_rotation_vector([0.02, -0.01, 0.4], [2.0, -1.0, 0.5]);
        let scan = truth.inverse().transform_points(&scene);
        for drift in [[0.0; 3], [5.0, 0.0, 0.0], [-6.5, 4.0, 1.5], [3.0, -7.0, -2.0]] {
            let mut expected = truth;
            expected.translation += Vector3::from(drift);
            let found = translations_on_map(&scan, &map, &expected, &RelocalisationSettings::default());
            let off = (found[0].translation - truth.translation).amax();
            assert!(off <= 0.51 * RelocalisationSettings::default().drift_step, "{drift:?}: {off}");
        }
    }
}
