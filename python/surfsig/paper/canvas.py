"""What all figures share: colours, saving, and a check that Matplotlib is there."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ..errors import InvalidInputError
from ..simulate.poses import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLUE: Final = "#2f6db5"
GREEN: Final = "#2a9d4a"
ORANGE: Final = "#d9731a"
RED: Final = "#c0392b"
GREY: Final = "#8a8f98"
DOTS_PER_INCH: Final = 130

#: Points drawn of a cloud at most: more are not seen.
DRAWN: Final = 16_000


def check_matplotlib() -> None:
    """Make sure, before a long computation, that figures can be drawn.

    Raises
    ------
    InvalidInputError
        If Matplotlib is not installed.
    """
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise InvalidInputError("figures need Matplotlib: pip install 'surfsig[plot]'") from None


def new_figure(width: float, height: float) -> Figure:
    """Make an empty figure, of sizes in inches; it needs no screen."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained")


def png(figure: Figure) -> bytes:
    """Render a figure."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", facecolor="white")
    return buffer.getvalue()


def space(figure: Figure, position: Any = 111, *, elevation: float = 28.0, azimuth: float = -60.0) -> Any:
    """Add axes in three dimensions, in millimetres, heights (negative z) upwards as the paper draws them."""
    axes: Any = figure.add_subplot(position, projection="3d")
    axes.view_init(elev=elevation, azim=azimuth)
    axes.set_xlabel("x, mm")
    axes.set_ylabel("y, mm")
    axes.set_zlabel("z, mm")
    axes.tick_params(labelsize=8)
    return axes


def limit(axes: Any, points: Array) -> None:
    """Set the axes' limits and true proportions for points (n, 3) in millimetres; -z is up."""
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(high[2], low[2])
    axes.set_box_aspect(np.maximum(high - low, 0.2 * (high - low).max()), zoom=1.0)


def sample(points: Array, count: int = DRAWN) -> Array:
    """At most so many of the points (n, ...), evenly taken."""
    return points[:: max(1, -(-len(points) // count))]
