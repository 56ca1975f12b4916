//! Poses that follow each other, each examined: what that says of the last piece on the first one.

use super::agreement::PiecePair;
use super::examination::Examination;
use super::object_symmetry::{Member, ObjectSymmetry, object_symmetries};
use super::result::{ExaminedPose, PoseEvidence};
use super::{PieceView, RecurrenceSettings};
use crate::alignment::{Alternative, Doubt, FreeDirection, joined_directions};
use crate::geometry::RigidTransform;
use rayon::prelude::*;

/// Alternatives of a chain at most: a cube has 23.
const MOST_ALTERNATIVES: usize = 24;

impl ExaminedPose {
    /// Of a piece on itself.
    fn of_itself() -> Self {
        Self {
            T_target_source: RigidTransform::identity(),
            free_directions: Vec::new(),
            alternatives: Vec::new(),
            evidence: PoseEvidence::of_itself(),
            doubts: Vec::new(),
        }
    }
}

/// The pose of a pair after that of its source on the first piece of the chain, where it is not the first itself.
pub(super) fn chained(
    pair: &PiecePair<'_>,
    link: &RigidTransform,
    examination: Examination,
    before: Option<&ExaminedPose>,
) -> ExaminedPose {
    let first = ExaminedPose::of_itself();
    let before = before.unwrap_or(&first);
    let moved: Vec<FreeDirection> =
        before.free_directions.iter().map(|direction| direction.transformed(link)).collect();
    let free_directions =
        joined_directions(&examination.free_directions, &moved, [0.0; 3], pair.target.extent);
    let mut found = ExaminedPose {
        T_target_source: *link * before.T_target_source,
        alternatives: alternatives(pair, link, &examination, before, &free_directions),
        free_directions,
        evidence: examination.evidence.after(&before.evidence),
        // Those of the pair and before; what they say of the whole chain follows from what is known of it.
        doubts: [&examination.doubts[..], &before.doubts].concat(),
    };
    found.doubts = doubts(&found, pair.settings);
    found
}

/// Adds to the alternatives of each pose those by the symmetries of the object that the pieces of its chain show.
pub(super) fn with_symmetries(
    views: &[&PieceView],
    poses: &[([usize; 2], RigidTransform)],
    found: &mut [ExaminedPose],
    settings: &RecurrenceSettings,
) {
    // Of each pose the piece that its chain begins with.
    let mut begins: Vec<usize> = Vec::with_capacity(poses.len());
    for ([source, _], _) in poses {
        let before = poses[..begins.len()].iter().rposition(|other| other.0[1] == *source);
        begins.push(before.map_or(*source, |number| begins[number]));
    }
    let mut firsts = begins.clone();
    firsts.sort_unstable();
    firsts.dedup();
    let of_first = |&first: &usize| {
        let of_chain = (0..poses.len()).filter(|&number| begins[number] == first);
        let others = of_chain.map(|number| (views[poses[number].0[1]], found[number].T_target_source));
        let members: Vec<Member<'_>> =
            [(views[first], RigidTransform::identity())].into_iter().chain(others).collect();
        (first, object_symmetries(&members, settings))
    };
    let symmetries: Vec<(usize, Vec<ObjectSymmetry>)> = firsts.par_iter().map(of_first).collect();
    for (first, symmetries) in symmetries {
        for number in (0..poses.len()).filter(|&number| begins[number] == first) {
            let pair = PiecePair { source: views[first], target: views[poses[number].0[1]], settings };
            let one = &mut found[number];
            for ObjectSymmetry { motion, explained } in &symmetries {
                let pose = one.T_target_source * *motion;
                let free_space = pair.free_space(&pose);
                let rival = Alternative { T_target_source: pose, explained: *explained, free_space };
                one.add(rival, &pair);
            }
            one.doubts = doubts(one, settings);
        }
    }
}

impl ExaminedPose {
    /// Takes another alternative, if it leads elsewhere than what is known.
    fn add(&mut self, rival: Alternative, pair: &PiecePair<'_>) {
        let known = self.alternatives.iter().map(|known| &known.T_target_source);
        let is_new = known
            .chain([&self.T_target_source])
            .all(|known| pair.is_elsewhere(&rival.T_target_source, known, &self.free_directions));
        if is_new && self.alternatives.len() < MOST_ALTERNATIVES {
            self.alternatives.push(rival);
        }
    }
}

/// Each pose of the pair that explains as much after each one before, but for those that differ by free motions.
fn alternatives(
    pair: &PiecePair<'_>,
    link: &RigidTransform,
    examination: &Examination,
    before: &ExaminedPose,
    free: &[FreeDirection],
) -> Vec<Alternative> {
    let best = *link * before.T_target_source;
    let itself = |transform: RigidTransform, evidence: &PoseEvidence| Alternative {
        T_target_source: transform,
        explained: evidence.explained,
        free_space: evidence.free_space,
    };
    let with_best = |best: Alternative, others: &[Alternative]| [&[best], others].concat();
    let ours = with_best(itself(*link, &examination.evidence), &examination.alternatives);
    let theirs = with_best(itself(before.T_target_source, &before.evidence), &before.alternatives);
    let mut found: Vec<Alternative> = Vec::new();
    for one in &ours {
        for other in &theirs {
            let pose = one.T_target_source * other.T_target_source;
            let known = found.iter().map(|known| &known.T_target_source).chain([&best]);
            let is_new = known.into_iter().all(|known| pair.is_elsewhere(&pose, known, free));
            if is_new && found.len() < MOST_ALTERNATIVES {
                found.push(Alternative {
                    T_target_source: pose,
                    explained: one.explained.min(other.explained),
                    free_space: one.free_space.max(other.free_space),
                });
            }
        }
    }
    found
}

/// What speaks against a pose: what is measured, and doubts of another kind that it already has.
fn doubts(found: &ExaminedPose, settings: &RecurrenceSettings) -> Vec<Doubt> {
    let PoseEvidence { overlap, free_space, scale, scale_standard_error: standard_error, .. } =
        found.evidence;
    let of_kind = |is_kind: fn(&Doubt) -> bool| found.doubts.iter().copied().find(is_kind);
    let mut doubts = Vec::new();
    if overlap < settings.trusted_overlap {
        doubts.push(Doubt::LittleOverlap { overlap });
    }
    if !found.free_directions.is_empty() {
        doubts.push(Doubt::FreeDirections { count: found.free_directions.len() });
    }
    if free_space > settings.doubted_free_space {
        doubts.push(Doubt::FreeSpace { share: free_space });
    }
    if !found.alternatives.is_empty() {
        doubts.push(Doubt::Ambiguous { alternatives: found.alternatives.len() });
    }
    doubts.extend(of_kind(|doubt| matches!(doubt, Doubt::Mirrored { .. })));
    // One size that differs is enough; what it is of the whole chain is known where each pose determines it.
    let size = of_kind(|doubt| matches!(doubt, Doubt::Scale { .. }));
    doubts
        .extend(size.map(|size| if scale.is_nan() { size } else { Doubt::Scale { scale, standard_error } }));
    doubts
}
