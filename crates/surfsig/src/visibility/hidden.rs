//! Which places points hide from a sensor that is far away, so that its lines of sight are parallel.

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

/// Point spacings before a place from which on a point hides it.
const MARGIN: f64 = 4.0;
/// Point spacings between lines of sight.
const CELL: f64 = 1.5;

/// Whether each place has points of a scan before it, seen from far away along a unit vector. `direction` goes to the
/// sensor, and `across` are two unit vectors square to it and to each other; `spacing` is that of the points.
///
/// ```
/// let wall: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i % 10), f64::from(i / 10), 0.0]).collect();
/// let places = [[4.0, 4.0, -9.0], [4.0, 4.0, 9.0], [40.0, 4.0, -9.0]];
/// let across = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// assert_eq!(surfsig::hidden_from([0.0, 0.0, 1.0], across, &places, &wall, 1.0), [true, false, false]);
/// ```
pub fn hidden_from(
    direction: [f64; 3],
    across: [[f64; 3]; 2],
    places: &[[f64; 3]],
    points: &[[f64; 3]],
    spacing: f64,
) -> Vec<bool> {
    let (direction, across) = (Vector3::from(direction), across.map(Vector3::from));
    let cell = |point: &Vector3<f64>| across.map(|axis| (point.dot(&axis) / (CELL * spacing)).floor() as i64);
    let mut front: FxHashMap<[i64; 2], f64> = FxHashMap::default();
    for point in points.iter().copied().map(Vector3::from) {
        let depth = point.dot(&direction);
        front.entry(cell(&point)).and_modify(|first| *first = first.max(depth)).or_insert(depth);
    }
    let is_hidden = |&place: &[f64; 3]| {
        let place = Vector3::from(place);
        front.get(&cell(&place)).is_some_and(|first| *first > place.dot(&direction) + MARGIN * spacing)
    };
    places.iter().map(is_hidden).collect()
}
