"""One self-contained page: points in a view that turns, and a table (`pip install surfsig[report]`)."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.colors import symmetric_limit
from surfsig.convert.libraries import library
from surfsig.files.atomic import replacing

Array = NDArray[np.float64]

DRAWN = 60_000
"""Points that are drawn at once; of more, evenly chosen ones."""

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 1.5rem auto; max-width: 75rem; padding: 0 1rem; }
h1 { font-size: 1.4rem; margin: 0; }
.view { height: 70vh; min-height: 25rem; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: right; padding: 0.2rem 0.6rem; border-bottom: 1px solid #ddd; }
th { position: sticky; top: 0; background: #fff; }
td.words, th.words { text-align: left; }
tbody tr { cursor: pointer; }
tr.chosen { background: #ffeeb0; }
i { display: inline-block; width: 0.8em; height: 0.8em; border-radius: 50%; }
"""

# A click on a point or a row marks the row and makes its points larger. It comes behind the table.
_SCRIPT = """
const view = document.getElementById('view');
const rows = document.querySelectorAll('#groups tbody tr');
function choose(number, scroll) {
  rows.forEach((row, i) => row.classList.toggle('chosen', i === number));
  if (scroll && rows[number]) rows[number].scrollIntoView({block: 'nearest', behavior: 'smooth'});
  const sizes = view.data.map(trace => trace.meta === number ? 4 : 1.6);
  Plotly.restyle(view, {'marker.size': sizes});
}
view.on('plotly_click', event => choose(event.points[0].data.meta, true));
rows.forEach((row, i) => row.addEventListener('click', () => choose(i, false)));
"""


@dataclass(frozen=True, eq=False)
class Group:
    """Points of one colour, and the row of the table that is about them."""

    name: str
    points: Array
    """(n, 3)."""
    color: Sequence[int]
    """Red, green, blue, 0 to 255."""
    row: int = -1
    """Its row; -1 for none."""
    words: Sequence[str] = ()
    """Lines that a pointer on it shows."""
    state: str | None = None
    """The state in which it is shown; None for all."""
    values: Array | None = None
    """(n,): a number for each point, which gives it its colour in place of the group's, on a diverging scale
    that is symmetric about 0."""


def write_page(
    path: str | Path,
    title: str,
    text: str,
    groups: Sequence[Group],
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
) -> None:
    """Write the page; it needs no network.

    Parameters
    ----------
    path
        Where to write.
    title, text
        The page's, and a sentence below.
    groups
        What is drawn. Where they have states, the page has a button for each, and begins with the last.
    header, rows
        Of the table. A row that has a group has its colour.

    Raises
    ------
    InvalidInputError
        If Plotly is not installed.
    """
    library("plotly", "Plotly", "surfsig[report]")
    view = _figure(groups).to_html(
        full_html=False, include_plotlyjs=True, div_id="view", config={"responsive": True}
    )
    page = (
        '<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head>\n<body>\n"
        f"<h1>{html.escape(title)}</h1>\n<p>{html.escape(text)}</p>\n"
        f'<div class="view">{view}</div>\n{_table(groups, header, rows)}\n<script>{_SCRIPT}</script>\n'
        "</body>\n</html>\n"
    )
    with replacing(Path(path)) as file:
        file.write(page.encode())


def _figure(groups: Sequence[Group]) -> Any:
    import plotly.graph_objects as go

    states = _states(groups)
    drawn = [_drawn(groups, state) for state in [*states, None]]
    step = max(1, math.ceil(max(drawn) / DRAWN))
    chosen = [np.flatnonzero(np.isfinite(group.points).all(axis=1))[::step] for group in groups]
    parts = [group.points[some] for group, some in zip(groups, chosen, strict=True)]
    origin = _origin(np.concatenate([np.empty((0, 3)), *parts]))
    traces = [
        _trace(go, (places - origin).astype(np.float32), group, some, states)
        for group, places, some in zip(groups, parts, chosen, strict=True)
    ]
    titles = [f"{letter} - {at:.15g}" if at else letter for letter, at in zip("xyz", origin, strict=True)]
    axes = {f"{letter}axis": {"title": {"text": text}} for letter, text in zip("xyz", titles, strict=True)}
    figure = go.Figure(traces)
    figure.update_layout(
        scene={"aspectmode": "data", "camera": {"eye": {"x": 1.4, "y": 1.4, "z": 1.1}}, **axes},
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        # Below the buttons.
        legend={"itemsizing": "constant", "y": 0.93},
        updatemenus=_buttons(groups, states),
    )
    return figure


def _states(groups: Sequence[Group]) -> list[str]:
    """Give the states, in their order of appearance."""
    return list(dict.fromkeys(group.state for group in groups if group.state is not None))


def _drawn(groups: Sequence[Group], state: str | None) -> int:
    return sum(len(group.points) for group in groups if group.state in (None, state))


def _buttons(groups: Sequence[Group], states: Sequence[str]) -> list[dict[str, Any]]:
    if not states:
        return []
    buttons = [
        {
            "label": state,
            "method": "restyle",
            "args": [{"visible": [group.state in (None, state) for group in groups]}],
        }
        for state in states
    ]
    menu = {"type": "buttons", "direction": "right", "buttons": buttons, "active": len(states) - 1}
    return [menu | {"x": 0.0, "y": 1.0, "xanchor": "left", "yanchor": "top"}]


def _origin(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give a round place near points that are far from 0, for the browser has float32 only; else 0."""
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    middle = points.mean(axis=0) if len(points) else np.zeros(3)
    if not extent > 0:
        return middle
    step = 10.0 ** math.floor(math.log10(extent))
    origin: NDArray[np.float64] = np.where(np.abs(middle) > 100 * extent, np.round(middle / step) * step, 0.0)
    return origin


def _trace(
    go: Any, places: NDArray[np.float32], group: Group, some: NDArray[np.intp], states: Sequence[str]
) -> Any:
    where = dict(zip("xyz", places.T, strict=True))
    marker: dict[str, Any] = {"size": 1.6, "color": _css(group.color)}
    words = [f"<b>{group.name}</b>", *group.words]
    if group.values is not None:
        end = symmetric_limit(group.values)
        marker |= {"color": group.values[some].astype(np.float32), "cmin": -end, "cmax": end}
        marker |= {"colorscale": "RdBu", "reversescale": True, "colorbar": {"title": {"text": group.name}}}
        words.append("%{marker.color:.3g}")
    hover = "<br>".join(words) + "<extra></extra>"
    return go.Scatter3d(
        **where,
        mode="markers",
        name=group.name,
        meta=group.row,
        marker=marker,
        hovertemplate=hover,
        visible=group.state in (None, *states[-1:]),
    )


def _css(color: Sequence[int]) -> str:
    return "rgb({},{},{})".format(*color)


def _table(groups: Sequence[Group], header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    colors = {group.row: group.color for group in groups}
    # Numbers stand on the right, words on the left.
    words = [any(any(c.isalpha() for c in row[column]) for row in rows) for column in range(len(header))]
    left = [' class="words"' if is_words else "" for is_words in words]
    head = "".join(f"<th{side}>{html.escape(word)}</th>" for side, word in zip(left, header, strict=True))
    body = []
    for number, row in enumerate(rows):
        mark = f'<i style="background:{_css(colors[number])}"></i> ' if number in colors else ""
        cells = [html.escape(word) for word in row]
        cells[0] = mark + cells[0]
        text = "".join(f"<td{side}>{cell}</td>" for side, cell in zip(left, cells, strict=True))
        body.append(f"<tr>{text}</tr>")
    return (
        f'<table id="groups"><thead><tr>{head}</tr></thead>\n<tbody>\n'
        + "\n".join(body)
        + "\n</tbody></table>"
    )
