"""`find_instances`: all instances of models in a scene."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig._surfsig import FindSettings
from surfsig.alignment.free_directions import free_direction
from surfsig.arguments import progress_callback, thread_count
from surfsig.defaults import INSTANCE_SCORE
from surfsig.errors import InvalidInputError
from surfsig.finding.instances import Instance, Instances
from surfsig.finding.library import Library, stored_model
from surfsig.finding.model import Model, model_of
from surfsig.finding.scan import scan_argument
from surfsig.missing_returns import missing_returns, missing_returns_text
from surfsig.point_cloud import PointCloud
from surfsig.resolution import warn_if_too_coarse
from surfsig.spacing import point_spacing
from surfsig.units import ratio_text

_FEWEST = 50
"""Points of a scene without which the core looks for nothing."""


def find_instances(
    model: PointCloud | ArrayLike | Library | Mapping[str, PointCloud | ArrayLike],
    scene: PointCloud | ArrayLike,
    *,
    score: float = INSTANCE_SCORE,
    at_most: int | None = None,
    only: str | Sequence[str] | None = None,
    mask: ArrayLike | None = None,
    settings: FindSettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Instances:
    """Find every instance of a model, or of several, in a scene: transform, score, how much of it is seen.

    Each place of the scene proposes transforms by the places of the model whose field signatures, of patches
    of several sizes, are most like its own. Of those that what the sensor saw speaks for, the ones that most
    others agree with are fitted to the scene's surface, and the probability of each is told by what of the
    model is confirmed, seen through or not measured, how well it agrees, and whether the scene ends where the
    model does. The best is taken, with its points, and the others are judged again without these, until none
    is left that is good enough. So half hidden instances are found, and where there is none, none is. The
    result is always the same.

    Of several models, where the scene's viewpoint is known, each is first looked for briefly, by its largest
    patches; only those that may be there are searched, and read from a library as a whole, a hundred at most
    (`FindSettings.searched`).

    Parameters
    ----------
    model
        `PointCloud`, array (n, 3) of numbers, or any other that `PointCloud.of` takes: a whole object, or one
        view of it; a `Library`, or a mapping of names to clouds, for several. In the scene's unit.
    scene
        A cloud alike. Where it has a viewpoint, or one for each value of its field ``scan``, free space
        counts, or where all of it can have been seen from its origin; otherwise only what is confirmed does.
    score
        Of an instance, at least: the probability that its pose is right.
    at_most
        How many instances of all models are given at most; the most probable ones.
    only
        Names of the models that are looked for, of a `Library` or a mapping; all by default.
    mask
        Which points of the scene an instance may have, (n,) of bool; all by default. Nothing is known of the
        others: leave a margin around what is looked for.
    settings
        For experts; `FindSettings` describes what may be changed.
    threads
        Number of threads; all cores by default. The result is the same.
    progress
        Called with the number of steps done and their total, some twenty times a second.

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
    min_score = _score(score)
    threads = thread_count(threads)
    given = PointCloud.of(scene)
    missing = missing_returns(given)
    if missing.any():
        told = missing_returns_text(int(missing.sum()), len(given))
        warnings.warn(f"the scene: {told}; they are left out", stacklevel=2)
    models = _source(model, _names(only), threads)
    numbers = np.flatnonzero(given.finite & ~missing & _mask(mask, len(given)))
    if len(numbers) < _FEWEST or not models.names:
        return Instances([], given, {}, len(models.names))
    warn_if_too_coarse(given, max(models.radii), "the scene: patches")
    cloud = given.at(numbers)
    names = models.names
    found = _surfsig.find_instances(
        models.radii,
        lambda number, is_brief: models.load(names[number], is_brief).argument(),
        scan_argument(cloud),
        min_score=min_score,
        at_most=_most(at_most),
        settings=settings,
        threads=threads,
        progress=progress_callback(progress),
    )
    instances = []
    for values in found:
        free = [free_direction(*direction) for direction in values.pop("free_directions")]
        name, indices = names[values.pop("model")], numbers[values.pop("indices")]
        values["alternatives"] = [np.array(pose) for pose in values["alternatives"]]
        instances.append(Instance(name=name, free_directions=free, indices=indices, **values))
    if not instances:
        hints = _unit_hints(models, point_spacing(cloud.points))
        if hints:
            others = f"; {len(hints) - 1} other models differ alike" if len(hints) > 1 else ""
            warnings.warn(f"nothing was found, and {hints[0]}{others}", stacklevel=2)
    whole = {instance.name: models.load(instance.name, False) for instance in instances}
    clouds = {name: PointCloud(part.points, part.center) for name, part in sorted(whole.items())}
    return Instances(instances, given, clouds, len(names))


class _Source(NamedTuple):
    """Models that are loaded when they are needed."""

    names: tuple[str, ...]
    radii: list[float]
    """Of their smallest patches."""
    spacings: list[float]
    """Between their points."""
    load: Callable[[str, bool], Model]
    """Gives a model by its name, and whether what `Model.brief` has is enough."""


def _unit_hints(models: _Source, spacing: float) -> list[str]:
    """Say which models seem to be in another unit than a scene whose points are so far apart."""
    relation = "has points {ratio} times as far apart as"
    told = (
        ratio_text(own, spacing, (f"the model '{name}'", "the scene"), relation)
        for name, own in zip(models.names, models.spacings, strict=True)
    )
    return [hint for hint in told if hint is not None]


def _source(model: object, only: tuple[str, ...] | None, threads: int | None) -> _Source:
    if isinstance(model, Library):
        entries = {entry.name: entry for entry in model.list()}
        chosen = [entries[name] for name in _chosen(tuple(entries), only)]
        names = tuple(entry.name for entry in chosen)
        radii, spacings = [entry.radius for entry in chosen], [entry.spacing for entry in chosen]
        return _Source(names, radii, spacings, partial(stored_model, model))
    if isinstance(model, Mapping) and all(isinstance(name, str) for name in model):
        given = {name: model[name] for name in _chosen(tuple(model), only)}
    elif only is None:
        given = {"model": PointCloud.of(model)}
    else:
        raise InvalidInputError("only chooses among the models of a library or a mapping: there is one model")
    models = {name: model_of(cloud, threads=threads) for name, cloud in given.items()}
    parts = models.values()
    radii, spacings = [part.radius for part in parts], [part.spacing for part in parts]
    return _Source(tuple(models), radii, spacings, lambda name, _: models[name])


def _chosen(names: tuple[str, ...], only: tuple[str, ...] | None) -> tuple[str, ...]:
    unknown = [] if only is None else [name for name in only if name not in names]
    if unknown:
        raise InvalidInputError(f"only: there is no model {unknown[0]!r:.60}")
    return names if only is None else tuple(name for name in names if name in only)


def _names(only: str | Sequence[str] | None) -> tuple[str, ...] | None:
    if only is None:
        return None
    names = (only,) if isinstance(only, str) else tuple(only)
    if not names or not all(isinstance(name, str) for name in names):
        raise InvalidInputError("only must be a model's name, or several")
    return names


def _mask(mask: ArrayLike | None, count: int) -> NDArray[np.bool_]:
    if mask is None:
        return np.ones(count, np.bool_)
    array = np.asarray(mask)
    if array.dtype != np.bool_ or array.size != count:
        raise InvalidInputError(f"mask must be {count} values of bool, one for each point of the scene")
    return array.ravel()


def _most(value: int | None) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise InvalidInputError(f"at_most must be a whole number above 0, not {value!r:.40}")
    return int(value)


def _score(value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not 0.0 < number <= 1.0:
        raise InvalidInputError(f"score must be a number above 0 and up to 1, not {value!r:.40}")
    return number
