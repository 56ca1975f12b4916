"""Colours that tell things apart, and scales of them."""

from __future__ import annotations

import colorsys
import math

import numpy as np
from numpy.typing import NDArray

GREY = (150, 150, 150)
"""For points of none of them."""

_GOLDEN = (math.sqrt(5) - 1) / 2
"""Of the circle of hues: no two of many such steps come close."""

_SHOWN = 0.95
"""Share of the values that a scale spans: a few that are far out would leave all others one colour."""


def distinct_colors(count: int) -> NDArray[np.uint8]:
    """Give so many distinct colours.

    Parameters
    ----------
    count
        How many.

    Returns
    -------
    numpy.ndarray
        Red, green, blue, (count, 3); the first ones are the same for any count.
    """
    lightness = (0.45, 0.62, 0.35)
    colors = [colorsys.hls_to_rgb(0.6 + i * _GOLDEN, lightness[i % 3], 0.75) for i in range(count)]
    return np.round(255 * np.array(colors).reshape(-1, 3)).astype(np.uint8)


def symmetric_limit(values: NDArray[np.float64]) -> float:
    """Give the end of a scale that is symmetric about 0 and spans most values.

    Parameters
    ----------
    values
        (n,); those that are not finite do not count.

    Returns
    -------
    float
        What 95 % of the values are within; 1 where there is none.
    """
    sizes = np.abs(values[np.isfinite(values)])
    return float(np.quantile(sizes, _SHOWN)) if len(sizes) else 1.0
