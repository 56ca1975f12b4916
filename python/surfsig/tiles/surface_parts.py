"""What surfaces of several tiles measure, and the parts that say of each point which is its own."""

from __future__ import annotations

import json
import math
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.errors import FileFormatError
from surfsig.point_cloud import PointCloud
from surfsig.shapes.area import covered_area
from surfsig.shapes.geometry import Array, Placement, outline
from surfsig.shapes.measured import measured_surface
from surfsig.shapes.surface import Surface
from surfsig.surfaces.classes import PointClass, belonging
from surfsig.tiles.manifest import PIECES, Record, write_record
from surfsig.tiles.surface_joining import Joined
from surfsig.tiles.surface_pieces import Found, surface_values, write_arrays
from surfsig.tiles.task import TilePoints, TileSource, write_part

SURFACES = "surfaces.npz"

MOST_SUMS = 16
"""Tiles whose sums of one surface are kept apart, before they are added: some 2 MB."""


@dataclass(frozen=True)
class MeasureTask:
    """Sums over a tile's points of those surfaces that no tile has alone.

    Attributes
    ----------
    source
        What gives the points.
    out
        The folder of parts.
    origin
        From which coordinates of surfaces are counted.
    """

    source: TileSource
    out: Path
    origin: tuple[float, float, float]

    def __call__(self, tile: int, threads: int | None = None, progress: TilePoints | None = None) -> Record:
        """Work on a tile; give a record with an error where it cannot be read."""
        joined = Joined.read(self.out)
        surfaces = joined.of_points(self.out, tile)
        values: dict[str, Any] = {"counts": _counts(surfaces), "sums": {}}
        arrays: dict[str, NDArray[Any]] = {}
        there = [number for number, _ in values["counts"] if number in joined.values]
        if there:
            try:
                cloud = own_points(self.source, tile)
            except (OSError, FileFormatError) as error:
                return {"tile": tile, "error": str(error)}
            local = np.asarray(cloud.offsets, np.float64) + (cloud.origin - self.origin)
            measured = Found.of(self.out, tile).array("own_measured")
            for number, members in _members(surfaces):
                if number in joined.values:
                    entry = joined.values[number]["entry"]
                    sums, more = _sums(entry, local[members], measured[members])
                    values["sums"][str(number)] = sums
                    arrays |= {f"{name}_{number}": value for name, value in more.items()}
        write_arrays(Found.of(self.out, tile, "sums").path, arrays, values)
        return {"tile": tile}


def _counts(surfaces: NDArray[np.integer]) -> list[list[int]]:
    """Give the numbers of the surfaces that points have, and of how many."""
    numbers, counts = np.unique(surfaces[surfaces >= 0], return_counts=True)
    return np.column_stack([numbers, counts]).tolist()  # type: ignore[no-any-return]


def _members(surfaces: NDArray[np.integer]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Give each surface that points have, with the numbers of these, ascending."""
    order = np.argsort(surfaces, kind="stable")
    ends = np.searchsorted(surfaces[order], np.unique(surfaces), side="right")
    for part in np.split(order, ends[:-1]):
        if len(part) and surfaces[part[0]] >= 0:
            yield int(surfaces[part[0]]), part


def _sums(
    entry: Mapping[str, Any], points: Array, measured: NDArray[np.bool_]
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Sum what a surface's points in a tile tell about it."""
    # With few points away from borders, those at borders count, too, as in the core.
    inner = points[measured] if measured.any() else points
    count, squares, at_limit, crossing, blocks = _surfsig.surface_sums(entry, np.ascontiguousarray(inner))
    placement = placement_of(entry)
    local = points - np.array(entry["point"])
    distances = placement.distances(local)
    values = {
        "count": len(points),
        "mean": points.mean(axis=0).tolist(),
        "squares": float((distances**2).sum()),
        "low": float(distances.min()),
        "high": float(distances.max()),
        "area": covered_area(placement, local),
        "sums": [count, squares, at_limit, crossing],
    }
    return values, {"blocks": blocks, "outline": outline(placement, local) + np.array(entry["point"])}


def placement_of(entry: Mapping[str, Any]) -> Placement:
    """Give the surface of the core's values about its own point."""
    axis = np.array(entry["axis"])
    return Placement(entry["kind"], axis, entry["radius"], entry["major_radius"], entry["half_angle"])


def own_points(source: TileSource, tile: int) -> PointCloud:
    """Read a tile's own points, in the order of the input."""
    points = source.read(tile, 0.0)
    return points.cloud if points.own.all() else points.cloud.at(points.own)


class _Sums:
    """What tiles summed of one surface, of one tile after the other."""

    def __init__(self) -> None:
        self.tiles: list[int] = []
        self.count = self.squares = self.area = 0.0
        self.low, self.high = math.inf, -math.inf
        self.mean = np.zeros(3)
        self.sums: list[tuple[int, float, int, float, Array]] = []
        self.outlines: list[Array] = []

    def add(
        self, values: Mapping[str, Any], blocks: Array, outlined: Array, placed: Mapping[str, Any]
    ) -> None:
        self.count += values["count"]
        self.squares += values["squares"]
        self.area += values["area"] if math.isfinite(values["area"]) else 0.0
        self.low, self.high = min(self.low, values["low"]), max(self.high, values["high"])
        self.mean += values["count"] * np.array(values["mean"])
        self.outlines.append(outlined)
        count, squares, at_limit, crossing = values["sums"]
        self.sums.append((count, squares, at_limit, crossing, blocks))
        if len(self.sums) > MOST_SUMS:
            self.sums = [_surfsig.added_sums(self.sums)]
            points, point = np.concatenate(self.outlines), np.array(placed["point"])
            self.outlines = [outline(placement_of(placed), points - point) + point]


def assembled(
    out: Path, tiles: Sequence[int], origin: Array
) -> tuple[list[dict[str, Any]], NDArray[np.int64]]:
    """Put together what all tiles measured.

    Parameters
    ----------
    out
        The folder of parts.
    tiles
        Those that were measured.
    origin
        (3,), from which the tiles' coordinates of surfaces are counted.

    Returns
    -------
    The surfaces, the one with most points first: their values, with ``points``, their number, and ``tiles``.
    And of each joined surface its number among these; -1 where it has no points.
    """
    joined = Joined.read(out)
    counts: Counter[int] = Counter()
    of_tiles: defaultdict[int, list[int]] = defaultdict(list)
    sums: defaultdict[int, _Sums] = defaultdict(_Sums)
    whole: dict[int, dict[str, Any]] = {}
    for tile in tiles:
        found, pieces = Found.of(out, tile, "sums"), Found.of(out, tile).values()["pieces"]
        values = found.values()
        for number, count in values["counts"]:
            counts[number] += count
            of_tiles[number].append(tile)
            if number not in joined.values and joined.whole[number, 0] == tile:
                whole[number] = pieces[joined.whole[number, 1]]["surface"]
        for name, of_tile in values["sums"].items():
            entry = joined.values[int(name)]["entry"]
            blocks, outlined = found.array(f"blocks_{name}"), found.array(f"outline_{name}")
            sums[int(name)].add(of_tile, blocks, outlined, entry)
    order = sorted(counts, key=lambda number: (-counts[number], number))
    numbers = np.full(len(joined.whole), -1, np.int64)
    numbers[order] = np.arange(len(order))
    surfaces = []
    for number in order:
        found_of = whole[number] if number in whole else _whole(joined.values[number], sums[number], origin)
        surfaces.append({**found_of, "points": counts[number], "tiles": of_tiles[number]})
    return surfaces, numbers


def _whole(joined: Mapping[str, Any], sums: _Sums, origin: Array) -> dict[str, Any]:
    """Describe a surface by what its tiles summed."""
    entry, fitted = joined["entry"], joined["alone"]
    # Who has seen all of it has measured it.
    if fitted["count"] < sums.count:
        found = _surfsig.surface_of_sums(entry, sums.sums)
        fitted = {**entry, "deviation": math.nan, "covariance": (), "across": ()} if found is None else found
    fitted = {**fitted, "checked": True}
    for name in ("point", "axis", "covariance", "across"):
        fitted[name] = np.asarray(fitted[name], np.float64)
    points = np.concatenate(sums.outlines)
    surface = measured_surface(
        {**fitted, "point": fitted["point"] + origin}, points, origin, np.arange(len(points))
    )
    values = surface_values(surface)
    if entry["kind"] == "plane":
        foot = placement_of(fitted).foot(sums.mean / sums.count - fitted["point"])
        values["center"] = (fitted["point"] + origin + foot).tolist()
    # About the surface that the sums are about, which differs from the fitted one by less than its error.
    more = {
        "rms": math.sqrt(sums.squares / sums.count),
        "area": sums.area,
        "form_error": sums.high - sums.low,
    }
    return {**values, **more}


@dataclass(frozen=True)
class WriteTask:
    """Writes the part of a tile, with the surface of each point.

    Attributes
    ----------
    source
        What gives the points.
    out
        The folder of parts.
    suffix
        Of the parts.
    numbers
        Whether parts have a column ``point_number``.
    """

    source: TileSource
    out: Path
    suffix: str
    numbers: bool

    def __call__(self, tile: int, threads: int | None = None, progress: TilePoints | None = None) -> Record:
        """Work on a tile; give its record, with an error where it cannot be read.

        Raises
        ------
        OSError
            If the part cannot be written.
        """
        clock, processor = time.perf_counter(), time.process_time()
        try:
            cloud = own_points(self.source, tile)
        except (OSError, FileFormatError) as error:
            return {"tile": tile, "error": str(error)}
        if not len(cloud):
            record: Record = {"tile": tile, "part": None, "bytes": 0, "points": 0}
            write_record(self.out, record)
            return record
        found = Found.of(self.out, tile)
        columns = _columns(cloud, *self._surfaces(tile), found)
        if self.numbers:
            columns["point_number"] = found.array("own_numbers").astype(np.int64)
        more = {"in_surfaces": int((columns["surface"] >= 0).sum())}
        return write_part(self.out, tile, self.suffix, cloud, columns, {}, more, (clock, processor))

    def _surfaces(self, tile: int) -> tuple[NDArray[np.int32], dict[int, TileSurface]]:
        """Give the surface of each point, and those that there are."""
        everything = Found(self.out / PIECES / SURFACES)
        joined = Joined.read(self.out).of_points(self.out, tile)
        # The last number is that of points without a surface.
        labels = np.append(everything.array("numbers"), -1)[joined].astype(np.int32)
        texts, ends = everything.array("texts"), everything.array("ends")
        there = np.unique(labels[labels >= 0]).tolist()
        return labels, {
            number: surface_of(json.loads(texts[ends[number] : ends[number + 1]].tobytes()))
            for number in there
        }


def write_surfaces(out: Path, surfaces: Sequence[Mapping[str, Any]], numbers: NDArray[np.int64]) -> None:
    """Write what `assembled` gives, for the parts."""
    texts = [np.frombuffer(json.dumps(one).encode(), np.uint8) for one in surfaces]
    arrays = {
        "numbers": numbers,
        "texts": np.concatenate([np.empty(0, np.uint8), *texts]),
        "ends": np.cumsum([0, *map(len, texts)]),
    }
    write_arrays(out / PIECES / SURFACES, arrays, {})


def _columns(
    cloud: PointCloud, labels: NDArray[np.int32], surfaces: Mapping[int, Surface], found: Found
) -> dict[str, NDArray[Any]]:
    """Give the columns that `surfsig.Surfaces.columns` names."""
    classes, confidence = found.array("own_classes"), found.array("own_confidence")
    kinds = np.zeros(len(labels), np.uint8)
    deviations = np.full(len(labels), np.nan)
    for number, members in _members(labels):
        surface = surfaces[number]
        deviations[members] = surface.distances(cloud.offsets[members] + cloud.origin)
        kinds[members] = PointClass[surface.kind.upper()]
        confidence[members] = belonging(surface, deviations[members])
    return {
        "surface": labels,
        "surface_kind": kinds,
        "point_class": np.where(labels >= 0, kinds, classes),
        "confidence": confidence,
        "deviation": deviations.astype(np.float32),
    }


@dataclass(frozen=True, eq=False, repr=False)
class TileSurface(Surface):
    """A surface of a cloud in tiles; it does not know its members' numbers, but has the number of them."""

    points: int = 0
    """Number of its points."""
    tiles: tuple[int, ...] = ()
    """The tiles that have some of them."""

    @property
    def count(self) -> int:
        """Number of its points."""
        return self.points


_VECTORS = ("point", "axis", "center", "across", "covariance")


def surface_of(values: Mapping[str, Any]) -> TileSurface:
    """Make a surface of its values."""
    arrays = {name: np.array(values[name], np.float64) for name in _VECTORS}
    return TileSurface(**{**values, **arrays, "members": np.arange(0), "tiles": tuple(values["tiles"])})
