//! How poses between pieces are searched and judged.

use crate::alignment::{PointToSurfaceSettings, RivalSettings, ScaleLimits};

/// What an expert may change; nothing has to be set. All values were chosen on seeds 1 to 6 of
/// `benchmarks/recurrences.py`, unless their description says otherwise.
///
/// ```
/// let settings = surfsig::RecurrenceSettings { proposals: 1000, ..Default::default() };
/// assert_eq!(settings.kept, 12);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RecurrenceSettings {
    /// Voxels along a piece's extent (the largest distance of its points from their mean), to which it is thinned
    /// before its points are paired: some hundred points, and some ten thousand pairs.
    pub pair_voxels_per_extent: f64,
    /// Point spacings along the voxels to which a piece is thinned before poses are judged by it.
    pub spacings_per_voxel: f64,
    /// How far around a piece its depth image reaches, in its extents from its mean: what another piece has beyond the
    /// piece's rim is seen to be missing, or is hidden.
    pub image_reach: f64,
    /// Distance between the points of a pair, at least, in the unit of length that counts as a radian: the line between
    /// nearer points has no certain direction.
    pub min_pair_distance: f64,
    /// Pairs of the target that are most similar to one of the source.
    pub similar_pairs: usize,
    /// Of these, how many propose a pose, chosen at random: the most similar ones are often neighbours of each other.
    pub poses_per_pair: usize,
    /// Largest distance of the features of similar pairs, in radians, or units of length.
    pub feature_tolerance: f64,
    /// Proposed poses, at most.
    pub proposals: usize,
    /// Points of each piece by which proposals are judged.
    pub first_points: usize,
    /// Tolerances within which they are, in those of the later judgements: proposals are not exact.
    pub first_tolerance: f64,
    /// Proposals that are judged by more points.
    pub tried: usize,
    /// Points of each piece in the coarse search.
    pub coarse_points: usize,
    /// Points of each piece in the fine search.
    pub fine_points: usize,
    /// Poses that each round of the coarse search keeps, and the fine search at first; there, every second round keeps
    /// half as many as the one before.
    pub kept: usize,
    /// Random changes of each pose that is kept, in each round.
    pub mutations: usize,
    /// Standard deviation of the rotation of the first random changes, about each axis, in radians; halved from round
    /// to round.
    pub rotation_deviation: f64,
    /// Standard deviation of their translation along each axis, in extents of the target; likewise.
    pub translation_deviation: f64,
    /// Rounds of the coarse search.
    pub coarse_rounds: usize,
    /// Rounds of the fine search, whose first changes are as large as those of the second last coarse round.
    pub fine_rounds: usize,
    /// Score of the coarse search below which a pair of pieces is given up: no fine search made a match of such a pair.
    pub min_coarse_score: f64,
    /// Steps of a least squares fit.
    pub fit_steps: usize,
    /// Share of the largest eigenvalue of the normal equations below which a motion is not observable, and is not made:
    /// residuals of 3 % of the largest ones.
    pub unobservable_share: f64,
    /// What a contradicted and a missing point count in the coarse search, in confirmed ones: even the best poses are
    /// not exact there.
    pub coarse_weights: [f64; 2],
    /// The same in the fine search, and in the score: under true poses hardly any point is either.
    pub fine_weights: [f64; 2],
    /// What a match counts whose confirmed points are on one plane: many objects have a flat face.
    pub planar_weight: f64,
    /// Spread of the confirmed normals (1 less the largest eigenvalue of their second moments) from which on a match
    /// counts fully.
    pub round_spread: f64,
    /// What counts as a radius of a patch when a pose is examined, in extents of the smaller piece: as of a registered
    /// scan.
    pub radius_share: f64,
    /// When another pose explains as much of what both sensors saw; so many proposals are brought near.
    pub rivals: RivalSettings,
    /// Poses that pairs of points propose as rivals, at most: what explains as much as the best pose is proposed as
    /// often, so that a part of `proposals` is enough.
    pub rival_proposals: usize,
    /// Rounds of random changes that bring a rival near.
    pub rival_rounds: usize,
    /// Points of each piece by which a pose is examined: shares of 400 have a standard error of 0.025 at most.
    pub examined_points: usize,
    /// Points of each piece that make its surface, at most, which tells free directions and the scale.
    pub surface_points: usize,
    /// Points of all pieces of a group that show how the object looks, at most.
    pub object_points: usize,
    /// By how much an object's share of points in free space may grow with a motion after which it looks the same, and
    /// what may not be explained any more: poses of all pieces err.
    pub symmetry_excess: f64,
    /// What a rival explains over what the best pose does, at least: with a half turn two sensors that saw three faces
    /// of a box have one or two in common.
    pub least_explained: f64,
    /// How points are fitted to the surface of another piece, which tells free directions and the scale.
    pub point_to_surface: PointToSurfaceSettings,
    /// Distance from the surface, in radii, from which pieces of another size are fitted: as in finding.
    pub rival_distance: f64,
    /// By how much a rival's share of points in free space may be larger than the best pose's: as in registration.
    pub free_space_excess: f64,
    /// Share of points in free space from which on a pose is doubted.
    pub doubted_free_space: f64,
    /// Share of both pieces' points that lie on the other piece, below which a pose is doubted.
    pub trusted_overlap: f64,
    /// Share of points in sight that disagree, from which on the source's mirror image is tried.
    pub doubted_disagreement: f64,
    /// What disagrees then, over what disagrees without, below which the mirror image is the better one.
    pub mirrored_disagreement: f64,
    /// The logarithm of a scale from which on it is doubted, as in finding.
    pub doubted_scale: f64,
    /// The same in its standard errors.
    pub scale_deviations: f64,
    /// Seed of the random choices; the same one gives the same poses.
    pub seed: u64,
    /// Number of threads; all cores where it is `None`. The result is the same, bit for bit.
    pub threads: Option<usize>,
}

impl Default for RecurrenceSettings {
    fn default() -> Self {
        Self {
            pair_voxels_per_extent: 5.0,
            spacings_per_voxel: 1.5,
            image_reach: 1.6,
            min_pair_distance: 2.0,
            similar_pairs: 16,
            poses_per_pair: 4,
            feature_tolerance: 0.35,
            proposals: 3000,
            first_points: 60,
            first_tolerance: 2.0,
            tried: 48,
            coarse_points: 240,
            fine_points: 600,
            kept: 12,
            mutations: 24,
            rotation_deviation: 0.15,
            translation_deviation: 0.06,
            coarse_rounds: 4,
            fine_rounds: 6,
            min_coarse_score: 0.1,
            fit_steps: 5,
            unobservable_share: 9e-4,
            coarse_weights: [4.0, 8.0],
            fine_weights: [15.0, 40.0],
            planar_weight: 0.7,
            round_spread: 0.1,
            radius_share: 0.4,
            rivals: RivalSettings { proposals: 4, ..Default::default() },
            rival_proposals: 600,
            rival_rounds: 2,
            examined_points: 400,
            surface_points: 1500,
            object_points: 800,
            symmetry_excess: 0.05,
            least_explained: 0.25,
            point_to_surface: PointToSurfaceSettings::default(),
            rival_distance: 0.55,
            free_space_excess: 0.01,
            doubted_free_space: 0.02,
            trusted_overlap: 0.2,
            doubted_disagreement: 0.02,
            mirrored_disagreement: 0.5,
            doubted_scale: ScaleLimits::DEFAULT.doubted,
            scale_deviations: ScaleLimits::DEFAULT.deviations,
            seed: 0,
            threads: None,
        }
    }
}
