//! How well two pieces agree under a pose: each must be what the other's sensor saw.

use super::{PieceView, RecurrenceSettings};
use crate::depth_image::{Counts, DepthImage, ImagePose, Judgement, SurfacePlace};
use crate::geometry::RigidTransform;
use nalgebra::{Matrix3, Vector3};

/// Points of a piece that are judged before it is asked whether the pose can still be good enough.
const BLOCK: usize = 8;

/// By what poses are judged in a stage of the search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage {
    /// Points of each piece, the first ones.
    points: usize,
    /// In units of each piece's own.
    tolerance: f64,
    /// What a contradicted and a missing point count.
    weights: [f64; 2],
}

impl Stage {
    pub fn of_proposals(settings: &RecurrenceSettings) -> Self {
        let (points, tolerance) = (settings.first_points, settings.first_tolerance);
        Self { points, tolerance, weights: settings.coarse_weights }
    }

    pub fn coarse(settings: &RecurrenceSettings) -> Self {
        Self { points: settings.coarse_points, tolerance: 1.0, weights: settings.coarse_weights }
    }

    pub fn fine(settings: &RecurrenceSettings) -> Self {
        Self { points: settings.fine_points, tolerance: 1.0, weights: settings.fine_weights }
    }
}

/// The source and the target of poses T_target_source.
pub(super) struct PiecePair<'a> {
    pub source: &'a PieceView,
    pub target: &'a PieceView,
    pub settings: &'a RecurrenceSettings,
}

/// Points of one piece in the depth image of the other: those judged so far.
struct Side<'a> {
    image: &'a DepthImage,
    pose: ImagePose,
    points: &'a [SurfacePlace],
    tolerance: f32,
    judged: usize,
    counts: Counts,
}

impl<'a> Side<'a> {
    fn new(moving: &'a PieceView, fixed: &'a PieceView, pose: &RigidTransform, stage: &Stage) -> Self {
        Self {
            image: &fixed.image,
            pose: fixed.image.to_image(pose),
            points: &moving.points[..stage.points.min(moving.points.len())],
            tolerance: stage.tolerance as f32 * fixed.tolerance,
            judged: 0,
            counts: Counts::default(),
        }
    }

    fn judge_block(&mut self) {
        let next = self.points.len().min(self.judged + BLOCK);
        self.counts.add(&self.image.count(&self.pose, &self.points[self.judged..next], self.tolerance));
        self.judged = next;
    }

    fn remaining(&self) -> usize {
        self.points.len() - self.judged
    }

    /// Confirmed less wrong points over all of them, if all that remain are confirmed. No rounding makes this less than
    /// what it will be in the end.
    fn bound(&self, weights: [f64; 2]) -> f64 {
        let counts = &self.counts;
        let wrong = weights[0] * f64::from(counts.contradicted)
            + weights[1] * f64::from(counts.missing)
            + f64::from(counts.mismatched);
        let confirmed = f64::from(counts.confirmed) + self.remaining() as f64;
        (confirmed - wrong) / self.points.len().max(1) as f64
    }
}

impl PiecePair<'_> {
    /// The mean of both pieces' confirmed less wrong points, where it is more than `least`: 1 where all is seen from
    /// both sides and agrees.
    ///
    /// Each of the remaining points adds one at most, so that a pose that is not good enough is soon given up.
    pub fn agreement_above(&self, least: f64, pose: &RigidTransform, stage: &Stage) -> Option<f64> {
        let mut sides = [
            Side::new(self.source, self.target, pose, stage),
            Side::new(self.target, self.source, &pose.inverse(), stage),
        ];
        loop {
            sides.iter_mut().for_each(Side::judge_block);
            let bound = 0.5 * (sides[0].bound(stage.weights) + sides[1].bound(stage.weights));
            if bound <= least {
                return None;
            }
            if sides.iter().all(|side| side.remaining() == 0) {
                return Some(bound);
            }
        }
    }

    /// The `count` poses with the best agreement, the best first, of equal ones the first.
    pub fn best(&self, poses: &[RigidTransform], count: usize, stage: &Stage) -> Vec<(RigidTransform, f64)> {
        let mut best: Vec<(RigidTransform, f64)> = Vec::with_capacity(count + 1);
        for pose in poses {
            let least = if best.len() < count {
                f64::NEG_INFINITY
            } else {
                best.last().map_or(f64::INFINITY, |worst| worst.1)
            };
            let Some(agreement) = self.agreement_above(least, pose, stage) else { continue };
            best.truncate(count - 1);
            let position = best.partition_point(|other| other.1 >= agreement);
            best.insert(position, (*pose, agreement));
        }
        best
    }

    /// Judges a pose by all points of both pieces: the source's in the target's depth image, and the other way round.
    pub fn judgements(&self, pose: &RigidTransform) -> [Judgement; 2] {
        let (source, target) = (self.source, self.target);
        [
            target.image.judge(pose, &source.points, target.tolerance),
            source.image.judge(&pose.inverse(), &target.points, source.tolerance),
        ]
    }

    /// The score of a pose by its judgements: their agreement, which counts less where what is confirmed is one plane.
    pub fn score(&self, pose: &RigidTransform, judgements: &[Judgement; 2]) -> f64 {
        let [contradicted, missing] = self.settings.fine_weights;
        let agreement = |shares: &Judgement| {
            f64::from(shares.confirmed)
                - contradicted * f64::from(shares.contradicted)
                - missing * f64::from(shares.missing)
                - f64::from(shares.mismatched)
        };
        0.5 * (agreement(&judgements[0]) + agreement(&judgements[1])) * self.weight(pose)
    }

    /// What the confirmed part of a match counts: less where its normals are those of one plane.
    fn weight(&self, pose: &RigidTransform) -> f64 {
        let found = self.target.image.correspondences(pose, &self.source.points, self.target.tolerance);
        let normals: Vec<[f32; 3]> = found.into_iter().flatten().map(|point| point.normal).collect();
        if normals.is_empty() {
            return 0.0;
        }
        let settings = self.settings;
        let roundness = (spread(&normals) / settings.round_spread).min(1.0);
        settings.planar_weight + (1.0 - settings.planar_weight) * roundness
    }
}

/// Of unit vectors, 1 less the largest eigenvalue of their second moments: 0 where all are along one line.
fn spread(normals: &[[f32; 3]]) -> f64 {
    let vectors = normals.iter().map(|normal| Vector3::from(normal.map(f64::from)));
    let moments = vectors.map(|v| v * v.transpose()).sum::<Matrix3<f64>>() / normals.len().max(1) as f64;
    1.0 - moments.symmetric_eigenvalues().max()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{FLAT, SHEET, sheet};
    use super::*;
    use crate::random::Generator;

    #[test]
    fn giving_up_early_keeps_the_poses_that_are_best_by_all_points() {
        let (source, target) =
            (sheet(SHEET, &RigidTransform::identity()), sheet(FLAT, &RigidTransform::identity()));
        let settings = RecurrenceSettings::default();
        let mut random = Generator::new(&[5]);
        let mut pose = || {
            let [vector, offset] = [0.1, 2.0].map(|scale| [0; 3].map(|_| scale * random.normal()));
            RigidTransform::from_rotation_vector(vector, offset)
        };
        let mut poses: Vec<RigidTransform> = (0..300).map(|_| pose()).collect();
        // Of equal poses the first are kept.
        poses.extend_from_within(..50);
        let pair = PiecePair { source: &source, target: &target, settings: &settings };
        for stage in [Stage::of_proposals(&settings), Stage::coarse(&settings), Stage::fine(&settings)] {
            let agreement = |pose: &RigidTransform| {
                let side = |moving: &PieceView, fixed: &PieceView, pose: &RigidTransform| {
                    let points = &moving.points[..stage.points.min(moving.points.len())];
                    let tolerance = stage.tolerance as f32 * fixed.tolerance;
                    let mut sum = 0.0;
                    for point in points {
                        let found = fixed.image.judge(pose, &[*point], tolerance);
                        let wrong = stage.weights[0] * f64::from(found.contradicted)
                            + stage.weights[1] * f64::from(found.missing)
                            + f64::from(found.mismatched);
                        sum += f64::from(found.confirmed) - wrong;
                    }
                    sum / points.len() as f64
                };
                0.5 * (side(&source, &target, pose) + side(&target, &source, &pose.inverse()))
            };
            let mut slow: Vec<(RigidTransform, f64)> =
                poses.iter().map(|pose| (*pose, agreement(pose))).collect();
            slow.sort_by(|a, b| b.1.total_cmp(&a.1));
            for count in [1, 12, 400] {
                let found = pair.best(&poses, count, &stage);
                assert_eq!(found.len(), count.min(poses.len()));
                for (found, slow) in found.iter().zip(&slow) {
                    assert_eq!(found.0, slow.0);
                    assert!((found.1 - slow.1).abs() < 1e-12);
                }
            }
            assert!(pair.best(&poses, 0, &stage).is_empty());
        }
    }

    #[test]
    fn the_spread_of_normals_is_that_of_their_directions() {
        assert!(spread(&[[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]).abs() < 1e-12);
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!((spread(&axes) - 2.0 / 3.0).abs() < 1e-12);
        assert!((spread(&axes[..2]) - 0.5).abs() < 1e-12);
    }
}
