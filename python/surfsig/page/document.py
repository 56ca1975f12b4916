"""The page as a document: the viewer with the data inside."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from surfsig.errors import InvalidInputError
from surfsig.files.atomic import replacing
from surfsig.page.layer import Layer, Trajectory
from surfsig.page.packing import MOST_POINTS, Packer

MOST_ELLIPSOIDS = 60
"""Ellipsoids of a trajectory, evenly chosen: more hide each other."""


def page_html(
    title: str,
    text: str,
    layers: Sequence[Layer],
    *,
    header: Sequence[str] = (),
    rows: Sequence[Sequence[str]] = (),
    quantity: str = "plain",
    unit: str = "unit",
    trajectory: Trajectory | None = None,
    most_points: int = MOST_POINTS,
) -> str:
    """Make a page that needs no network.

    Parameters
    ----------
    title, text
        The page's, and a sentence below.
    layers
        What is drawn. Where one has a stage or a transform, the page has a slider from before to after.
    header, rows
        Of the table. Points whose label is a row's number are chosen with it.
    quantity
        By what points are coloured at first: a column's name as the page has it, "surface", "plain".
    unit
        Of the coordinates: "m", "mm", "cm", "ft", or "unit" where it is not known.
    trajectory
        A line with ellipsoids.
    most_points
        Points of all layers together that the page holds; of more, evenly chosen ones.

    Returns
    -------
    The document, some 1 MB and 4 to 16 bytes a point.
    """
    total = sum(len(layer.points) for layer in layers)
    share = min(1.0, most_points / max(total, 1))
    packer = Packer()
    report = {
        "title": title,
        "text": text,
        "unit": unit,
        "quantity": quantity,
        "header": list(header),
        "rows": [list(row) for row in rows],
        "trajectory": None if trajectory is None else _trajectory(trajectory),
        "layers": [packer.layer(layer, share) for layer in layers],
    }
    report["bytes"] = packer.packed()
    return _with_data(title, "report-data", report)


def source_html(title: str, url: str, name: str) -> str:
    """Make the page that loads a file from the server that it comes from."""
    return _with_data(title, "source-data", {"url": url, "name": name})


def write_page(path: str | Path, document: str) -> None:
    """Write a document, whole or not at all."""
    with replacing(Path(path)) as file:
        file.write(document.encode())


@cache
def viewer() -> str:
    """Give the page as it was built, without data."""
    try:
        return (resources.files("surfsig.page") / "viewer.html").read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InvalidInputError("the page has not been built: run `make page`") from None


def _with_data(title: str, element: str, data: Any) -> str:
    # No "</script>" may stand within the element.
    content = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
    script = f'<script type="application/json" id="{element}">{content}</script>'
    page = viewer().replace("<title>surfsig</title>", f"<title>{html.escape(title)}</title>", 1)
    return page.replace("<!--data-->", script, 1)


def _trajectory(trajectory: Trajectory) -> dict[str, Any]:
    known = np.flatnonzero(np.isfinite(trajectory.positions).all(axis=1))
    covariances = trajectory.covariances[known]
    with_error = np.flatnonzero(np.isfinite(covariances).all(axis=(1, 2)))
    some = with_error[:: max(1, -(-len(with_error) // MOST_ELLIPSOIDS))]
    return {
        "name": trajectory.name,
        "positions": trajectory.positions[known].tolist(),
        "covariances": [{"pose": int(i), "matrix": covariances[i].ravel().tolist()} for i in some],
    }
