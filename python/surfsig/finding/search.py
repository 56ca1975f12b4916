"""`find_instances`: all instances of models in a scene."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.alignment.contact import Surface, contact, spread
from surfsig.alignment.free_directions import free_directions
from surfsig.arguments import thread_count
from surfsig.defaults import INSTANCE_SCORE
from surfsig.errors import InvalidInputError
from surfsig.finding.evidence import Evidence, Witness
from surfsig.finding.instances import Instance, Instances
from surfsig.finding.library import Library, stored_model
from surfsig.finding.model import FEWEST, SPACINGS, Model, model_of
from surfsig.finding.proposals import proposed_poses
from surfsig.finding.scene import Scene
from surfsig.geometry import from_translation, inverse, rotate, rotation_angle, transform_points
from surfsig.missing_returns import missing_returns, missing_returns_text
from surfsig.point_cloud import PointCloud
from surfsig.resolution import warn_if_too_coarse
from surfsig.units import ratio_text

Array = NDArray[np.float64]

_PROPOSALS, _TRIED = 1000, 60
"""Poses that are settled and judged by few places, and of those that differ, by all."""
_SPACINGS_APART = 1.5
"""Of the scene's point spacings, between places at least: steep surfaces have fewer points."""
_NOISES_APART = 2.5
"""Of the scene's noise, between places at least, so that equal surfaces are well within a voxel."""
_COARSE = 2.0
"""Voxels of the first judgement, in those of the last."""
_FEW = 300
"""Places of the model that are looked at in the first judgement."""
_FIRST_REACHES = np.geomspace(4.0, 1.5, 8)
_LAST_REACHES = np.geomspace(2.5, 1.5, 5)
"""Voxels between partners, in the steps of settling."""
_SAME_MIDDLE, _SAME_TURN = 0.25, 0.2
"""Radii of a patch, and radians, within which two poses are one."""
_MOST_FITTED = 5000
"""Points that a pose is fitted to at last."""
_OWN = 1.5
"""Voxels from an instance's surface within which the scene's points are its own."""


@dataclass(frozen=True, eq=False)
class _Candidate:
    name: str
    witness: Witness
    model: Model
    pose: Array

    def near(self, places: Array) -> NDArray[np.bool_]:
        """Tell which places (n, 3) of the scene are at the model's surface."""
        local = transform_points(inverse(self.pose), places)
        reach = _OWN * self.witness.around.voxel
        within = np.flatnonzero(np.linalg.norm(local, axis=1) < self.model.extent + reach)
        near = np.zeros(len(places), np.bool_)
        distances, _ = self.witness.tree.query(local[within], distance_upper_bound=reach)
        near[within] = np.isfinite(distances)
        return near


def find_instances(
    model: PointCloud | ArrayLike | Library | Mapping[str, PointCloud | ArrayLike],
    scene: PointCloud | ArrayLike,
    *,
    score: float = INSTANCE_SCORE,
    threads: int | None = None,
) -> Instances:
    """Find every instance of a model, or of several, in a scene: pose, score, and how much of it is seen.

    Each place of the scene proposes a pose by the place of the model whose field signature is most like its
    own. Poses that many agree on are fitted to the scene's surface and judged by what the sensor saw: what of
    the model is confirmed by points, less what it saw through and where it saw nothing. The best is taken,
    with its points, and the others are judged again without these, until none is left that is good enough. So
    half hidden instances are found, and where there is none, none is. The result is always the same.

    Parameters
    ----------
    model
        `PointCloud`, array (n, 3) of numbers, or any other that `PointCloud.of` takes: a whole object, or one
        view of it; a `Library`, or a mapping of names to clouds, for several. In the scene's unit.
    scene
        A cloud alike. Where it has a viewpoint, or one for each value of its field ``scan``, free space
        counts, or where all of it can have been seen from its origin; otherwise only what is confirmed does,
        and instances that are none are found, too: a higher `score` leaves them out.
    score
        Of an instance, at least: 1 is as much as can be seen of the model at once, with nothing against it.
    threads
        Number of threads; all cores by default. The result is the same.

    Returns
    -------
    Instances
        The best first; empty where there is none.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.
    FileFormatError
        If a library's file is damaged.

    Warns
    -----
    UserWarning
        If missing returns of the scene are left out, its coordinates are too coarse, or nothing is found and
        a model seems to be in another unit than the scene.
    """
    least = _score(score)
    threads = thread_count(threads)
    cloud = PointCloud.of(scene)
    missing = missing_returns(cloud)
    if missing.any():
        told = missing_returns_text(int(missing.sum()), len(cloud))
        warnings.warn(f"the scene: {told}; they are left out", stacklevel=2)
    models = _models(model, threads)
    if int((cloud.finite & ~missing).sum()) < FEWEST or not models:
        return Instances([], cloud, {})
    candidates: list[_Candidate] = []
    warn_if_too_coarse(cloud, max(part.radius for part in models.values()), "the scene: patches")
    prepared = Scene(cloud, min(part.radius for part in models.values()), threads)
    eye = prepared.eye() if prepared.sided else None
    for name, part in models.items():
        candidates += _candidates(name, part, prepared, eye, least, threads)
    found = _accepted(candidates, prepared, least)
    if not len(found):
        for name, part in models.items():
            relation = "has points {ratio} times as far apart as"
            hint = ratio_text(part.spacing, prepared.spacing, (f"the model '{name}'", "the scene"), relation)
            if hint is not None:
                warnings.warn(f"nothing was found, and {hint}", stacklevel=2)
    return found


def _models(model: object, threads: int | None) -> dict[str, Model]:
    if isinstance(model, Library):
        return {name: stored_model(model, name) for name in model.names()}
    if isinstance(model, Mapping) and all(isinstance(name, str) for name in model):
        return {name: model_of(data, threads=threads) for name, data in model.items()}
    return {"model": model_of(PointCloud.of(model), threads=threads)}


def _score(value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not 0.0 < number <= 1.0:
        raise InvalidInputError(f"score must be a number above 0 and up to 1, not {value!r:.40}")
    return number


def _candidates(
    name: str, model: Model, scene: Scene, eye: Array | None, least: float, threads: int | None
) -> list[_Candidate]:
    """Give poses of a model that are good enough where no other instance is near."""
    if model.radius < SPACINGS * scene.spacing:
        model = model.with_radius(SPACINGS * scene.spacing, threads)
    voxel = max(model.voxel, model.spacing, _SPACINGS_APART * scene.spacing)
    voxel = max(voxel, _NOISES_APART * scene.surroundings(voxel).noise)
    signatures = scene.signatures(model.radius)
    coarse, fine = scene.surroundings(_COARSE * voxel), scene.surroundings(voxel)
    sides = [model] if model.sided and scene.sided else [model, model.inside_out(threads)]
    found: list[tuple[float, _Candidate]] = []
    for side in sides:
        first, last = Witness(side, coarse, eye, _FEW), Witness(side, fine, eye, None)
        poses = proposed_poses(side.signatures, signatures, _PROPOSALS)
        if not len(poses):
            continue
        poses = first.settled(poses, _FIRST_REACHES, threads)
        scores = np.array([evidence.score for evidence in first.judged(poses, coarse.all_free)])
        order = np.argsort(-scores, kind="stable")
        tried = _different(poses[order[scores[order] > 0.0]], side.radius)[:_TRIED]
        if not tried:
            continue
        better = last.settled(np.array(tried), _LAST_REACHES, threads)
        for pose, evidence in zip(better, last.judged(better, fine.all_free), strict=True):
            if evidence.score >= least:
                found.append((evidence.score, _Candidate(name, last, side, pose)))
    return [candidate for _, candidate in sorted(found, key=lambda pair: -pair[0])]


def _different(poses: Array, radius: float) -> list[Array]:
    """Leave out poses that are one with an earlier one."""
    kept: list[Array] = []
    for pose in poses:
        for other in kept:
            near = np.linalg.norm(pose[:3, 3] - other[:3, 3]) < _SAME_MIDDLE * radius
            if near and rotation_angle(inverse(pose) @ other) < _SAME_TURN:
                break
        else:
            kept.append(pose)
    return kept


def _accepted(candidates: list[_Candidate], scene: Scene, least: float) -> Instances:
    """Take the best candidate and its part of the scene away, until none is good enough."""
    instances: list[Instance] = []
    models: dict[str, PointCloud] = {}
    taken = np.zeros(len(scene.points), np.bool_)
    while candidates:
        scores = np.array([_weighed(candidate).score for candidate in candidates])
        kept = np.flatnonzero(scores >= least)
        if not len(kept):
            break
        best = candidates[kept[np.argmax(scores[kept])]]
        found = _instance(best, scene, taken)
        if found is not None and found.score >= least:
            instances.append(found)
            models[best.name] = PointCloud(best.model.points, best.model.middle)
        candidates = [candidates[number] for number in kept if candidates[number] is not best]
    instances.sort(key=lambda instance: -instance.score)
    return Instances(instances, scene.given, models)


def _weighed(candidate: _Candidate) -> Evidence:
    """Judge a candidate by what no instance explains yet."""
    return candidate.witness.judged(candidate.pose[None], candidate.witness.around.free)[0]


def _instance(candidate: _Candidate, scene: Scene, taken: NDArray[np.bool_]) -> Instance | None:
    """Fit the scene's own points to the model's surface, and take what is explained away."""
    witness, model = candidate.witness, candidate.model
    around = witness.around
    near = candidate.near(scene.points)
    moved = spread(scene.points[near & ~taken], _MOST_FITTED, scene.threads)
    fitted = contact(
        moved, Surface(model.points, around.voxel, scene.threads), inverse(candidate.pose), around.voxel
    )
    if fitted is None:
        return None
    pose = inverse(fitted.pose)
    better = replace(candidate, pose=pose)
    evidence = _weighed(better)
    for part in scene.parts():
        part.free[better.near(part.places)] = False
    own = better.near(scene.points) & ~taken
    taken |= own
    # A small motion of the scene in the model's axes is the opposite one of the model in the scene's.
    turn = np.kron(np.eye(2), pose[:3, :3])
    center = transform_points(pose, fitted.center)
    return Instance(
        name=candidate.name,
        T_scene_model=from_translation(scene.middle) @ pose @ from_translation(-model.middle),
        covariance=turn @ fitted.covariance @ turn.T,
        center=center + scene.middle,
        score=evidence.score,
        visible=evidence.visible,
        overlap=evidence.overlap,
        rms=fitted.rms,
        free_directions=free_directions(
            transform_points(pose, fitted.places) + scene.middle, rotate(pose, fitted.normals)
        ),
        indices=scene.numbers[own],
    )
