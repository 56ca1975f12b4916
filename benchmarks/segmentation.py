"""Compare how well surfaces are found: surfsig without parameters, and the RANSAC of other libraries.

The truth is that of Fit4CAD (planes, cylinders, cones, tori and spheres) and of labelled scans of tables.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from machine import measured_here
from peers import BUILD, HERE, ROOT, Command, PeerUnavailable, run_json
from report import Results, Row, markdown_table, measured_on, update_section
from rich.console import Console
from rich.progress import Progress
from segmentation_methods import METHODS, SEED, Method, cgal_program, pyransac3d_program
from segmentation_score import SurfaceScore, TableScore, score_surfaces, score_table
from segmentation_truth import Model, TableScene, read_models, read_tables, with_noise, with_share

MODEL_COLUMNS = (
    "method", "F1", "typed F1", "kind share", "radius error, median", "radii matched", "found / known",
    "processor seconds",
)  # fmt: skip
TABLE_COLUMNS = (
    "method", "labelled points unmixed", "without the table's own", "segments per object",
    "processor seconds",
)  # fmt: skip
PROGRAMS = {"cgal": cgal_program, "pyransac3d": pyransac3d_program}


def run_method(
    method: Method, scenes: Sequence[Model | TableScene], progress: Progress, what: str
) -> Results:
    """Run a method on all clouds, and return each one's score and seconds, or why there are none."""
    entry: Results = {"method": method.label, "clouds": {}, "skipped": None}
    for scene in progress.track(scenes, description=f"{what}: {method.name}"):
        try:
            found, seconds = method.find(scene.cloud)
        except PeerUnavailable as reason:
            entry["skipped"] = f"{scene.name}: {reason}" if entry["clouds"] else str(reason)
            break
        score = score_surfaces(scene, found) if isinstance(scene, Model) else score_table(scene, found)
        entry["clouds"][scene.name] = {"seconds": seconds, "score": asdict(score)}
    return entry


def measure(plan: argparse.Namespace, console: Console) -> Results:
    """Run all methods on all clouds."""
    models, tables = read_models(plan.data), read_tables(plan.data)
    if plan.only:
        models = [model for model in models if model.name in plan.only]
        tables = [table for table in tables if table.name in plan.only]
    if not models and not tables:
        sys.exit(f"{plan.data} has no cloud that is asked for: of Fit4CAD, or in labelled_tables")
    methods = [method for method in METHODS if method.name in plan.methods]
    results: Results = {
        **measured_here(peer_versions(plan.methods)),
        "seed": SEED,
        "clouds": len(models),
        "models": {},
        "sparse": {},
        "tables": [],
    }
    with Progress(console=console, transient=True) as progress:
        for noise in plan.noise if models else ():
            noisy = [with_noise(model, noise, SEED) for model in models]
            what = f"noise {noise:g}"
            results["models"][str(noise)] = [run_method(each, noisy, progress, what) for each in methods]
        for share in plan.shares if models else ():
            sparse = [with_share(model, share, SEED) for model in models]
            what = f"{share:.0%} of the points"
            results["sparse"][str(share)] = [run_method(each, sparse, progress, what) for each in methods]
        if tables:
            results["tables"] = [run_method(each, tables, progress, "tables") for each in methods]
    return results


def peer_versions(names: Sequence[str]) -> Results:
    """Return the versions of the peers that run; of one that cannot, none."""
    versions: Results = {}
    for start, program in PROGRAMS.items():
        if any(name.startswith(start) for name in names):
            try:
                command: Command = [*program(), "versions"]
                versions |= run_json(command, threads=1)
            except PeerUnavailable:
                continue
    return versions


def model_cells(clouds: Sequence[Results]) -> Row:
    """Return the numbers of one row: of one cloud, or of several added up."""
    score = SurfaceScore.total(SurfaceScore(**each["score"]) for each in clouds)
    error = score.radius_error
    return (
        f"{score.f1:.3f}", f"{score.typed_f1:.3f}", f"{score.kind_share:.3f}",
        "" if error is None else f"{error:.3%}", f"{len(score.radius_errors)} of {score.with_radius}",
        f"{score.found} / {score.known}", f"{sum(each['seconds'] for each in clouds):.1f}",
    )  # fmt: skip


def table_cells(clouds: Sequence[Results]) -> Row:
    """Return the numbers of one row: of one scene, or of several added up."""
    score = TableScore.total(TableScore(**each["score"]) for each in clouds)
    return (
        f"{score.unmixed / score.labelled:.3f}", f"{score.on_table_unmixed / score.on_table:.3f}",
        f"{score.segments / score.objects:.1f}", f"{sum(each['seconds'] for each in clouds):.1f}",
    )  # fmt: skip


def rows(entries: Sequence[Results], columns: Sequence[str], detail: bool) -> list[Row]:
    """Return a row for each method, and with `detail` one for each of its clouds below."""
    cells = model_cells if columns is MODEL_COLUMNS else table_cells
    table: list[Row] = []
    for entry in entries:
        empty = ("",) * (len(columns) - 2)
        if entry["skipped"]:
            table.append((entry["method"], f"not measured: {entry['skipped']}", *empty))
            continue
        table.append((entry["method"], *cells(list(entry["clouds"].values()))))
        if detail:
            table += [(name, *cells([cloud])) for name, cloud in entry["clouds"].items()]
    return table


def markdown(results: Results, detail: bool) -> str:
    """Return all tables and notes as Markdown."""
    parts = []
    for noise, entries in results["models"].items():
        title = "without noise" if float(noise) == 0 else f"with noise of {float(noise):.1%} of the diagonal"
        parts.append(f"### Fit4CAD, {title} (clouds: {results['clouds']})")
        parts.append(markdown_table(MODEL_COLUMNS, rows(entries, MODEL_COLUMNS, detail)))
    for share, entries in results["sparse"].items():
        parts.append(f"### Fit4CAD, {float(share):.0%} of the points (clouds: {results['clouds']})")
        parts.append(markdown_table(MODEL_COLUMNS, rows(entries, MODEL_COLUMNS, detail)))
    if results["tables"]:
        parts.append("### Labelled tables")
        parts.append(markdown_table(TABLE_COLUMNS, rows(results["tables"], TABLE_COLUMNS, detail)))
    parts.append("\n".join(f"- {line}" for line in notes(results)))
    return "\n\n".join(parts)


def notes(results: Results) -> list[str]:
    """Return the sentences that belong to the tables."""
    return [*measured_on(results), f"The seed of the noise and of the peers is {results['seed']}."]


def read_arguments() -> argparse.Namespace:
    """Read the command line."""
    data = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
    names = [method.name for method in METHODS]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "data", type=Path, nargs="?", default=data,
        help="folder of the real scans, or of clouds of Fit4CAD (default: SURFSIG_TEST_DATA)",
    )  # fmt: skip
    parser.add_argument(
        "--methods", nargs="+", choices=names, default=names, metavar="NAME", help=", ".join(names)
    )
    parser.add_argument(
        "--noise",
        type=float,
        nargs="+",
        default=[0.0, 0.001],
        help="shares of the diagonal (default: 0 0.001)",
    )
    parser.add_argument(
        "--shares", type=float, nargs="*", default=[0.1], help="of the points, without noise (default: 0.1)"
    )
    parser.add_argument("--only", nargs="+", default=[], metavar="CLOUD", help="such as PC1 or learn0")
    parser.add_argument("--detail", action="store_true", help="add a row for each cloud")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md and segmentation.json")
    arguments = parser.parse_args()
    if min(arguments.noise) < 0:
        parser.error("noise is not negative")
    if not all(0 < share <= 1 for share in arguments.shares):
        parser.error("shares are above 0, and at most 1")
    return arguments


def main() -> None:
    """Measure, print and write."""
    arguments = read_arguments()
    results = measure(arguments, Console(stderr=True))
    print(markdown(results, arguments.detail))
    target = (HERE if arguments.write else BUILD) / "segmentation.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    if arguments.write:
        try:
            update_section(ROOT / "BENCHMARKS.md", "make bench-segmentation", markdown(results, detail=False))
        except (OSError, ValueError) as error:
            sys.exit(f"BENCHMARKS.md is not updated: {error}")


if __name__ == "__main__":
    main()
