"""Clouds in units that cannot go together, told by how many times one is as large as the other."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from surfsig.point_cloud import PointCloud


class _Units(NamedTuple):
    """Two units of length: how many of the first make one of the second."""

    ratio: float
    smaller: str
    larger: str


_PAIRS = (
    _Units(1000.0, "millimetres", "metres"),
    _Units(304.8, "millimetres", "feet"),
    _Units(100.0, "centimetres", "metres"),
    _Units(39.37, "inches", "metres"),
    _Units(25.4, "millimetres", "inches"),
    _Units(12.0, "inches", "feet"),
    _Units(3.2808, "feet", "metres"),
)

_LARGE = 50.0
"""Ratio from which on two clouds of one scene are hardly of one unit."""

_WIDE, _NARROW = 2.0, 1.3
"""Factor by which a ratio may differ from a large and from a small one of two units: what two scans show of
one scene differs by a third, and seldom by a half."""


def unit_mismatch(
    a: PointCloud | ArrayLike, b: PointCloud | ArrayLike, names: tuple[str, str] = ("a", "b")
) -> str | None:
    """Say whether one of two clouds of one scene seems to be in another unit than the other.

    Parameters
    ----------
    a, b
        What `PointCloud.of` takes.
    names
        What the text calls them.

    Returns
    -------
    str or None
        A sentence that names the ratio and the units that have it, where one cloud (by the median distance of
        its points from their median) is about 1,000, 305, 100, 39.4, 25.4, 12 or 3.28 times as large as the
        other; None where it is not.
    """
    size_a, size_b = (size_of(PointCloud.of(cloud)) for cloud in (a, b))
    return ratio_text(size_a, size_b, names, "is {ratio} times as large as")


def size_of(cloud: PointCloud) -> float:
    """Median distance of the finite points from their median; NaN where there are none."""
    points = cloud.offsets[cloud.finite].astype(np.float64)
    if not len(points):
        return math.nan
    return float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))


def ratio_text(a: float, b: float, names: tuple[str, str], relation: str) -> str | None:
    """Say in which units two lengths may be that should be about equal; None where no two units explain them.

    Parameters
    ----------
    a, b
        The lengths.
    names
        Whose they are.
    relation
        Stands between the names, with ``{ratio}`` in it.
    """
    if not (a > 0.0 and b > 0.0 and math.isfinite(a) and math.isfinite(b)):
        return None
    if a < b:
        a, b, names = b, a, names[::-1]
    ratio = a / b
    units = min(_PAIRS, key=lambda pair: abs(math.log(ratio / pair.ratio)))
    apart = math.exp(abs(math.log(ratio / units.ratio)))
    if apart > (_WIDE if units.ratio >= _LARGE else _NARROW):
        return None
    told = relation.format(ratio=f"{ratio:.3g}")
    return (
        f"{names[0]} {told} {names[1]}; a factor of {units.ratio:.5g} is that of {units.smaller} and "
        f"{units.larger}: give unit= for each file if their units differ"
    )
