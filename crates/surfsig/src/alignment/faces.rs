//! Large faces at right angles, as floors, ceilings and walls are, and the transforms that take those of one scan onto
//! those of another.
//!
//! Scans from different rooms see the surface that they share from other sides and hidden by other things, so that
//! patches of it do not match. Their faces do: a rotation takes right angles to right angles, and along each axis the
//! offsets of the faces tell the translation (Pathak and others, Fast registration based on noisy planes, 2010). That
//! leaves some thousand transforms, of which other tests must choose.

use crate::geometry::{RigidTransform, axes_across};
use crate::random::some_of;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// Normals from which axes are taken, at most; the search compares each with all others.
const NORMALS: usize = 400;
/// Cosine of the angle between normals of one face, at least (10 degrees).
const PARALLEL: f64 = 0.985;
/// Sine of the angle by which a face may be off the right angle to another (10 degrees).
const ACROSS: f64 = 0.174;
/// Steps of a profile that are kept, the fullest: a building has some dozen faces along an axis.
const MOST_STEPS: usize = 400;
/// Steps by which two translations along an axis differ, at least: noise spreads a face over two or three.
const APART: i64 = 3;

/// Points with unit normals on the side from which they were seen.
pub(crate) struct FacedPoints {
    pub points: Vec<[f64; 3]>,
    pub normals: Vec<[f64; 3]>,
}

impl FacedPoints {
    /// Takes points with normals of an open side, which were seen from a viewpoint.
    pub fn seen_from(viewpoint: [f64; 3], points: &[[f64; 3]], normals: &[[f64; 3]]) -> Self {
        let faced = |(point, normal): (&[f64; 3], &[f64; 3])| -> [f64; 3] {
            let normal = Vector3::from(*normal);
            let to_viewpoint = Vector3::from(viewpoint) - Vector3::from(*point);
            (if normal.dot(&to_viewpoint) < 0.0 { -normal } else { normal }).into()
        };
        Self { points: points.to_vec(), normals: points.iter().zip(normals).map(faced).collect() }
    }

    /// Some of them, spread evenly over all.
    pub fn some(&self, most: usize) -> Self {
        let (points, normals) =
            some_of(self.points.len(), most).into_iter().map(|i| (self.points[i], self.normals[i])).unzip();
        Self { points, normals }
    }
}

/// How many transforms are proposed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FaceOffsets {
    /// Width of the steps in which offsets of faces are compared.
    pub step: f64,
    /// Translations along each axis, at most.
    pub most: usize,
    /// The area that a translation brings together, over the largest one along that axis, at least.
    pub least_share: f64,
}

/// Transforms that take the source's faces onto the target's; with `mirrored` those that do so with its mirror image.
///
/// None where either has no face.
pub(crate) fn face_transforms(
    source: &FacedPoints,
    target: &FacedPoints,
    offsets: FaceOffsets,
    mirrored: bool,
) -> Vec<RigidTransform> {
    let (Some(from), Some(to)) = (axes_of_faces(&source.normals), axes_of_faces(&target.normals)) else {
        return Vec::new();
    };
    let profile = |faced: &FacedPoints, axes: &Matrix3<f64>| {
        [0, 1, 2].map(|k| Profile::new(faced, &axes.column(k).into(), offsets.step))
    };
    let (ours, theirs) = (profile(source, &from), profile(target, &to));
    // Along each axis of the target, from each one of the source that points along or against it.
    let translations = [0, 1, 2].map(|axis| {
        [0, 1, 2].map(|other| {
            let other: &Profile = &ours[other];
            [other.shifts_to(&theirs[axis], &offsets), other.reversed().shifts_to(&theirs[axis], &offsets)]
        })
    });
    let mut found = Vec::new();
    for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
        for signs in 0..8 {
            let is_against = [0, 1, 2].map(|axis| signs >> axis & 1);
            let mut turned = Matrix3::zeros();
            for axis in 0..3 {
                turned[(axis, order[axis])] = 1.0 - 2.0 * f64::from(is_against[axis] as u8);
            }
            if (turned.determinant() < 0.0) != mirrored {
                continue;
            }
            let rotation = to * turned * from.transpose();
            let [x, y, z] = [0, 1, 2].map(|axis| &translations[axis][order[axis]][is_against[axis]]);
            for (&x, &y, &z) in
                x.iter().flat_map(|x| y.iter().flat_map(move |y| z.iter().map(move |z| (x, y, z))))
            {
                found.push(RigidTransform { rotation, translation: to * Vector3::new(x, y, z) });
            }
        }
    }
    found
}

/// The area of the faces across an axis, by their offset along it, in steps: of those that face along it, and against.
struct Profile([BTreeMap<i64, f64>; 2]);

impl Profile {
    fn new(faced: &FacedPoints, axis: &Vector3<f64>, step: f64) -> Self {
        let mut counts = [BTreeMap::new(), BTreeMap::new()];
        for (point, normal) in faced.points.iter().zip(&faced.normals) {
            let cosine = axis.dot(&Vector3::from(*normal));
            if cosine.abs() > PARALLEL {
                let number = (axis.dot(&Vector3::from(*point)) / step).floor() as i64;
                // A point counts for the steps next to its own, too, as faces may lie on the border of two.
                for near in [number.saturating_sub(1), number, number.saturating_add(1)] {
                    *counts[usize::from(cosine < 0.0)].entry(near).or_insert(0.0) += 1.0;
                }
            }
        }
        Self(counts.map(|counts| {
            let mut fullest: Vec<(i64, f64)> = counts.into_iter().collect();
            fullest.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            // By the square root, so that many small faces count beside a large one.
            fullest.into_iter().take(MOST_STEPS).map(|(number, count)| (number, count.sqrt())).collect()
        }))
    }

    /// Of the same faces along the opposite axis.
    fn reversed(&self) -> Self {
        let reverse = |side: &BTreeMap<i64, f64>| {
            side.iter().map(|(number, count)| ((-1_i64).saturating_sub(*number), *count)).collect()
        };
        Self([reverse(&self.0[1]), reverse(&self.0[0])])
    }

    /// The translations that bring most area together, the best first.
    fn shifts_to(&self, target: &Self, offsets: &FaceOffsets) -> Vec<f64> {
        let mut together: BTreeMap<i64, f64> = BTreeMap::new();
        for (ours, theirs) in self.0.iter().zip(&target.0) {
            for (from, area) in ours {
                for (to, other) in theirs {
                    *together.entry(to.saturating_sub(*from)).or_insert(0.0) += area * other;
                }
            }
        }
        let mut ordered: Vec<(i64, f64)> = together.into_iter().collect();
        ordered.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut chosen: Vec<i64> = Vec::new();
        for &(shift, area) in &ordered {
            if chosen.len() == offsets.most || area < offsets.least_share * ordered[0].1 {
                break;
            }
            if chosen.iter().all(|other| other.abs_diff(shift) > APART as u64) {
                chosen.push(shift);
            }
        }
        chosen.into_iter().map(|shift| shift as f64 * offsets.step).collect()
    }
}

/// The normal that most others are parallel to, that of those across it, and the one across both.
pub(super) fn axes_of_faces(normals: &[[f64; 3]]) -> Option<Matrix3<f64>> {
    let some: Vec<Vector3<f64>> =
        some_of(normals.len(), NORMALS).into_iter().map(|number| normals[number].into()).collect();
    let first = largest_face(&some)?;
    let across: Vec<Vector3<f64>> =
        some.iter().filter(|normal| normal.dot(&first).abs() < ACROSS).copied().collect();
    let second = largest_face(&across).unwrap_or_else(|| axes_across(&first)[0]);
    let second = (second - first * first.dot(&second)).try_normalize(0.5)?;
    Some(Matrix3::from_columns(&[first, second, first.cross(&second)]))
}

/// The mean of the normals that are parallel to the one to which most are, whichever side they are on.
fn largest_face(normals: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let parallel =
        |one: &Vector3<f64>| normals.iter().filter(|other| one.dot(other).abs() > PARALLEL).count();
    let counts: Vec<usize> = normals.iter().map(parallel).collect();
    // Of equal counts the first.
    let best =
        (0..normals.len()).reduce(|best, other| if counts[other] > counts[best] { other } else { best })?;
    let same_side = |other: &Vector3<f64>| *other * other.dot(&normals[best]).signum();
    let all = normals.iter().filter(|other| normals[best].dot(other).abs() > PARALLEL).map(same_side);
    all.sum::<Vector3<f64>>().try_normalize(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    /// Points of an L-shaped room, seen from its corner's middle.
    fn room(seed: u64, pose: &RigidTransform) -> FacedPoints {
        // Axis, offset, and where the wall is along the other axes; the sensor stands at (2, 1.5, 1.2).
        let walls = [
            (2, 0.0, [[0.0, 7.0], [0.0, 3.0]]),
            (2, 2.6, [[0.0, 7.0], [0.0, 3.0]]),
            (0, 0.0, [[0.0, 3.0], [0.0, 2.6]]),
            (0, 7.0, [[0.0, 3.0], [0.0, 2.6]]),
            (1, 0.0, [[0.0, 2.6], [0.0, 7.0]]),
            (1, 3.0, [[0.0, 2.6], [0.0, 4.0]]),
        ];
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        for i in 0..3000 {
            let (axis, offset, sides) = walls[i % walls.len()];
            let mut point = [offset; 3];
            for (k, [low, high]) in [1, 2].into_iter().zip(sides) {
                point[(axis + k) % 3] = low + (high - low) * uniform(i, seed + k as u64);
            }
            let mut normal = [0.0; 3];
            normal[axis] = 1.0;
            points.push(pose.transform_point(point));
            normals.push(pose.transform_vector(normal));
        }
        FacedPoints::seen_from(pose.transform_point([2.0, 1.5, 1.2]), &points, &normals)
    }

    #[test]
    fn the_true_transform_is_among_those_that_are_proposed() {
        let pose = RigidTransform::from_rotation_vector([0.3, -0.5, 2.0], [10.0, -3.0, 1.0]);
        let (source, target) = (room(5, &RigidTransform::identity()), room(50, &pose));
        let offsets = FaceOffsets { step: 0.06, most: 8, least_share: 0.15 };
        let found = face_transforms(&source, &target, offsets, false);
        let off =
            |transform: &RigidTransform| transform.displacement_from(&pose, source.points.iter().copied());
        let nearest = found.iter().map(off).fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.06, "{nearest}");
        assert!((24..24 * 512).contains(&found.len()), "{}", found.len());
        for transform in face_transforms(&source, &target, offsets, true) {
            assert!((transform.rotation.determinant() + 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn nothing_has_no_faces() {
        let nothing = FacedPoints { points: Vec::new(), normals: Vec::new() };
        let offsets = FaceOffsets { step: 0.1, most: 8, least_share: 0.15 };
        assert!(face_transforms(&nothing, &room(5, &RigidTransform::identity()), offsets, false).is_empty());
    }
}
