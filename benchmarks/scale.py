"""Clouds of any size, tile by tile: memory, processor time and bits beside the extraction of the whole cloud.

python benchmarks/scale.py --points 20 60 200 --write
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from machine import measured_here
from numpy.typing import NDArray
from report import Results, Row, markdown_table, measured_on, publish, verdict

import surfsig
from surfsig.tiles.memory import memory_bytes

COMMAND = "make bench-scale"
RADIUS = 0.5
DENSITY = 127.0
"""Points per square metre: some 100 in a ball."""
FILES = 64
MOST_PROCESSOR_TIME, MOST_SPREAD = 1.25, 0.20
"""What is to be reached: processor time over that of the whole cloud, and by how much memory may differ."""
_SAMPLES_PER_SECOND = 20

COLUMNS = (
    "points",
    "tiles",
    "peak memory, MB",
    "processor seconds per million points",
    "of the whole cloud in memory",
    "their ratio",
    "points read per point",
    "seconds",
    "scheduling, ms a tile",
)


def make_input(folder: Path, points: int, files: int) -> list[Path]:
    """Write rolling ground with blocks of houses on it into files, each a strip of the flight."""
    folder.mkdir(parents=True)
    side = float(np.sqrt(points / DENSITY))
    rng = np.random.default_rng(17)
    paths = []
    for number, count in enumerate(np.diff(np.linspace(0, points, files + 1).astype(int))):
        x = 389_000 + side * (number + rng.random(count)) / files
        y = 5_819_000 + side * rng.random(count)
        z = 40 + 3 * np.sin(0.05 * x) * np.cos(0.04 * y) + rng.normal(0, 0.01, count)
        z += 8 * ((np.floor(x / 25) % 3 == 0) & (np.floor(y / 25) % 2 == 0))
        origin = np.array([389_000.0, 5_819_000.0, 0.0])
        fields: dict[str, NDArray[Any]] = {
            "intensity": rng.integers(0, 4096, count).astype(np.uint16),
            "classification": rng.integers(1, 7, count).astype(np.uint8),
            "gps_time": 1e5 * number + np.sort(rng.random(count)) * 1e3,
        }
        cloud = surfsig.PointCloud(np.round(np.column_stack([x, y, z]) - origin, 3), origin, fields=fields)
        paths.append(folder / f"strip_{number:03d}.laz")
        surfsig.write(paths[-1], cloud)
    return paths


class PeakMemory:
    """The largest sum of the resident memory of a process and its descendants, sampled."""

    def __init__(self, process: int) -> None:
        self.bytes = 0
        self._process, self._stopped = process, threading.Event()
        self._thread = threading.Thread(target=self._sample)
        self._thread.start()

    def stop(self) -> int:
        """Stop sampling, and give the peak in bytes."""
        self._stopped.set()
        self._thread.join()
        return self.bytes

    def _sample(self) -> None:
        while not self._stopped.wait(1 / _SAMPLES_PER_SECOND):
            self.bytes = max(self.bytes, sum(map(resident, family(self._process))))


def family(process: int) -> list[int]:
    """Give the ids of a process and all its descendants (Linux)."""
    found = [process]
    for one in found:
        try:
            for thread in Path(f"/proc/{one}/task").iterdir():
                found += map(int, (thread / "children").read_text().split())
        except OSError:
            # It has ended.
            continue
    return found


def resident(process: int) -> int:
    """Give the bytes of memory that a process has; 0 where it has ended."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * resource.getpagesize()
    except (OSError, IndexError):
        return 0


def measured(job: str, *arguments: object) -> Results:
    """Run a job of this program in a process of its own; give its seconds, processor time and peak memory."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    command = [sys.executable, __file__, "--job", job, *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        peak = PeakMemory(process.pid)
        out, _ = process.communicate()
    if process.returncode:
        raise SystemExit(f"{job} failed")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "seconds": time.perf_counter() - start,
        "processor_seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        "peak_bytes": peak.stop(),
        **json.loads(out.splitlines()[-1]),
    }


def in_memory(paths: Sequence[Path], out: Path) -> Results:
    """Read all files as one cloud, extract, and write one file."""
    cloud = surfsig.read(list(paths))
    found = surfsig.extract(cloud, RADIUS)
    surfsig.write(out, cloud, found.columns())
    return {"neighbours": float(found.count.mean())}


def in_tiles(paths: Sequence[Path], out: Path, memory: str, tiles: int | None = None) -> Results:
    """Do the same tile by tile."""
    found = surfsig.extract_tiles(list(paths), out, RADIUS, memory=memory, tiles=tiles)
    records = found.manifest["tiles"]
    total = sum(record.get("seconds", 0.0) for record in records)
    return {
        "tiles": len(records),
        "read": sum(record["read"] for record in records),
        "task_seconds": total,
        "bytes": sum(record["bytes"] for record in records),
    }


def size_row(points: int, folder: Path, memory: str, whole: Results | None) -> tuple[Row, Results, Results]:
    """Measure one size, beside the whole cloud in memory where that fits (else beside a smaller one)."""
    paths = make_input(folder / "in", points, FILES)
    if whole is None:
        whole = measured("whole", folder / "whole.laz", *paths) | {"points": points}
        (folder / "whole.laz").unlink()
    tiles = measured("tiles", folder / "out", memory, *paths) | {"points": points}
    cost = 1e6 * tiles["processor_seconds"] / points
    whole_cost = 1e6 * whole["processor_seconds"] / whole["points"]
    beside = "" if whole["points"] == points else f" (at {whole['points']:,} points)"
    scheduling = (tiles["seconds"] - tiles["task_seconds"]) / tiles["tiles"]
    row = (
        f"{points:,}",
        f"{tiles['tiles']}",
        f"{tiles['peak_bytes'] / 1e6:,.0f}",
        f"{cost:.2f}",
        f"{whole_cost:.2f}{beside}",
        f"{cost / whole_cost:.2f}",
        f"{tiles['read'] / points:.3f}",
        f"{tiles['seconds']:,.0f}",
        f"{1000 * scheduling:,.0f} (first look and binning included)",
    )
    shutil.rmtree(folder)
    return row, tiles, whole


def sorted_hash(found: surfsig.TileDataset) -> str:
    """Give the SHA-256 of all columns of a result, its points in the order of the input."""
    cloud = found.read()
    order = np.argsort(cloud.fields["point_number"])
    digest = hashlib.sha256()
    for name in sorted(set(cloud.fields) - {"file"}):
        digest.update(name.encode() + np.ascontiguousarray(cloud.fields[name][order]).tobytes())
    digest.update(np.ascontiguousarray(cloud.points[order]).tobytes())
    return digest.hexdigest()


def same_bits(folder: Path, points: int) -> list[Row]:
    """Hash the results of several manners of cutting and working."""
    paths = make_input(folder / "in", points, 8)
    rows: list[Row] = []

    def add(what: str, out: Path, **more: Any) -> None:
        surfsig.extract_tiles(
            paths, out, RADIUS, numbers=True, suffix=".npz", store=folder / f"{out.name} store", **more
        )
        rows.append((what, sorted_hash(surfsig.TileDataset(out))[:16]))
        shutil.rmtree(out)
        shutil.rmtree(folder / f"{out.name} store")

    cloud = surfsig.read(paths)
    columns = surfsig.extract(cloud, RADIUS).columns() | {"point_number": np.arange(len(cloud))}
    digest = hashlib.sha256()
    values = {**{name: v for name, v in cloud.fields.items() if name != "file"}, **columns}
    for name in sorted(values):
        digest.update(name.encode() + np.ascontiguousarray(values[name]).tobytes())
    digest.update(np.ascontiguousarray(cloud.points).tobytes())
    rows.append(("whole cloud in memory", digest.hexdigest()[:16]))
    for tiles in (1, 4, 16, 64):
        add(f"{tiles} tiles", folder / f"{tiles}", tiles=tiles)
    try:
        import distributed
    except ModuleNotFoundError:
        rows.append(("two workers of a Dask cluster", "not measured: Dask is not installed"))
    else:
        with (
            distributed.LocalCluster(  # type: ignore[no-untyped-call]
                2, threads_per_worker=1, dashboard_address=None
            ) as cluster,
            distributed.Client(cluster) as client,  # type: ignore[no-untyped-call]
        ):
            add("16 tiles, two workers of a Dask cluster", folder / "dask", tiles=16, client=client)
    return rows


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=float, nargs="+", default=[20, 60], help="millions")
    parser.add_argument("--memory", default="2GB")
    parser.add_argument("--most-whole", type=float, default=30, help="millions that fit into memory at once")
    parser.add_argument("--same-bits", type=float, default=2, help="millions of points that are hashed")
    parser.add_argument("--folder", type=Path, help="for input and output; by default a temporary one")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    parser.add_argument("--job", help=argparse.SUPPRESS)
    parser.add_argument("rest", nargs="*", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.job == "whole":
        print(json.dumps(in_memory([Path(path) for path in arguments.rest[1:]], Path(arguments.rest[0]))))
        return
    if arguments.job == "tiles":
        out, memory, *paths = arguments.rest
        print(json.dumps(in_tiles([Path(path) for path in paths], Path(out), memory)))
        return
    results: Results = measured_here()
    rows: list[Row] = []
    peaks: list[int] = []
    ratios: list[float] = []
    whole: Results | None = None
    with tempfile.TemporaryDirectory(dir=arguments.folder) as temporary:
        folder = Path(temporary)
        for millions in sorted(arguments.points):
            points = int(1e6 * millions)
            known = None if millions <= arguments.most_whole else whole
            row, tiles, whole = size_row(points, folder / f"{points}", arguments.memory, known)
            rows.append(row)
            peaks.append(tiles["peak_bytes"])
            ratios.append(float(row[5]))
            print(" | ".join(row), file=sys.stderr)
        bits = same_bits(folder / "bits", int(1e6 * arguments.same_bits))
    limit = memory_bytes(arguments.memory)
    spread = max(peaks) / min(peaks) - 1
    equal = len({value for _, value in bits if not value.startswith("not")}) == 1
    targets = [
        (
            f"Peak memory of all processes with --memory {arguments.memory}",
            f"<= {limit / 1e6:,.0f} MB",
            f"{max(peaks) / 1e6:,.0f} MB",
            verdict(max(peaks) <= limit),
        ),
        (
            "Memory at the largest size over the smallest",
            f"<= {1 + MOST_SPREAD:.2f}",
            f"{1 + spread:.2f}",
            verdict(spread <= MOST_SPREAD),
        ),
        (
            "Processor time over that of the whole cloud",
            f"<= {MOST_PROCESSOR_TIME}",
            f"{max(ratios):.2f}",
            verdict(max(ratios) <= MOST_PROCESSOR_TIME),
        ),
        ("Same bits however it is cut", "all", "all" if equal else "not all", verdict(equal)),
    ]
    notes = [
        *measured_on(results),
        f"Input: {FILES} LAZ files, side by side, {DENSITY:g} points per square metre in steps of a "
        f"millimetre; balls of {RADIUS} m with {(whole or {}).get('neighbours', 0):.0f} points; all columns "
        "are written.",
        f"Peak memory: the resident memory of all processes together, {_SAMPLES_PER_SECOND} times a second.",
        "Processor time: of all threads and processes, reading and writing LAZ included; the whole cloud is "
        "read, extracted and written as one.",
        f"Same bits: SHA-256 of all columns of {1e6 * arguments.same_bits:,.0f} points, in their order.",
        f"Cores: {os.cpu_count()}.",
    ]
    text = "\n\n".join(
        [
            markdown_table(("target", "wanted", "reached", ""), targets),
            markdown_table(COLUMNS, rows),
            markdown_table(("how", "SHA-256 of the sorted result, its first digits"), bits),
            "\n".join(f"- {line}" for line in notes),
        ]
    )
    publish(text, COMMAND, arguments.write)


if __name__ == "__main__":
    main()
