"""Turns the results of a run into tables: on a terminal, and in BENCHMARKS.md."""

from __future__ import annotations

import statistics
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from peers import PEERS, ROOT
from rich.console import Console
from rich.table import Table

TARGET_POINTS = 200_000
TARGET_RADIUS = 0.02
COLUMNS = (
    "method",
    "per point",
    "neighbours",
    "threads",
    "points/s (range)",
    "surfsig's speed / this one's (range)",
    "the same in processor time",
)
TARGET_COLUMNS = ("target", "wanted", "reached", "")

Results = dict[str, Any]
Row = tuple[str, ...]
Target = tuple[str, int, tuple[str, ...]]
"""What is computed beside what, how many times as fast it is to be, and the peers' names."""

SPEED_TARGETS: tuple[Target, ...] = (
    ("Curvature: the faster of PCL's normals, jakteristics", 12, ("pcl_normals", "jakteristics")),
    ("The same, PCL's tree told not to sort", 12, ("pcl_normals_unsorted", "jakteristics")),
    ("Curvature: Open3D's normals", 20, ("open3d_normals",)),
    ("Curvature and its errors: Open3D's normals", 30, ("open3d_normals",)),
    ("Curvature and its errors: CGAL's jets of degree 2", 100, ("cgal_jet2",)),
    ("With all 242 numbers: Open3D's FPFH", 50, ("open3d_fpfh",)),
    ("With all 242 numbers: Open3D's FPFH", 100, ("open3d_fpfh",)),
)
DENSE_TARGETS: tuple[Target, ...] = (
    ("A hundred times as dense: CGAL's jets of degree 2", 2500, ("cgal_jet2",)),
)


@dataclass(frozen=True)
class Spread:
    """A median and the range around it."""

    median: float
    least: float
    most: float

    @classmethod
    def of(cls, values: Iterable[float]) -> Spread:
        """Summarise the values of all rounds."""
        listed = list(values)
        return cls(statistics.median(listed), min(listed), max(listed))

    def text(self, form: str) -> str:
        """Write the three numbers, each in the format `form`; one where there was one round."""
        if self.least == self.most:
            return f"{self.median:{form}}"
        return f"{self.median:{form}} ({self.least:{form}} to {self.most:{form}})"


def rate(runs: Sequence[Results]) -> Spread:
    """Return the points per second of some measurements."""
    return Spread.of(run["points_per_second"] for run in runs)


def ratio(pairs: Results) -> Spread:
    """Return how many times as fast surfsig was, each run of a peer against surfsig's run just before it."""
    both = zip(pairs["ours"], pairs["theirs"], strict=True)
    return Spread.of(ours["points_per_second"] / theirs["points_per_second"] for ours, theirs in both)


def processor_ratio(pairs: Results) -> Spread:
    """Return how many times the processor time per point of surfsig the peer took, in the same pairs."""
    both = zip(pairs["ours"], pairs["theirs"], strict=True)
    return Spread.of(processor_cost(theirs) / processor_cost(ours) for ours, theirs in both)


def processor_cost(run: Results) -> float:
    """Return the processor's seconds per point."""
    return float(run["processor_seconds"] / run["points"])


def method_rows(at_radius: Results) -> list[Row]:
    """Return the table of one radius, a row for each method."""
    labels = {"curvature": "surfsig", "signatures": "surfsig, with signatures"}
    what = {
        "curvature": "k1, k2, their errors, directions, normal, residual, shape",
        "signatures": "the same and 242 numbers",
    }
    rows: list[Row] = []
    for kind, ours in at_radius["ours"].items():
        rows.append((labels[kind], what[kind], *run_cells(ours), "1", "1"))
        for peer in PEERS:
            pairs = at_radius["peers"].get(peer.name)
            if peer.counterpart != kind or pairs is None:
                continue
            if pairs["skipped"]:
                rows.append((peer.label, peer.computes, "", "", f"not measured: {pairs['skipped']}", "", ""))
                continue
            timed = pairs["theirs"][0]["points"]
            some = "" if timed == at_radius["points"] else f" ({timed:,} points timed)"
            cells = run_cells(pairs["theirs"])
            ratios = (ratio(pairs).text(",.1f"), processor_ratio(pairs).text(",.1f"))
            rows.append((peer.label + some, peer.computes, *cells, *ratios))
    return rows


def run_cells(runs: Sequence[Results]) -> tuple[str, str, str]:
    """Return neighbours, threads and speed of one method."""
    return f"{runs[0]['mean_neighbours']:.0f}", str(runs[0]["threads"]), rate(runs).text(",.0f")


def target_rows(results: Results) -> list[Row]:
    """Return what was to be reached and what was; speeds only on the cloud that the targets name."""
    rows: list[Row] = []
    if results["settings"]["points"] == TARGET_POINTS:
        for at_radius in results["radii"]:
            if at_radius["radius"] == TARGET_RADIUS:
                rows += speed_targets(at_radius["peers"], SPEED_TARGETS)
        rows += speed_targets(results["dense"]["peers"], DENSE_TARGETS)
    memory = results["memory"]
    if memory["skipped"]:
        rows.append(("Memory above the input", "<= 250 MB", "not measured", ""))
    elif not results["settings"]["quick"]:
        megabytes = memory["peak_bytes"] / 1e6
        label = f"Memory above the input, curvature of {memory['points']:,} points"
        rows.append((label, "<= 250 MB", f"{megabytes:.0f} MB", verdict(megabytes <= 250)))
    seconds = import_cost(results)
    rows.append(("Import of surfsig", "< 0.3 s", f"{seconds:.2f} s", verdict(seconds < 0.3)))
    return rows


def speed_targets(peers: Results, targets: Iterable[Target]) -> list[Row]:
    """Return the rows of the speeds; a target with several peers counts against the fastest of them."""
    rows: list[Row] = []
    for label, wanted, names in targets:
        missing = [name for name in names if name not in peers or peers[name]["skipped"]]
        if missing:
            rows.append((label, f">= {wanted:,} times", f"not measured without {', '.join(missing)}", ""))
            continue
        fastest = min((peers[name] for name in names), key=lambda pairs: ratio(pairs).median)
        reached = ratio(fastest)
        text = f"{reached.text(',.1f')} times; {processor_ratio(fastest).median:,.1f} in processor time"
        rows.append((label, f">= {wanted:,} times", text, verdict(reached.median >= wanted)))
    return rows


def verdict(met: bool) -> str:
    """Say whether a target is met."""
    return "met" if met else "missed"


def import_cost(results: Results) -> float:
    """Return the seconds that importing surfsig adds to a bare interpreter."""
    seconds = results["import_seconds"]
    return float(statistics.median(seconds["surfsig"]) - statistics.median(seconds["bare"]))


def notes(results: Results) -> list[str]:
    """Return the sentences that belong to the tables."""
    settings = results["settings"]
    bare = statistics.median(results["import_seconds"]["bare"])
    first = statistics.median(run["first_seconds"] for run in results["radii"][0]["ours"]["curvature"])
    return [
        *measured_on(results),
        f"Threads: {settings['threads']}; rounds: {settings['rounds']}.",
        f"The first extraction of a process at radius {results['radii'][0]['radius']} took {first:.3f} s; "
        "the speeds are those of the later ones.",
        memory_note(results["memory"]),
        f"`import surfsig` adds {import_cost(results):.3f} s to the {bare:.3f} s of a bare `python -c ''`.",
    ]


def measured_on(results: Results) -> list[str]:
    """Return what was measured when, on what machine, and the versions."""
    machine = results["machine"]
    share = machine["busy_share_before"]
    busy = "other load unknown" if share is None else f"others kept {share:.0%} of it busy just before"
    versions = ", ".join(f"{name} {version}" for name, version in results["versions"].items())
    return [
        f"Measured on {results['date']} on {machine['processor']}, {machine['cores']} cores "
        f"({', '.join(machine['instruction_sets'])}), {machine['memory_bytes'] / 2**30:.0f} GiB, "
        f"{machine['system']}; {busy}.",
        f"Versions: {versions}.",
    ]


def memory_note(memory: Results) -> str:
    """Return what the extraction of the dense cloud took."""
    if memory["skipped"]:
        return f"Memory is not measured: {memory['skipped']}."
    return (
        f"{memory['points']:,} points with {memory['mean_neighbours']:,.0f} neighbours each took "
        f"{memory['seconds']:.2f} s ({memory['points_per_second']:,.0f} points per second) and "
        f"{memory['peak_bytes'] / 1e6:.0f} MB above the {memory['input_bytes'] / 1e6:.0f} MB of the input, "
        "the results included."
    )


def print_tables(results: Results, console: Console) -> None:
    """Print everything on a terminal."""
    for at_radius in [*results["radii"], results["dense"]]:
        console.print(rich_table(table_title(at_radius), COLUMNS, method_rows(at_radius)))
    console.print(rich_table("targets", TARGET_COLUMNS, target_rows(results)))
    for note in notes(results):
        console.print(note, highlight=False)


def table_title(at_radius: Results) -> str:
    """Name the radius and the cloud of a table."""
    return f"Radius {at_radius['radius']}, {at_radius['cloud']}"


def rich_table(title: str, columns: Sequence[str], rows: Iterable[Row]) -> Table:
    """Return a table for a terminal."""
    table = Table(*columns, title=title)
    for row in rows:
        table.add_row(*row)
    return table


def markdown(results: Results) -> str:
    """Return the same tables and notes as Markdown."""
    parts = [markdown_table(TARGET_COLUMNS, target_rows(results))]
    for at_radius in [*results["radii"], results["dense"]]:
        parts.append(f"### {table_title(at_radius)}")
        parts.append(markdown_table(COLUMNS, method_rows(at_radius)))
    parts.append("\n".join(f"- {note}" for note in notes(results)))
    return "\n\n".join(parts)


def markdown_table(columns: Sequence[str], rows: Iterable[Row]) -> str:
    """Return one table as Markdown."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def publish(text: str, command: str, write: bool) -> None:
    """Print what a benchmark found, and put it into the command's section of BENCHMARKS.md."""
    print(text)
    if not write:
        return
    try:
        update_section(ROOT / "BENCHMARKS.md", command, text)
    except (OSError, ValueError) as error:
        sys.exit(f"BENCHMARKS.md is not updated: {error}")


def update_section(document: Path, command: str, text: str) -> None:
    """Replace what stands between the two marker comments of a command in `document`.

    Raises
    ------
    ValueError
        When a marker is missing.
    """
    begin, end = (f"<!-- {mark}: written by `{command}` -->" for mark in ("begin", "end"))
    head, found_begin, rest = document.read_text(encoding="utf-8").partition(begin)
    _, found_end, tail = rest.partition(end)
    if not found_begin or not found_end:
        raise ValueError(f"{document.name} has no section between {begin} and {end}")
    document.write_text(f"{head}{begin}\n\n{text}\n\n{end}{tail}", encoding="utf-8")
