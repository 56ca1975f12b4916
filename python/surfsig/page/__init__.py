"""One self-contained page: points in a view that turns, with what is known of them, and a table.

The page is `web/`, built by `make page` into `viewer.html`: the same that computes in a browser.
It needs no network.
"""

from surfsig.page.document import page_html, write_page
from surfsig.page.layer import Layer, Stage, Trajectory
from surfsig.page.notebook import NOTEBOOK_POINTS, cloud_html, notebook_html
from surfsig.page.serve import serve_cloud

__all__ = [
    "NOTEBOOK_POINTS",
    "Layer",
    "Stage",
    "Trajectory",
    "cloud_html",
    "notebook_html",
    "page_html",
    "serve_cloud",
    "write_page",
]
