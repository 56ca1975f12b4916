"""A page inside a notebook's cell."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfsig.page.document import page_html
from surfsig.page.layer import Layer

if TYPE_CHECKING:
    from surfsig.point_cloud import PointCloud

NOTEBOOK_POINTS = 100_000
"""Points of a page in a notebook, which keeps every cell's output in its file."""

_STYLE = "width: 100%; height: 34rem; border: 0; border-radius: 8px"


def notebook_html(document: str, title: str) -> str:
    """Give a frame with a page in it.

    Parameters
    ----------
    document
        As `page_html` gives it.
    title
        What a screen reader says.

    Returns
    -------
    HTML for a cell's output.
    """
    title, content = html.escape(title, quote=True), html.escape(document, quote=True)
    return f'<iframe title="{title}" style="{_STYLE}" srcdoc="{content}"></iframe>'


def cloud_html(cloud: PointCloud) -> str:
    """Give a frame with a cloud in it: its points, normals and colours, and its fields of one number a point.

    Parameters
    ----------
    cloud
        Of more than 100,000 points so many are drawn, evenly chosen.

    Returns
    -------
    HTML for a cell's output.
    """
    fields = cloud.fields
    colors = [fields[name] for name in ("red", "green", "blue") if name in fields]
    normals = [fields[name] for name in ("nx", "ny", "nz") if name in fields]
    apart = {"red", "green", "blue", "nx", "ny", "nz"}
    layer = Layer(
        "points",
        cloud.points,
        normals=np.column_stack(normals) if len(normals) == 3 else None,
        colors=np.column_stack([_in_bytes(color) for color in colors]) if len(colors) == 3 else None,
        columns={
            name: values
            for name, values in fields.items()
            if name not in apart and values.ndim == 1 and values.dtype.kind in "fiub"
        },
    )
    text = f"{len(cloud):,} points"
    return notebook_html(page_html("Cloud", text, [layer], most_points=NOTEBOOK_POINTS), "Cloud")


def _in_bytes(color: NDArray[Any]) -> NDArray[np.uint8]:
    """Give 0 to 255 of a colour in 8 bits, in 16, or from 0 to 1; 0 where there is none."""
    if color.dtype.kind == "f":
        color = 255.0 * np.clip(np.nan_to_num(color), 0.0, 1.0)
    elif color.dtype == np.uint16:
        color = color >> 8
    return np.asarray(np.clip(color, 0, 255), np.uint8)
