//! What is done with a sensor that is lost.

/// When another map is begun: where a sensor stays lost, or the lengths that were taken from the first scan do not fit
/// those that follow.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentSettings {
    /// Scans that follow each other through a map of their own, while they are lost in the present one, after which it
    /// takes the present one's place: so many may be lost by something that is over soon.
    pub scans_lost: usize,
    /// The same, where the present lengths do not fit.
    pub scans_unfit: usize,
    /// Share of the voxels that a scan should fill, below which voxels are too large for it.
    pub least_filled: f64,
    /// Voxels that a scan fills, in those that one should, above which they are too small, and take too much time.
    pub most_filled: f64,
    /// Factor between the present voxels and those that a scan would have, below which another map is not worth it.
    pub least_ratio: f64,
    /// Past maps that are kept, to find the sensor again.
    pub max_kept: usize,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        Self {
            scans_lost: 5,
            scans_unfit: 3,
            least_filled: 0.25,
            most_filled: 2.0,
            least_ratio: 1.5,
            max_kept: 8,
        }
    }
}

/// How a sensor that was lost is found again: among keyframes, by the signatures of their keypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct RelocalisationSettings {
    /// Distance between keyframes, in median ranges.
    pub keyframe_distance: f64,
    /// Rotation between keyframes nearer than that, in radians.
    pub keyframe_rotation: f64,
    /// Keyframes that are searched for one scan, at most: the nearest to where the sensor was last, and as many others,
    /// those first that see about as far, so that a search costs a few tracked scans.
    pub max_keyframes: usize,
    /// Of these, keyframes whose keypoints are described for one scan, at most: that takes longer than all else, and is
    /// done once for each. The next scan that is searched goes on.
    pub max_described: usize,
    /// Keyframes of a map whose descriptions are kept, at most: each takes some 1.3 MB.
    pub max_descriptions: usize,
    /// Keypoints of a scan and of a keyframe, at most. Of eight places that `carry_away` of `benchmarks/odometry.py` takes
    /// a lidar to (seeds 601 and 602), all were found with 800, and seven with 400.
    pub keypoints: usize,
    /// Voxels along the radius of a keypoint's patch, of which each gives one candidate. With 4 as many of these places
    /// were found as with 8, in half of the time; with 3, which takes half of that again, those of seeds 601 to 606 are.
    pub candidates_per_radius: f64,
    /// Candidates that each is compared with to tell how distinctive it is, at most: with all of them that took half of
    /// the time of a description (a profile of `benchmarks/odometry.py`).
    pub compared: usize,
    /// Keyframes that are kept, at most: each takes some 300 kB.
    pub max_kept: usize,
    /// Scans after which a keyframe that is not in the map any more may be one that the sensor comes back to.
    pub scans_apart: u32,
    /// Distance, in median ranges, within which such a keyframe is looked for.
    pub loop_distance: f64,
    /// Step of the grid of translations that are tried there, in voxels: between two of them a scan is near enough to be
    /// aligned.
    pub drift_step: f64,
    /// Such steps to either side along each axis: so far, some eight voxels, may a way around have drifted.
    pub drift_steps: usize,
    /// Such translations from which the scan is aligned, at most, the best first.
    pub drift_trials: usize,
    /// Scans after a search in a past map before the next one: it costs several tracked scans.
    pub scans_between_loops: usize,
    /// Scans after a search before a pose is searched again that would be kept without.
    pub scans_between: usize,
    /// Step between the rotations about the sensor's axes that are tried at its last position, in radians: a point at
    /// the median range of some 30 voxels moves by two in half a step.
    pub rotation_step: f64,
    /// Points of the scan by which such rotations are compared.
    pub rotation_points: usize,
    /// Distance to the map, in voxels, within which such a point counts.
    pub rotation_distance: f64,
    /// Share of these points by which more come near the map from another start than from where the motion leads, to be
    /// preferred.
    pub clear_gain: f64,
    /// Such rotations from which the scan is aligned, at most, the best first.
    pub rotation_trials: usize,
    /// Share of these points that come near the map from which on a rotation is tried where keyframes are searched, too,
    /// and any other motion is aligned with all points. Right rotations brought 0.33 to 0.96 of them near before they were
    /// aligned, wrong ones up to 0.45 (`benchmarks/hard_sequences.py`, `loops.py` and `odometry.py`).
    pub likely_share: f64,
    /// Matches that agree with a pose that is tried, at least.
    pub min_matches: usize,
    /// Matches that agree with a pose, at least, where it was found by how far the scan sees all around. Right poses had 57
    /// to 195 of them, and wrong ones 26 to 67 (`benchmarks/odometry.py`, seeds 601 to 606, and `loops.py`).
    pub confirming_matches: usize,
    /// Distance at the median range between such a pose and that which the matches propose, at most, in voxels: that of
    /// right poses was 0.1 to 1.0, and of wrong ones 1.2 to 9.5.
    pub confirming_distance: f64,
    /// Poses that are tried on the keyframes' map, at most, those that most matches agree with: the one by which most
    /// points come near the map is aligned.
    pub max_trials: usize,
    /// Edge of the voxels of which keypoints are described, in voxels of the map: signatures need more points than a
    /// pose does.
    pub detail_voxel: f64,
    /// Keyframes next to a pose that say what they would have seen.
    pub observers: usize,
    /// Largest distance of corresponding points in the first round, in voxels: so far off may a pose be that matches
    /// propose.
    pub max_correspondence_distance: f64,
    /// Overlap by which a pose that was searched must exceed a doubted one, to take its place.
    pub overlap_gain: f64,
    /// Scans that must follow each other through a part of the map that was searched, where none alone is certain:
    /// parts that look alike from one viewpoint differ a little farther on.
    pub scans_on_trial: usize,
    /// The same, where the sensor is seen again at its last pose.
    pub scans_on_trial_there: usize,
}

impl Default for RelocalisationSettings {
    fn default() -> Self {
        Self {
            keyframe_distance: 0.3,
            keyframe_rotation: 30.0_f64.to_radians(),
            max_keyframes: 16,
            max_described: 2,
            max_descriptions: 64,
            keypoints: 800,
            candidates_per_radius: 3.0,
            compared: 500,
            max_kept: 400,
            scans_apart: 30,
            loop_distance: 0.6,
            drift_step: 2.5,
            drift_steps: 3,
            drift_trials: 2,
            scans_between_loops: 3,
            scans_between: 10,
            rotation_step: 8.0_f64.to_radians(),
            rotation_points: 300,
            rotation_distance: 1.5,
            clear_gain: 0.1,
            rotation_trials: 2,
            likely_share: 0.5,
            min_matches: 16,
            confirming_matches: 32,
            confirming_distance: 1.0,
            max_trials: 3,
            detail_voxel: 0.5,
            observers: 4,
            max_correspondence_distance: 4.0,
            overlap_gain: 0.1,
            scans_on_trial: 3,
            scans_on_trial_there: 2,
        }
    }
}
