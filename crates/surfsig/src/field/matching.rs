//! Matches between the places of two scans, each with a whole transform.

use super::{FIELD_PHASES, FIELD_SIGNATURE, FieldPhases, FieldPlaces};
use crate::geometry::RigidTransform;
use crate::simd::InstructionSet;
use crate::simd::field::ORDERS;
use crate::simd::products::{COLUMNS, Panel, ROWS, products};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Angles about the axis that are tried; the best one lies between two of them.
const ANGLES: usize = 128;

/// Vectors of one set that a thread takes at a time, where each has to be compared with all of another set.
const TOGETHER: usize = 16 * ROWS;

/// Cosine and sine of each of them.
static CIRCLE: LazyLock<[[f64; 2]; ANGLES]> = LazyLock::new(|| {
    std::array::from_fn(|step| {
        let angle = TAU / ANGLES as f64 * step as f64;
        [angle.cos(), angle.sin()]
    })
});

/// A place of a source and the place of a target that it is most like.
///
/// ```
/// use surfsig::{FieldMatch, RigidTransform};
/// let same = FieldMatch { source: 0, target: 0, distance: 0.0, T_target_source: RigidTransform::identity() };
/// assert_eq!(same.distance, 0.0);
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldMatch {
    /// Number of the source's place.
    pub source: usize,
    /// Number of the target's place.
    pub target: usize,
    /// Between the two signatures: 0 to 2.
    pub distance: f32,
    /// By this match alone: place on place, axis on axis, and rotated about it by what the phases say.
    pub T_target_source: RigidTransform,
}

/// Finds for each place of the source the most similar one of the target; the most similar first.
///
/// With `mutual` only those stay of which each place is the other's most similar.
///
/// ```
/// use surfsig::{match_fields, FieldPlaces};
/// assert!(match_fields(&FieldPlaces::new(1.0), &FieldPlaces::new(1.0), true).is_empty());
/// ```
pub fn match_fields(source: &FieldPlaces, target: &FieldPlaces, mutual: bool) -> Vec<FieldMatch> {
    if source.is_empty() || target.is_empty() {
        return Vec::new();
    }
    let [nearest, back] = match mutual {
        true => most_similar_of_both(&source.vectors, &target.vectors),
        false => [most_similar(&source.vectors, &target.vectors, 1), Vec::new()],
    };
    let is_mutual = |&(place, (other, _)): &(usize, (usize, f32))| !mutual || back[other].0 == place;
    let mut kept: Vec<(usize, (usize, f32))> = nearest.into_iter().enumerate().filter(is_mutual).collect();
    kept.sort_by(|a, b| b.1.1.total_cmp(&a.1.1));
    kept.into_par_iter()
        .with_min_len(16)
        .map(|(place, (other, product))| matched(source, place, target, other, product))
        .collect()
}

/// For each place of the source the `count` most similar ones of the target (all, if there are fewer): place by place,
/// the most similar first.
pub(crate) fn similar_places(source: &FieldPlaces, target: &FieldPlaces, count: usize) -> Vec<FieldMatch> {
    let count = count.min(target.len());
    if count == 0 {
        return Vec::new();
    }
    let similar = most_similar(&source.vectors, &target.vectors, count);
    similar
        .into_par_iter()
        .enumerate()
        .with_min_len(16)
        .map(|(number, (other, product))| matched(source, number / count, target, other, product))
        .collect()
}

fn matched(
    source: &FieldPlaces,
    place: usize,
    target: &FieldPlaces,
    other: usize,
    product: f32,
) -> FieldMatch {
    FieldMatch {
        source: place,
        target: other,
        distance: (2.0 - 2.0 * product).max(0.0).sqrt(),
        T_target_source: transform(source, place, target, other),
    }
}

/// For each vector the numbers of the `count` with the largest scalar products, the largest first and of equal ones the
/// first, and the products. There are at least `count`.
fn most_similar(
    vectors: &[[f32; FIELD_SIGNATURE]],
    among: &[[f32; FIELD_SIGNATURE]],
    count: usize,
) -> Vec<(usize, f32)> {
    let set = InstructionSet::detect();
    let panels: Vec<Panel<FIELD_SIGNATURE>> = among.par_chunks(COLUMNS).map(Panel::of).collect();
    let of_some = |some: &[[f32; FIELD_SIGNATURE]]| {
        let rows = std::array::from_fn(|row| &some[row.min(some.len() - 1)]);
        let mut best: [Vec<(usize, f32)>; ROWS] =
            std::array::from_fn(|_| vec![(0, f32::NEG_INFINITY); count]);
        for (panel, first) in panels.iter().zip((0..).step_by(COLUMNS)) {
            for (best, products) in best.iter_mut().zip(products(set, &rows, panel)) {
                for (other, product) in (first..among.len()).zip(products) {
                    if product > best[count - 1].1 {
                        let rank = best.partition_point(|(_, known)| *known >= product);
                        best[rank..].rotate_right(1);
                        best[rank] = (other, product);
                    }
                }
            }
        }
        best[..some.len()].concat()
    };
    vectors.par_chunks(ROWS).flat_map_iter(of_some).collect()
}

/// For each vector of one set the number of the most similar one of the other, of equal ones the first, and the product;
/// and the same for each of the other set. Each product is made once, and is the same either way.
fn most_similar_of_both(
    vectors: &[[f32; FIELD_SIGNATURE]],
    others: &[[f32; FIELD_SIGNATURE]],
) -> [Vec<(usize, f32)>; 2] {
    let set = InstructionSet::detect();
    let panels: Vec<Panel<FIELD_SIGNATURE>> = others.par_chunks(COLUMNS).map(Panel::of).collect();
    let nothing = (0, f32::NEG_INFINITY);
    let of_some = |(start, some): (usize, &[[f32; FIELD_SIGNATURE]])| {
        let (mut best, mut back) = (vec![nothing; some.len()], vec![nothing; others.len()]);
        for (first, rows) in (0..).step_by(ROWS).zip(some.chunks(ROWS)) {
            let full = std::array::from_fn(|row| &rows[row.min(rows.len() - 1)]);
            for (panel, column) in panels.iter().zip((0..).step_by(COLUMNS)) {
                let products = products(set, &full, panel);
                for (row, products) in products.iter().enumerate().take(rows.len()) {
                    let of_row = &mut best[first + row];
                    for (other, &product) in (column..others.len()).zip(products) {
                        if product > of_row.1 {
                            *of_row = (other, product);
                        }
                        if product > back[other].1 {
                            back[other] = (start + first + row, product);
                        }
                    }
                }
            }
        }
        [best, back]
    };
    let parts: Vec<_> =
        vectors.par_chunks(TOGETHER).enumerate().map(|(k, some)| of_some((k * TOGETHER, some))).collect();
    let (mut best, mut back) = (Vec::with_capacity(vectors.len()), vec![nothing; others.len()]);
    for [of_part, back_of_part] in parts {
        best.extend(of_part);
        for (known, found) in back.iter_mut().zip(back_of_part) {
            if found.1 > known.1 {
                *known = found;
            }
        }
    }
    [best, back]
}

/// T_target_source of a pair of places.
fn transform(source: &FieldPlaces, place: usize, target: &FieldPlaces, other: usize) -> RigidTransform {
    let angle = rotation_about_axis(&source.phases[place], &target.phases[other]);
    let ours = axes(source, place);
    let about_z = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    let rotation = axes(target, other) * about_z.matrix() * ours.transpose();
    let translation = Vector3::from(target.points[other]) - rotation * Vector3::from(source.points[place]);
    RigidTransform { rotation, translation }
}

/// Tangent, the vector square to both, and axis, as columns.
fn axes(places: &FieldPlaces, place: usize) -> Matrix3<f64> {
    let [axis, tangent] =
        [places.axes[place], places.tangents[place]].map(|v| Vector3::from(v.map(f64::from)));
    let axis = axis.normalize();
    let tangent = (tangent - axis * axis.dot(&tangent)).normalize();
    Matrix3::from_columns(&[tangent, axis.cross(&tangent), axis])
}

/// The angle by which the source must be rotated about its axis to agree best with the target, in radians.
fn rotation_about_axis(source: &FieldPhases, target: &FieldPhases) -> f64 {
    // Of each order, the sum of conj(source) times target.
    let mut agreement = [[0.0; 2]; ORDERS - 1];
    for (sum, (ours, theirs)) in agreement.iter_mut().zip(source.iter().zip(target)) {
        for k in 0..FIELD_PHASES {
            let [[a, b], [c, d]] = [ours[k], theirs[k]].map(|number| number.map(f64::from));
            sum[0] += a * c + b * d;
            sum[1] += a * d - b * c;
        }
    }
    // Dereferenced once, not for each angle.
    let circle: &[[f64; 2]; ANGLES] = &CIRCLE;
    let score = |step: usize| {
        let waves = agreement.iter().zip(1..).map(|([real, imaginary], order)| {
            let [cosine, sine] = circle[order * step % ANGLES];
            real * cosine + imaginary * sine
        });
        waves.sum::<f64>()
    };
    let scores: [f64; ANGLES] = std::array::from_fn(score);
    let best = (1..ANGLES).fold(0, |best, step| if scores[step] > scores[best] { step } else { best });
    let [before, peak, after] = [ANGLES - 1, 0, 1].map(|step| scores[(best + step) % ANGLES]);
    // The vertex of the parabola through the best angle and its neighbours.
    let curvature = before - 2.0 * peak + after;
    let between = if curvature == 0.0 { 0.0 } else { 0.5 * (before - after) / curvature };
    TAU / ANGLES as f64 * (best as f64 + between)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(i: usize) -> f32 {
        ((i as f32) * 12.9898).sin()
    }

    fn random_places(count: usize, seed: usize) -> FieldPlaces {
        let mut places = FieldPlaces::new(1.0);
        for i in 0..count {
            let at = |k: usize| number(seed * 7919 + i * 523 + k);
            let raw: [f32; FIELD_SIGNATURE] = std::array::from_fn(at);
            let length = raw.iter().map(|v| v * v).sum::<f32>().sqrt();
            places.vectors.push(raw.map(|v| v / length));
            places.points.push([at(300), at(301), at(302)].map(f64::from));
            let axis = Vector3::new(at(303), at(304), at(305)).normalize();
            places.axes.push(axis.into());
            places.tangents.push(crate::geometry::axes_across(&axis)[0].into());
            places.phases.push(std::array::from_fn(|order| {
                std::array::from_fn(|k| [at(400 + order * 16 + k), at(500 + order * 16 + k)])
            }));
            places.indices.push(i as u32);
            places.count.push(100);
        }
        places
    }

    #[test]
    fn matches_are_those_of_a_search_through_all() {
        let (source, target) = (random_places(53, 1), random_places(37, 2));
        let product = |a: usize, b: usize| -> f32 {
            source.vectors[a].iter().zip(&target.vectors[b]).map(|(x, y)| x * y).sum()
        };
        let best =
            |scores: Vec<f32>| (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b])).unwrap();
        let forward: Vec<usize> = (0..53).map(|a| best((0..37).map(|b| product(a, b)).collect())).collect();
        let backward: Vec<usize> = (0..37).map(|b| best((0..53).map(|a| product(a, b)).collect())).collect();
        let all = match_fields(&source, &target, false);
        assert_eq!(all.len(), 53);
        assert!(all.iter().all(|found| forward[found.source] == found.target));
        assert!(all.windows(2).all(|pair| pair[0].distance <= pair[1].distance));
        let mutual = match_fields(&source, &target, true);
        assert_eq!(mutual.len(), (0..53).filter(|&a| backward[forward[a]] == a).count());
        assert!(mutual.iter().all(|found| backward[found.target] == found.source));
    }

    #[test]
    fn the_most_similar_of_both_are_those_of_two_searches() {
        // More than a thread takes at a time, the last ones again.
        let (mut source, mut target) = (random_places(TOGETHER + 21, 6), random_places(2 * TOGETHER + 3, 7));
        source.vectors.extend_from_within(..9);
        target.vectors.extend_from_within(..9);
        let expected = [
            most_similar(&source.vectors, &target.vectors, 1),
            most_similar(&target.vectors, &source.vectors, 1),
        ];
        assert_eq!(most_similar_of_both(&source.vectors, &target.vectors), expected);
    }

    #[test]
    fn several_similar_places_are_those_of_a_search_through_all() {
        let (source, target) = (random_places(21, 4), random_places(30, 5));
        let found = similar_places(&source, &target, 3);
        assert_eq!(found.len(), 3 * source.len());
        for (place, some) in found.chunks(3).enumerate() {
            let product = |b: usize| -> f32 {
                source.vectors[place].iter().zip(&target.vectors[b]).map(|(x, y)| x * y).sum()
            };
            let mut order: Vec<usize> = (0..target.len()).collect();
            order.sort_by(|&a, &b| product(b).total_cmp(&product(a)));
            let numbers: Vec<usize> = some.iter().map(|one| one.target).collect();
            assert_eq!(numbers, order[..3]);
            assert!(some.iter().all(|one| one.source == place));
        }
        assert_eq!(similar_places(&source, &target, 99).len(), 21 * 30);
        assert!(similar_places(&source, &FieldPlaces::new(1.0), 3).is_empty());
    }

    #[test]
    fn a_rotated_place_is_matched_with_its_rotation() {
        let source = random_places(9, 3);
        let truth = RigidTransform::from_rotation_vector([0.4, -1.1, 0.7], [3.0, -2.0, 1.0]);
        let mut target = source.clone();
        target.points = truth.transform_points(&source.points);
        for place in 0..9 {
            let rotate = |v: [f32; 3]| truth.transform_vector(v.map(f64::from)).map(|x| x as f32);
            target.axes[place] = rotate(source.axes[place]);
            // The target counts angles from another tangent, 0.3 further by the right-hand rule.
            let axis = Vector3::from(target.axes[place]);
            let tangent = Vector3::from(rotate(source.tangents[place]));
            let angle = 0.3_f32;
            target.tangents[place] = (tangent * angle.cos() + axis.cross(&tangent) * angle.sin()).into();
            for (order, phases) in target.phases[place].iter_mut().enumerate() {
                let (sine, cosine) = (-angle * (order + 1) as f32).sin_cos();
                for [re, im] in phases.iter_mut() {
                    (*re, *im) = (*re * cosine - *im * sine, *re * sine + *im * cosine);
                }
            }
        }
        let found = match_fields(&source, &target, true);
        assert_eq!(found.len(), 9);
        for one in found {
            assert_eq!(one.source, one.target);
            let off = (truth.inverse() * one.T_target_source).log();
            assert!(off.iter().all(|component| component.abs() < 3e-3), "{off:?}");
        }
    }
}
