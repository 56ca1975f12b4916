"""One self-contained page about the curvature of a scan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from surfsig.page import Layer, page_html
from surfsig.page.packing import MOST_POINTS

if TYPE_CHECKING:
    from surfsig.extraction import Extraction

COLUMNS = ("k1", "k2", "k1_std", "k2_std", "mean_curvature_std")
"""What the page has of each place; it computes H and K itself."""


def report_html(
    extraction: Extraction,
    title: str,
    more: Mapping[str, ArrayLike] | None = None,
    most_points: int = MOST_POINTS,
) -> str:
    """Make the page: the places coloured by curvature, its standard errors, class or normal.

    Parameters
    ----------
    extraction
        What was extracted.
    title
        The page's.
    more
        Further numbers of each place, by name, such as zeta.
    most_points
        Places that the page holds.
    """
    columns = {name: getattr(extraction, name) for name in COLUMNS}
    columns |= {name: np.asarray(values) for name, values in (more or {}).items()}
    own_radii = not isinstance(extraction.radius, float)
    if own_radii:
        columns["radius"] = extraction.radius
    points = np.asarray(extraction.points, np.float64)
    layer = Layer("scan", points, normals=extraction.normals, columns=columns)
    radius = "a radius of their own" if own_radii else f"the radius {extraction.radius:.4g}"
    counts = ", ".join(f"{name.replace('_', ' ')}: {n:,}" for name, n in extraction.status_counts().items())
    side = "" if extraction.oriented else " No viewpoint is known: the sign of curvature is a convention."
    text = f"Curvature of {len(extraction):,} places with {radius}, per unit of length; {counts}.{side}"
    return page_html(title, text, [layer], quantity="mean_curvature", most_points=most_points)
