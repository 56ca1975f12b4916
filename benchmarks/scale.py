"""Clouds of any size, tile by tile: memory, processor time and bits beside the extraction of the whole cloud.

python benchmarks/scale.py --points 20 60 200 --write
"""

from __future__ import annotations

import argparse
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
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from machine import measured_here
from numpy.typing import NDArray
from report import Results, Row, markdown_table, measured_on, publish, verdict
from scale_bits import same_bits

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

FILES_OF_BITS = 8
PROCESSOR_TIME = "processor seconds per million points"

COLUMNS = (
    "points",
    "tiles",
    "peak memory, MB",
    PROCESSOR_TIME,
    "of the whole cloud in memory",
    "their ratio",
    "points read per point",
    "seconds",
    "of these first look and binning",
    "scheduling and start, ms a tile",
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
    began, prepared = time.perf_counter(), 0.0

    def told(what: str, done: int, total: int) -> None:
        nonlocal prepared
        if what in ("reading", "binning"):
            prepared = time.perf_counter() - began

    found = surfsig.extract_tiles(list(paths), out, RADIUS, memory=memory, tiles=tiles, progress=told)
    records = found.manifest["tiles"]
    total = sum(record.get("seconds", 0.0) for record in records)
    return {
        "tiles": len(records),
        "read": sum(record["read"] for record in records),
        "task_seconds": total,
        "prepared_seconds": prepared,
        "bytes": sum(record["bytes"] for record in records),
    }


def today_row(points: int, folder: Path, paths: Sequence[Path]) -> Row:
    """Measure what users of jakteristics do with the files, where it is installed."""
    try:
        import jakteristics  # type: ignore[import-not-found, import-untyped, unused-ignore]  # noqa: F401
    except ModuleNotFoundError:
        return (f"{points:,}", "not measured: jakteristics is not installed", "", "", "")
    found = measured("today", folder / "today", *paths)
    shutil.rmtree(folder / "today")
    return (
        f"{points:,}",
        f"jakteristics {version('jakteristics')}, file by file, without a halo: 4 features",
        f"{found['peak_bytes'] / 1e6:,.0f}",
        f"{1e6 * found['processor_seconds'] / points:.2f}",
        f"{found['seconds']:,.0f}",
    )


def size_row(
    points: int, folder: Path, paths: Sequence[Path], memory: str, whole: Results | None
) -> tuple[Row, Results, Results]:
    """Measure one size, beside the whole cloud in memory where that fits (else beside a smaller one)."""
    if whole is None:
        whole = measured("whole", folder / "whole.laz", *paths) | {"points": points}
        (folder / "whole.laz").unlink()
    tiles = measured("tiles", folder / "out", memory, *paths) | {"points": points}
    cost = 1e6 * tiles["processor_seconds"] / points
    whole_cost = 1e6 * whole["processor_seconds"] / whole["points"]
    beside = "" if whole["points"] == points else f" (at {whole['points']:,} points)"
    scheduling = (tiles["seconds"] - tiles["task_seconds"] - tiles["prepared_seconds"]) / tiles["tiles"]
    row = (
        f"{points:,}",
        f"{tiles['tiles']}",
        f"{tiles['peak_bytes'] / 1e6:,.0f}",
        f"{cost:.2f}",
        f"{whole_cost:.2f}{beside}",
        f"{cost / whole_cost:.2f}",
        f"{tiles['read'] / points:.3f}",
        f"{tiles['seconds']:,.0f}",
        f"{tiles['prepared_seconds']:,.0f}",
        f"{1000 * scheduling:,.0f}",
    )
    shutil.rmtree(folder / "out")
    return row, tiles, whole


def as_today(paths: Sequence[Path], out: Path) -> Results:
    """Compute four shape features of each file by jakteristics, as its users do, without a halo."""
    import jakteristics
    import laspy

    out.mkdir()
    names = ["linearity", "planarity", "sphericity", "verticality"]
    for path in paths:
        las = laspy.read(path)
        features = jakteristics.compute_features(
            np.ascontiguousarray(las.xyz), RADIUS, num_threads=os.cpu_count(), feature_names=names
        )
        for name, values in zip(names, features.T, strict=True):
            las.add_extra_dim(laspy.ExtraBytesParams(name, np.float32))
            las[name] = values
        las.write(out / path.name)
    return {}


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
    if arguments.job == "today":
        print(json.dumps(as_today([Path(path) for path in arguments.rest[1:]], Path(arguments.rest[0]))))
        return
    if arguments.job == "tiles":
        out, memory, *paths = arguments.rest
        print(json.dumps(in_tiles([Path(path) for path in paths], Path(out), memory)))
        return
    results: Results = measured_here()
    rows: list[Row] = []
    todays: list[Row] = []
    peaks: list[int] = []
    ratios: list[float] = []
    whole: Results | None = None
    with tempfile.TemporaryDirectory(dir=arguments.folder) as temporary:
        folder = Path(temporary)
        for millions in sorted(arguments.points):
            points = int(1e6 * millions)
            known = None if millions <= arguments.most_whole else whole
            size = folder / f"{points}"
            paths = make_input(size / "in", points, FILES)
            if known is None:
                todays.append(today_row(points, size, paths))
            row, tiles, whole = size_row(points, size, paths, arguments.memory, known)
            shutil.rmtree(size)
            rows.append(row)
            peaks.append(tiles["peak_bytes"])
            ratios.append(float(row[5]))
            print(" | ".join(row), file=sys.stderr)
        bits = same_bits(
            folder, make_input(folder / "bits", int(1e6 * arguments.same_bits), FILES_OF_BITS), RADIUS
        )
    limit = memory_bytes(arguments.memory)
    spread = max(peaks) / min(peaks) - 1
    equal = len({value for _, value in bits}) == 1
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
            markdown_table(
                ("points", "as a user would do it today", "peak memory, MB", PROCESSOR_TIME, "seconds"),
                todays,
            ),
            markdown_table(("how", "SHA-256 of the sorted result, its first digits"), bits),
            "\n".join(f"- {line}" for line in notes),
        ]
    )
    publish(text, COMMAND, arguments.write)


if __name__ == "__main__":
    main()
