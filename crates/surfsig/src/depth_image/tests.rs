//! What depth images say of a square before a wall.

use super::*;

const UP: [f32; 3] = [0.0, 0.0, 1.0];
const FAR_ABOVE: [f64; 3] = [0.0, 0.0, 1e4];

fn at(x: f32, y: f32, z: f32) -> SurfacePlace {
    SurfacePlace { place: [x, y, z], normal: UP }
}

fn board(columns: std::ops::Range<i32>, rows: std::ops::Range<i32>, z: f32) -> Vec<SurfacePlace> {
    let row = |y: i32| columns.clone().map(move |x| at(x as f32, y as f32, z));
    rows.flat_map(row).collect()
}

/// A square of 21 before a wall, with a strip from x = 16 to 22 where nothing was measured.
fn image(second_viewpoint: Option<[f64; 3]>) -> DepthImage {
    let square = board(-10..11, -10..11, 0.0);
    let mut points = board(-30..31, -30..31, -10.0);
    points.retain(|point| point.place[0] < 16.0 || point.place[0] > 22.0);
    let own: Vec<bool> = (0..square.len() + points.len()).map(|number| number < square.len()).collect();
    DepthImage::new(&[square, points].concat(), &own, FAR_ABOVE, 1.0, 30.0, second_viewpoint)
}

fn judged(image: &DepthImage, point: SurfacePlace) -> [f32; 4] {
    let found = image.judge(&RigidTransform::identity(), &[point], 0.3);
    [found.confirmed, found.contradicted, found.mismatched, found.missing]
}

#[test]
fn what_is_on_hidden_through_and_missing() {
    let image = image(None);
    assert_eq!(judged(&image, at(5.0, 5.0, 0.1)), [1.0, 0.0, 0.0, 0.0]);
    assert_eq!(judged(&image, at(5.0, 5.0, -1.0)), [0.0, 0.0, 1.0, 0.0]);
    assert_eq!(judged(&image, at(5.0, 5.0, -8.0)), [0.0; 4]);
    assert_eq!(judged(&image, at(-20.0, 5.0, -2.0)), [0.0, 1.0, 0.0, 0.0]);
    assert_eq!(judged(&image, at(19.0, 0.0, 0.0)), [0.0, 0.0, 0.0, 1.0]);
}

#[test]
fn what_faces_away_is_neither_confirmed_nor_missing() {
    let away = |x| SurfacePlace { place: [x, 5.0, 0.0], normal: [0.0, 0.0, -1.0] };
    assert_eq!(judged(&image(None), away(5.0)), [0.0, 0.0, 1.0, 0.0]);
    assert_eq!(judged(&image(None), away(19.0)), [0.0; 4]);
}

#[test]
fn nothing_is_missing_where_a_second_viewpoint_could_not_see() {
    // Seen from the left at 45 degrees, the square hides what is 9 behind its plane and 19 to the right.
    let beside = image(Some([-1e4, 0.0, 1e4]));
    assert_eq!(judged(&beside, at(19.0, 0.0, -15.0))[3], 0.0);
    assert_eq!(judged(&beside, at(19.0, 0.0, 0.0))[3], 1.0);
}

#[test]
fn nothing_is_beneath_a_support_plane() {
    let supported = image(None).supported_by(&[at(0.0, 0.0, -5.0)]);
    assert_eq!(judged(&supported, at(5.0, 5.0, -8.0)), [0.0, 1.0, 0.0, 0.0]);
    assert_eq!(judged(&supported, at(5.0, 5.0, -4.0)), [0.0; 4]);
}

#[test]
fn the_smallest_around_is_that_of_a_search_through_the_square() {
    for (side, reach) in [(1, 2), (2, 2), (7, 1), (9, 2)] {
        let values: Vec<f32> = (0..side * side).map(|i| (i as f32 * 12.9898).sin()).collect();
        let found = smallest_around(&values, side, reach);
        for (cell, smallest) in found.into_iter().enumerate() {
            let near = |other: &usize| {
                (other / side).abs_diff(cell / side).max((other % side).abs_diff(cell % side)) <= reach
            };
            let slow = (0..values.len()).filter(near).map(|other| values[other]);
            assert_eq!(smallest, slow.fold(f32::INFINITY, f32::min), "{side} {reach} {cell}");
        }
    }
}

#[test]
fn correspondences_are_the_points_there_in_the_axes_of_the_scan() {
    let image = image(None);
    let pose = RigidTransform::from_rotation_vector([0.0; 3], [3.0, 0.0, 0.0]);
    let found = image.correspondences(&pose, &[at(0.2, 4.1, 0.1), at(12.0, 4.0, 0.1)], 0.3);
    let near = found[0].expect("on the square");
    let apart = |a: [f32; 3], b: [f32; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f32::max);
    assert!(apart(near.place, [3.0, 4.0, 0.0]) <= 1.0 && apart(near.normal, UP) < 1e-6);
    assert_eq!(found[1], None);
}

#[test]
fn what_a_surface_hides_of_itself_does_not_count() {
    let image = image(None);
    let front =
        |places: &[SurfacePlace]| image.front(&image.to_image(&RigidTransform::identity()), places, 0.3, 3);
    let square = board(-10..11, -10..11, 0.0);
    let alone = front(&square);
    assert_eq!((alone.facing, alone.confirmed, alone.pixels), (441, 441, 441));
    let with_bottom = front(&[square, board(-10..11, -10..11, -5.0)].concat());
    assert_eq!((with_bottom.facing, with_bottom.confirmed), (441, 441));
    let faces_away = |mut point: SurfacePlace| {
        point.normal = [0.0, 0.0, -1.0];
        point
    };
    assert_eq!(front(&board(-5..6, -5..6, 0.0).into_iter().map(faces_away).collect::<Vec<_>>()).facing, 0);
    let sunk = front(&board(-5..6, -5..6, -1.0));
    assert_eq!((sunk.mismatched, sunk.hidden), (121, 0));
    let above = front(&board(-5..6, -5..6, 5.0));
    assert_eq!((above.contradicted, above.confirmed), (121, 0));
    assert_eq!(front(&board(18..21, -1..2, 0.0)).missing, 9);
    assert_eq!(front(&[]), Front::default());
}

#[test]
fn beyond_an_outline_the_scan_steps_back_or_goes_on() {
    let image = image(None);
    let front =
        |places: &[SurfacePlace]| image.front(&image.to_image(&RigidTransform::identity()), places, 0.3, 3);
    let whole = front(&board(-10..11, -10..11, 0.0));
    assert!(whole.outline > 100 && whole.goes_on == 0, "{whole:?}");
    assert!(f64::from(whole.ends) > 0.9 * f64::from(whole.outline), "{whole:?}");
    // Beside a corner some ways come from no confirmed place.
    let part = front(&board(-5..4, -5..4, 0.0));
    assert_eq!((part.outline, part.ends, part.goes_on), (128, 0, 104));
}

#[test]
fn what_is_hidden_beside_what_is_confirmed_is_behind_a_step() {
    let points = [board(-10..11, -10..11, 0.0), board(-30..31, -30..31, -10.0)].concat();
    let image = DepthImage::new(&points, &vec![true; points.len()], FAR_ABOVE, 1.0, 30.0, None);
    let front =
        |places: &[SurfacePlace]| image.front(&image.to_image(&RigidTransform::identity()), places, 0.3, 3);
    // Of a part of the wall the square hides the middle.
    let behind = front(&board(-15..16, -15..16, -10.0));
    assert!(behind.hidden > 400 && behind.not_covered == 0, "{behind:?}");
    // A step that the square has not.
    let stepped = front(&[board(-8..0, -8..9, 0.0), board(0..9, -8..9, -5.0)].concat());
    assert!(stepped.not_covered > 30, "{stepped:?}");
}
