//! The transform that most matches agree with: each of them proposes a whole one.

use crate::field::{FieldMatch, FieldPlaces};
use crate::geometry::RigidTransform;
use nalgebra::Vector3;
use rayon::prelude::*;

/// When a match agrees with a transform, and how many transforms are tried.
///
/// ```
/// assert_eq!(surfsig::ConsensusSettings::default().proposals, 1000);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConsensusSettings {
    /// Largest distance between a moved place and its correspondence, in radii of a patch: places of a quarter of a
    /// patch apart see mostly the same surface.
    pub max_distance: f64,
    /// Smallest cosine between their axes (37 degrees): axes of noisy patches differ by that at most.
    pub min_cosine: f64,
    /// Matches whose transforms are tried, the most similar first.
    pub proposals: usize,
    /// Times that the best one is fitted again to the places that agree with it; most stay the same after three.
    pub max_refits: usize,
}

impl Default for ConsensusSettings {
    fn default() -> Self {
        Self { max_distance: 0.25, min_cosine: 0.8, proposals: 1000, max_refits: 10 }
    }
}

/// One match: a place of the source and one of the target, with their axes.
#[derive(Debug, Clone, Copy)]
struct Pair {
    source: Vector3<f64>,
    target: Vector3<f64>,
    source_axis: Vector3<f64>,
    target_axis: Vector3<f64>,
}

/// Matched places of two scans with the transforms that they propose, the most similar first.
#[derive(Debug, Clone)]
pub(crate) struct Correspondences {
    pairs: Vec<Pair>,
    proposals: Vec<RigidTransform>,
    similarity: Vec<f32>,
    max_distance: f64,
    settings: ConsensusSettings,
}

impl Correspondences {
    pub fn new(
        matches: &[FieldMatch],
        source: &FieldPlaces,
        target: &FieldPlaces,
        settings: ConsensusSettings,
    ) -> Self {
        let vector = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let pair = |one: &FieldMatch| Pair {
            source: source.points[one.source].into(),
            target: target.points[one.target].into(),
            source_axis: vector(source.axes[one.source]),
            target_axis: vector(target.axes[one.target]),
        };
        Self {
            pairs: matches.iter().map(pair).collect(),
            proposals: matches.iter().map(|one| one.T_target_source).collect(),
            similarity: matches.iter().map(|one| one.distance).collect(),
            max_distance: settings.max_distance * source.radius,
            settings,
        }
    }

    /// These and others of the same two scans, the most similar first.
    #[must_use]
    pub fn joined(mut self, other: Self) -> Self {
        self.pairs.extend(other.pairs);
        self.proposals.extend(other.proposals);
        self.similarity.extend(other.similarity);
        let mut order: Vec<usize> = (0..self.pairs.len()).collect();
        order.sort_by(|&a, &b| self.similarity[a].total_cmp(&self.similarity[b]));
        self.pairs = order.iter().map(|&i| self.pairs[i]).collect();
        self.proposals = order.iter().map(|&i| self.proposals[i]).collect();
        self.similarity = order.iter().map(|&i| self.similarity[i]).collect();
        self
    }

    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Which of them agree with a transform.
    pub fn inliers(&self, transform: &RigidTransform) -> Vec<bool> {
        self.pairs.iter().map(|pair| self.closeness(pair, transform) > 0.0).collect()
    }

    /// How many of them agree with a transform.
    pub fn inlier_count(&self, transform: &RigidTransform) -> usize {
        self.inliers(transform).into_iter().filter(|&agrees| agrees).count()
    }

    /// 1 where a transform takes the place onto its correspondence, 0 from the largest distance on.
    fn closeness(&self, pair: &Pair, transform: &RigidTransform) -> f64 {
        let gap = transform.rotation * pair.source + transform.translation - pair.target;
        let closeness = 1.0 - gap.norm_squared() / self.max_distance.powi(2);
        let cosine = (transform.rotation * pair.source_axis).dot(&pair.target_axis);
        if cosine > self.settings.min_cosine { closeness.max(0.0) } else { 0.0 }
    }

    /// The proposed transforms that most matches agree with, close ones counting more, the best first; each is fitted
    /// again to the matches that agree.
    ///
    /// At least the best one is given, and up to `rivals` more of at least `least_share` of its score; they carry the
    /// source's places `distance` apart in the root mean square. The identity where there is no match.
    pub fn agreed_transforms(&self, rivals: usize, least_share: f64, distance: f64) -> Vec<RigidTransform> {
        let score = |proposal: &RigidTransform| -> f64 {
            self.pairs.iter().map(|pair| self.closeness(pair, proposal)).sum()
        };
        let tried = &self.proposals[..self.proposals.len().min(self.settings.proposals)];
        let scores: Vec<f64> = tried.par_iter().with_min_len(8).map(score).collect();
        let mut order: Vec<usize> = (0..tried.len()).collect();
        // A stable sort: of equal scores the more similar match comes first.
        order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
        let mut chosen: Vec<RigidTransform> = Vec::new();
        for &number in &order {
            let is_weak = scores[number] < least_share * scores[order[0]];
            if chosen.len() > rivals || (!chosen.is_empty() && is_weak) {
                break;
            }
            let places = || self.pairs.iter().map(|pair| pair.source.into());
            let is_distinct =
                |other: &RigidTransform| tried[number].displacement_from(other, places()) > distance;
            if chosen.iter().all(is_distinct) {
                chosen.push(self.refitted(tried[number]));
            }
        }
        if chosen.is_empty() { vec![RigidTransform::identity()] } else { chosen }
    }

    /// The one that most matches agree with.
    pub fn agreed_transform(&self) -> RigidTransform {
        self.agreed_transforms(0, 1.0, 0.0).swap_remove(0)
    }

    fn refitted(&self, mut transform: RigidTransform) -> RigidTransform {
        let mut agree = self.inliers(&transform);
        for _ in 0..self.settings.max_refits {
            let chosen =
                || self.pairs.iter().zip(&agree).filter(|(_, agrees)| **agrees).map(|(pair, _)| pair);
            let (source, target): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
                chosen().map(|pair| (<[f64; 3]>::from(pair.source), <[f64; 3]>::from(pair.target))).unzip();
            if source.len() < 3 {
                break;
            }
            let again = RigidTransform::from_correspondences(&source, &target);
            let now = self.inliers(&again);
            if now.iter().filter(|&&agrees| agrees).count() < source.len() {
                break;
            }
            transform = again;
            if now == agree {
                break;
            }
            agree = now;
        }
        transform
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(i: usize) -> f64 {
        (i as f64 * 12.9898).sin() * 43_758.545_3 % 1.0
    }

    /// Places of which every `right_of`-th match is right, the others are anywhere.
    fn scene(count: usize, right_of: usize, truth: &RigidTransform) -> Correspondences {
        let (mut source, mut target) = (FieldPlaces::new(1.0), FieldPlaces::new(1.0));
        let mut matches = Vec::new();
        for i in 0..count {
            let point = [number(i * 9), number(i * 9 + 1), number(i * 9 + 2)].map(|c| 10.0 * c);
            let axis = Vector3::new(number(i * 9 + 3), number(i * 9 + 4), number(i * 9 + 5)).normalize();
            let is_right = i % right_of == 0;
            let wrong = RigidTransform::from_rotation_vector(point, [number(i * 9 + 6) * 10.0, 3.0, -2.0]);
            let proposal = if is_right { *truth } else { wrong };
            source.points.push(point);
            source.axes.push(axis.map(|c| c as f32).into());
            target.points.push(proposal.transform_point(point));
            target.axes.push(proposal.transform_vector(axis.into()).map(|c| c as f32));
            matches.push(FieldMatch {
                source: i,
                target: i,
                distance: number(i * 9 + 7).abs() as f32,
                T_target_source: proposal,
            });
        }
        Correspondences::new(&matches, &source, &target, ConsensusSettings::default())
    }

    #[test]
    fn the_transform_of_the_few_right_matches_is_found() {
        let truth = RigidTransform::from_rotation_vector([0.5, 0.2, -1.0], [3.0, 1.0, -2.0]);
        let matches = scene(300, 12, &truth);
        let found = matches.agreed_transform();
        assert!((truth.inverse() * found).log().iter().all(|c| c.abs() < 1e-6));
        assert!(matches.inlier_count(&found) >= 25);
        assert_eq!(matches.inliers(&found).iter().step_by(12).filter(|&&agrees| agrees).count(), 25);
    }

    #[test]
    fn a_rival_is_another_transform_that_many_agree_with() {
        let truth = RigidTransform::from_rotation_vector([0.5, 0.2, -1.0], [3.0, 1.0, -2.0]);
        let other = RigidTransform::from_rotation_vector([0.0, 0.0, 2.0], [-4.0, 0.0, 1.0]);
        let both = scene(90, 3, &truth).joined(scene(80, 4, &other));
        let found = both.agreed_transforms(5, 0.5, 1.0);
        assert_eq!(found.len(), 2);
        for (found, truth) in found.iter().zip([truth, other]) {
            assert!((truth.inverse() * *found).log().iter().all(|c| c.abs() < 1e-6));
        }
        assert_eq!(both.agreed_transforms(0, 0.5, 1.0), found[..1]);
        assert_eq!(both.agreed_transforms(5, 0.8, 1.0), found[..1], "20 matches are few beside 30");
    }

    #[test]
    fn joined_matches_come_in_the_order_of_similarity() {
        let truth = RigidTransform::identity();
        let joined = scene(20, 2, &truth).joined(scene(11, 2, &truth));
        assert_eq!(joined.len(), 31);
        assert!(joined.similarity.is_sorted());
    }

    #[test]
    fn without_matches_nothing_is_moved() {
        assert_eq!(
            scene(0, 1, &RigidTransform::identity()).agreed_transforms(3, 0.3, 1.0),
            [RigidTransform::identity()]
        );
    }
}
