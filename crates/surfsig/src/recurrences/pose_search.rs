//! The search for the pose that two pieces agree with most: proposals, random changes, least squares.

use super::agreement::{PiecePair, Stage};
use super::point_pairs::proposed_poses;
use super::{PieceAlignment, PieceView, RecurrenceSettings};
use crate::geometry::RigidTransform;
use crate::random::Generator;

/// What the changes of the first round are multiplied by in each further one.
const CHANGE_PER_ROUND: f64 = 0.5;

/// Finds the pose T_target_source that both pieces agree with most; `None` where none is proposed, or none is any good.
/// `key` is that of the random choices.
pub(super) fn align(pair: &PiecePair<'_>, key: &[u64]) -> Option<PieceAlignment> {
    let settings = pair.settings;
    let mut random = Generator::new(key);
    let proposed = proposed_poses(&pair.source.pairs, &pair.target.pairs, settings, &mut random);
    let tried = poses_of(pair.best(&proposed, settings.tried, &Stage::of_proposals(settings)));
    let coarse = Stage::coarse(settings);
    let mut kept = pair.best(&tried, settings.kept, &coarse);
    for round in 0..settings.coarse_rounds {
        let candidates = mutated(poses_of(kept), pair.target, round, settings, &mut random);
        kept = pair.best(&candidates, settings.kept, &coarse);
    }
    let (_, best) = kept.first()?;
    if *best < settings.min_coarse_score {
        return None;
    }
    let mut poses = poses_of(kept);
    for number in 0..poses.len().min(settings.kept.div_ceil(2)) {
        poses.push(pair.fitted(&poses[number], settings.fine_points));
    }
    search_around(pair, poses, &mut random)
}

/// Searches around good poses T_target_source for the one that both pieces agree with most; `None` where none is given.
pub(super) fn refined(pair: &PiecePair<'_>, poses: &[RigidTransform], key: &[u64]) -> Option<PieceAlignment> {
    search_around(pair, poses.to_vec(), &mut Generator::new(key))
}

fn search_around(
    pair: &PiecePair<'_>,
    mut poses: Vec<RigidTransform>,
    random: &mut Generator,
) -> Option<PieceAlignment> {
    let settings = pair.settings;
    let fine = Stage::fine(settings);
    for round in 0..settings.fine_rounds {
        // Half as many after two rounds, a quarter of these after two more; one at least.
        let kept = (settings.kept >> (1 + round / 2)).max(1);
        let best = poses_of(pair.best(&poses, kept, &fine));
        let first_round = settings.coarse_rounds.saturating_sub(2);
        poses = mutated(best, pair.target, first_round + round, settings, random);
    }
    let (best, _) = *pair.best(&poses, 1, &fine).first()?;
    let [searched, fitted] = [best, pair.fitted(&best, usize::MAX)].map(|pose| measured(pair, &pose));
    Some(if fitted.score > searched.score { fitted } else { searched })
}

/// Judges a pose T_target_source by all points of both pieces.
pub(super) fn measured(pair: &PiecePair<'_>, pose: &RigidTransform) -> PieceAlignment {
    let judgements = pair.judgements(pose);
    PieceAlignment { T_target_source: *pose, judgements, score: pair.score(pose, &judgements) }
}

/// The poses, and changes of each at random: a rotation about the target's centre, and a translation.
pub(super) fn mutated(
    mut poses: Vec<RigidTransform>,
    target: &PieceView,
    round: usize,
    settings: &RecurrenceSettings,
    random: &mut Generator,
) -> Vec<RigidTransform> {
    let scale = CHANGE_PER_ROUND.powi(i32::try_from(round).unwrap_or(i32::MAX));
    let rotation = scale * settings.rotation_deviation;
    let translation = scale * settings.translation_deviation * target.extent;
    for number in 0..poses.len() {
        let pose = poses[number];
        for _ in 0..settings.mutations {
            let [vector, offset] =
                [rotation, translation].map(|deviation| [0; 3].map(|_| deviation * random.normal()));
            poses.push(RigidTransform::from_rotation_vector(vector, offset) * pose);
        }
    }
    poses
}

fn poses_of(scored: Vec<(RigidTransform, f64)>) -> Vec<RigidTransform> {
    scored.into_iter().map(|(pose, _)| pose).collect()
}
