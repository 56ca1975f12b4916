"""Time the page: its engine beside one native thread, the first picture of a file, and the sizes of pages.

Times of engines are of the processor, so that other work on the machine changes them little.
"""

from __future__ import annotations

import argparse
import gzip
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from report import markdown_table, publish

import surfsig
from surfsig.page.document import viewer

ROOT = Path(__file__).parents[1]
NEIGHBOURS = 100
DRAWN = 300_000
"""Points of the file that is dropped, and of the report."""

MANY = 5_000_000
"""Points of the largest file that is dropped."""

REPEATS = 3


def bumps(count: int) -> NDArray[np.float32]:
    """Give points of a bumpy square of side 2, evenly at random, with noise."""
    rng = np.random.default_rng(21)
    x, y = rng.uniform(-1, 1, (2, count))
    z = 0.1 * np.sin(3 * x) * np.cos(2 * y) + 0.001 * rng.normal(size=count)
    return np.column_stack([x, y, z]).astype(np.float32)


def radius_for(count: int) -> float:
    """Give the radius of a ball with `NEIGHBOURS` points of the square."""
    return math.sqrt(4.0 * NEIGHBOURS / (math.pi * count))


def run_node(script: str, *arguments: object) -> dict[str, Any]:
    """Run a script of web/bench."""
    env = {**os.environ, "PYTHON": sys.executable}
    words = ["node", str(ROOT / "web" / "bench" / script), *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True, check=True, env=env)
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def native_seconds(points: NDArray[np.float32], radius: float) -> float:
    """Give the processor time of one native thread."""
    start = time.process_time()
    surfsig.extract(points, radius, threads=1)
    return time.process_time() - start


def engine_rows(folder: Path) -> list[tuple[str, ...]]:
    """Time curvature in WebAssembly and natively."""
    rows: list[tuple[str, ...]] = []
    for count in (100_000, 1_000_000):
        points, radius = bumps(count), radius_for(count)
        file = folder / "points.f32"
        file.write_bytes(points.tobytes())
        # In turn, as other work on the machine slows both; the least times are of the quietest moments.
        pairs = [
            (run_node("engine.mjs", file, radius), native_seconds(points, radius)) for _ in range(REPEATS)
        ]
        first, again = (min(found[name] for found, _ in pairs) for name in ("first", "again"))
        native = min(seconds for _, seconds in pairs)
        neighbours = pairs[0][0]["neighbours"]
        cells = (f"{first:.2f}", f"{again:.2f}", f"{native:.2f}", f"{again / native:.1f}")
        rows.append((f"{count:,}", f"{neighbours:.0f}", *cells))
    return rows


def size_rows(folder: Path) -> list[tuple[str, str]]:
    """Measure the first picture, and the sizes of the page and of a report."""
    points = bumps(DRAWN)
    file, report = folder / "scan.ply", folder / "report.html"
    surfsig.write(file, points)
    load = os.getloadavg()[0]
    seen = run_node("first_picture.mjs", file)
    surfsig.extract(points, radius_for(DRAWN)).write_report(report)
    surfsig.write(file, bumps(MANY))
    many = run_node("many_points.mjs", file)
    page = viewer().encode()
    return [
        ("page, compressed (MB)", f"{len(gzip.compress(page)) / 1e6:.2f}"),
        ("page as it is (MB)", f"{len(page) / 1e6:.2f}"),
        (f"report of an extraction of {DRAWN:,} points (MB)", f"{report.stat().st_size / 1e6:.2f}"),
        (f"first picture of a PLY of {DRAWN:,} points (s, by the clock)", f"{seen['picture']:.1f}"),
        ("its curvature, drawn (s, by the clock)", f"{seen['curvature']:.1f}"),
        (f"first picture of a PLY of {MANY:,} points (s, by the clock)", f"{many['picture']:.1f}"),
        ("a picture while these are turned (s, by the clock)", f"{many['frame']:.2f}"),
        ("points of such a picture", f"{many['drawn']:,}"),
        (f"programs that wanted the {os.cpu_count()} processors before that", f"{load:.1f}"),
    ]


def main() -> None:
    """Measure, print, and with --write put the tables into BENCHMARKS.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="Write that part of BENCHMARKS.md.")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        engine, sizes = engine_rows(Path(name)), size_rows(Path(name))
    header = (
        "points",
        "neighbours",
        "page, first time (s)",
        "page, again (s)",
        "one native thread (s)",
        "ratio",
    )
    text = "\n\n".join([markdown_table(header, engine), markdown_table(("", "measured"), sizes)])
    publish(text, "make bench-page", chosen.write)


if __name__ == "__main__":
    main()
