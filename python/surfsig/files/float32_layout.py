"""How long the rows of a file of nothing but float32 are, told by what its numbers can be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

# Metres: far beyond the reach of any scanner.
FARTHEST = 1e6
MOST_INTENSITY = 65535.0
"""What the wide integers of scanners reach; others write 0 to 255, or 0 to 1."""
MOST_RINGS = 512
"""No scanner has so many lasers."""

# Where rows of 3, 4, 5, 6, 7 and 8 values all begin: blocks of the sample start and end there.
_COMMON_ROWS = 840
_BLOCK_VALUES = 4 * _COMMON_ROWS
_MOST_BLOCKS = 6
# Classes of value, each with as many of the sample's, by which places in a row are compared.
_CLASSES = 16
# Values that a class needs at each place for chi squared to mean anything, and a sample for its median step.
_FEWEST_EXPECTED, _FEWEST_STEPS = 5, 120
# How much more than by chance the places of a row must differ, in standard deviations of chi squared.
_CLEAR_DEVIATIONS = 8.0
# Of the true length every place has values of its own kind; another mixes them.
_SHARE_OF_BEST = 0.7
_LONGER_EXPLAINS = 1.5
_ROUGHNESS_ALLOWED = 1.8
# A property that a column has by chance less often than this (as a power of ten) says what it is.
_CHANCE = -6.0
# How far a normal's squared length is from 1 at most; hardly one vector in a hundred is as near.
_LENGTH_TOLERANCE, _DIGITS_OF_LENGTH = 0.01, 2.0
# Lengths of rows that are only recognised, so that they are not taken for shorter ones.
_LONGER = (7, 8)


_Number = TypeVar("_Number", np.float32, np.int64)


class _Limits(NamedTuple):
    lowest: float
    highest: float
    whole: bool = False


_MOST_COORDINATE = float(np.nextafter(np.float32(FARTHEST), np.float32(0)))
_COORDINATE = _Limits(-_MOST_COORDINATE, _MOST_COORDINATE)
_FINITE = _Limits(float(np.finfo(np.float32).min), float(np.finfo(np.float32).max))
_LIMITS = {
    **dict.fromkeys(("x", "y", "z"), _COORDINATE),
    "intensity": _Limits(0, MOST_INTENSITY),
    "ring": _Limits(0, MOST_RINGS, whole=True),
    "time": _FINITE,
    **dict.fromkeys(("red", "green", "blue"), _Limits(0, 255, whole=True)),
    **dict.fromkeys(("nx", "ny", "nz"), _Limits(-1 - _LENGTH_TOLERANCE, 1 + _LENGTH_TOLERANCE)),
}


@dataclass(frozen=True)
class RowLayout:
    """What the values of a row are.

    Attributes
    ----------
    names
        Of the columns.
    told
        In words, for messages.
    signed
        The intensity may be negative.
    """

    names: tuple[str, ...]
    told: str
    signed: bool = False

    @property
    def width(self) -> int:
        """Values of a row."""
        return len(self.names)

    def fits(self, columns: Sequence[NDArray[np.float32]]) -> bool:
        """Tell whether these values (n,), a column each, can be what the layout says."""
        inside = all(
            _within(values, _FINITE if self.signed and name == "intensity" else _LIMITS[name])
            for name, values in zip(self.names, columns, strict=True)
        )
        if not inside or "nx" not in self.names:
            return inside
        lengths = _squared_lengths(columns[3:6])
        unit = np.abs(lengths - 1) < _LENGTH_TOLERANCE
        # A point without a normal has 0 0 0; where most have none, they are something else.
        return bool((unit | (lengths == 0)).all()) and 2 * int(np.count_nonzero(unit)) >= len(lengths)


def _within(values: NDArray[np.float32], limits: _Limits) -> bool:
    # Side by side in memory, the values are compared several at once.
    values = np.ascontiguousarray(values)
    # Any NaN makes both NaN.
    low, high = values.min(initial=limits.highest), values.max(initial=limits.lowest)
    inside = bool(limits.lowest <= low and high <= limits.highest)
    return inside and (not limits.whole or bool((values == np.floor(values)).all()))


def _squared_lengths(vector: Sequence[NDArray[np.float32]]) -> NDArray[np.float64]:
    x, y, z = (values.astype(np.float64) for values in vector)
    lengths: NDArray[np.float64] = x * x + y * y + z * z
    return lengths


XYZ = RowLayout(("x", "y", "z"), "x y z")
INTENSITY = RowLayout((*XYZ.names, "intensity"), "x y z intensity")
SIGNED_INTENSITY = RowLayout(INTENSITY.names, INTENSITY.told, signed=True)
LAYOUTS = (
    XYZ,
    INTENSITY,
    RowLayout((*INTENSITY.names, "ring"), "x y z intensity ring"),
    RowLayout((*INTENSITY.names, "time"), "x y z intensity time"),
    RowLayout((*XYZ.names, "red", "green", "blue"), "x y z red green blue"),
    RowLayout((*XYZ.names, "nx", "ny", "nz"), "x y z and a normal"),
    RowLayout((*INTENSITY.names, "ring", "time"), "x y z intensity ring time"),
)


def sample(file: BinaryIO, count: int) -> list[NDArray[np.float32]]:
    """Read blocks from all over a file of `count` values, each from where rows of any length begin."""
    blocks = max(1, min(_MOST_BLOCKS, count // _BLOCK_VALUES))
    last = max(0, count - _BLOCK_VALUES) // _COMMON_ROWS
    parts = []
    for place in np.unique(np.linspace(0, last, blocks).astype(np.int64)):
        file.seek(int(place) * _COMMON_ROWS * 4)
        data = file.read(4 * _BLOCK_VALUES)
        parts.append(np.frombuffer(data[: len(data) // 4 * 4], "<f4"))
    return parts


@dataclass(frozen=True)
class Finding:
    """What the rows of a file may be.

    Attributes
    ----------
    layouts
        Those that fit, the likeliest first.
    widths
        The lengths of rows that the numbers allow.
    certain
        The first layout is what the file holds.
    """

    layouts: list[RowLayout]
    widths: set[int]
    certain: bool


def fitting_layouts(parts: Sequence[NDArray[np.float32]], count: int) -> Finding:
    """Tell the layouts that a file of `count` values can have by its `sample`."""
    possible = [layout for layout in LAYOUTS if count % layout.width == 0]
    rows = {layout: _rows(parts, layout.width) for layout in possible}
    fitting = [layout for layout in possible if layout.fits([*rows[layout].T])]
    # What only such rows have, as normals of the length 1, says more than where values are alike.
    proven = [layout for layout in fitting if _chance(layout, rows[layout], parts, marks=True) < _CHANCE]
    if len({layout.width for layout in proven}) == 1:
        return Finding([_strictest(proven)], {proven[0].width}, certain=True)
    widths, told = _by_structure(parts, count)
    fitting = [layout for layout in fitting if layout.width in widths]
    proven = [layout for layout in fitting if _chance(layout, rows[layout], parts, marks=False) < _CHANCE]
    if len({layout.width for layout in proven}) == 1:
        fitting = proven
    if len({layout.width for layout in fitting}) == 1:
        best = _strictest(fitting)
        # Nothing speaks against three values a row, ever.
        certain = best is not XYZ or told or widths == {3}
        return Finding([best], widths, certain)
    if not fitting and 4 in widths and all(_within(v, _COORDINATE) for v in rows[INTENSITY].T):
        # KITTI's rows but for what is negative: no other layout is left.
        return Finding([SIGNED_INTENSITY], widths, certain=True)
    return Finding(fitting, widths, certain=False)


def _strictest(layouts: Sequence[RowLayout]) -> RowLayout:
    """Choose among layouts of one length: a ring could be a time as well, a normal nothing else."""
    order = ("time", "intensity", "ring", "red", "nx")
    return max(
        layouts, key=lambda layout: max((order.index(n) for n in layout.names if n in order), default=-1)
    )


def _rows(parts: Sequence[NDArray[_Number]], width: int) -> NDArray[_Number]:
    return np.concatenate([part[: len(part) // width * width].reshape(-1, width) for part in parts])


def _chance(
    layout: RowLayout, rows: NDArray[np.float32], parts: Sequence[NDArray[np.float32]], *, marks: bool
) -> float:
    """Give the chance, as a power of ten, that columns are what they are where the rows are others.

    A column that mixed the others would have a property as often as all values have it. With `marks`, only
    properties count that hardly anything else has: whole numbers of rings and colours, the length of normals.
    """
    if "nx" in layout.names:
        # Points on a sphere of radius 1 have this length as well.
        others = np.abs(_squared_lengths([*rows.T[:3]]) - 1) > _LENGTH_TOLERANCE
        return -_DIGITS_OF_LENGTH * int(np.count_nonzero(others))
    values = np.concatenate(list(parts))
    exponent = 0.0
    for i, name in enumerate(layout.names[3:], 3):
        if name == "time" or (marks and name == "intensity"):
            continue
        limits = _LIMITS[name]
        if name == "intensity" and rows[:, i].max(initial=0) <= 1:
            limits = _Limits(0, 1)
        fit = (values >= limits.lowest) & (values <= limits.highest)
        if limits.whole:
            fit &= values == np.floor(values)
        exponent += len(rows) * np.log10(max(float(fit.mean()), 1e-9))
    return exponent


def _by_structure(parts: Sequence[NDArray[np.float32]], count: int) -> tuple[set[int], bool]:
    """Give the lengths of rows at which each place has its own kind of value, and whether others are not."""
    possible = [width for width in (*range(3, 7), *_LONGER) if count % width == 0]
    explained = _explained(parts, possible)
    best = max((share for share, clear in explained.values() if clear), default=0.0)
    kept = {
        width
        for width, (share, clear) in explained.items()
        if not best or (clear and share >= _SHARE_OF_BEST * best)
    }
    if sum(map(len, parts)) >= _FEWEST_STEPS:
        rough = {width: _roughness(parts, width) for width in possible}
        smoothest = min(rough.values(), default=0.0)
        kept &= {width for width, value in rough.items() if value <= _ROUGHNESS_ALLOWED * smoothest}
    told = len(kept) < len(possible)
    shares = {width: explained[width][0] for width in kept}
    shorter = max((share for width, share in shares.items() if width not in _LONGER), default=0.0)
    if any(shares[width] > _LONGER_EXPLAINS * shorter for width in kept if width in _LONGER):
        return set(), True
    return kept - {*_LONGER}, told


def _explained(parts: Sequence[NDArray[np.float32]], widths: Sequence[int]) -> dict[int, tuple[float, bool]]:
    """Say how much the place in a row of each length tells of a value, and if that is clear.

    How much is the mean square contingency of places and classes of value.
    """
    values = np.sort(np.concatenate(list(parts)))
    sizes = {width: min(_CLASSES, len(values) // (_FEWEST_EXPECTED * width)) for width in widths}
    # Most samples are large enough to have the same classes for rows of any length.
    classes = {number: _classes(values, parts, number) for number in {*sizes.values()} if number >= 2}
    return {
        width: _contingency(*classes[number], width) if number in classes else (0.0, False)
        for width, number in sizes.items()
    }


def _classes(
    ordered: NDArray[np.float32], parts: Sequence[NDArray[np.float32]], number: int
) -> tuple[list[NDArray[np.int64]], int]:
    """Put the values of each part into classes of about equal size; also how many there are."""
    places = np.linspace(0, len(ordered) - 1, number + 1)[1:-1]
    edges = np.unique(np.interp(places, np.arange(len(ordered)), ordered).astype(np.float32))
    return [np.searchsorted(edges, part, side="right") for part in parts], len(edges) + 1


def _contingency(parts: Sequence[NDArray[np.int64]], number: int, width: int) -> tuple[float, bool]:
    """Give the mean square contingency of classes and their places in a row, and whether it is clear."""
    cells = _rows(parts, width) + number * np.arange(width)
    table = np.bincount(cells.ravel(), minlength=width * number).reshape(width, number)
    expected = table.sum(axis=1, keepdims=True) * table.sum(axis=0) / table.sum()
    there = expected > 0
    chi_squared = float((np.square(table - expected)[there] / expected[there]).sum())
    free = (width - 1) * (number - 1)
    clear = chi_squared > free + _CLEAR_DEVIATIONS * np.sqrt(2 * free)
    return max(chi_squared - free, 0.0) / max(int(table.sum()), 1), bool(clear and free)


def _roughness(parts: Sequence[NDArray[np.float32]], width: int) -> float:
    """Give the median step from a value to the one a row further: small where points follow a surface."""
    steps = [np.abs(part[width:] - part[:-width]) for part in parts if len(part) > width]
    if not steps:
        return 0.0
    together = np.concatenate(steps)
    # np.median takes twice as long; where it says NaN, so does the sum.
    middle = len(together) // 2
    return float("nan") if np.isnan(together.sum()) else float(np.partition(together, middle)[middle])
