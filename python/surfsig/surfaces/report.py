"""One self-contained page about the surfaces of a scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from surfsig.page import Layer, page_html
from surfsig.page.packing import MOST_POINTS
from surfsig.surfaces.wording import run_rows

if TYPE_CHECKING:
    from surfsig.surfaces.found import Surfaces


def report_html(found: Surfaces, title: str, most_points: int = MOST_POINTS) -> str:
    """Make the page: the points coloured by surface or by their distance from it, and the surfaces' table.

    Parameters
    ----------
    found
        The surfaces.
    title
        The page's.
    most_points
        Points that the page holds.
    """
    header, rows = found.table()
    columns = {"deviation": found.deviations()} if len(found) else {}
    layer = Layer("scan", found.cloud.points, labels=found.labels, columns=columns)
    text = (
        f"{found.summary()}. Lengths are in the scan's unit; a click on a point or a row shows the surface."
    )
    all_rows = [*rows, *run_rows(found.pipe_runs())]
    return page_html(
        title, text, [layer], header=header, rows=all_rows, quantity="surface", most_points=most_points
    )
