//! Transforms of a model that many places of a scene propose.
//!
//! Proposals are points in seven dimensions, translation and unit quaternion, scaled so that those within a distance of
//! 1 agree; the most agreed ones are the modes of their density (pose clustering: Stockman, Object recognition and
//! localization via pose clustering, 1987).

use super::FindSettings;
use crate::field::{match_fields, similar_places};
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use crate::{FieldMatch, FieldPlaces};
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Proposals that a thread counts votes for at a time.
const PART: usize = 64;

/// Proposed transforms (T_scene_model) and how much each counts.
pub(super) struct Proposals {
    translations: Vec<[f64; 3]>,
    rotations: Vec<UnitQuaternion<f64>>,
    weights: Vec<f64>,
    tree: KdTree,
    /// Between translations that agree.
    distance: f64,
    /// Between quaternions of rotations that agree: the angle between these is twice that of the quaternions.
    chord: f64,
    /// How many of the most agreed ones are given, at most.
    most: usize,
    /// Of the distances within which two agree, those of which only the more agreed one is given.
    merged: f64,
}

impl Proposals {
    fn new(transforms: &[RigidTransform], weights: Vec<f64>, distance: f64, angle: f64) -> Self {
        let translations: Vec<[f64; 3]> = transforms.iter().map(|one| one.translation.into()).collect();
        Self {
            rotations: transforms.iter().map(quaternion).collect(),
            weights,
            tree: KdTree::new(&translations),
            translations,
            distance,
            chord: 0.5 * angle,
            most: usize::MAX,
            merged: 1.0,
        }
    }

    /// Each place of the scene proposes a transform by the place of the model that it is most similar to, and counts by how
    /// similar the two are; a place of the model that much of the scene is similar to counts less.
    pub fn of_best_matches(model: &FieldPlaces, scene: &FieldPlaces, settings: &FindSettings) -> Self {
        let matches = match_fields(scene, model, false);
        let counts = counts(&matches, model);
        let weights = matches.iter().map(|one| similarity(one) / counts[one.target]).collect();
        let transforms: Vec<RigidTransform> =
            matches.iter().map(|one| one.T_target_source.inverse()).collect();
        let [distance, angle] = settings.agreement;
        Self {
            most: settings.proposals,
            merged: settings.merged_share,
            ..Self::new(&transforms, weights, distance * model.radius, angle)
        }
    }

    /// Of weighted transforms that agree by the model's extent. Of those that agree with one another only one is given, so
    /// that a turn about an axis that hardly shows is tried at many angles.
    pub fn of_weighted(weighted: &[(RigidTransform, f64)], extent: f64, settings: &FindSettings) -> Self {
        let [distance, angle] = settings.agreed_within;
        let (transforms, weights): (Vec<RigidTransform>, Vec<f64>) = weighted.iter().copied().unzip();
        Self { most: settings.agreed, ..Self::new(&transforms, weights, distance * extent, angle) }
    }

    /// The numbers of proposals that agree with one, with their squared scaled distances, below 1; in ascending order.
    fn agreeing(&self, one: usize, near: &mut Vec<u32>, found: &mut Vec<(usize, f64)>) {
        self.tree.within(self.translations[one], self.distance, near);
        found.clear();
        let at = Vector3::from(self.translations[one]);
        for &other in near.iter() {
            let other = other as usize;
            let gap = (Vector3::from(self.translations[other]) - at).norm_squared();
            // A quaternion and its negative are one rotation.
            let cosine = self.rotations[one].coords.dot(&self.rotations[other].coords).abs();
            let square = gap / self.distance.powi(2) + (2.0 - 2.0 * cosine) / self.chord.powi(2);
            if square < 1.0 {
                found.push((other, square));
            }
        }
    }

    /// The weights of proposals that agree, close ones counting more.
    fn weight(&self, agreeing: &[(usize, f64)]) -> f64 {
        agreeing.iter().map(|&(other, square)| self.weights[other] * (1.0 - square)).sum()
    }

    /// Of each proposal the weights of those that agree with it.
    fn votes(&self) -> Vec<f64> {
        let of_one = |(near, found): &mut (Vec<u32>, Vec<(usize, f64)>), one: usize| {
            self.agreeing(one, near, found);
            self.weight(found)
        };
        let numbers = (0..self.weights.len()).into_par_iter().with_min_len(PART);
        numbers.map_init(|| (Vec::new(), Vec::new()), of_one).collect()
    }

    /// The mean of proposals that agree with one.
    fn mean(&self, one: usize, agreeing: &[(usize, f64)]) -> RigidTransform {
        let (mut translation, mut rotation, mut sum) = (Vector3::zeros(), Quaternion::identity() * 0.0, 0.0);
        for &(other, square) in agreeing {
            let weight = self.weights[other] * (1.0 - square);
            let quaternion = self.rotations[other].into_inner();
            let sign = self.rotations[one].coords.dot(&quaternion.coords).signum();
            translation += Vector3::from(self.translations[other]) * weight;
            rotation += quaternion * (weight * sign);
            sum += weight;
        }
        if sum <= 0.0 {
            (translation, rotation, sum) =
                (self.translations[one].into(), self.rotations[one].into_inner(), 1.0);
        }
        let rotation = UnitQuaternion::from_quaternion(rotation).to_rotation_matrix();
        RigidTransform { rotation: *rotation.matrix(), translation: translation / sum }
    }

    /// The most agreed transforms with the weights of those that agree with them, the most agreed first.
    pub fn most_agreed(&self) -> Vec<(RigidTransform, f64)> {
        let votes = self.votes();
        let mut order: Vec<usize> = (0..votes.len()).collect();
        order.sort_by(|&a, &b| votes[b].total_cmp(&votes[a]));
        let mut is_left = vec![true; votes.len()];
        let (mut near, mut found, mut chosen) = (Vec::new(), Vec::new(), Vec::new());
        for one in order {
            if chosen.len() == self.most {
                break;
            }
            if is_left[one] {
                self.agreeing(one, &mut near, &mut found);
                chosen.push((self.mean(one, &found), votes[one]));
                let same = found.iter().filter(|(_, square)| *square < self.merged * self.merged);
                same.for_each(|&(other, _)| is_left[other] = false);
            }
        }
        chosen
    }
}

fn quaternion(transform: &RigidTransform) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(transform.rotation))
}

/// T_scene_model by each place of the scene and each of the places of the model that are most similar to it, and how much
/// each counts: the more similar the two are, and the fewer places of the scene are similar to that of the model. Many are
/// wrong: they are for a judgement that costs little.
pub(super) fn weighted_transforms(
    model: &FieldPlaces,
    scene: &FieldPlaces,
    count: usize,
) -> Vec<(RigidTransform, f64)> {
    let matches = similar_places(scene, model, count);
    let mean = matches.len() as f64 / model.len().max(1) as f64;
    let counts = counts(&matches, model);
    let weight = |one: &FieldMatch| similarity(one) / (1.0 + counts[one.target] / mean);
    matches.par_iter().map(|one| (one.T_target_source.inverse(), weight(one))).collect()
}

/// How many matches each place of the model has.
fn counts(matches: &[FieldMatch], model: &FieldPlaces) -> Vec<f64> {
    let mut counts = vec![0.0; model.len()];
    matches.iter().for_each(|one| counts[one.target] += 1.0);
    counts
}

/// Scalar product of the two signatures.
fn similarity(one: &FieldMatch) -> f64 {
    (1.0 - 0.5 * f64::from(one.distance).powi(2)).max(0.0)
}

/// The transforms that are not the same as an earlier one, `most` of them at most.
pub(super) fn different(
    transforms: impl Iterator<Item = RigidTransform>,
    most: usize,
    distance: f64,
    angle: f64,
) -> Vec<RigidTransform> {
    let mut kept: Vec<RigidTransform> = Vec::new();
    // The trace of a rotation by an angle is 1 + 2 cos(angle).
    let trace = 1.0 + 2.0 * angle.cos();
    for transform in transforms {
        if kept.len() == most {
            break;
        }
        let is_same = |other: &RigidTransform| {
            (transform.translation - other.translation).norm() < distance
                && transform.rotation.dot(&other.rotation) > trace
        };
        if !kept.iter().any(is_same) {
            kept.push(transform);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(i: usize) -> f64 {
        (i as f64 * 12.9898).sin() * 43_758.545_3 % 1.0
    }

    /// Some transforms near each of a few, in a random order.
    fn transforms(count: usize) -> Vec<RigidTransform> {
        (0..count)
            .map(|i| {
                let group = 1000 * (i * 7 % 5);
                let of_group = |k: usize| 3.0 * number(group + k);
                let small = |k: usize| 0.3 * number(i * 6 + k + 17);
                RigidTransform::exp(std::array::from_fn(small))
                    * RigidTransform::exp(std::array::from_fn(of_group))
            })
            .collect()
    }

    #[test]
    fn votes_are_those_of_a_count_of_all_pairs() {
        let transforms = transforms(300);
        let weights: Vec<f64> = (0..300).map(|i| number(i * 3 + 5).abs()).collect();
        let (distance, angle) = (0.4, 0.5);
        let found = Proposals::new(&transforms, weights.clone(), distance, angle).votes();
        for (i, one) in transforms.iter().enumerate() {
            let mut expected = 0.0;
            for (k, other) in transforms.iter().enumerate() {
                let rotation = (one.inverse() * *other).log()[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
                let gap = (one.translation - other.translation).norm() / distance;
                // Unit quaternions of rotations by an angle from each other are 2 sin(angle / 4) apart.
                let chord = 2.0 * (rotation / 4.0).sin() / (0.5 * angle);
                expected += weights[k] * (1.0 - gap * gap - chord * chord).max(0.0);
            }
            assert!((found[i] - expected).abs() < 1e-9, "{i}: {} {expected}", found[i]);
        }
    }

    #[test]
    fn the_most_agreed_transforms_are_the_means_of_their_groups() {
        let near = |twist: [f64; 6], count: usize, seed: usize| {
            (0..count).map(move |i| {
                let small = |k: usize| 0.02 * number(seed + i * 6 + k);
                RigidTransform::exp(twist) * RigidTransform::exp(std::array::from_fn(small))
            })
        };
        // A rotation by almost pi: quaternions of both signs.
        let (large, small) = ([3.1, 0.1, 0.0, 1.0, 2.0, 3.0], [0.0, 0.3, 0.0, -4.0, 0.0, 0.0]);
        let all: Vec<RigidTransform> = near(small, 20, 1).chain(near(large, 60, 999)).collect();
        let proposals = Proposals::new(&all, vec![1.0; 80], 0.5, 0.35);
        let found = Proposals { most: 2, merged: 0.5, ..proposals }.most_agreed();
        for ((found, _), twist) in found.iter().zip([large, small]) {
            let off = (RigidTransform::exp(twist).inverse() * *found).log();
            assert!(off.iter().all(|x| x.abs() < 0.01), "{off:?}");
        }
    }

    #[test]
    fn of_many_transforms_those_that_others_agree_with_come_first() {
        let settings = FindSettings { agreed: 3, ..Default::default() };
        let [distance, angle] = settings.agreed_within;
        let extent = 0.5;
        let truth = RigidTransform::exp([0.4, -1.0, 0.7, 0.2, 0.1, 0.9]);
        // All over the place, but for eight within a third of what agrees.
        let anywhere = |i: usize| RigidTransform::exp(std::array::from_fn(|k| 3.0 * number(i * 6 + k)));
        let near = |i: usize| {
            let of = |k: usize| number(5000 + i * 6 + k) / 5.0;
            let turned = RigidTransform::from_rotation_vector([0, 1, 2].map(|k| angle * of(k)), [0.0; 3]);
            let shift = Vector3::from([3, 4, 5].map(|k| distance * extent * of(k)));
            let rotation = turned.rotation * truth.rotation;
            RigidTransform { rotation, translation: truth.translation + shift }
        };
        let mut all: Vec<RigidTransform> = (0..400).map(anywhere).collect();
        (0..8).for_each(|i| all.insert(50 * i, near(i)));
        let weighted: Vec<(RigidTransform, f64)> = all.iter().map(|one| (*one, 1.0)).collect();
        let found = Proposals::of_weighted(&weighted, extent, &settings).most_agreed();
        assert_eq!(found.len(), 3);
        let gap = (found[0].0.translation - truth.translation).norm();
        let turn = (truth.inverse() * found[0].0).log()[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!(gap < 0.2 * distance * extent && turn < 0.2 * angle, "{gap} {turn}");
    }

    #[test]
    fn matches_with_common_places_of_the_model_count_less() {
        let places = |of: &[usize]| {
            let mut places = FieldPlaces::new(1.0);
            for (i, &which) in of.iter().enumerate() {
                places.vectors.push(std::array::from_fn(|k| f32::from(k == which)));
                places.points.push([i as f64, 0.0, 0.0]);
                places.axes.push([0.0, 0.0, 1.0]);
                places.tangents.push([1.0, 0.0, 0.0]);
                places.phases.push([Default::default(); _]);
            }
            places
        };
        // Two matches for each place of the model in the mean: three and one.
        let weighted = weighted_transforms(&places(&[0, 1]), &places(&[0, 0, 1, 0]), 1);
        let weights: Vec<f64> = weighted.iter().map(|(_, weight)| *weight).collect();
        assert_eq!(weights, [0.4, 0.4, 1.0 / 1.5, 0.4]);
        assert_eq!(weighted[2].0.transform_point([1.0, 0.0, 0.0]), [2.0, 0.0, 0.0]);
    }

    #[test]
    fn different_ones_stay() {
        let at = |angle: f64, x: f64| RigidTransform::from_rotation_vector([0.0, 0.0, angle], [x, 0.0, 0.0]);
        let all = [at(0.0, 0.0), at(0.1, 0.1), at(0.3, 0.1), at(0.0, 0.5), at(0.3, 0.0)];
        let kept = different(all.into_iter(), 9, 0.2, 0.2);
        assert_eq!(kept, [all[0], all[2], all[3]]);
        assert_eq!(different(all.into_iter(), 2, 0.2, 0.2), [all[0], all[2]]);
    }
}
