"""Measure the error of curvature against the size of the patch: surfsig's fits beside CGAL's jets.

All of them get the same neighbourhoods: seeded draws of surfaces whose curvature is known, with noise.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Literal

import numpy as np
from error_picture import draw_picture
from error_report import COLUMNS, CROSSING_COLUMNS, Error, crossing_rows, error_rows, notes, target_rows
from machine import describe_machine, own_versions
from patches import SURFACES, Array, Surface, draw_patches
from peers import BUILD, HERE, ROOT, Command, PeerUnavailable, jets_program, run_json
from report import TARGET_COLUMNS, markdown_table, rich_table, update_section
from rich.console import Console
from rich.progress import track

import surfsig

SEED, POINTS, THREADS = 2026, 500, 2
RADII = (14.15, 29.15, 60.0, 100.0)
BALLS = (4.0, 6.0, 8.0, 11.0, 14.0, 17.0, 20.0, 24.0)
NOISES = (0.02, 0.1, 0.3)
FITS: tuple[Literal["paraboloid", "quadric", "auto"], ...] = ("paraboloid", "quadric", "auto")
DEGREES = (2, 4)
PIPE_COLUMNS = 160
SENSOR = (0.0, 0.0, 1e9)
COMMAND = "make bench-error"


def surfsig_curvatures(
    patches: Array, ball: float, fit: Literal["paraboloid", "quadric", "auto"]
) -> tuple[Array, float]:
    """Return k1 and k2 of each patch, (draws, 2), and the share of quadrics among the fits."""
    draws, points, _ = patches.shape
    apart = np.zeros((draws, 1, 3))
    apart[:, 0, 0] = np.arange(draws) * np.ceil(5 * ball)
    cloud = (patches + apart).reshape(-1, 3)
    s = surfsig.extract(cloud, ball, at=np.arange(draws) * points, viewpoint=SENSOR, fit=fit, threads=THREADS)
    if not np.all(s.count == points):
        raise AssertionError("a patch is not what the ball holds")
    used = 0.0 if s.fit_used is None else float(np.mean(s.fit_used == surfsig.FitUsed.QUADRIC))
    return np.column_stack([s.k1, s.k2]).astype(np.float64), used


def jet_curvatures(program: Command, degree: int, patches: Array, folder: Path) -> Array:
    """Return k1 and k2 of CGAL's jet of each patch, (draws, 2)."""
    asked, answered = folder / "patches.f64", folder / "answers.f64"
    patches.tofile(asked)
    run_json([*program, str(degree), asked, str(patches.shape[1]), answered], threads=THREADS)
    return np.fromfile(answered).reshape(-1, 2)


def measure_setting(
    patches: Array, surface: Surface, size: tuple[float, float, float], program: Command | None, folder: Path
) -> list[Error]:
    """Fit patches of one surface with all methods; the size is radius of curvature, ball and noise."""
    radius, ball, noise = size
    answers: dict[str, tuple[Array, float]] = {}
    for fit in FITS:
        answers[fit] = surfsig_curvatures(patches, ball, fit)
    if program is not None:
        for degree in DEGREES:
            answers[f"jet{degree}"] = jet_curvatures(program, degree, patches, folder), 0.0
    errors = []
    for method, (curvatures, quadrics) in answers.items():
        asked = curvatures.mean(axis=1) if surface.quantity == "H" else curvatures[:, 0]
        relative = asked[np.isfinite(asked)] * radius / surface.truth - 1
        errors.append(
            Error(
                surface=surface.name,
                quantity=surface.quantity,
                radius=radius,
                ball=ball,
                noise=noise,
                method=method,
                bias=float(relative.mean()) if len(relative) else np.nan,
                spread=float(relative.std(ddof=1)) if len(relative) > 1 else np.nan,
                rms=float(np.sqrt(np.mean(relative**2))) if len(relative) else np.nan,
                valid=len(relative) / len(patches),
                quadrics=quadrics,
            )
        )
    return errors


def measure(draws: int, console: Console) -> tuple[list[Error], dict[str, str]]:
    """Measure all settings, and return the errors and the versions of all that took part."""
    versions = own_versions()
    try:
        program: Command | None = jets_program()
        versions |= run_json([*jets_program(), "versions"], threads=1)
    except PeerUnavailable as reason:
        program = None
        console.print(f"CGAL's jets are left out: {reason}", highlight=False)
    settings = [
        (surface, (radius, ball, noise))
        for surface in SURFACES
        for radius in RADII
        for noise in NOISES
        for ball in BALLS
    ]
    errors: list[Error] = []
    with tempfile.TemporaryDirectory() as name:
        shown = track(settings, "drawing and fitting", console=console, transient=True)
        for number, (surface, size) in enumerate(shown):
            patches = draw_patches(surface, *size, (draws, POINTS), (SEED, number))
            errors += measure_setting(patches, surface, size, program, Path(name))
    return errors, versions


def write_csv(path: Path, errors: list[Error]) -> None:
    """Write a row for each setting and method."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="ascii", newline="") as file:
        table = csv.DictWriter(file, list(asdict(errors[0])), lineterminator="\n")
        table.writeheader()
        for error in errors:
            row = asdict(error)
            table.writerow({
                key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()
            })  # fmt: skip


def main() -> None:
    """Measure, print, draw and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=1000, help="of each setting (default: 1000)")
    parser.add_argument(
        "--write", action="store_true", help="update BENCHMARKS.md, docs/fits.md and its picture"
    )
    arguments = parser.parse_args()
    if arguments.draws < 2:
        parser.error("a spread needs two draws or more")
    console = Console(width=None if sys.stdout.isatty() else PIPE_COLUMNS)
    machine = describe_machine()
    errors, versions = measure(arguments.draws, console)
    tables = [
        (TARGET_COLUMNS, target_rows(errors)),
        (COLUMNS, error_rows(errors)),
        (CROSSING_COLUMNS, crossing_rows(errors)),
    ]
    for columns, rows in tables:
        console.print(rich_table("", columns, rows))
    measured = {
        "machine": machine,
        "versions": versions,
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
    }
    lines = notes(measured, arguments.draws, POINTS)
    write_csv((HERE if arguments.write else BUILD) / "curvature_error.csv", errors)
    pictures = ROOT / "docs" / "pictures" if arguments.write else BUILD
    draw_picture(pictures / "curvature_error.png", errors)
    if arguments.write:
        parts = [markdown_table(*table) for table in tables]
        listed = "\n".join(f"- {line}" for line in lines)
        try:
            update_section(ROOT / "BENCHMARKS.md", COMMAND, "\n\n".join([*parts[:2], listed]))
            update_section(ROOT / "docs" / "fits.md", COMMAND, parts[2])
        except (OSError, ValueError) as error:
            sys.exit(f"the documents are not updated: {error}")


if __name__ == "__main__":
    main()
