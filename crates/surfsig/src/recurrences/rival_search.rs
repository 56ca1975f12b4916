//! Poses that lead elsewhere than the best one: proposed ones, each the best around, brought near by random changes.

use super::RecurrenceSettings;
use super::agreement::{PiecePair, Stage};
use super::point_pairs::proposed_poses;
use super::pose_search::mutated;
use crate::geometry::RigidTransform;
use crate::random::Generator;

impl PiecePair<'_> {
    /// Rivals of a pose T_target_source, those that both pieces agree with most first; `leads_elsewhere` tells of two poses
    /// whether they differ.
    pub fn rivals(
        &self,
        best: &RigidTransform,
        leads_elsewhere: impl Fn(&RigidTransform, &RigidTransform) -> bool,
        random: &mut Generator,
    ) -> Vec<RigidTransform> {
        let settings = self.settings;
        let few = RecurrenceSettings { proposals: settings.rival_proposals, ..settings.clone() };
        let proposed = proposed_poses(&self.source.pairs, &self.target.pairs, &few, random);
        let stage = Stage::of_proposals(settings);
        // What more speaks against than for leads nowhere.
        let scored = |pose: RigidTransform| Some((self.agreement_above(0.0, &pose, &stage)?, pose));
        let mut scored: Vec<(f64, RigidTransform)> = proposed.into_iter().filter_map(scored).collect();
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut starts: Vec<RigidTransform> = Vec::new();
        for (_, pose) in scored {
            if starts.len() == settings.rivals.proposals {
                break;
            }
            if starts.iter().chain([best]).all(|other| leads_elsewhere(&pose, other)) {
                starts.push(pose);
            }
        }
        let coarse = Stage::coarse(settings);
        let refined = |start: RigidTransform| {
            let mut kept = vec![start];
            for round in 0..settings.rival_rounds {
                let candidates = mutated(kept, self.target, round, settings, random);
                kept = self.best(&candidates, 1, &coarse).into_iter().map(|(pose, _)| pose).collect();
            }
            kept.first().map(|pose| self.fitted(pose, settings.fine_points))
        };
        starts.into_iter().filter_map(refined).collect()
    }
}
