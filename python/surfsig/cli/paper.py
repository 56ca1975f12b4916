"""`surfsig paper`: the paper's tables and figures, printed and ours."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from surfsig import defaults
from surfsig.cli.console import on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import json_option


@click.command("paper")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    help="Folder for index.html, tables.json, tables.csv and the figures.",
)
@click.option(
    "--seeds",
    type=click.IntRange(min=1),
    default=defaults.PAPER_SEEDS,
    show_default=True,
    help="Draws of noise and poses; random poses get five times as many.",
)
@json_option
def paper_command(out: Path, seeds: int, as_json: bool) -> None:
    """Reproduce the paper that this library comes from, with a simulated laser scanner.

    Scans table III's twenty acquisitions, makes its tables and figures with printed values beside ours,
    counts the 57 decisions (zeta of 0.5 or above), and shows the same objects in random poses.

    \b
    Examples:
      surfsig paper --out paper
      surfsig paper --out paper --seeds 20 --json | jq .decisions
    """  # noqa: D301
    from surfsig.paper import reproduce, write_reproduction
    from surfsig.paper.canvas import check_matplotlib

    check_matplotlib()
    out.mkdir(parents=True, exist_ok=True)
    shown = on_terminal()
    with progress_bar("scanning", "scans", shown=shown) as progress:
        result = reproduce(seeds, progress=progress)
    with progress_bar("drawing", "figures", shown=shown) as progress:
        values = write_reproduction(result, out, progress=progress)
    if as_json:
        print_json(values)
        return
    print_table(f"the paper, reproduced with {seeds} seeds", _summary(values, out), err=False)
    _print_similarities(values)


def _summary(values: Mapping[str, Any], out: Path) -> list[tuple[str, str]]:
    rows = []
    for frame in values["decisions_by_frame"]:
        middle, jittered = frame["stated"]["median_seed"], frame["jittered"]["median_seed"]
        text = f"{middle['positives']} of {middle['of_positives']} positives, "
        text += f"{middle['negatives']} of {middle['of_negatives']} negatives "
        text += f"(jittered poses: {jittered['positives']} and {jittered['negatives']}): {frame['frame']}"
        rows.append(("decisions", text))
    eigenvalue = values["decisions_by_frame"][0]["smallest_eigenvalue"]
    text = f"smallest eigenvalue of F F^T {eigenvalue['ours']:.3g}, printed about {eigenvalue['printed']:.2g}"
    rows.append(("frame", text))
    for way in values["random_poses"]:
        alike = ", ".join(f"{kind} {share:.3f}" for kind, share in way["self_similarity"].items())
        false = way["false_matches"]["largest_share"]
        text = f"{way['way']}: alike with itself: {alike}; falsely with others: {false:.3f}"
        rows.append(("random poses", text))
    rows.append(("all of it", str(out / "index.html")))
    return rows


def _print_similarities(values: Mapping[str, Any]) -> None:
    """Print tables IV to VI side by side: printed values, then our medians."""
    from rich.console import Console
    from rich.table import Table

    from surfsig.paper.printed import SIMILARITIES, TABLE_III

    table = Table(title="zeta, printed and ours", title_justify="left", box=None, padding=(0, 2, 0, 0))
    table.add_column("acquisition", no_wrap=True)
    cells: dict[int, list[str]] = {number: [] for number in range(1, len(TABLE_III) + 1)}
    for similarities in SIMILARITIES:
        table.add_column(similarities.name, justify="right")
        table.add_column("ours", justify="right")
        cells[similarities.reference] += ["-", "-"]
        for row in values["tables"][similarities.name]["rows"]:
            cells[row["acquisition"]] += [f"{row['printed']:.4f}", f"{row['stated']['median']:.4f}"]
    for number, texts in cells.items():
        table.add_row(f"{number} {TABLE_III[number - 1].name.lower()}", *texts)
    Console(highlight=False).print(table)
