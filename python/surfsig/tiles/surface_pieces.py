"""The surfaces of one tile: found with its halo, and kept until those of all tiles are known.

A tile's halo belongs to its neighbours, who find the same surfaces there. So what two tiles say of the same
points tells which of their surfaces may be one, and a point at a border that its own tile leaves without a
surface may have one by its neighbour, who saw more of it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.atomic import replacing
from surfsig.shapes.surface import Surface
from surfsig.surfaces.search import AskedSurfaces, found_in
from surfsig.tiles.manifest import PIECES, Record
from surfsig.tiles.task import TilePoints, TileSource

SAMPLE = 1000
"""Points by which a surface is compared with those of other tiles: as many as the core looks at."""

FEWEST_IN_COMMON = 8
"""Points that two tiles must have in common of their surfaces for these to overlap."""

REACH = 0.25
"""A surface that ends nearer to its tile's border than this part of its extent may go on behind a gap: as
wide a gap as the core closes."""


@dataclass(frozen=True)
class FindTask:
    """Finds the surfaces of a tile.

    Attributes
    ----------
    source
        What gives the points.
    out
        The folder of parts.
    asked
        Which surfaces are looked for.
    halo
        Distance from the tile within which points are read.
    origin
        From which coordinates of surfaces are counted.
    """

    source: TileSource
    out: Path
    asked: AskedSurfaces
    halo: float
    origin: tuple[float, float, float]

    def __call__(self, tile: int, threads: int | None = None, progress: TilePoints | None = None) -> Record:
        """Work on a tile; give a record with an error where it cannot be read.

        Raises
        ------
        OSError
            If what was found cannot be written.
        """
        try:
            points = self.source.read(tile, self.halo)
        except (OSError, FileFormatError) as error:
            return {"tile": tile, "error": str(error)}
        cloud, own = points.cloud, points.own
        core = found_in(cloud, self.asked, threads, progress)
        found = core.surfaces(cloud, self.asked, threads)
        box = self.source.plan.boxes[tile]
        pieces: list[dict[str, Any]] = []
        samples = []
        for entry, surface in zip(core.entries, found.surfaces, strict=True):
            members = cloud.offsets[surface.members] + (cloud.origin - self.origin)
            low, high = members.min(axis=0) + self.origin, members.max(axis=0) + self.origin
            reach = max(self.halo, REACH * float(np.linalg.norm(high - low)))
            is_inside = bool((low - reach >= box[0]).all() and (high + reach < box[1]).all())
            # What cannot go on in another tile needs not be compared.
            chosen = np.arange(0) if is_inside else np.arange(0, len(members), -(-len(members) // SAMPLE))
            samples.append(members[chosen])
            pieces.append(
                {
                    "entry": plain({**entry, "point": entry["point"] - self.origin}),
                    "surface": surface_values(surface),
                    "is_inside": is_inside,
                }
            )
        labels = core.labels
        with_surface = ~own & (labels >= 0)
        arrays: dict[str, NDArray[Any]] = {
            "own_labels": labels[own],
            "own_numbers": points.numbers[own],
            "own_measured": core.measured[own],
            "own_classes": found.classes[own],
            "own_confidence": found.confidence[own],
            "halo_labels": labels[with_surface],
            "halo_numbers": points.numbers[with_surface],
            "samples": np.concatenate([np.empty((0, 3)), *samples]),
            "sample_ends": np.cumsum([0, *map(len, samples)]),
        }
        values = {"pieces": pieces, "rounding": core.rounding}
        write_arrays(Found.of(self.out, tile).path, arrays, values)
        return {"tile": tile}


@dataclass(frozen=True)
class LinkTask:
    """Compares what a tile and its neighbours say of its points.

    Attributes
    ----------
    source
        What knows the tiles.
    out
        The folder of parts.
    halo
        Within which each tile found its surfaces.
    """

    source: TileSource
    out: Path
    halo: float

    def __call__(self, tile: int, threads: int | None = None, progress: TilePoints | None = None) -> Record:
        """Write which surfaces overlap those of the tile, and which of its points get one by a neighbour."""
        own = Found.of(self.out, tile)
        numbers, labels = own.array("own_numbers"), own.array("own_labels")
        lent_tile, lent_label = np.full(len(labels), -1, np.int32), np.full(len(labels), -1, np.int32)
        overlaps = [np.empty((0, 4), np.int64)]
        around = self.source.plan.boxes[tile] + np.array([[-self.halo], [self.halo]])
        for other in self.source.plan.touching(around):
            found = Found.of(self.out, other)
            if other == tile or not len(numbers) or not found.path.exists():
                continue
            theirs = found.array("halo_numbers")
            at = np.minimum(np.searchsorted(numbers, theirs), len(numbers) - 1)
            is_own = numbers[at] == theirs
            at, others = at[is_own], found.array("halo_labels")[is_own]
            both = labels[at] >= 0
            pairs, counts = np.unique(
                np.column_stack([labels[at][both], others[both]]), axis=0, return_counts=True
            )
            other_tile = np.full(len(pairs), other)
            overlaps.append(np.column_stack([pairs[:, 0], other_tile, pairs[:, 1], counts]))
            free = ~both & (lent_tile[at] < 0)
            lent_tile[at[free]], lent_label[at[free]] = other, others[free]
        lent = np.flatnonzero(lent_tile >= 0)
        write_arrays(
            Found.of(self.out, tile, "links").path,
            {
                "overlaps": np.concatenate(overlaps),
                "lent": lent,
                "lent_tile": lent_tile[lent],
                "lent_label": lent_label[lent],
            },
            {},
        )
        return {"tile": tile}


@dataclass(frozen=True)
class Found:
    """What was written of a tile."""

    path: Path

    @classmethod
    def of(cls, out: Path, tile: int, stage: str = "found") -> Found:
        """Name what a stage wrote of a tile: "found", "links" or "sums"."""
        return cls(out / PIECES / f"{stage}_{tile:06d}.npz")

    def array(self, name: str) -> NDArray[Any]:
        """Read one array."""
        with np.load(self.path) as arrays:
            values: NDArray[Any] = arrays[name]
        return values

    def values(self) -> dict[str, Any]:
        """Read what is no array."""
        values: dict[str, Any] = json.loads(self.array("values").tobytes())
        return values


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]], values: Mapping[str, Any]) -> None:
    """Write arrays and other values as one file, which appears whole."""
    text = np.frombuffer(json.dumps(values).encode(), np.uint8)
    with replacing(path) as file:
        np.savez(file, **arrays, values=text)  # type: ignore[arg-type]


def plain(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Give a surface of the core as lists and numbers."""
    return {
        name: np.asarray(value).tolist() if isinstance(value, (np.ndarray, list)) else value
        for name, value in entry.items()
    }


def surface_values(surface: Surface) -> dict[str, Any]:
    """Give a surface as lists and numbers, without its members."""
    return plain({one.name: getattr(surface, one.name) for one in fields(Surface) if one.name != "members"})
