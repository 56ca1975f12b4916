"""What a page draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Stage = Literal["before", "after"]
"""Whether something is shown before or after what was computed."""


@dataclass(frozen=True, eq=False)
class Layer:
    """Points that belong together. Those that are not finite are left out."""

    name: str
    points: Array
    """(n, 3), in the cloud's unit."""
    normals: NDArray[Any] | None = None
    """Unit normals (n, 3)."""
    color: Sequence[int] | None = None
    """Red, green, blue of all points, 0 to 255."""
    colors: NDArray[np.uint8] | None = None
    """Of each point, (n, 3)."""
    labels: NDArray[np.integer[Any]] | None = None
    """Of each point the number of its row in the table, (n,); -1 for none."""
    label_name: str = "Surface"
    """What a label is."""
    columns: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Numbers of each point, (n,), by name."""
    stage: Stage | None = None
    """When it is shown; None for always."""
    T_target_source: Array | None = None
    """Transform by which the points are moved between before and after, (4, 4)."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A line through positions, with ellipsoids of three standard deviations."""

    positions: Array
    """(n, 3); rows that are not finite are left out."""
    covariances: Array
    """Of the positions, (n, 3, 3), in the positions' axes; not finite where there is none."""
    name: str = "trajectory"
