//! The maps of a sequence: the present one, one on trial beside it, and those before.

use super::deskewing::{MeasuredScan, MotionWithin};
use super::pose_covariance::Covariance;
use super::segment::{FoundLoop, FoundPose, Segment};
use super::settings::OdometrySettings;
use super::tracker::Step;
use crate::RigidTransform;
use nalgebra::Vector6;

/// What a scan has led to.
#[derive(Default)]
pub(super) struct Followed {
    /// Poses of this scan and of earlier ones.
    pub found: Vec<FoundPose>,
    /// Scans whose poses were wrong.
    pub disproved: Vec<usize>,
    /// Loops that the scan has closed, about the sensors.
    pub loops: Vec<FoundLoop>,
    /// Whether too little of the scan was left to align it.
    pub is_thin: bool,
}

/// The last scan with a pose before another map was begun; lengths are in the scans' unit.
#[allow(non_snake_case)]
struct Anchor {
    scan: usize,
    measured: MeasuredScan,
    T_world_sensor: RigidTransform,
    covariance: Covariance,
    /// From this scan to the next one.
    motion: [f64; 6],
}

/// A map on trial, and the steps through it.
struct Candidate {
    segment: Segment,
    steps: Vec<Step>,
}

/// The maps of a sequence.
pub(super) struct Segments {
    settings: OdometrySettings,
    /// The present one is the last.
    segments: Vec<Segment>,
    candidate: Option<Candidate>,
    anchor: Option<Anchor>,
    /// Scans so far.
    count: usize,
    /// Worlds so far.
    worlds: usize,
    /// Scans that have been lost since the last one with a pose: they are searched in one map each.
    lost: usize,
    /// The last scan that was looked for in a past map to close a loop.
    last_loop_search: Option<usize>,
}

impl Segments {
    pub fn new(settings: &OdometrySettings) -> Self {
        Self {
            settings: settings.clone(),
            segments: Vec::new(),
            candidate: None,
            anchor: None,
            count: 0,
            worlds: 0,
            lost: 0,
            last_loop_search: None,
        }
    }

    /// Edge of the voxels of the present map.
    pub fn voxel(&self) -> Option<f64> {
        self.segments.last().map(|segment| segment.scale.voxel)
    }

    /// Takes the next scan, if it is one.
    pub fn follow(&mut self, scan: Option<MeasuredScan>) -> Followed {
        let number = self.count;
        self.count += 1;
        let Some(measured) = scan else {
            self.segments.iter_mut().for_each(|segment| drop(segment.follow(None)));
            self.candidate = None;
            return Followed { is_thin: true, ..Followed::default() };
        };
        if self.segments.is_empty() {
            let segment = Segment::new(self.worlds, number, &measured.points, &self.settings);
            if segment.thinned(&measured, &self.settings).is_none() {
                return Followed { is_thin: true, ..Followed::default() };
            }
            self.segments.push(segment);
            self.worlds += 1;
        }
        let count = self.segments.len();
        let (past, present) = self.segments.split_at_mut(count - 1);
        let segment = &mut present[0];
        let scan = segment.thinned(&measured, &self.settings);
        let mut followed = Followed { is_thin: scan.is_none(), ..Followed::default() };
        let turn = turn_to_search(past, segment, self.lost);
        segment.tracker.search_keyframes(turn == Turn::Present);
        let is_unfit = segment.is_unfit(scan.as_ref(), measured.points.len(), &self.settings);
        let steps = segment.follow(scan.as_ref());
        followed.disproved =
            segment.tracker.take_disproved().into_iter().map(|step| segment.first + step).collect();
        followed.loops = segment.take_loops();
        let between = self.settings.relocalisation.scans_between_loops;
        let is_due = self.last_loop_search.is_none_or(|last| number >= last + between);
        if is_due
            && followed.loops.is_empty()
            && segment.tracker.is_at_sure_keyframe()
            && let Some(step) = steps.last().filter(|step| segment.first + step.number == number)
            && let Some((past, expected)) = past_around(past, segment, step, &self.settings)
        {
            self.last_loop_search = Some(number);
            let found = closed_with_past(past, &expected, segment, &measured, step, &self.settings);
            followed.loops.extend(found);
        }
        followed.found = steps.iter().map(|step| segment.found(step)).collect();
        let searched = match turn {
            Turn::Past(index) if steps.is_empty() => Some(index),
            _ => None,
        };
        if let Some((index, found)) = search_past(past, &measured, searched, &self.settings) {
            self.lost = 0;
            followed.is_thin = false;
            if let Some((around, closed)) = self.closed_around(index, &measured, &found) {
                followed.found = around;
                followed.loops.push(closed);
            }
            followed.found.extend(found);
            let segment = self.segments.remove(index);
            self.leave_present();
            self.segments.push(segment);
            self.candidate = None;
            return followed;
        }
        self.lost = if steps.is_empty() { self.lost + 1 } else { 0 };
        if steps.is_empty() || is_unfit {
            let needed = match steps.is_empty() {
                true => self.settings.segments.scans_lost,
                false => self.settings.segments.scans_unfit,
            };
            self.try_another_map(&measured, needed, &mut followed);
        } else {
            self.candidate = None;
        }
        if let (None, Some(step)) = (&self.candidate, steps.last()) {
            self.remember(number, measured, step);
        }
        followed
    }

    /// The loop that a scan closes which is found in a past map, where a map on trial leads around to it from the last scan
    /// that had a pose; and the poses of the scans between.
    #[allow(non_snake_case)]
    fn closed_around(
        &mut self,
        index: usize,
        measured: &MeasuredScan,
        found: &[FoundPose],
    ) -> Option<(Vec<FoundPose>, FoundLoop)> {
        let Candidate { mut segment, mut steps } = self.candidate.take()?;
        let (past, present) = (self.segments.get(index)?, self.segments.last()?);
        let first = found.first().filter(|first| first.segment == present.number)?;
        let scan = segment.thinned(measured, &self.settings)?;
        steps.extend(segment.follow(Some(&scan)));
        let (T_world_map, covariance) = self.in_present_world(&segment)?;
        (segment.number, segment.origin) = (present.number, present.origin);
        (segment.T_world_map, segment.covariance) = (T_world_map, covariance);
        let at_first = steps.iter().position(|step| segment.first + step.number == first.scan)?;
        let (earlier, T_world_earlier) = past.keyframe_next_to(&first.T_world_sensor)?;
        let closed = FoundLoop {
            scan: first.scan,
            earlier,
            origin: segment.origin,
            T_earlier_scan: T_world_earlier.inverse() * first.T_world_sensor,
            T_world_scan_before: segment.in_world(&steps[at_first]).0,
        };
        Some((steps[..at_first].iter().map(|step| segment.found(step)).collect(), closed))
    }

    /// The present map becomes one of the past, in which only a search finds the sensor again.
    fn leave_present(&mut self) {
        if let Some(present) = self.segments.last_mut() {
            present.tracker.leave();
            present.tracked = 0;
        }
        if self.segments.len() > self.settings.segments.max_kept {
            self.segments.remove(0);
        }
    }

    fn remember(&mut self, scan: usize, measured: MeasuredScan, step: &Step) {
        let Some(segment) = self.segments.last().filter(|segment| segment.first + step.number == scan) else {
            return;
        };
        let (pose, covariance) = segment.in_world(step);
        let mut motion = segment.tracker.motion();
        motion.translation *= segment.scale.voxel;
        self.anchor = Some(Anchor { scan, measured, T_world_sensor: pose, covariance, motion: motion.log() });
    }

    /// Follows the scan through a map that was begun when the present one failed.
    fn try_another_map(&mut self, measured: &MeasuredScan, needed: usize, followed: &mut Followed) {
        let number = self.count - 1;
        if let Some(candidate) = &mut self.candidate {
            let scan = candidate.segment.thinned(measured, &self.settings);
            let steps = candidate.segment.follow(scan.as_ref());
            if steps.is_empty() {
                self.candidate = None;
            } else {
                candidate.steps.extend(steps);
            }
        }
        if self.candidate.is_none() {
            let mut segment = Segment::new(self.worlds, number, &measured.points, &self.settings);
            let ratio = self.voxel().map_or(f64::INFINITY, |voxel| (segment.scale.voxel / voxel).ln().abs());
            if needed == self.settings.segments.scans_unfit && ratio < self.settings.segments.least_ratio.ln()
            {
                return;
            }
            // A scan that is lost in a map of its own ends that: nothing is searched there.
            segment.tracker.search_keyframes(false);
            let scan = segment.thinned(measured, &self.settings);
            let steps = segment.follow(scan.as_ref());
            if steps.is_empty() {
                return;
            }
            self.candidate = Some(Candidate { segment, steps });
        }
        if self.candidate.as_ref().is_some_and(|candidate| candidate.segment.tracked >= needed) {
            self.go_on_in_another_map(followed);
        }
    }

    /// Puts the map on trial in the present one's place, in the same world where the scan before lies in it.
    fn go_on_in_another_map(&mut self, followed: &mut Followed) {
        let Some(Candidate { mut segment, steps }) = self.candidate.take() else { return };
        if let (Some(present), Some((pose, covariance))) =
            (self.segments.last(), self.in_present_world(&segment))
        {
            (segment.number, segment.origin) = (present.number, present.origin);
            (segment.T_world_map, segment.covariance) = (pose, covariance);
        } else {
            self.worlds += 1;
        }
        followed.found = steps.iter().map(|step| segment.found(step)).collect();
        followed.is_thin = false;
        self.leave_present();
        self.segments.push(segment);
    }

    /// The pose of another map in the present one's world, and what it is off by, where the last scan with a pose lies in
    /// it.
    fn in_present_world(&self, segment: &Segment) -> Option<(RigidTransform, Covariance)> {
        let anchor = self.anchor.as_ref()?;
        let (transform, covariance) = self.joined(anchor, segment)?;
        Some((anchor.T_world_sensor * transform.inverse(), covariance))
    }

    /// The pose of the scan before in another map, in the scans' unit, and what the map's pose in the world is off by.
    fn joined(&self, anchor: &Anchor, segment: &Segment) -> Option<(RigidTransform, Covariance)> {
        let within = MotionWithin {
            twist: Vector6::from_fn(|k, _| anchor.motion[k] / if k < 3 { 1.0 } else { segment.scale.voxel }),
            ..segment.tracker.expected_within()
        };
        let scan = segment.thinned_with(&anchor.measured, within, &self.settings)?;
        let steps = segment.first.abs_diff(anchor.scan) as f64;
        let mut expected = RigidTransform::exp(anchor.motion.map(|component| -steps * component));
        expected.translation /= segment.scale.voxel;
        let found = segment.tracker.located(&scan, &[expected, RigidTransform::identity()])?;
        let mut transform = found.T_map_scan;
        transform.translation *= segment.scale.voxel;
        let of_pose =
            Covariance { random: found.covariance, systematic: found.systematic, ..Covariance::zeros() };
        let both = anchor.covariance.and(&of_pose.scaled(segment.scale.voxel));
        Some((transform, both.carried(&transform)))
    }
}

/// The latest past map of the same world with a keyframe near a scan, of scans that are long ago, and where the scan is
/// expected in it.
fn past_around<'a>(
    past: &'a [Segment],
    present: &Segment,
    step: &Step,
    settings: &OdometrySettings,
) -> Option<(&'a Segment, RigidTransform)> {
    let (pose, _) = present.in_world(step);
    let before = before_loop(present, step, settings);
    past.iter().rev().filter(|past| past.number == present.number && past.first < before).find_map(|past| {
        let mut expected = past.T_world_map.inverse() * pose;
        expected.translation /= past.scale.voxel;
        past.tracker.has_keyframe_near(&expected, before - past.first).then_some((past, expected))
    })
}

/// The scan from which on keyframes are not long ago.
fn before_loop(present: &Segment, step: &Step, settings: &OdometrySettings) -> usize {
    (present.first + step.number).saturating_sub(settings.relocalisation.scans_apart as usize)
}

/// The loop that a scan closes where it lies on a past map, onto which the present map is moved.
#[allow(non_snake_case)]
fn closed_with_past(
    past: &Segment,
    expected: &RigidTransform,
    present: &mut Segment,
    measured: &MeasuredScan,
    step: &Step,
    settings: &OdometrySettings,
) -> Option<FoundLoop> {
    let within = present.tracker.expected_within();
    let factor = present.scale.voxel / past.scale.voxel;
    let twist = Vector6::from_fn(|k, _| within.twist[k] * if k < 3 { 1.0 } else { factor });
    let within = MotionWithin { twist, ..past.tracker.expected_within() };
    let thinned = past.thinned_with(measured, within, settings)?;
    let before = before_loop(present, step, settings) - past.first;
    let (there, keyframe, earlier) = past.tracker.seen_again(&thinned, expected, before)?;
    let in_unit = |mut transform: RigidTransform| {
        transform.translation *= past.scale.voxel;
        transform
    };
    let (T_world_scan_before, _) = present.in_world(step);
    let mut of_scan = step.T_map_scan;
    of_scan.translation *= present.scale.voxel;
    present.T_world_map = past.T_world_map * in_unit(there.T_map_scan) * of_scan.inverse();
    Some(FoundLoop {
        scan: present.first + step.number,
        earlier: past.first + earlier,
        origin: present.origin,
        T_earlier_scan: in_unit(keyframe.inverse() * there.T_map_scan),
        T_world_scan_before,
    })
}

/// The map whose keyframes a scan is searched among: the present one's first, for a search costs several tracked scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Turn {
    Present,
    Past(usize),
}

fn turn_to_search(past: &[Segment], present: &Segment, lost: usize) -> Turn {
    let on_trial: Vec<bool> = past.iter().map(|segment| segment.tracker.is_on_trial()).collect();
    turn_of(&on_trial, present.tracker.is_on_trial(), lost)
}

/// A trial goes on with the next scan; otherwise it is another map's turn, the latest first.
fn turn_of(past_on_trial: &[bool], is_present_on_trial: bool, lost: usize) -> Turn {
    if is_present_on_trial {
        return Turn::Present;
    }
    let on_trial = past_on_trial.iter().position(|is_on_trial| *is_on_trial);
    let count = past_on_trial.len();
    let by_turns = (lost % (count + 1)).checked_sub(1).map(|turn| count - 1 - turn);
    on_trial.or(by_turns).map_or(Turn::Present, Turn::Past)
}

/// Searches a scan in one of the past maps, in which it then goes on: its index, and the poses that are found.
fn search_past(
    past: &mut [Segment],
    measured: &MeasuredScan,
    searched: Option<usize>,
    settings: &OdometrySettings,
) -> Option<(usize, Vec<FoundPose>)> {
    let others = past.iter_mut().enumerate().filter(|(index, _)| Some(*index) != searched);
    others.for_each(|(_, segment)| segment.tracker.skip());
    let chosen = searched?;
    let segment = &mut past[chosen];
    segment.tracker.search_keyframes(true);
    let scan = segment.thinned(measured, settings);
    let steps = segment.follow(scan.as_ref());
    (!steps.is_empty()).then(|| (chosen, steps.iter().map(|step| segment.found(step)).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_searched_by_turns_but_for_one_on_trial() {
        let turns: Vec<Turn> = (0..5).map(|lost| turn_of(&[false; 3], false, lost)).collect();
        assert_eq!(turns, [Turn::Present, Turn::Past(2), Turn::Past(1), Turn::Past(0), Turn::Present]);
        assert!((0..5).all(|lost| turn_of(&[], false, lost) == Turn::Present));
        assert!((0..5).all(|lost| turn_of(&[false, true, false], false, lost) == Turn::Past(1)));
        assert!((0..5).all(|lost| turn_of(&[false, true, false], true, lost) == Turn::Present));
    }
}
