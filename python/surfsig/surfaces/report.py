"""One self-contained page about the surfaces of a scan, by Plotly (`pip install surfsig[report]`)."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from surfsig.convert.libraries import library
from surfsig.surfaces.colors import NO_SURFACE, surface_colors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from surfsig.surfaces.found import Surfaces

DRAWN = 60_000
"""Points that are drawn; of more, evenly chosen ones."""

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 1.5rem auto; max-width: 75rem; padding: 0 1rem; }
h1 { font-size: 1.4rem; margin: 0; }
.view { height: 70vh; min-height: 25rem; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: right; padding: 0.2rem 0.6rem; border-bottom: 1px solid #ddd; }
th { position: sticky; top: 0; background: #fff; }
td:nth-child(2), th:nth-child(2), td:nth-child(5), th:nth-child(5) { text-align: left; }
tbody tr { cursor: pointer; }
tr.chosen { background: #ffeeb0; }
i { display: inline-block; width: 0.8em; height: 0.8em; border-radius: 50%; }
"""

# A click on a point or a row marks the row and makes the surface's points larger.
_SCRIPT = """
const view = document.getElementById('{plot_id}');
const rows = document.querySelectorAll('#surfaces tbody tr');
function choose(number, scroll) {
  rows.forEach((row, i) => row.classList.toggle('chosen', i === number));
  if (scroll && rows[number]) rows[number].scrollIntoView({block: 'nearest', behavior: 'smooth'});
  const sizes = view.data.map(trace => trace.meta === number ? 4 : 1.6);
  Plotly.restyle(view, {'marker.size': sizes});
}
view.on('plotly_click', event => choose(event.points[0].data.meta, true));
rows.forEach((row, i) => row.addEventListener('click', () => choose(i, false)));
"""


def page(found: Surfaces, title: str) -> str:
    """Make the page.

    Parameters
    ----------
    found
        The surfaces.
    title
        The page's.

    Raises
    ------
    InvalidInputError
        If Plotly is not installed.
    """
    library("plotly", "Plotly", "surfsig[report]")
    view = _figure(found).to_html(
        full_html=False,
        include_plotlyjs=True,
        div_id="view",
        post_script=_SCRIPT,
        config={"responsive": True},
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head>\n<body>\n"
        f"<h1>{html.escape(title)}</h1>\n<p>{html.escape(found.summary())}. Lengths are in the scan's unit; "
        f"a click on a point or a row shows the surface.</p>\n"
        f'<div class="view">{view}</div>\n{_table(found)}\n</body>\n</html>\n'
    )


def _figure(found: Surfaces) -> Any:
    import plotly.graph_objects as go

    finite = np.flatnonzero(found.cloud.finite)
    shown = finite[:: max(1, math.ceil(len(finite) / DRAWN))]
    points = found.cloud.offsets[shown] + found.cloud.origin
    # Near 0 the browser's float32 loses nothing.
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    places = (points - middle).astype(np.float32)
    labels = found.labels[shown]
    colors = [*surface_colors(len(found)).tolist(), NO_SURFACE]
    header, rows = found.table()
    traces = []
    for number, color in enumerate(colors):
        row = rows[number] if number < len(rows) else None
        members = labels == (number if row else -1)
        name = f"{row[0]} {row[1]}" if row else "no surface"
        words = (
            [f"{what}: {value}" for what, value in zip(header[2:], row[2:], strict=True) if value]
            if row
            else []
        )
        traces.append(_trace(go, places[members], number if row else -1, name, words, color))
    axes = {
        f"{letter}axis": {"title": {"text": letter if abs(at) < 1e-12 else f"{letter} - {at:.6g}"}}
        for letter, at in zip("xyz", middle, strict=True)
    }
    figure = go.Figure(traces)
    figure.update_layout(
        scene={"aspectmode": "data", **axes},
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        legend={"itemsizing": "constant"},
    )
    return figure


def _trace(go: Any, places: NDArray[np.float32], number: int, name: str, words: list[str], color: Any) -> Any:
    where = dict(zip("xyz", places.T, strict=True))
    marker = {"size": 1.6, "color": "rgb({},{},{})".format(*color)}
    hover = "<br>".join([f"<b>{name}</b>", *words]) + "<extra></extra>"
    return go.Scatter3d(**where, mode="markers", name=name, meta=number, marker=marker, hovertemplate=hover)


def _table(found: Surfaces) -> str:
    header, rows = found.table()
    head = "".join(f"<th>{html.escape(word)}</th>" for word in header)
    body = []
    for color, (number, *words) in zip(surface_colors(len(found)).tolist(), rows, strict=True):
        mark = '<i style="background:rgb({},{},{})"></i>'.format(*color)
        cells = "".join(f"<td>{html.escape(word)}</td>" for word in words)
        body.append(f"<tr><td>{mark} {number}</td>{cells}</tr>")
    return (
        f'<table id="surfaces"><thead><tr>{head}</tr></thead>\n<tbody>\n'
        + "\n".join(body)
        + "\n</tbody></table>"
    )
