"""Compare surfsig with its peers on one cloud; the results go to benchmarks/results.json.

In every round each peer runs right after surfsig does the comparable thing (surfsig, peer, surfsig, next
peer, and so on), each in a process of its own, so that a machine that slows down slows both.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import json
import sys
import tempfile
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import numpy.typing as npt
from clouds import SCALING_POINTS, bumpy_square, bumpy_tenth
from machine import describe_machine, import_seconds, own_versions
from peers import (
    BUILD,
    HERE,
    PEERS,
    ROOT,
    Command,
    Peer,
    PeerUnavailable,
    cpp_program,
    python_program,
    run_json,
)
from report import TARGET_POINTS, TARGET_RADIUS, Results, markdown, print_tables, update_section
from rich.console import Console
from rich.progress import Progress

OURS: Command = [sys.executable, HERE / "ours.py"]
IMPORT_RUNS = 7
QUICK_POINTS = 20_000
DENSE_PEER, DENSE_QUERIES = "cgal_jet2", 500
PIPE_COLUMNS = 140
MOST_BUSY = 0.1

Programs = dict[str, Command | PeerUnavailable]


class Cloud:
    """A cloud on disk, in the formats that the programs read."""

    def __init__(self, folder: Path, name: str, points: npt.NDArray[np.float32]) -> None:
        self.name = f"{len(points):,} points on {name}"
        self.points = len(points)
        self.array_file = folder / f"{name}.npy"
        self.raw_file = folder / f"{name}.f32"
        np.save(self.array_file, points)
        points.tofile(self.raw_file)


def prepare_programs(peers: list[Peer]) -> Programs:
    """Build and install what the chosen peers need; keep the reason where that fails."""
    makers = {"c++": cpp_program, "python": python_program}
    programs: Programs = {}
    for name in {peer.program: None for peer in peers}:
        print(f"preparing the {name} peers (the first time takes minutes)", file=sys.stderr)
        try:
            programs[name] = makers[name]()
        except PeerUnavailable as reason:
            print(f"the {name} peers are left out: {reason}", file=sys.stderr)
            programs[name] = reason
    return programs


def peer_versions(programs: Programs) -> dict[str, str]:
    """Ask the peers' programs for their versions."""
    versions: dict[str, str] = {}
    for program in programs.values():
        if not isinstance(program, PeerUnavailable):
            versions |= run_json([*program, "versions"], threads=1)
    versions.pop("numpy", None)
    return versions


def time_ours(kind: str, cloud: Cloud, radius: float, threads: int) -> Results:
    """Time surfsig once in a fresh process."""
    return run_json([*OURS, kind, cloud.array_file, str(radius), str(threads)], threads)


def measure_memory(cloud: Cloud, threads: int) -> Results:
    """Measure the memory of one extraction in a fresh process, where the system tells."""
    try:
        return {"skipped": None} | time_ours("memory", cloud, TARGET_RADIUS, threads)
    except PeerUnavailable as reason:
        return {"skipped": str(reason)}


def time_peer(peer: Peer, programs: Programs, cloud: Cloud, radius: float, threads: int) -> Results:
    """Time one peer once in a fresh process."""
    program = programs[peer.program]
    if isinstance(program, PeerUnavailable):
        raise program
    if peer.program == "c++":
        job: Command = [cloud.raw_file, str(radius), str(threads), str(peer.queries)]
    else:
        job = [cloud.array_file, str(radius), str(threads)]
    return run_json([*program, peer.name, *job], threads)


def measure_radius(
    radius: float,
    cloud: Cloud,
    peers: list[Peer],
    programs: Programs,
    plan: argparse.Namespace,
    progress: Progress,
    kinds: Sequence[str] = ("curvature", "signatures"),
) -> Results:
    """Run all rounds of the plan, which is the command line, at one radius."""
    ours: dict[str, list[Results]] = {kind: [] for kind in kinds}
    pairs: dict[str, Results] = {peer.name: {"ours": [], "theirs": [], "skipped": None} for peer in peers}
    task = progress.add_task("", total=plan.rounds * len(peers))
    for round_number in range(plan.rounds):
        for kind, runs in ours.items():
            runs.append(time_ours(kind, cloud, radius, plan.threads))
        for peer in peers:
            progress.update(task, description=f"round {round_number + 1}, radius {radius}: {peer.label}")
            pair = pairs[peer.name]
            if pair["skipped"] is None:
                before = time_ours(peer.counterpart, cloud, radius, plan.threads)
                ours[peer.counterpart].append(before)
                try:
                    pair["theirs"].append(time_peer(peer, programs, cloud, radius, plan.threads))
                    pair["ours"].append(before)
                except PeerUnavailable as reason:
                    pair["skipped"] = str(reason)
            progress.advance(task)
    return {"radius": radius, "cloud": cloud.name, "points": cloud.points, "ours": ours, "peers": pairs}


def chosen_peers(plan: argparse.Namespace) -> list[Peer]:
    """Return the peers that the command line asks for."""
    return [peer for peer in PEERS if peer.name in plan.peers]


def measure(plan: argparse.Namespace, console: Console) -> Results:
    """Make the clouds, run everything and return the results."""
    peers = chosen_peers(plan)
    few_queries = [
        dataclasses.replace(peer, queries=DENSE_QUERIES) for peer in peers if peer.name == DENSE_PEER
    ]
    programs = prepare_programs(peers)
    machine = describe_machine()
    if (machine["busy_share_before"] or 0) > MOST_BUSY:
        print("other programs keep the processor busy: the figures will not be good", file=sys.stderr)
    points = QUICK_POINTS if plan.quick else TARGET_POINTS
    scaling_points = TARGET_POINTS if plan.quick else SCALING_POINTS
    results: Results = {
        "machine": machine,
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "versions": own_versions() | peer_versions(programs),
        "settings": {
            "points": points,
            "threads": plan.threads,
            "rounds": plan.rounds,
            "quick": plan.quick,
        },
        "import_seconds": import_seconds(IMPORT_RUNS),
    }
    with tempfile.TemporaryDirectory() as folder, Progress(console=console, transient=True) as progress:
        large = Cloud(Path(folder), "the large square", bumpy_square(scaling_points))
        results["memory"] = measure_memory(large, plan.threads)
        cloud = Cloud(Path(folder), "the square", bumpy_square(points))
        results["radii"] = [
            measure_radius(radius, cloud, peers, programs, plan, progress) for radius in plan.radius
        ]
        dense = Cloud(Path(folder), "a tenth of the square", bumpy_tenth(scaling_points))
        results["dense"] = measure_radius(
            TARGET_RADIUS, dense, few_queries, programs, plan, progress, kinds=["curvature"]
        )
    return results


def read_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--radius", type=float, nargs="+", default=[TARGET_RADIUS], help="radii (default: 0.02)"
    )
    parser.add_argument("--threads", type=int, default=2, help="threads for every method (default: 2)")
    parser.add_argument("--rounds", type=int, default=3, help="how often each method runs (default: 3)")
    parser.add_argument(
        "--peers",
        nargs="*",
        choices=[peer.name for peer in PEERS],
        default=[peer.name for peer in PEERS if peer.by_default],
        metavar="PEER",
        help=f"compare with these only, of: {', '.join(peer.name for peer in PEERS)}",
    )
    parser.add_argument(
        "--quick", action="store_true", help="one round on a small cloud, to see that all works"
    )
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    if arguments.quick and arguments.write:
        parser.error("--quick measures nothing worth writing")
    if arguments.quick:
        arguments.rounds = 1
    if arguments.rounds < 1 or arguments.threads < 1:
        parser.error("--rounds and --threads start at 1")
    return arguments


def main() -> None:
    """Measure, print and write."""
    arguments = read_arguments()
    if find_spec("surfsig") is None:
        sys.exit("surfsig is not installed in this Python: run `make bench`")
    console = Console(width=None if sys.stdout.isatty() else PIPE_COLUMNS)
    try:
        results = measure(arguments, console)
    except PeerUnavailable as error:
        sys.exit(f"surfsig could not be measured: {error}")
    print_tables(results, console)
    target = BUILD / "quick.json" if arguments.quick else HERE / "results.json"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    if arguments.write:
        try:
            update_section(ROOT / "BENCHMARKS.md", "make bench", markdown(results))
        except (OSError, ValueError) as error:
            sys.exit(f"BENCHMARKS.md is not updated: {error}")


if __name__ == "__main__":
    main()
