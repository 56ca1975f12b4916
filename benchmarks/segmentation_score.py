"""How well found surfaces agree with known ones."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from segmentation_truth import TABLE_LABEL, Model, Segment, TableScene

LEAST_OVERLAP = 0.5
UNMIXED_SHARE = 0.9


@dataclass(frozen=True)
class Found:
    """What a method found: (n,) each point's surface (-1 for none), and each surface's kind and radius."""

    labels: NDArray[np.int64]
    kinds: Sequence[str]
    radii: Sequence[float | None]


@dataclass(frozen=True)
class SurfaceScore:
    """Counts that add up over clouds.

    `matched` pairs of a known and a found surface overlap enough, `typed` of them with the right kind; of the
    known surfaces `with_radius` have one, and `radius_errors` (relative) has one entry for each of those that
    is matched with the right kind.
    """

    known: int
    found: int
    matched: int
    typed: int
    points: int
    points_of_right_kind: int
    with_radius: int
    radius_errors: tuple[float, ...]

    @classmethod
    def total(cls, scores: Iterable[SurfaceScore]) -> SurfaceScore:
        """Add up the scores of several clouds."""
        listed = list(scores)
        counts = {
            each.name: sum(getattr(score, each.name) for score in listed)
            for each in fields(cls)
            if each.name != "radius_errors"
        }
        errors = tuple(error for score in listed for error in score.radius_errors)
        return cls(**counts, radius_errors=errors)

    @property
    def f1(self) -> float:
        """The harmonic mean of precision (over found surfaces) and recall (over known ones)."""
        return 2 * self.matched / (self.known + self.found)

    @property
    def typed_f1(self) -> float:
        """The same, where only a match of the right kind counts."""
        return 2 * self.typed / (self.known + self.found)

    @property
    def kind_share(self) -> float:
        """The share of the points whose found surface has the kind of a known one that they belong to."""
        return self.points_of_right_kind / self.points

    @property
    def radius_error(self) -> float | None:
        """The median relative error of the radii, or None where there is none."""
        return statistics.median(self.radius_errors) if self.radius_errors else None


@dataclass(frozen=True)
class TableScore:
    """Counts that add up over scenes; the table is an object, `on_table` are the points of the others."""

    labelled: int
    unmixed: int
    on_table: int
    on_table_unmixed: int
    objects: int
    segments: int

    @classmethod
    def total(cls, scores: Iterable[TableScore]) -> TableScore:
        """Add up the scores of several scenes."""
        listed = list(scores)
        return cls(**{each.name: sum(getattr(score, each.name) for score in listed) for each in fields(cls)})


def score_surfaces(model: Model, found: Found) -> SurfaceScore:
    """Compare the found surfaces with those of a model."""
    pairs = match(model.segments, found.labels)
    typed = [(known, index) for known, index in pairs if known.kind == found.kinds[index]]
    errors = []
    for known, index in typed:
        radius = found.radii[index]
        if known.radius is not None and radius is not None:
            errors.append(abs(radius - known.radius) / known.radius)
    kinds = np.array([*found.kinds, ""])[found.labels]
    right = np.zeros(len(kinds), dtype=bool)
    for known in model.segments:
        right[known.points] |= kinds[known.points] == known.kind
    return SurfaceScore(
        known=len(model.segments),
        found=len(np.unique(found.labels[found.labels >= 0])),
        matched=len(pairs),
        typed=len(typed),
        points=len(kinds),
        points_of_right_kind=int(right.sum()),
        with_radius=sum(known.radius is not None for known in model.segments),
        radius_errors=tuple(errors),
    )


def match(segments: Sequence[Segment], labels: NDArray[np.int64]) -> list[tuple[Segment, int]]:
    """Pair known segments with found ones, each at most once, the best overlap first.

    The overlap is intersection over union. A point that several known segments share may go to any of them:
    it counts where it is in both, and is not missed where it is in another.
    """
    shared = np.bincount(np.concatenate([each.points for each in segments]), minlength=len(labels)) > 1
    sizes = np.bincount(labels[labels >= 0])
    overlaps = []
    for number, segment in enumerate(segments):
        of_points = labels[segment.points]
        both = np.bincount(of_points[of_points >= 0], minlength=len(sizes))
        missed = segment.points[~shared[segment.points]]
        own = np.bincount(labels[missed][labels[missed] >= 0], minlength=len(sizes))
        ratios = both / np.maximum(1, sizes + len(missed) - own)
        overlaps += [(float(ratios[index]), number, int(index)) for index in np.flatnonzero(both)]
    pairs: dict[int, int] = {}
    taken: set[int] = set()
    for overlap, number, index in sorted(overlaps, key=lambda each: -each[0]):
        if overlap >= LEAST_OVERLAP and number not in pairs and index not in taken:
            pairs[number] = index
            taken.add(index)
    return [(segments[number], index) for number, index in pairs.items()]


def score_table(scene: TableScene, found: Found) -> TableScore:
    """Count the labelled points in surfaces that do not mix objects, and the surfaces on each object.

    A surface belongs to the object that has most of its labelled points, and is unmixed where that object has
    at least 90 % of them.
    """
    labelled = scene.objects > 0
    inside = labelled & (found.labels >= 0)
    names, objects = np.unique(scene.objects[labelled], return_inverse=True)
    counts = np.zeros((len(found.kinds), len(names)), dtype=np.int64)
    np.add.at(counts, (found.labels[inside], objects[inside[labelled]]), 1)
    held = counts.sum(axis=1)
    pure = (held > 0) & (counts.max(axis=1, initial=0) >= UNMIXED_SHARE * held)
    unmixed = inside & np.append(pure, False)[found.labels]
    on_table = labelled & (scene.objects != TABLE_LABEL)
    return TableScore(
        labelled=int(labelled.sum()),
        unmixed=int(unmixed.sum()),
        on_table=int(on_table.sum()),
        on_table_unmixed=int((unmixed & on_table).sum()),
        objects=len(names),
        segments=int((held > 0).sum()),
    )
