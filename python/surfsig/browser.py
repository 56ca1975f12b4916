"""`show`: a cloud or a result in the browser."""

from __future__ import annotations

import tempfile
import threading
import webbrowser
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from surfsig.page import serve_cloud, write_page
from surfsig.point_cloud import PointCloud


@runtime_checkable
class _HasPage(Protocol):
    """A result that makes a page of itself."""

    def to_html(self, *, title: str = ...) -> str:
        """Make the page."""


def show(shown: Any, *, title: str | None = None, browser: bool = True) -> str:
    """Show a cloud, or a result, in the browser.

    A cloud is shown in the page that computes: curvature at any radius, where else a surface occurs,
    surfaces with their sizes. It is served on 127.0.0.1 as long as this process runs. A result
    (`Extraction`, `Surfaces`, `Instances`, `Odometry`) is shown as its report, a file.

    Parameters
    ----------
    shown
        The result, or whatever `PointCloud.of` takes.
    title
        The page's; by default a word for what it is.
    browser
        Whether the browser is opened.

    Returns
    -------
    The page's address.

    Raises
    ------
    InvalidInputError
        If it is neither a result that has a page nor a cloud.
    """
    if isinstance(shown, _HasPage):
        name = title or type(shown).__name__
        folder = Path(tempfile.mkdtemp(prefix="surfsig-"))
        path = folder / "page.html"
        write_page(path, shown.to_html(title=name))
        address = path.as_uri()
    else:
        address = _served(PointCloud.of(shown), title or "cloud")
    if browser:
        webbrowser.open(address)
    return address


def _served(cloud: PointCloud, name: str) -> str:
    server: Any = serve_cloud(cloud, name)
    threading.Thread(target=server.serve_forever, name="surfsig page", daemon=True).start()
    return str(server.url)
