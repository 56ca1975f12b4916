"""A page inside a notebook's cell."""

from __future__ import annotations

import html

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
