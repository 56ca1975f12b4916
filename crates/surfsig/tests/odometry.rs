//! The trajectory of a simulated lidar in a furnished room, whose truth is known.

use surfsig::{
    ExpectationSettings, FreeDirection, Odometry, OdometrySettings, PointCloud, RigidTransform, Scan,
    ScanPose, ScanStatus,
};

/// A box along the axes: its lowest and its highest corner.
type Cuboid = [[f64; 3]; 2];

const ROOM: Cuboid = [[-4.0, -3.0, -1.4], [4.5, 3.5, 1.6]];

/// A number from 0 to 1 that looks drawn at random.
fn number(i: u64) -> f64 {
    let mixed = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Along the walls, so that the sensor's path is free.
fn furniture() -> Vec<Cuboid> {
    let one = |i: u64| {
        let draw = |k: u64| number(100 * i + k);
        let [length, width, height] = [0, 1, 2].map(|k| 0.3 + 0.9 * draw(k));
        let x = -3.9 + 7.2 * draw(3);
        let y = if i.is_multiple_of(2) { -2.95 + 0.4 * draw(4) } else { 3.4 - width - 0.4 * draw(4) };
        [[x, y, -1.4], [x + length, y + width, -1.4 + 2.2 * height]]
    };
    (0..14).map(one).collect()
}

/// Distances along a ray at which it enters and leaves a box.
fn crossing(from: &[f64; 3], ray: &[f64; 3], [low, high]: &Cuboid) -> (f64, f64) {
    (0..3).fold((f64::NEG_INFINITY, f64::INFINITY), |(enter, leave), k| {
        let (a, b) = ((low[k] - from[k]) / ray[k], (high[k] - from[k]) / ray[k]);
        (enter.max(a.min(b)), leave.min(a.max(b)))
    })
}

/// What a lidar with 32 rings measures at a pose, in its own axes, with a deviation of 5 mm.
fn scan(room: &Cuboid, boxes: &[Cuboid], pose: &RigidTransform, seed: u64) -> Vec<[f64; 3]> {
    let from = pose.transform_point([0.0; 3]);
    let point = |i: u64| {
        let (azimuth, elevation) = ((i % 360) as f64, (i / 360) as f64 * 2.4 - 37.3);
        let (azimuth, elevation) = ((azimuth + 0.5).to_radians(), elevation.to_radians());
        let own = [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
        let ray = pose.transform_vector(own);
        let (_, wall) = crossing(&from, &ray, room);
        let met = boxes.iter().map(|cuboid| crossing(&from, &ray, cuboid));
        let range = met
            .filter(|(enter, leave)| 0.0 < *enter && enter < leave)
            .fold(wall, |t, (enter, _)| t.min(enter));
        let noise = (0..4).map(|k| number(seed * 100_000_000 + 10 * i + k) - 0.5).sum::<f64>() * 0.0087;
        own.map(|c| c * (range + noise))
    };
    (0..32 * 360).map(point).collect()
}

/// Along a curve through the room, 15 cm a step, and swaying.
fn pose(step: usize) -> RigidTransform {
    let at = step as f64 * 0.15;
    let translation = [-2.0 + at, 0.6 * (0.8 * at).sin(), 0.1 * (1.7 * at).sin()];
    RigidTransform::from_rotation_vector([0.04 * at.sin(), 0.03 * (1.3 * at).cos(), 0.3 * at], translation)
}

fn scans(steps: &[usize]) -> Vec<Vec<[f64; 3]>> {
    let boxes = furniture();
    (0..).zip(steps).map(|(seed, step)| scan(&ROOM, &boxes, &pose(*step), seed)).collect()
}

fn follow(scans: &[Vec<[f64; 3]>], settings: OdometrySettings) -> Vec<ScanPose> {
    let mut odometry = Odometry::new(settings).unwrap();
    for points in scans {
        odometry.push(&Scan::new(PointCloud::new_f64(points))).unwrap();
    }
    odometry.poses().to_vec()
}

fn statuses(poses: &[ScanPose]) -> Vec<ScanStatus> {
    poses.iter().map(|pose| pose.status).collect()
}

/// Metres by which poses are off, seen from the first; not a number where there is none.
fn errors(found: &[ScanPose], steps: &[usize]) -> Vec<f64> {
    let to_first = pose(steps[0]).inverse();
    let error = |(found, step): (&ScanPose, &usize)| {
        let Some(transform) = found.T_map_scan else { return f64::NAN };
        let [.., x, y, z] = ((to_first * pose(*step)).inverse() * transform).log();
        (x * x + y * y + z * z).sqrt()
    };
    found.iter().zip(steps).map(error).collect()
}

#[test]
fn a_room_is_followed_within_millimetres() {
    let steps: Vec<usize> = (0..20).collect();
    let found = follow(&scans(&steps), OdometrySettings::default());
    assert_eq!(statuses(&found), [ScanStatus::Tracked; 20]);
    let errors = errors(&found, &steps);
    assert!(errors.iter().all(|error| *error < 0.005), "{errors:?}");
    assert_eq!(found[0].covariance, [[0.0; 6]; 6]);
    assert!(found.iter().skip(1).all(|pose| pose.overlap > 0.6 && pose.covariance[3][3] > 0.0));
    // The covariance tells the size of the errors: within four standard deviations, and no more than ten times too large.
    for (pose, error) in found.iter().zip(&errors).skip(1) {
        let deviation = (3..6).map(|k| pose.covariance[k][k]).sum::<f64>().sqrt();
        assert!(*error < 4.0 * deviation && deviation < 0.02, "{error} {deviation}");
    }
}

#[test]
fn a_common_motion_of_all_scans_moves_the_poses() {
    let steps: Vec<usize> = (0..5).collect();
    let scans = scans(&steps);
    let plain = follow(&scans, OdometrySettings::default());
    let frame = RigidTransform::from_rotation_vector([0.0; 3], [300.0, -200.0, 50.0]);
    let mut odometry = Odometry::new(OdometrySettings::default()).unwrap();
    for points in &scans {
        let moved = frame.transform_points(points);
        let scan = Scan::new(PointCloud::new_f64(&moved)).seen_from(frame.transform_point([0.0; 3]));
        odometry.push(&scan).unwrap();
    }
    for (pose, expected) in odometry.poses().iter().zip(&plain) {
        let expected = frame * expected.T_map_scan.unwrap() * frame.inverse();
        let difference = (expected.inverse() * pose.T_map_scan.unwrap()).log();
        // The translation of a frame's origin that is far away is that of the rotation's rounding.
        assert!(difference.iter().all(|component| component.abs() < 2e-3), "{difference:?}");
        assert_eq!(pose.status, ScanStatus::Tracked);
    }
}

#[test]
fn the_result_is_the_same_on_any_number_of_threads() {
    let steps = [0, 1, 2, 3, 9, 1];
    let scans = scans(&steps);
    let with = |threads| follow(&scans, OdometrySettings { threads: Some(threads), ..Default::default() });
    let [one, three] = [1, 3].map(with);
    // NaN, where there is no pose, is not equal to itself.
    assert_eq!(format!("{one:?}"), format!("{three:?}"));
}

#[test]
fn motion_along_a_corridor_is_not_observable() {
    let corridor = [[-500.0, -1.0, -1.4], [500.0, 1.2, 1.6]];
    let at = |step: u64| RigidTransform::from_rotation_vector([0.0; 3], [0.2 * step as f64, 0.0, 0.0]);
    // The sensor sees six metres far; the normals of points farther away are those of planes through both walls.
    let is_near = |point: &[f64; 3]| point.iter().map(|c| c * c).sum::<f64>() < 36.0;
    let seen = |step| scan(&corridor, &[], &at(step), step).into_iter().filter(is_near).collect();
    let scans: Vec<Vec<[f64; 3]>> = (0..4).map(seen).collect();
    let found = follow(&scans, OdometrySettings::default());
    assert_eq!(found[0].status, ScanStatus::Tracked);
    for pose in &found[1..] {
        assert_eq!(pose.status, ScanStatus::Tracked);
        // The translation along x is free, and nothing else is.
        let [FreeDirection::Translation { axis }] = pose.free_directions[..] else {
            panic!("{:?}", pose.free_directions)
        };
        assert!(axis[0].abs() > 0.99, "{axis:?}");
        let variances: Vec<f64> = (0..6).map(|k| pose.covariance[k][k]).collect();
        assert!(variances[3].is_infinite(), "{variances:?}");
        assert!(variances[4].max(variances[5]) < 1e-3, "{variances:?}");
        let translation = pose.T_map_scan.unwrap().transform_point([0.0; 3]);
        assert!(translation[1].abs().max(translation[2].abs()) < 0.01, "{translation:?}");
    }
}

#[test]
fn poses_that_no_scan_alone_is_certain_of_wait_for_the_next_scans() {
    let steps = [0, 2, 4, 6, 8, 10, 12, 14, 16, 1, 2, 3];
    let scans = scans(&steps);
    let expectation = ExpectationSettings { certain_overlap: f64::INFINITY, ..Default::default() };
    let settings = OdometrySettings { expectation, ..Default::default() };
    let mut odometry = Odometry::new(settings).unwrap();
    let mut given = Vec::new();
    for points in &scans {
        let poses = odometry.push(&Scan::new(PointCloud::new_f64(points))).unwrap();
        given.push(poses.iter().map(|pose| (pose.scan, pose.status)).collect::<Vec<_>>());
    }
    let (lost, tracked) = (ScanStatus::Lost, ScanStatus::Tracked);
    assert!(given[..9].iter().zip(0..).all(|(given, scan)| *given == [(scan, tracked)]));
    // The third scan gives all three their poses; a sequence that ends before leaves them lost.
    assert_eq!(given[9..11], [vec![(9, lost)], vec![(10, lost)]]);
    assert_eq!(given[11], [(9, ScanStatus::Relocalised), (10, tracked), (11, tracked)]);
    assert!(errors(odometry.poses(), &steps).iter().all(|error| *error < 0.01));
}

#[test]
fn of_the_maps_before_the_present_one_as_many_are_kept_as_are_asked_for() {
    // Three rooms of other sizes, one after the other, and the first one again.
    let visits = [([1.0; 3], 0..4), ([1.5, 1.3, 1.2], 0..7), ([1.2, 1.7, 1.0], 0..7), ([1.0; 3], 1..8)];
    let sized =
        |cuboid: &Cuboid, factors: &[f64; 3]| cuboid.map(|corner| [0, 1, 2].map(|k| corner[k] * factors[k]));
    let scans: Vec<Vec<[f64; 3]>> = visits
        .iter()
        .flat_map(|(factors, steps)| {
            let boxes: Vec<Cuboid> = furniture().iter().map(|one| sized(one, factors)).collect();
            let room = sized(&ROOM, factors);
            steps.clone().map(move |step| scan(&room, &boxes, &pose(step), step as u64))
        })
        .collect();
    let segments = |max_kept| {
        let mut settings = OdometrySettings::default();
        settings.segments.max_kept = max_kept;
        let found = follow(&scans, settings);
        let known = found.iter().filter(|pose| pose.T_map_scan.is_some());
        known.map(|pose| (pose.scan, pose.segment)).collect::<Vec<_>>()
    };
    let before: Vec<(usize, usize)> = (0..18).zip([[0; 4].as_slice(), &[1; 7], &[2; 7]].concat()).collect();
    // The first room's map is searched after the present one and the second room's.
    let again = |segment, from| (from..25).map(move |scan| (scan, segment));
    assert_eq!(segments(2), before.iter().copied().chain(again(0, 20)).collect::<Vec<_>>());
    assert_eq!(segments(1), before.iter().copied().chain(again(3, 18)).collect::<Vec<_>>());
}
