"""Compare how fast files are read: surfsig, the libraries that others use, and the extraction that follows.

In every round each peer reads a file right after surfsig has read it, each in a process of its own.
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from clouds import bumpy_square
from machine import describe_machine, own_versions
from peers import BUILD, HERE, ROOT, Command, PeerUnavailable, python_program, run_json
from report import (
    TARGET_POINTS,
    TARGET_RADIUS,
    Results,
    Spread,
    markdown_table,
    measured_on,
    rich_table,
    update_section,
)
from rich.console import Console
from rich.progress import Progress

import surfsig
from surfsig.files.formats import FORMATS

READER = HERE / "reading_methods.py"
PIPE_COLUMNS = 140
SMALL_POINTS = 1000
COLUMNS = (
    "file", "reader", "points", "MB", "seconds (range)", "points/s", "extraction's time / this one's",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A format that is timed: the extension, what the table calls it, and who else reads it."""

    extension: str
    label: str
    peers: tuple[str, ...] = ()
    is_text: bool = False


CASES = (
    Case(".ply", "PLY, binary", ("open3d",)),
    Case(".pcd", "PCD, binary", ("open3d",)),
    Case(".las", "LAS", ("laspy",)),
    Case(".laz", "LAZ", ("laspy",)),
    Case(".e57", "E57"),
    Case(".npy", "NPY", ("numpy",)),
    Case(".npz", "NPZ", ("numpy",)),
    Case(".parquet", "Parquet"),
    Case(".csv", "CSV", ("pandas",), is_text=True),
)
LABELS = {"open3d": "Open3D", "laspy": "laspy", "numpy": "NumPy", "pandas": "pandas"}


def readable_cases() -> list[Case]:
    """Return the cases whose files can be made here: surfsig writes the format, or `make_file` does."""
    written = {extension for kind in FORMATS if kind.write is not None for extension in kind.extensions}
    return [case for case in CASES if case.extension in written or case.extension in (".npy", ".csv")]


def make_file(path: Path, points: int) -> None:
    """Write a cloud of so many points with an intensity each (NPY: as a fourth column)."""
    cloud = surfsig.PointCloud(
        bumpy_square(points), fields={"intensity": (np.arange(points) % 4096).astype(np.uint16)}
    )
    if path.suffix not in (".npy", ".csv"):
        surfsig.write(path, cloud)
        return
    rows = np.column_stack([cloud.offsets, cloud.fields["intensity"].astype(np.float32)])
    if path.suffix == ".npy":
        np.save(path, rows)
        return
    with path.open("w", encoding="ascii") as file:
        np.savetxt(file, rows, fmt="%.6f,%.6f,%.6f,%d", header="x,y,z,intensity", comments="")


def time_reading(program: Command, method: str, small: Path, path: Path, points: int) -> float:
    """Read a file once in a fresh process, and return the seconds.

    Raises
    ------
    PeerUnavailable
        When it cannot be read, or comes out with another number of points.
    """
    answer = run_json([*program, method, small, path], threads=2)
    if answer["points"] != points:
        raise PeerUnavailable(f"reads {answer['points']:,} of {points:,} points")
    return float(answer["seconds"])


def time_extraction(folder: Path, points: int) -> float:
    """Return the seconds per point of extracting with about 235 neighbours, the median of five runs."""
    path = folder / "extracted.npy"
    if not path.exists():
        np.save(path, bumpy_square(points))
    radius = TARGET_RADIUS * math.sqrt(TARGET_POINTS / points)
    answer = run_json([sys.executable, HERE / "ours.py", "curvature", path, str(radius), "2"], threads=2)
    return float(answer["seconds"]) / points


def measure(plan: argparse.Namespace, console: Console) -> Results:
    """Make the files and run all rounds."""
    ours: Command = [sys.executable, READER]
    theirs: Command = [python_program()[0], READER]
    machine, cases = describe_machine(), readable_cases()
    measured = [
        {
            "case": case,
            "points": plan.text_points if case.is_text else plan.points,
            "seconds": {},
            "skipped": {},
        }
        for case in cases
    ]
    extraction: list[float] = []
    with tempfile.TemporaryDirectory() as name, Progress(console=console, transient=True) as progress:
        folder = Path(name)
        task = progress.add_task("", total=len(cases) * (plan.rounds + 1))
        for entry in measured:
            progress.update(task, description=f"writing {entry['case'].label}")
            for stem, points in (("small", SMALL_POINTS), ("large", entry["points"])):
                make_file(folder / f"{stem}{entry['case'].extension}", points)
            entry["bytes"] = (folder / f"large{entry['case'].extension}").stat().st_size
            progress.advance(task)
        for number in range(plan.rounds):
            extraction.append(time_extraction(folder, plan.extracted_points))
            for entry in measured:
                progress.update(task, description=f"round {number + 1}: {entry['case'].label}")
                time_case(entry, folder, ours, theirs)
                progress.advance(task)
    return {
        "machine": machine,
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "versions": own_versions() | run_json([*theirs, "versions"], threads=1),
        "settings": {"rounds": plan.rounds, "extracted_points": plan.extracted_points},
        "extraction_seconds_per_point": extraction,
        "files": [entry | {"case": entry["case"].label} for entry in measured],
    }


def time_case(entry: Results, folder: Path, ours: Command, theirs: Command) -> None:
    """Read one file with surfsig and then with each peer, and add the seconds to the entry."""
    case: Case = entry["case"]
    paths = (folder / f"small{case.extension}", folder / f"large{case.extension}")
    for reader in ("surfsig", *case.peers):
        if reader in entry["skipped"]:
            continue
        try:
            program = ours if reader == "surfsig" else theirs
            seconds = time_reading(program, reader, *paths, entry["points"])
            entry["seconds"].setdefault(reader, []).append(seconds)
        except PeerUnavailable as reason:
            entry["skipped"][reader] = str(reason)


def rows(results: Results) -> list[tuple[str, ...]]:
    """Return the table: a row for each file and reader."""
    per_point = results["extraction_seconds_per_point"]
    table: list[tuple[str, ...]] = []
    for entry in results["files"]:
        size = (f"{entry['points']:,}", f"{entry['bytes'] / 1e6:,.0f}")
        for reader, seconds in entry["seconds"].items():
            spread = Spread.of(seconds)
            ratio = Spread.of(
                each * entry["points"] / time for each, time in zip(per_point, seconds, strict=True)
            )
            table.append((
                entry["case"], LABELS.get(reader, reader), *size, spread.text(".3f"),
                f"{entry['points'] / spread.median:,.0f}", ratio.text(".1f"),
            ))  # fmt: skip
        for reader, reason in entry["skipped"].items():
            table.append(
                (entry["case"], LABELS.get(reader, reader), *size, f"not measured: {reason}", "", "")
            )
    return table


def notes(results: Results) -> list[str]:
    """Return the sentences that belong to the table."""
    settings, per_point = results["settings"], results["extraction_seconds_per_point"]
    speed = Spread.of(1 / seconds for seconds in per_point)
    return [
        *measured_on(results),
        f"Rounds: {settings['rounds']}. The extraction is that of the curvature in balls of about 235 points "
        f"with 2 threads: {speed.text(',.0f')} points per second at {settings['extracted_points']:,} points; "
        "its time is scaled to the number of points in the file.",
    ]


def read_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=10_000_000, help="in each file (default: 10000000)")
    parser.add_argument("--text-points", type=int, default=1_000_000, help="in text (default: 1000000)")
    parser.add_argument(
        "--extracted-points", type=int, default=2_000_000, help="of the extraction (default: 2000000)"
    )
    parser.add_argument("--rounds", type=int, default=3, help="how often each reads (default: 3)")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md and reading.json")
    arguments = parser.parse_args()
    if min(arguments.points, arguments.text_points, arguments.extracted_points, arguments.rounds) < 1:
        parser.error("all numbers start at 1")
    return arguments


def main() -> None:
    """Measure, print and write."""
    arguments = read_arguments()
    console = Console(width=None if sys.stdout.isatty() else PIPE_COLUMNS)
    try:
        results = measure(arguments, console)
    except PeerUnavailable as error:
        sys.exit(f"nothing is measured: {error}")
    console.print(rich_table("reading", COLUMNS, rows(results)))
    lines = notes(results)
    for line in lines:
        console.print(line, highlight=False)
    target = (HERE if arguments.write else BUILD) / "reading.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    if arguments.write:
        text = markdown_table(COLUMNS, rows(results)) + "\n\n" + "\n".join(f"- {line}" for line in lines)
        try:
            update_section(ROOT / "BENCHMARKS.md", "make bench-reading", text)
        except (OSError, ValueError) as error:
            sys.exit(f"BENCHMARKS.md is not updated: {error}")


if __name__ == "__main__":
    main()
