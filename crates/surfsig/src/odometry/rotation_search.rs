//! A scan whose sensor has rotated by an unknown angle: the rotations by which it lies on the map.

use super::local_map::LocalMap;
use super::settings::RelocalisationSettings;
use crate::RigidTransform;
use crate::random::some_of;
use rayon::prelude::*;
use std::f64::consts::PI;

/// The rotations of a scan about its sensor, at a pose, by which most of its points come near the map: the best first,
/// each the best one of those next to it, with how many of some points that are.
pub(super) fn rotations_on_map(
    points: &[[f64; 3]],
    map: &LocalMap,
    around: &RigidTransform,
    settings: &RelocalisationSettings,
) -> Vec<(usize, RigidTransform)> {
    let some = some_points(points, settings.rotation_points);
    let steps = (2.0 * PI / settings.rotation_step).floor().max(1.0) as usize;
    // About each axis from no rotation to a whole one.
    let tried: Vec<(usize, RigidTransform)> = (0..3)
        .flat_map(|axis| (0..steps).map(move |step| (axis, step)))
        .filter(|(axis, step)| *axis == 0 || *step > 0)
        .map(|(axis, step)| {
            let mut vector = [0.0; 3];
            vector[axis] = 2.0 * PI * step as f64 / steps as f64;
            (steps * axis + step, *around * RigidTransform::from_rotation_vector(vector, [0.0; 3]))
        })
        .collect();
    let near = |pose: &RigidTransform| points_near(&some, map, pose, settings.rotation_distance);
    let mut counts = vec![0; 3 * steps];
    let found: Vec<usize> = tried.par_iter().map(|(_, pose)| near(pose)).collect();
    for ((number, _), count) in tried.iter().zip(found) {
        counts[*number] = count;
        if *number == 0 {
            // No rotation is the same about all axes.
            (counts[steps], counts[2 * steps]) = (count, count);
        }
    }
    let is_peak = |number: usize| {
        let (axis, step) = (number / steps, number % steps);
        let beside = |by: usize| counts[axis * steps + (step + by) % steps];
        counts[number] >= beside(1) && counts[number] >= beside(steps - 1)
    };
    let mut peaks: Vec<&(usize, RigidTransform)> =
        tried.iter().filter(|(number, _)| is_peak(*number)).collect();
    peaks.sort_by_key(|(number, _)| std::cmp::Reverse(counts[*number]));
    let chosen = peaks.into_iter().take(settings.rotation_trials);
    chosen.map(|(number, pose)| (counts[*number], *pose)).collect()
}

/// Some of a scan's points, by which poses are compared.
pub(super) fn some_points(points: &[[f64; 3]], count: usize) -> Vec<[f64; 3]> {
    some_of(points.len(), count).into_iter().map(|number| points[number]).collect()
}

/// How many points of a scan at a pose come near the map.
pub(super) fn points_near(
    points: &[[f64; 3]],
    map: &LocalMap,
    pose: &RigidTransform,
    distance: f64,
) -> usize {
    points.iter().filter(|point| map.nearest(pose.transform_point(**point), distance).is_some()).count()
}

#[cfg(test)]
mod tests {
    use super::super::settings::MapSettings;
    use super::*;

    #[test]
    fn a_rotated_scan_is_rotated_back() {
        // Walls of a room of unequal sides, a point for each voxel.
        let wall = |x: i32, y: i32, z: i32| {
            (x == -20 || x == 30 || y == -12 || y == 17 || z == -5).then(|| [x, y, z].map(f64::from))
        };
        let room: Vec<[f64; 3]> = (-20..=30)
            .flat_map(|x| (-12..=17).flat_map(move |y| (-5..=6).filter_map(move |z| wall(x, y, z))))
            .collect();
        let mut map = LocalMap::new(&MapSettings::default());
        map.add(room.iter().copied(), 0);
        let at = RigidTransform::from_rotation_vector([0.0; 3], [2.0, -1.0, 0.5]);
        for angle in [0.0_f64, 43.0, -95.0, 170.0] {
            let truth = at * RigidTransform::from_rotation_vector([0.0, 0.0, angle.to_radians()], [0.0; 3]);
            let scan = truth.inverse().transform_points(&room);
            let found = rotations_on_map(&scan, &map, &at, &RelocalisationSettings::default());
            let off = (truth.inverse() * found[0].1).log();
            let angle_off = (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]).sqrt();
            assert!(angle_off.to_degrees() < 5.0, "{angle}: {}", angle_off.to_degrees());
        }
    }
}
