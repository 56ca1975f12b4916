"""A server for one reader: the page with a cloud, on this machine only."""

from __future__ import annotations

import secrets
import tempfile
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from surfsig.files import write
from surfsig.page.document import source_html
from surfsig.point_cloud import PointCloud

HOST = "127.0.0.1"


def serve_cloud(cloud: PointCloud, name: str, port: int = 0) -> PageServer:
    """Make a server of the page with a cloud, which begins with `serve_forever()`.

    It listens at 127.0.0.1, at a path that cannot be guessed, and answers only what is asked of that host:
    another page in the same browser cannot read the cloud.

    Parameters
    ----------
    cloud
        The points, with all fields.
    name
        What the page calls them.
    port
        Where to listen; 0 for any that is free.

    Returns
    -------
    The server. Its `url` is the page's address.
    """
    secret = secrets.token_urlsafe(12)
    page = source_html(f"{name} - surfsig", "cloud.ply", name).encode()
    answers = {f"/{secret}/": ("text/html; charset=utf-8", page)}
    answers[f"/{secret}/cloud.ply"] = ("application/octet-stream", _as_ply(cloud))

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            host = (self.headers.get("Host") or "").rpartition(":")[0]
            known = answers.get(self.path.partition("?")[0])
            if known is None or host not in (HOST, "localhost"):
                self.send_error(404)
                return
            kind, content = known
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *values: Any) -> None:
            """Say nothing."""

    server = PageServer((HOST, port), Handler)
    server.url = f"http://{HOST}:{server.server_address[1]}/{secret}/"
    return server


class PageServer(ThreadingHTTPServer):
    """A server that knows its page's address."""

    daemon_threads = True
    url = ""


def _as_ply(cloud: PointCloud) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cloud.ply"
        write(path, cloud)
        return path.read_bytes()
