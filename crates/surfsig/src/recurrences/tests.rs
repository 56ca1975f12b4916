//! Alignments of bent sheets, which stand apart before a wall.

use super::*;
use crate::random::{Generator, uniform};

/// How a sheet is bent: f(x, y) = a x^2 + b x y + c y^3, which no rotation brings onto itself.
pub(super) const SHEET: [f64; 3] = [0.02, 0.01, -2e-3];
const OTHER: [f64; 3] = [-0.03, 0.02, 3e-3];
pub(super) const FLAT: [f64; 3] = [0.0; 3];

/// The points and normals of a scan: a sheet of 40 by 30, one apart from (offset, offset) on, 25 above a wall.
fn scanned([a, b, c]: [f64; 3], offset: f64) -> (Vec<[f64; 3]>, Vec<[f64; 3]>, usize) {
    let sheet = (0..1200).map(|i| (f64::from(i % 40) - 19.5 + offset, f64::from(i / 40) - 14.5 + offset));
    let (mut points, mut normals): (Vec<_>, Vec<_>) = sheet
        .map(|(x, y)| {
            let (dx, dy) = (2.0 * a * x + b * y, b * x + 3.0 * c * y * y);
            let normal = [-dx, -dy, 1.0].map(|part| part / (1.0 + dx * dx + dy * dy).sqrt());
            ([x, y, a * x * x + b * x * y + c * y * y * y], normal)
        })
        .unzip();
    let own = points.len();
    points.extend((0..6400).map(|i| [f64::from(i % 80) - 40.0, f64::from(i / 80) - 40.0, -25.0]));
    normals.resize(points.len(), [0.0, 0.0, 1.0]);
    (points, normals, own)
}

/// The view of a sheet that was moved with its surroundings and its viewpoint, and whose points are in an order.
fn view(sheet: [f64; 3], offset: f64, motion: &RigidTransform, order: impl Fn(&mut [usize])) -> PieceView {
    let (points, normals, own) = scanned(sheet, offset);
    let mut numbers: Vec<usize> = (0..points.len()).collect();
    order(&mut numbers);
    let points: Vec<[f64; 3]> = numbers.iter().map(|&i| motion.transform_point(points[i])).collect();
    let normals: Vec<[f64; 3]> = numbers.iter().map(|&i| motion.transform_vector(normals[i])).collect();
    let piece: Vec<usize> = (0..points.len()).filter(|&i| numbers[i] < own).collect();
    let situation = PieceSituation {
        viewpoint: motion.transform_point([0.0, 0.0, 1e3]),
        second_viewpoint: None,
        support_planes: vec![[
            motion.transform_point([0.0, 0.0, -25.0]),
            motion.transform_vector([0.0, 0.0, 1.0]),
        ]],
    };
    let scan = OrientedScan { points: &points, normals: &normals, spacing: 1.0, tolerance: 0.4 };
    PieceView::new(&scan, &piece, &situation, 2.0, &RecurrenceSettings::default()).unwrap()
}

pub(super) fn sheet(shape: [f64; 3], motion: &RigidTransform) -> PieceView {
    view(shape, 0.0, motion, |_| {})
}

fn motion() -> RigidTransform {
    RigidTransform::from_rotation_vector([0.2, -0.1, 2.0], [100.0, 50.0, 20.0])
}

fn aligned(views: &[&PieceView; 2]) -> PieceAlignment {
    let found = align_pieces(views, &[[0, 1]], &RecurrenceSettings::default(), &Monitor::default()).unwrap();
    found[0].expect("the same sheet")
}

/// Radians, and point spacings at the pieces' centres, between two poses.
pub(super) fn apart(a: &RigidTransform, b: &RigidTransform) -> [f64; 2] {
    let [x, y, z, translation @ ..] = (a.inverse() * *b).log();
    [[x, y, z], translation].map(|part| part.iter().map(|c| c * c).sum::<f64>().sqrt())
}

/// The pose about both centres of a motion between scans.
fn between(source: &PieceView, target: &PieceView, motion: &RigidTransform) -> RigidTransform {
    let translated = |by: [f64; 3]| RigidTransform::from_rotation_vector([0.0; 3], by);
    translated(target.center()).inverse() * *motion * translated(source.center())
}

/// Under poses that are off by 0.02 radians all points of a sheet are within their tolerance, to its rim, and a sheet
/// with slopes of a half may slide by twice the tolerance, so that no score tells a better pose; two of them may differ
/// by half as much again.
fn assert_close(found: &RigidTransform, expected: &RigidTransform) {
    let [angle, distance] = apart(expected, found);
    assert!(angle < 0.03 && distance < 1.2, "{angle} {distance}");
}

#[test]
fn a_known_motion_is_found_between_other_points_of_the_same_sheet() {
    let source = sheet(SHEET, &RigidTransform::identity());
    let target = view(SHEET, 0.37, &motion(), |_| {});
    let found = aligned(&[&source, &target]);
    assert_close(&found.T_target_source, &between(&source, &target, &motion()));
    assert!(found.score > 0.9, "{found:?}");
}

#[test]
fn a_score_is_the_mean_agreement_of_both_sides() {
    let (source, target) = (sheet(SHEET, &RigidTransform::identity()), sheet(SHEET, &motion()));
    let off = RigidTransform::from_rotation_vector([0.0; 3], [0.0, 0.0, 0.6]);
    let pose = between(&source, &target, &motion()) * off;
    let poses = [([0, 1], pose)];
    let settings = RecurrenceSettings::default();
    let found = judge_poses(&[&source, &target], &poses, &settings, &Monitor::default()).unwrap()[0];
    let one_by_one = |view: &PieceView, image: &crate::DepthImage, pose: &RigidTransform| {
        let score = |point: &crate::SurfacePlace| {
            let judged = image.judge(pose, &[*point], 0.4);
            judged.confirmed - 15.0 * judged.contradicted - 40.0 * judged.missing - judged.mismatched
        };
        view.points.iter().map(score).map(f64::from).sum::<f64>() / view.points.len() as f64
    };
    let there = one_by_one(&source, &target.image, &pose);
    let back = one_by_one(&target, &source.image, &pose.inverse());
    assert!((found.score - 0.5 * (there + back)).abs() < 1e-4, "{found:?} {there} {back}");
    assert!(found.judgements.iter().all(|judged| judged.mismatched > 0.1));
}

#[test]
fn a_flat_match_counts_less() {
    let flat = sheet(FLAT, &RigidTransform::identity());
    let settings = RecurrenceSettings::default();
    let identity = [([0, 0], RigidTransform::identity())];
    let found = judge_poses(&[&flat], &identity, &settings, &Monitor::default()).unwrap()[0];
    assert!((found.score - settings.planar_weight).abs() < 1e-6, "{found:?}");
}

#[test]
fn other_sheets_do_not_match() {
    let views = [sheet(SHEET, &RigidTransform::identity()), sheet(OTHER, &motion())];
    let settings = RecurrenceSettings::default();
    let found = align_pieces(&[&views[0], &views[1]], &[[0, 1]], &settings, &Monitor::default()).unwrap()[0];
    assert!(found.is_none_or(|found| found.score < 0.1), "{found:?}");
}

#[test]
fn a_motion_of_a_scan_moves_poses_with_it() {
    let target = view(SHEET, 0.37, &motion(), |_| {});
    let source = sheet(SHEET, &RigidTransform::identity());
    let expected = aligned(&[&source, &target]).T_target_source;
    for seed in 0..3 {
        let draw = |k: usize| uniform(k, seed) - 0.5;
        let other = RigidTransform::from_rotation_vector(
            [4.0 * draw(0), 4.0 * draw(1), 4.0 * draw(2)],
            [900.0 * draw(3), 900.0 * draw(4), 900.0 * draw(5)],
        );
        let moved = sheet(SHEET, &other);
        let found = aligned(&[&moved, &target]);
        let rotated = between(&source, &moved, &other);
        assert_close(&(found.T_target_source * rotated), &expected);
        let back = aligned(&[&target, &moved]).T_target_source.inverse();
        assert_close(&back, &found.T_target_source);
    }
}

#[test]
fn the_order_of_points_does_not_matter() {
    let target = view(SHEET, 0.37, &motion(), |_| {});
    let source = sheet(SHEET, &RigidTransform::identity());
    let expected = aligned(&[&source, &target]).T_target_source;
    for key in 0..2 {
        let shuffled = view(SHEET, 0.0, &RigidTransform::identity(), |numbers| {
            Generator::new(&[key]).shuffled(numbers, usize::MAX);
        });
        assert_close(&aligned(&[&shuffled, &target]).T_target_source, &expected);
    }
}

#[test]
fn results_have_the_same_bits_for_any_number_of_threads_and_beside_any_other_pair() {
    let views = [
        sheet(SHEET, &RigidTransform::identity()),
        sheet(SHEET, &motion()),
        sheet(OTHER, &motion()),
        view(SHEET, 0.37, &motion(), |_| {}),
    ];
    let views = views.each_ref();
    let pairs: Vec<[usize; 2]> = (0..4).flat_map(|j| (0..j).map(move |i| [i, j])).collect();
    let align = |pairs: &[[usize; 2]], threads| {
        let settings = RecurrenceSettings { threads: Some(threads), ..Default::default() };
        let monitor = Monitor::default();
        let found = align_pieces(&views, pairs, &settings, &monitor).unwrap();
        assert_eq!(monitor.done(), pairs.len());
        found
    };
    let expected = align(&pairs, 1);
    assert_eq!(align(&pairs, 3), expected);
    for (number, pair) in pairs.iter().enumerate() {
        assert_eq!(align(&[*pair], 2)[0], expected[number]);
    }
    let poses: Vec<PosesOfPair> = pairs
        .iter()
        .zip(&expected)
        .map(|(&pair, found)| PosesOfPair {
            pair,
            poses: found.iter().map(|found| found.T_target_source).collect(),
        })
        .collect();
    let refine = |threads| {
        let settings = RecurrenceSettings { threads: Some(threads), ..Default::default() };
        refine_poses(&views, &poses, &settings, &Monitor::default()).unwrap()
    };
    let refined = refine(1);
    assert_eq!(refine(3), refined);
    for (before, after) in expected.iter().zip(&refined) {
        assert_eq!(before.is_some(), after.is_some());
        // A further search makes a pose hardly worse.
        assert!(before.is_none_or(|before| after.is_some_and(|after| after.score > before.score - 0.02)));
    }
}

#[test]
fn another_seed_makes_other_choices_and_finds_the_same_pose() {
    let (source, target) = (sheet(SHEET, &RigidTransform::identity()), view(SHEET, 0.37, &motion(), |_| {}));
    let truth = between(&source, &target, &motion());
    let poses: Vec<RigidTransform> = (0..4)
        .map(|seed| {
            let settings = RecurrenceSettings { seed, ..Default::default() };
            let found = align_pieces(&[&source, &target], &[[0, 1]], &settings, &Monitor::default());
            found.unwrap()[0].expect("the same sheet").T_target_source
        })
        .collect();
    for pose in &poses {
        assert_close(pose, &truth);
    }
    assert_ne!(poses[0], poses[1]);
}

#[test]
fn mistakes_are_errors() {
    let scan = |points, normals| OrientedScan { points, normals, spacing: 1.0, tolerance: 0.4 };
    let (points, normals) = ([[0.0; 3], [1.0, 0.0, 0.0], [f64::NAN; 3]], [[0.0, 0.0, 1.0]; 3]);
    let seen = PieceSituation { viewpoint: [0.0, 0.0, 9.0], ..Default::default() };
    let settings = RecurrenceSettings::default();
    let new = |scan: &OrientedScan<'_>, piece: &[usize], seen: &PieceSituation, unit: f64| {
        PieceView::new(scan, piece, seen, unit, &settings).map(|view| view.center())
    };
    let whole = scan(&points, &normals);
    assert_eq!(new(&whole, &[0, 1], &seen, 1.0), Ok([0.5, 0.0, 0.0]));
    let mismatch = Error::DirectionsMismatch { directions: 1, queries: 3 };
    assert_eq!(new(&scan(&points, &normals[..1]), &[0], &seen, 1.0), Err(mismatch));
    assert_eq!(new(&whole, &[0, 3], &seen, 1.0), Err(Error::IndexOutOfRange { index: 3, len: 3 }));
    let length = |result| matches!(result, Err(Error::InvalidLength { .. }));
    assert!(length(new(&whole, &[0, 2], &seen, 1.0)), "not finite");
    assert!(length(new(&whole, &[1], &seen, 1.0)), "no extent");
    assert!(length(new(&whole, &[], &seen, 1.0)), "no points");
    assert!(length(new(&whole, &[0, 1], &seen, 0.0)));
    assert!(length(new(&OrientedScan { spacing: -1.0, ..whole }, &[0, 1], &seen, 1.0)));
    assert!(length(new(&OrientedScan { tolerance: f64::NAN, ..whole }, &[0, 1], &seen, 1.0)));
    let at_center = PieceSituation { viewpoint: [0.5, 0.0, 0.0], ..Default::default() };
    assert!(length(new(&whole, &[0, 1], &at_center, 1.0)));
    let second = PieceSituation { second_viewpoint: Some([f64::INFINITY; 3]), ..seen.clone() };
    assert!(length(new(&whole, &[0, 1], &second, 1.0)));

    // Two points make a view, but no pose; no numbers make a panic.
    let view = PieceView::new(&whole, &[0, 1], &seen, 1.0, &settings).unwrap();
    let monitor = Monitor::default();
    assert_eq!(align_pieces(&[&view], &[[0, 0]], &settings, &monitor), Ok(vec![None]));
    let out_of_range = Error::PieceOutOfRange { piece: 1, len: 1 };
    assert_eq!(align_pieces(&[&view], &[[0, 1]], &settings, &monitor), Err(out_of_range));
    let nothing = RecurrenceSettings { tried: 0, kept: 0, poses_per_pair: 0, ..Default::default() };
    let sheet = sheet(SHEET, &RigidTransform::identity());
    assert_eq!(align_pieces(&[&sheet], &[[0, 0]], &nothing, &monitor), Ok(vec![None]));
    let no_pose = [PosesOfPair { pair: [0, 0], poses: Vec::new() }];
    assert_eq!(refine_poses(&[&sheet], &no_pose, &settings, &monitor), Ok(vec![None]));
    monitor.cancel();
    assert_eq!(align_pieces(&[&sheet], &[[0, 0]], &settings, &monitor), Err(Error::Cancelled));
}
