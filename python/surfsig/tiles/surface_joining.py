"""Which surfaces of neighbouring tiles are one: those that the core joins, by what their tiles found."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Container, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.tiles.manifest import PIECES
from surfsig.tiles.plan import Plan
from surfsig.tiles.surface_pieces import FEWEST_IN_COMMON, Found, plain, write_arrays

JOINED = "joined.npz"


@dataclass(frozen=True)
class Joined:
    """What the surfaces of all tiles have become.

    Attributes
    ----------
    first
        (t + 1,), the number of each tile's first piece, in the order of tiles.
    surfaces
        (p,), the number of each piece's surface.
    whole
        (s, 2), of each surface that one tile has alone the tile and the label; else -1.
    values
        Of all others ``entry``, what the core found, or fitted to a sample of several pieces, and ``alone``,
        the largest piece.
    """

    first: NDArray[np.int64]
    surfaces: NDArray[np.int64]
    whole: NDArray[np.int64]
    values: dict[int, dict[str, Any]]

    def of_points(self, out: Path, tile: int) -> NDArray[np.int64]:
        """Give the number of the surface of each of a tile's points; -1 for none."""
        found, links = Found.of(out, tile), Found.of(out, tile, "links")
        labels = found.array("own_labels")
        surfaces = np.full(len(labels), -1, np.int64)
        own = labels >= 0
        surfaces[own] = self.surfaces[self.first[tile] + labels[own]]
        lent = links.array("lent")
        surfaces[lent] = self.surfaces[self.first[links.array("lent_tile")] + links.array("lent_label")]
        return surfaces

    def write(self, out: Path) -> None:
        """Write it for the tasks that follow."""
        arrays = {"first": self.first, "surfaces": self.surfaces, "whole": self.whole}
        write_arrays(out / PIECES / JOINED, arrays, {str(number): one for number, one in self.values.items()})

    @classmethod
    def read(cls, out: Path) -> Joined:
        """Take it back."""
        found = Found(out / PIECES / JOINED)
        values = {int(number): one for number, one in found.values().items()}
        return cls(found.array("first"), found.array("surfaces"), found.array("whole"), values)


def joined_pieces(out: Path, plan: Plan, tiles: Sequence[int]) -> Joined:
    """Join the surfaces that some tiles have found.

    Memory goes with the number of surfaces that reach a tile's border, of each of which there is a sample.
    """
    first = np.zeros(len(plan) + 1, np.int64)
    places: list[tuple[int, int]] = []
    # Of the pieces that reach a border, their number, entry, sample and rounding.
    border: dict[int, tuple[dict[str, Any], NDArray[np.float64], float]] = {}
    for tile in tiles:
        found = Found.of(out, tile)
        values, samples, ends = found.values(), found.array("samples"), found.array("sample_ends")
        first[tile + 1] = len(values["pieces"])
        for label, piece in enumerate(values["pieces"]):
            if not piece["is_inside"]:
                sample = samples[ends[label] : ends[label + 1]]
                border[len(places)] = piece["entry"], sample, values["rounding"]
            places.append((tile, label))
    first = np.cumsum(first)
    numbers = sorted(border)
    place = {number: at for at, number in enumerate(numbers)}
    pairs = [
        (place[one], place[other], overlap) for one, other, overlap in _pairs(out, plan, tiles, first, border)
    ]
    groups, primitives = _surfsig.join_surface_pieces([border[number] for number in numbers], pairs)
    members: defaultdict[int, list[int]] = defaultdict(list)
    for number, group in zip(numbers, groups.tolist(), strict=True):
        members[group].append(number)
    group_of = {some[0]: group for group, some in members.items()}
    surfaces = np.full(len(places), -1, np.int64)
    whole: list[tuple[int, int]] = []
    joined: dict[int, dict[str, Any]] = {}
    # In the order of their first pieces.
    for number, tile_and_label in enumerate(places):
        if number not in border:
            surfaces[number] = len(whole)
            whole.append(tile_and_label)
        elif number in group_of:
            group = group_of[number]
            entries = [border[member][0] for member in members[group]]
            largest = max(entries, key=lambda entry: int(entry["count"]))
            several = len(entries) > 1
            surfaces[members[group]] = len(whole)
            joined[len(whole)] = {
                "entry": {**largest, **plain(primitives[group])} if several else largest,
                "alone": largest,
            }
            whole.append((-1, -1))
    return Joined(first, surfaces, np.array(whole, np.int64).reshape(-1, 2), joined)


def _pairs(
    out: Path, plan: Plan, tiles: Sequence[int], first: NDArray[np.int64], border: Container[int]
) -> list[tuple[int, int, bool]]:
    """Give pairs of pieces of neighbouring tiles, and whether they overlap."""
    common: Counter[tuple[int, int]] = Counter()
    there = set(tiles)
    of_tile = {
        tile: [number for number in range(first[tile], first[tile + 1]) if number in border] for tile in tiles
    }
    pairs = []
    for tile in tiles:
        for label, other, other_label, count in Found.of(out, tile, "links").array("overlaps").tolist():
            one, two = int(first[tile]) + label, int(first[other]) + other_label
            common[min(one, two), max(one, two)] += count
        for other in plan.touching(plan.boxes[tile]):
            if other > tile and other in there:
                pairs += [(one, two, False) for one in of_tile[tile] for two in of_tile[other]]
    overlapping = [pair for pair, count in sorted(common.items()) if count >= FEWEST_IN_COMMON]
    return pairs + [(one, two, True) for one, two in overlapping if one in border and two in border]
