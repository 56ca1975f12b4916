"""The compiled core: what it offers to the package."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, BinaryIO, Literal, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "COARSEST_STEP",
    "FEWEST_AUTO_POINTS",
    "FEWEST_SURFACE_POINTS",
    "FLAT_ATOM_NOISES",
    "GOOD",
    "INSTANCE_SCORE",
    "INSTRUCTION_SET",
    "KIND_PARAMETERS",
    "OPTIMAL",
    "RESOLUTION_SAMPLES",
    "SCAN_STATUS_NAMES",
    "STATUS_NAMES",
    "E57Reader",
    "FindSettings",
    "Frame",
    "FusedMap",
    "Odometry",
    "OdometrySettings",
    "PieceView",
    "Primitive",
    "RecurrenceSettings",
    "RegistrationSettings",
    "__version__",
    "added_sums",
    "align_pieces",
    "brief_model",
    "consistent_directions",
    "coordinate_resolution",
    "coordinate_steps",
    "deskewed_points",
    "different_places",
    "distance_to_nearest",
    "estimated_viewpoint",
    "examine_poses",
    "extract",
    "field_keypoints",
    "field_signatures",
    "find_instances",
    "find_surfaces",
    "fit_primitive",
    "free_directions",
    "free_space_share",
    "hidden_from",
    "join_surface_pieces",
    "judge_poses",
    "match_fields",
    "mean_neighbor_distances",
    "measured_from_origin",
    "point_spacing",
    "prepare_model",
    "refine_poses",
    "register",
    "sampled_numbers",
    "spin_times",
    "surface_of_sums",
    "surface_sums",
    "time_range",
    "voxel_representatives",
    "write_e57",
]

_Scan = tuple[NDArray[np.floating], list[float], list[float] | None, NDArray[np.float32] | None]
_Places = tuple[
    NDArray[np.float64], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]
]

__version__: str
SCAN_STATUS_NAMES: list[str]
STATUS_NAMES: list[str]
KIND_PARAMETERS: dict[str, int]
FEWEST_AUTO_POINTS: int
FEWEST_SURFACE_POINTS: int
INSTRUCTION_SET: str
COARSEST_STEP: float
RESOLUTION_SAMPLES: int
OPTIMAL: float
FLAT_ATOM_NOISES: float
INSTANCE_SCORE: float
GOOD: float

def coordinate_resolution(
    points: NDArray[np.floating], *, origin: Sequence[float]
) -> tuple[bool, list[float]]: ...
def coordinate_steps(points: NDArray[np.floating], *, origin: Sequence[float]) -> tuple[float, float]: ...
def extract(
    points: NDArray[np.floating],
    *,
    origin: Sequence[float],
    radius: float | Sequence[float] | str | None,
    axes: str,
    fit: str,
    neighbors: int | None = None,
    at: NDArray[np.uint32] | NDArray[np.float64] | None = None,
    viewpoint: Sequence[float] | None = None,
    directions: NDArray[np.float32] | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
    whole: tuple[bool, Sequence[float], Sequence[float], float, Sequence[Sequence[float]]] | None = None,
) -> list[dict[str, NDArray[Any]]]: ...
def different_places(candidates: NDArray[np.float64]) -> list[list[float]]: ...
def distance_to_nearest(points: NDArray[np.float64], place: Sequence[float], k: int) -> float: ...
def sampled_numbers(count: int) -> list[int]: ...
def field_signatures(
    points: NDArray[np.floating],
    *,
    origin: Sequence[float],
    radius: float,
    at: NDArray[np.uint32] | NDArray[np.float64] | None = None,
    viewpoint: Sequence[float] | None = None,
    directions: NDArray[np.float32] | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
    pools: bool = False,
) -> dict[str, NDArray[Any]]: ...
def field_keypoints(
    points: NDArray[np.floating],
    *,
    origin: Sequence[float],
    radius: float,
    count: int | None = None,
    spacing: float | None = None,
    viewpoint: Sequence[float] | None = None,
    directions: NDArray[np.float32] | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, NDArray[Any]]: ...
def match_fields(
    source: _Places, target: _Places, *, mutual: bool, threads: int | None = None
) -> dict[str, NDArray[Any]]: ...

@final
class RegistrationSettings:
    """How scans are registered, for experts: what is not given keeps its default.

    The crate's `RegistrationSettings` says why each has its value.
    """

    def __new__(
        cls,
        *,
        radius_share: float | None = None,
        keypoints: int | None = None,
        candidates_per_radius: float | None = None,
        description_voxels_per_radius: float | None = None,
        voxels_per_radius: float | None = None,
        orientation_voxels_per_radius: float | None = None,
        consensus_max_distance: float | None = None,
        consensus_min_cosine: float | None = None,
        consensus_proposals: int | None = None,
        gicp_distances: Sequence[float] | None = None,
        gicp_iterations: int | None = None,
        surface_max_distance: float | None = None,
        surface_max_deviations: float | None = None,
        surface_max_iterations: int | None = None,
        max_points: int | None = None,
        rival_proposals: int | None = None,
        rival_least_score: float | None = None,
        rival_distance: float | None = None,
        rival_weak: float | None = None,
        rival_held_share: float | None = None,
        rival_held_deviations: float | None = None,
        rival_deficit: float | None = None,
        rival_deviations: float | None = None,
        free_space_pixel: float | None = None,
        free_space_margin: float | None = None,
        free_space_relative_margin: float | None = None,
        doubted_free_space: float | None = None,
        free_space_excess: float | None = None,
        certain_free_space: float | None = None,
        certain_inliers: int | None = None,
        certain_explained: float | None = None,
        doubted_agreement: float | None = None,
        mirrored_inliers: float | None = None,
        doubted_scale: float | None = None,
        scale_deviations: float | None = None,
        trusted_inliers: int | None = None,
        trusted_overlap: float | None = None,
        trusted_overlap_of_start: float | None = None,
    ) -> RegistrationSettings: ...
    @property
    def radius_share(self) -> float:
        """Radius of the patches over the median distance of a scan's points from their middle."""
    @property
    def keypoints(self) -> int:
        """Keypoints of each scan."""
    @property
    def candidates_per_radius(self) -> float:
        """Candidates for keypoints along a patch's radius."""
    @property
    def description_voxels_per_radius(self) -> float:
        """Voxels along a patch's radius, to which scans are thinned before their patches are described."""
    @property
    def voxels_per_radius(self) -> float:
        """Voxels along a patch's radius, to which scans are thinned before they are refined."""
    @property
    def orientation_voxels_per_radius(self) -> float:
        """The same where normals are oriented by their neighbours, because no viewpoint is known."""
    @property
    def consensus_max_distance(self) -> float:
        """Radii of a patch between a moved place and its correspondence within which a match agrees."""
    @property
    def consensus_min_cosine(self) -> float:
        """Smallest cosine between their axes, likewise."""
    @property
    def consensus_proposals(self) -> int:
        """Matches whose transforms are tried, the most similar first."""
    @property
    def gicp_distances(self) -> list[float]:
        """Largest distances between correspondences in the two rounds of generalised ICP, in voxels."""
    @property
    def gicp_iterations(self) -> int:
        """Steps of each round, at most."""
    @property
    def surface_max_distance(self) -> float:
        """Voxels from the target's nearest point beyond which there is no surface to measure from."""
    @property
    def surface_max_deviations(self) -> float:
        """Standard deviations within which a residual is an inlier."""
    @property
    def surface_max_iterations(self) -> int:
        """Steps of the last fit, at most."""
    @property
    def max_points(self) -> int:
        """Points of the source in the last fit, at most."""
    @property
    def rival_proposals(self) -> int:
        """Proposed transforms that are tried beside the best one, at most."""
    @property
    def rival_least_score(self) -> float:
        """The score of a proposal over the best one's, at least."""
    @property
    def rival_distance(self) -> float:
        """Radii of a patch by which a rival moves points elsewhere, at least."""
    @property
    def rival_weak(self) -> float:
        """Distances from the surface over the points' paths, below which a motion is weakly held."""
    @property
    def rival_held_share(self) -> float:
        """Share of what the target's normals say of a weak motion that both scans' say alike, to hold it."""
    @property
    def rival_held_deviations(self) -> float:
        """What both say alike, in standard errors, likewise."""
    @property
    def rival_deficit(self) -> float:
        """What a rival explains less, as a share, at least, to be refuted."""
    @property
    def rival_deviations(self) -> float:
        """The same in its standard errors."""
    @property
    def free_space_pixel(self) -> float:
        """Radians of a pixel of the range images that tell free space."""
    @property
    def free_space_margin(self) -> float:
        """Voxels before what was measured within which a point is on it."""
    @property
    def free_space_relative_margin(self) -> float:
        """The same as a share of the range."""
    @property
    def doubted_free_space(self) -> float:
        """Share of points in free space from which on a transform is doubted."""
    @property
    def free_space_excess(self) -> float:
        """By how much the shares of two transforms must differ for the smaller one to win."""
    @property
    def certain_free_space(self) -> float:
        """Share of points in free space up to which few matches are enough."""
    @property
    def certain_inliers(self) -> int:
        """Matches that agree, from which on a transform is trusted that leaves nothing in free space."""
    @property
    def certain_explained(self) -> float:
        """Share that such a transform explains, at least."""
    @property
    def doubted_agreement(self) -> float:
        """Matches that agree, per match and overlap, below which the source's mirror image is tried."""
    @property
    def mirrored_inliers(self) -> float:
        """How many times as many matches of the mirror image must agree."""
    @property
    def doubted_scale(self) -> float:
        """Logarithm of a scale from which on it is doubted."""
    @property
    def scale_deviations(self) -> float:
        """The same in its standard errors."""
    @property
    def trusted_inliers(self) -> int:
        """Matches that agree, from which on a transform is trusted."""
    @property
    def trusted_overlap(self) -> float:
        """Overlap from which on it is."""
    @property
    def trusted_overlap_of_start(self) -> float:
        """Overlap from which on a transform is trusted that the caller gave roughly."""
    def __eq__(self, value: object, /) -> bool: ...

def register(
    source: _Scan,
    target: _Scan,
    *,
    start: list[list[float]] | None = None,
    radius: float | None = None,
    keypoints: int | None = None,
    settings: RegistrationSettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]: ...
def free_space_share(
    source: _Scan,
    target: _Scan,
    T_target_source: list[list[float]],
    *,
    radius: float | None = None,
    settings: RegistrationSettings | None = None,
    threads: int | None = None,
) -> float: ...

@final
class RecurrenceSettings:
    """How poses between pieces are searched and judged, for experts: what is not given keeps its default.

    The crate's `RecurrenceSettings` says why each has its value.
    """

    def __new__(
        cls,
        *,
        pair_voxels_per_extent: float | None = None,
        spacings_per_voxel: float | None = None,
        image_reach: float | None = None,
        min_pair_distance: float | None = None,
        similar_pairs: int | None = None,
        poses_per_pair: int | None = None,
        feature_tolerance: float | None = None,
        proposals: int | None = None,
        first_points: int | None = None,
        first_tolerance: float | None = None,
        tried: int | None = None,
        coarse_points: int | None = None,
        fine_points: int | None = None,
        kept: int | None = None,
        mutations: int | None = None,
        rotation_deviation: float | None = None,
        translation_deviation: float | None = None,
        coarse_rounds: int | None = None,
        fine_rounds: int | None = None,
        min_coarse_score: float | None = None,
        fit_steps: int | None = None,
        unobservable_share: float | None = None,
        coarse_weights: Sequence[float] | None = None,
        fine_weights: Sequence[float] | None = None,
        planar_weight: float | None = None,
        round_spread: float | None = None,
        radius_share: float | None = None,
        rival_starts: int | None = None,
        rival_proposals: int | None = None,
        rival_rounds: int | None = None,
        examined_points: int | None = None,
        surface_points: int | None = None,
        object_points: int | None = None,
        symmetry_excess: float | None = None,
        rival_distance: float | None = None,
        rival_deficit: float | None = None,
        rival_deviations: float | None = None,
        least_explained: float | None = None,
        free_space_excess: float | None = None,
        doubted_free_space: float | None = None,
        trusted_overlap: float | None = None,
        doubted_disagreement: float | None = None,
        mirrored_disagreement: float | None = None,
        doubted_scale: float | None = None,
        scale_deviations: float | None = None,
        seed: int | None = None,
    ) -> RecurrenceSettings: ...
    @property
    def pair_voxels_per_extent(self) -> float:
        """Voxels along a piece's extent, to which it is thinned before its points are paired."""
    @property
    def spacings_per_voxel(self) -> float:
        """Point spacings along the voxels to which a piece is thinned before poses are judged by it."""
    @property
    def image_reach(self) -> float:
        """How far around a piece its depth image reaches, in its extents from its mean."""
    @property
    def min_pair_distance(self) -> float:
        """Distance between the points of a pair, at least, in the unit of length that counts as a radian."""
    @property
    def similar_pairs(self) -> int:
        """Pairs of the target that are most similar to one of the source."""
    @property
    def poses_per_pair(self) -> int:
        """Of these, how many propose a pose, chosen at random."""
    @property
    def feature_tolerance(self) -> float:
        """Largest distance of the features of similar pairs, in radians, or units of length."""
    @property
    def proposals(self) -> int:
        """Proposed poses, at most."""
    @property
    def first_points(self) -> int:
        """Points of each piece by which proposals are judged."""
    @property
    def first_tolerance(self) -> float:
        """Tolerances within which they are, in those of the later judgements."""
    @property
    def tried(self) -> int:
        """Proposals that are judged by more points."""
    @property
    def coarse_points(self) -> int:
        """Points of each piece in the coarse search."""
    @property
    def fine_points(self) -> int:
        """Points of each piece in the fine search."""
    @property
    def kept(self) -> int:
        """Poses that each round of the coarse search keeps."""
    @property
    def mutations(self) -> int:
        """Random changes of each pose that is kept, in each round."""
    @property
    def rotation_deviation(self) -> float:
        """Standard deviation of the rotation of the first random changes, in radians."""
    @property
    def translation_deviation(self) -> float:
        """Standard deviation of their translation along each axis, in extents of the target."""
    @property
    def coarse_rounds(self) -> int:
        """Rounds of the coarse search."""
    @property
    def fine_rounds(self) -> int:
        """Rounds of the fine search."""
    @property
    def min_coarse_score(self) -> float:
        """Score of the coarse search below which a pair of pieces is given up."""
    @property
    def fit_steps(self) -> int:
        """Steps of a least squares fit."""
    @property
    def unobservable_share(self) -> float:
        """Share of the largest eigenvalue below which a motion is not observable."""
    @property
    def coarse_weights(self) -> list[float]:
        """What a contradicted and a missing point count in the coarse search, in confirmed ones."""
    @property
    def fine_weights(self) -> list[float]:
        """The same in the fine search, and in the score."""
    @property
    def planar_weight(self) -> float:
        """What a match counts whose confirmed points are on one plane."""
    @property
    def round_spread(self) -> float:
        """Spread of the confirmed normals from which on a match counts fully."""
    @property
    def radius_share(self) -> float:
        """What counts as a radius of a patch when a pose is examined, in extents of the smaller piece."""
    @property
    def rival_starts(self) -> int:
        """Other poses that are brought near, at most."""
    @property
    def rival_proposals(self) -> int:
        """Poses that pairs of points propose as rivals, at most."""
    @property
    def rival_rounds(self) -> int:
        """Rounds of random changes that bring a rival near."""
    @property
    def examined_points(self) -> int:
        """Points of each piece by which a pose is examined."""
    @property
    def surface_points(self) -> int:
        """Points of each piece that make its surface, at most."""
    @property
    def object_points(self) -> int:
        """Points of all pieces of a group that show how the object looks, at most."""
    @property
    def symmetry_excess(self) -> float:
        """By how much an object's share of points in free space may grow with a symmetry."""
    @property
    def rival_distance(self) -> float:
        """Radii of a patch by which a rival moves points elsewhere, at least."""
    @property
    def rival_deficit(self) -> float:
        """What a rival explains less of what is seen with both poses, as a share, at least, to be refuted."""
    @property
    def rival_deviations(self) -> float:
        """The same in its standard errors."""
    @property
    def least_explained(self) -> float:
        """What a rival explains over what the best pose does, at least."""
    @property
    def free_space_excess(self) -> float:
        """By how much a rival's share of points in free space may be larger than the best pose's."""
    @property
    def doubted_free_space(self) -> float:
        """Share of points in free space from which on a pose is doubted."""
    @property
    def trusted_overlap(self) -> float:
        """Share of both pieces' points that lie on the other piece, below which a pose is doubted."""
    @property
    def doubted_disagreement(self) -> float:
        """Share of points in sight that disagree, from which on the mirror image is tried."""
    @property
    def mirrored_disagreement(self) -> float:
        """What disagrees then, over what disagrees without, below which the mirror image is better."""
    @property
    def doubted_scale(self) -> float:
        """Logarithm of a scale from which on it is doubted."""
    @property
    def scale_deviations(self) -> float:
        """The same in its standard errors."""
    @property
    def seed(self) -> int:
        """Seed of the random choices."""
    def __eq__(self, value: object, /) -> bool: ...

@final
class PieceView:
    def __new__(
        cls,
        points: NDArray[np.float64],
        normals: NDArray[np.float64],
        piece: NDArray[np.int64],
        *,
        viewpoint: Sequence[float],
        second_viewpoint: Sequence[float] | None = None,
        support_planes: Sequence[tuple[Sequence[float], Sequence[float]]],
        spacing: float,
        tolerance: float,
        pair_unit: float,
        settings: RecurrenceSettings | None = None,
    ) -> PieceView: ...
    @property
    def center(self) -> list[float]: ...

def align_pieces(
    views: Sequence[PieceView],
    pairs: Sequence[tuple[int, int]],
    *,
    settings: RecurrenceSettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[tuple[NDArray[np.float64], float] | None]: ...
def refine_poses(
    views: Sequence[PieceView],
    poses: Sequence[tuple[tuple[int, int], Sequence[NDArray[np.float64]]]],
    *,
    settings: RecurrenceSettings | None = None,
    threads: int | None = None,
) -> list[tuple[NDArray[np.float64], float] | None]: ...
def judge_poses(
    views: Sequence[PieceView],
    poses: Sequence[tuple[tuple[int, int], NDArray[np.float64]]],
    *,
    settings: RecurrenceSettings | None = None,
    threads: int | None = None,
) -> list[float]: ...
def examine_poses(
    views: Sequence[PieceView],
    poses: Sequence[tuple[tuple[int, int], NDArray[np.float64]]],
    *,
    settings: RecurrenceSettings | None = None,
    threads: int | None = None,
) -> list[dict[str, Any]]: ...

@final
class FindSettings:
    """How instances are searched and judged, for experts: what is not given keeps its default.

    The crate's `FindSettings` says why each has its value.
    """

    def __new__(
        cls,
        *,
        similar: int | None = None,
        few_points: int | None = None,
        rough_voxel: float | None = None,
        agreed: int | None = None,
        agreed_within: Sequence[float] | None = None,
        aligned: int | None = None,
        support_per_vote: float | None = None,
        proposals: int | None = None,
        first_points: int | None = None,
        first_distances: tuple[float, float, int] | None = None,
        kept: int | None = None,
        coarse_points: int | None = None,
        coarse_distances: tuple[float, float, int] | None = None,
        coarse_voxels: float | None = None,
        tried: int | None = None,
        brief_aligned: int | None = None,
        brief_tried: int | None = None,
        brief_points: int | None = None,
        brief_deficit: float | None = None,
        searched: int | None = None,
        aligned_points: int | None = None,
        fine_points: int | None = None,
        fine_distances: tuple[float, float, int] | None = None,
        spacings_per_voxel: float | None = None,
        noises_per_voxel: float | None = None,
        agreement: Sequence[float] | None = None,
        merged_share: float | None = None,
        same: Sequence[float] | None = None,
        max_fitted: int | None = None,
        own_distance: float | None = None,
        contradicted_weight: float | None = None,
        missing_weight: float | None = None,
        unknown_free_space_weight: float | None = None,
        round_spread: float | None = None,
        touching_distance: float | None = None,
        agreement_by_chance: Sequence[float] | None = None,
    ) -> FindSettings: ...
    @property
    def similar(self) -> int:
        """Places of the model that are matched with each place of the scene."""
    @property
    def few_points(self) -> int:
        """Points of the model by which all transforms that matches propose are judged, without alignment."""
    @property
    def rough_voxel(self) -> float:
        """Voxels of that judgement in the model's extent."""
    @property
    def agreed(self) -> int:
        """Of these transforms, how many are judged by more points: those that most others agree with."""
    @property
    def agreed_within(self) -> list[float]:
        """Of the model's extent, and radians, within which two of them agree."""
    @property
    def aligned(self) -> int:
        """Of these, how many are aligned, by votes and support together."""
    @property
    def support_per_vote(self) -> float:
        """Share of the model that, where it is confirmed, counts as much as e times the votes."""
    @property
    def proposals(self) -> int:
        """Proposed transforms that are aligned where the scene's viewpoint is not known."""
    @property
    def first_points(self) -> int:
        """Points of the model in their alignment and judgement."""
    @property
    def first_distances(self) -> tuple[float, float, int]:
        """Voxels between correspondences in the steps of the first alignment: from, to, how many."""
    @property
    def kept(self) -> int:
        """Of these, how many are judged by more points."""
    @property
    def coarse_points(self) -> int:
        """Points of the model by which few transforms are aligned and judged, wherever they come from."""
    @property
    def coarse_distances(self) -> tuple[float, float, int]:
        """Voxels between correspondences in the steps of that alignment."""
    @property
    def coarse_voxels(self) -> float:
        """Voxels of both judgements, in those of the last."""
    @property
    def tried(self) -> int:
        """Transforms that are aligned and judged by most points."""
    @property
    def brief_aligned(self) -> int:
        """In the brief search for each of several models, how many transforms are aligned."""
    @property
    def brief_tried(self) -> int:
        """Of these, how many are aligned again and judged."""
    @property
    def brief_points(self) -> int:
        """By that many points."""
    @property
    def brief_deficit(self) -> float:
        """By how much the logarithm of the odds of the best of them may be below that of what is given up."""
    @property
    def searched(self) -> int:
        """How many of several models are searched after it, at most: those with the largest odds."""
    @property
    def aligned_points(self) -> int:
        """Points of the model in their alignment."""
    @property
    def fine_points(self) -> int:
        """Points of the model in their judgement."""
    @property
    def fine_distances(self) -> tuple[float, float, int]:
        """Voxels between correspondences in its steps."""
    @property
    def spacings_per_voxel(self) -> float:
        """Distance between points of the surface, in the scene's point spacings at least."""
    @property
    def noises_per_voxel(self) -> float:
        """The same in the scene's noise."""
    @property
    def agreement(self) -> list[float]:
        """Patch radii, and radians, within which two proposed transforms agree."""
    @property
    def merged_share(self) -> float:
        """Of these, between two proposals of which the less agreed one is left out."""
    @property
    def same(self) -> list[float]:
        """Patch radii, and radians, within which two aligned transforms are the same."""
    @property
    def max_fitted(self) -> int:
        """Points of the scene that an instance is fitted to, at most."""
    @property
    def own_distance(self) -> float:
        """Voxels from an instance's surface within which the scene's points are its own."""
    @property
    def contradicted_weight(self) -> float:
        """What a point that the sensor saw through counts, in confirmed ones."""
    @property
    def missing_weight(self) -> float:
        """The same of one where the sensor saw nothing."""
    @property
    def unknown_free_space_weight(self) -> float:
        """What a confirmed point counts where nobody knows what the sensor saw through."""
    @property
    def round_spread(self) -> float:
        """Spread of confirmed normals from which on they are more than a plane."""
    @property
    def touching_distance(self) -> float:
        """Voxels from the scene's next point within which a point of the model lies on the scene."""
    @property
    def agreement_by_chance(self) -> list[float]:
        """Mean agreement of touching surfaces that is reached by chance, and by equal ones."""
    def __eq__(self, value: object, /) -> bool: ...

def prepare_model(scan: _Scan, *, threads: int | None = None) -> dict[str, Any]: ...
def brief_model(model: tuple[Any, ...]) -> dict[str, Any]: ...
def find_instances(
    radii: Sequence[float],
    load: Callable[[int, bool], tuple[Any, ...]],
    scene: _Scan,
    *,
    min_score: float,
    at_most: int | None = None,
    settings: FindSettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[dict[str, Any]]: ...
def point_spacing(points: NDArray[np.float64]) -> float: ...
def hidden_from(
    direction: list[float],
    across: list[list[float]],
    places: NDArray[np.float64],
    points: NDArray[np.float64],
    spacing: float,
) -> NDArray[np.bool_]: ...
def measured_from_origin(points: NDArray[np.float64], spacing: float) -> bool: ...
def estimated_viewpoint(points: NDArray[np.float64]) -> list[float] | None: ...
def deskewed_points(
    points: NDArray[np.float32] | NDArray[np.float64],
    times: NDArray[np.float64],
    twist: list[float],
    *,
    origin: list[float],
) -> NDArray[np.float64]: ...
def spin_times(
    points: NDArray[np.float32] | NDArray[np.float64],
    *,
    origin: list[float],
    sensor: list[float],
    spin_rate: float,
) -> NDArray[np.float64]: ...
def time_range(times: NDArray[np.float64], fewest: int) -> list[float] | None: ...
def free_directions(
    points: NDArray[np.float64], normals: NDArray[np.float64]
) -> list[tuple[Literal["rotation", "translation"], list[float] | None, list[float] | None]]: ...
def mean_neighbor_distances(
    points: NDArray[np.float64],
    *,
    count: int,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> NDArray[np.float64]: ...
def consistent_directions(
    points: NDArray[np.float64], *, voxel: float, threads: int | None = None
) -> NDArray[np.float32]: ...
def find_surfaces(
    points: NDArray[np.floating],
    *,
    origin: Sequence[float],
    kinds: Sequence[str],
    min_points: int | None = None,
    noise: float | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[NDArray[np.int32], list[dict[str, Any]], NDArray[np.bool_], float]: ...
def join_surface_pieces(
    pieces: Sequence[tuple[Mapping[str, Any], NDArray[np.float64], float]],
    pairs: Sequence[tuple[int, int, bool]],
) -> tuple[NDArray[np.uint32], list[dict[str, Any]]]: ...

_SurfaceSums: TypeAlias = tuple[int, float, int, float, NDArray[np.float64]]

def surface_sums(surface: Mapping[str, Any], points: NDArray[np.float64]) -> _SurfaceSums: ...
def added_sums(sums: Sequence[_SurfaceSums]) -> _SurfaceSums: ...
def surface_of_sums(surface: Mapping[str, Any], sums: Sequence[_SurfaceSums]) -> dict[str, Any] | None: ...
def fit_primitive(
    points: NDArray[np.float64],
    kind: str,
    start: Primitive | None = None,
    weights: NDArray[np.float64] | None = None,
    radius: float | None = None,
    axis: Sequence[float] | NDArray[np.float64] | None = None,
) -> Primitive | None: ...
def voxel_representatives(
    points: NDArray[np.floating], *, origin: Sequence[float], voxel: float
) -> NDArray[np.uint32]: ...
def write_e57(
    file: BinaryIO,
    *,
    guid: str,
    description: str | None,
    extensions: Sequence[tuple[str, str]],
    records: Sequence[tuple[str, str, int, int]],
    scans: Iterable[tuple[str, Sequence[float] | None, Iterable[Sequence[NDArray[Any]]]]],
) -> None: ...

@final
class E57Reader:
    def __new__(cls, file: BinaryIO, source: str, progress: Callable[[int], object]) -> E57Reader: ...
    def __len__(self) -> int: ...
    def scan(self, number: int) -> tuple[dict[str, NDArray[Any]], tuple[list[float], list[float]] | None]: ...

@final
class Frame:
    def __new__(
        cls,
        *,
        quadratic: tuple[float, int] | None = None,
        slope: tuple[float, int] | None = None,
        mixed: tuple[float, int] | None = None,
        offset: tuple[float, int] | None = None,
        as_printed: bool = False,
    ) -> Frame: ...
    @staticmethod
    def default() -> Frame: ...
    @staticmethod
    def reproduction() -> Frame: ...
    def __len__(self) -> int: ...
    @property
    def hash(self) -> str: ...
    @property
    def as_printed(self) -> bool: ...
    @property
    def atoms(self) -> NDArray[np.float64]: ...
    @property
    def singular_values(self) -> NDArray[np.float64]: ...
    def smallest_eigenvalue(self, side: float) -> float: ...
    def curvature_fields(self, surface: Sequence[float]) -> NDArray[np.float64]: ...
    def coefficients(self, surface: Sequence[float]) -> NDArray[np.float64]: ...
    def flat_atom_length(self, noise: float) -> float | None: ...
    def signatures_of_curvatures(
        self, k1: NDArray[np.float32], k2: NDArray[np.float32], *, side: float
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]: ...
    def signatures_of_surfaces(
        self, surfaces: NDArray[np.float32], *, side: float
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]: ...

@final
class OdometrySettings:
    """How a sensor is followed, for experts: what is not given keeps its default.

    The crate's `OdometrySettings` says why each has its value.
    """

    def __new__(
        cls,
        *,
        voxels_of_scan: float | None = None,
        patch_radius: float | None = None,
        min_points: int | None = None,
        coarse_voxel: float | None = None,
        plane_steps: int | None = None,
        max_point_distance: float | None = None,
        max_residual: float | None = None,
        held_share: float | None = None,
        map_range_factor: float | None = None,
        map_min_translation: float | None = None,
        map_min_rotation: float | None = None,
        prediction_max_deviation: float | None = None,
        expectation_scans: int | None = None,
        doubted_overlap: float | None = None,
        min_overlap: float | None = None,
        max_keyframes: int | None = None,
        min_matches: int | None = None,
        scans_on_trial: int | None = None,
    ) -> OdometrySettings: ...
    @property
    def voxels_of_scan(self) -> float:
        """Voxels that the first scan fills, where no voxel is given."""
    @property
    def patch_radius(self) -> float:
        """Radius of the patches that keypoints are described by, in median ranges."""
    @property
    def min_points(self) -> int:
        """Points of a scan without which it is not aligned."""
    @property
    def coarse_voxel(self) -> float:
        """Edge, in voxels, of the coarser voxels of which generalised ICP takes a scan's points."""
    @property
    def plane_steps(self) -> int:
        """Steps point to plane that follow it."""
    @property
    def max_point_distance(self) -> float:
        """Largest distance between corresponding points in the last steps, in voxels."""
    @property
    def max_residual(self) -> float:
        """Largest point-to-plane residual of an inlier, in voxels."""
    @property
    def held_share(self) -> float:
        """Share of what normals say of a motion that halves of their neighbourhoods say alike, to hold it."""
    @property
    def map_range_factor(self) -> float:
        """Range of the map over the distance within which 99 in 100 points of a scan are."""
    @property
    def map_min_translation(self) -> float:
        """Translation, in voxels, from which on the next scan goes into the map."""
    @property
    def map_min_rotation(self) -> float:
        """Rotation, in radians, likewise."""
    @property
    def prediction_max_deviation(self) -> float:
        """Largest distance of corresponding points, in root mean squares of the errors of predictions."""
    @property
    def expectation_scans(self) -> int:
        """Scans that the expected overlap is taken from."""
    @property
    def doubted_overlap(self) -> float:
        """Share of the expected overlap below which a pose is doubted."""
    @property
    def min_overlap(self) -> float:
        """Overlap of a pose that is believed, at least."""
    @property
    def max_keyframes(self) -> int:
        """Keyframes that are searched, at most, the latest first."""
    @property
    def min_matches(self) -> int:
        """Matches that agree with a pose that is tried, at least."""
    @property
    def scans_on_trial(self) -> int:
        """Scans that must follow each other where the sensor is found again."""
    def __eq__(self, value: object, /) -> bool: ...

@final
class Odometry:
    def __new__(
        cls,
        *,
        voxel: float | None = None,
        max_correspondence_distance: float | None = None,
        map_range: float | None = None,
        settings: OdometrySettings | None = None,
        threads: int | None = None,
    ) -> Odometry: ...
    def push(
        self,
        points: NDArray[np.floating],
        *,
        origin: Sequence[float],
        viewpoint: Sequence[float] | None = None,
        times: NDArray[np.float64] | None = None,
    ) -> list[int]: ...
    def __len__(self) -> int: ...
    @property
    def voxel(self) -> float | None: ...
    def loops(self) -> list[tuple[int, int, list[list[float]], list[list[float]]]]: ...
    def arrays(self, *, last_only: bool = False) -> dict[str, Any]: ...

@final
class FusedMap:
    def __new__(cls, voxel: float) -> FusedMap: ...
    def add(
        self,
        points: NDArray[np.floating],
        *,
        origin: Sequence[float],
        T_map_scan: Sequence[Sequence[float]],
        viewpoint: Sequence[float],
    ) -> None: ...
    def arrays(self) -> dict[str, NDArray[Any]]: ...

@final
class Primitive:
    @property
    def point(self) -> NDArray[np.float64]: ...
    @property
    def axis(self) -> NDArray[np.float64]: ...
    @property
    def radius(self) -> float: ...
    @property
    def major_radius(self) -> float: ...
    @property
    def half_angle(self) -> float: ...
    def distances(self, points: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def uncertainty(
        self,
        points: NDArray[np.float64],
        weights: NDArray[np.float64] | None = None,
        radius: float | None = None,
        axis: Sequence[float] | NDArray[np.float64] | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float]: ...
    def independent_error(self, points: NDArray[np.float64]) -> float: ...
