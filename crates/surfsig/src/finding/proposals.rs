//! Transforms of a model that many places of a scene propose.
//!
//! Proposals are points in seven dimensions, translation and unit quaternion, scaled so that those within a distance of
//! 1 agree; the most agreed ones are the modes of their density (pose clustering: Stockman, Object recognition and
//! localization via pose clustering, 1987).

use super::FindSettings;
use crate::FieldPlaces;
use crate::field::{match_fields, similar_places};
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

/// Proposals that a thread counts votes for at a time.
const PART: usize = 64;

/// Proposed transforms and how much each counts.
struct Proposals {
    translations: Vec<[f64; 3]>,
    rotations: Vec<UnitQuaternion<f64>>,
    weights: Vec<f64>,
    tree: KdTree,
    /// Between translations that agree.
    distance: f64,
    /// Between quaternions of rotations that agree: the angle between these is twice that of the quaternions.
    chord: f64,
}

impl Proposals {
    fn new(transforms: &[RigidTransform], weights: Vec<f64>, distance: f64, angle: f64) -> Self {
        let translations: Vec<[f64; 3]> = transforms.iter().map(|one| one.translation.into()).collect();
        let quaternion = |one: &RigidTransform| {
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(one.rotation))
        };
        Self {
            rotations: transforms.iter().map(quaternion).collect(),
            weights,
            tree: KdTree::new(&translations),
            translations,
            distance,
            chord: 0.5 * angle,
        }
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

    /// Of each proposal the weights of those that agree with it, close ones counting more.
    fn votes(&self) -> Vec<f64> {
        let of_one = |(near, found): &mut (Vec<u32>, Vec<(usize, f64)>), one: usize| {
            self.agreeing(one, near, found);
            found.iter().map(|&(other, square)| self.weights[other] * (1.0 - square)).sum()
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

    /// The most agreed transforms, of those within `merged` of each other only the most agreed one.
    fn most_agreed(&self, count: usize, merged: f64) -> Vec<RigidTransform> {
        let votes = self.votes();
        let mut order: Vec<usize> = (0..votes.len()).collect();
        order.sort_by(|&a, &b| votes[b].total_cmp(&votes[a]));
        let mut is_left = vec![true; votes.len()];
        let (mut near, mut found, mut chosen) = (Vec::new(), Vec::new(), Vec::new());
        for one in order {
            if chosen.len() == count {
                break;
            }
            if is_left[one] {
                self.agreeing(one, &mut near, &mut found);
                chosen.push(self.mean(one, &found));
                let same = found.iter().filter(|(_, square)| *square < merged * merged);
                same.for_each(|&(other, _)| is_left[other] = false);
            }
        }
        chosen
    }
}

/// T_scene_model, the most agreed first.
///
/// Each place of the scene proposes one, by the place of the model that it is most similar to. A proposal counts the
/// others that agree with it, each by how similar its two places are; a place of the model that much of the scene is
/// similar to counts less.
pub(super) fn proposed_transforms(
    model: &FieldPlaces,
    scene: &FieldPlaces,
    settings: &FindSettings,
) -> Vec<RigidTransform> {
    let matches = match_fields(scene, model, false);
    let mut counts = vec![0.0_f64; model.len()];
    matches.iter().for_each(|one| counts[one.target] += 1.0);
    let weight = |one: &crate::FieldMatch| {
        let similarity = (1.0 - 0.5 * f64::from(one.distance).powi(2)).max(0.0);
        similarity / counts[one.target]
    };
    let transforms: Vec<RigidTransform> = matches.iter().map(|one| one.T_target_source.inverse()).collect();
    let [distance, angle] = settings.agreement;
    let weights = matches.iter().map(weight).collect();
    let proposals = Proposals::new(&transforms, weights, distance * model.radius, angle);
    proposals.most_agreed(settings.proposals, settings.merged_share)
}

/// T_scene_model by each place of the scene and each of the places of the model that are most similar to it. Many are
/// wrong: they are for a judgement that costs little.
pub(super) fn raw_transforms(model: &FieldPlaces, scene: &FieldPlaces, count: usize) -> Vec<RigidTransform> {
    similar_places(scene, model, count).par_iter().map(|one| one.T_target_source.inverse()).collect()
}

/// The transforms that most others agree with, by the model's extent; each counts the same. Of those that agree with one
/// another only one is given, so that a turn about an axis that hardly shows is tried at many angles.
pub(super) fn most_agreed(
    transforms: &[RigidTransform],
    extent: f64,
    settings: &FindSettings,
) -> Vec<RigidTransform> {
    let [distance, angle] = settings.agreed_within;
    let proposals = Proposals::new(transforms, vec![1.0; transforms.len()], distance * extent, angle);
    proposals.most_agreed(settings.agreed, 1.0)
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
        let found = Proposals::new(&all, vec![1.0; 80], 0.5, 0.35).most_agreed(2, 0.5);
        for (found, twist) in found.iter().zip([large, small]) {
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
        let found = most_agreed(&all, extent, &settings);
        assert_eq!(found.len(), 3);
        let gap = (found[0].translation - truth.translation).norm();
        let turn = (truth.inverse() * found[0]).log()[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!(gap < 0.2 * distance * extent && turn < 0.2 * angle, "{gap} {turn}");
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
