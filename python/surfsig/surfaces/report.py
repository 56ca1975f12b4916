"""One self-contained page about the surfaces of a scan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from surfsig.colors import GREY, distinct_colors
from surfsig.page import Group, write_page
from surfsig.surfaces.wording import run_rows

if TYPE_CHECKING:
    from surfsig.surfaces.found import Surfaces


def write_report(found: Surfaces, path: str | Path, title: str) -> None:
    """Write the points coloured by surface or by their distance from it, and the table of the surfaces.

    Parameters
    ----------
    found
        The surfaces.
    path
        Where to write.
    title
        The page's.

    Raises
    ------
    InvalidInputError
        If Plotly is not installed.
    """
    points, labels = found.cloud.points, found.labels
    header, rows = found.table()
    groups = [
        Group(
            f"{row[0]} {row[1]}",
            points[labels == number],
            color,
            number,
            [f"{what}: {value}" for what, value in zip(header[2:], row[2:], strict=True) if value],
            state="surfaces",
        )
        for number, (row, color) in enumerate(zip(rows, distinct_colors(len(found)).tolist(), strict=True))
    ]
    groups.append(Group("no surface", points[labels < 0], GREY))
    if len(found):
        inside = labels >= 0
        deviations = Group(
            "distance from the surface",
            points[inside],
            GREY,
            state="deviations",
            values=found.deviations()[inside],
        )
        # A page begins with its last state.
        groups.insert(0, deviations)
    text = (
        f"{found.summary()}. Lengths are in the scan's unit; a click on a point or a row shows the surface."
    )
    write_page(path, title, text, groups, header, [*rows, *run_rows(found.pipe_runs())])
