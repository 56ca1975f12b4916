"""How many nearest neighbours among descriptors are right, beside FPFH and SHOT, and how long they take.

python benchmarks/descriptors.py --write

Random points of each scan are described, and each is matched with the most similar one of the other scan; a
match is right where the true motion carries the one to within the tolerance of the other. FPFH and SHOT get
surfsig's normals, and several radii.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from descriptor_objects import read_objects, simulated_objects
from descriptor_pairs import Array, Scan, ScanPairs, read_pairs
from machine import measured_here
from numpy.typing import NDArray
from peers import HERE, ROOT, PeerUnavailable, peer_python, run_json, shot_program
from report import Results, Row, markdown_table, measured_on, publish
from timing import times_of

import surfsig

COMMAND = "python benchmarks/descriptors.py --write"
COLUMNS = ("descriptor", "right", "right, mutual", "mutual matches")
SPEED_COLUMNS = ("cloud", "points", "in a ball", "FPFH, ms a point", "surfsig, ms a point", "ratio")
SHARES = (0.7, 1.0)
"""Radii of the peers, in units of surfsig's."""

SPACING = 0.05
"""The peers' clouds are thinned to this, in units of surfsig's radius; with all points FPFH takes an hour."""

SHOT = 352
"""Numbers of a SHOT."""

NORMALS = 0.16
"""Radius in which normals are fitted, in units of surfsig's."""

Vectors = dict[str, NDArray[np.float32]]


def score(pairs: ScanPairs, vectors: Vectors) -> tuple[float, float, float]:
    """Share of right matches of all and of the mutual ones, and the number of these, all means over pairs."""
    results = []
    for (source, target), motion in pairs.motions.items():
        ours, theirs = vectors[source], vectors[target]
        square = np.sum(theirs**2, axis=1) - 2.0 * ours @ theirs.T
        nearest = square.argmin(axis=1)
        back = (np.sum(ours**2, axis=1)[:, None] - 2.0 * ours @ theirs.T).argmin(axis=0)
        places, others = (pairs.scans[name].points[pairs.scans[name].places] for name in (source, target))
        carried = places @ motion[:3, :3].T + motion[:3, 3]
        right = np.linalg.norm(carried - others[nearest], axis=1) < pairs.tolerance
        mutual = back[nearest] == np.arange(len(ours))
        results.append((right.mean(), right[mutual].mean(), mutual.sum()))
    first, second, third = np.mean(results, axis=0)
    return float(first), float(second), float(third)


def ours(pairs: ScanPairs) -> Vectors:
    """Field signatures; places without one get zeros, like nothing else."""
    vectors = {}
    for name, scan in pairs.scans.items():
        found = surfsig.extract_field_signatures(
            scan.points, pairs.radius, at=scan.places, normals=scan.sides
        )
        vectors[name] = np.nan_to_num(found.vectors)
    return vectors


def oriented_normals(scan: Scan, at: NDArray[np.int64], radius: float) -> Array:
    """Fit the normals that all methods share; zero where there is none."""
    found = surfsig.extract(scan.points, radius, at=at, normals=scan.sides)
    return np.nan_to_num(found.normals.astype(np.float64))


def write_cloud(path: Path, scan: Scan, support: NDArray[np.int64], radius: float) -> None:
    """Write a cloud for the peer: the places first, then other points."""
    chosen = np.concatenate([scan.places, np.setdiff1d(support, scan.places)])
    normals = oriented_normals(scan, chosen, radius)
    np.savez(path, points=scan.points[chosen], normals=normals, count=len(scan.places))


def run_fpfh(clouds: list[Path], radius: float) -> tuple[list[NDArray[np.float32]], list[float]]:
    """Histograms of each cloud's places, and processor seconds for all points of each cloud."""
    program = [peer_python("open3d"), HERE / "descriptors_open3d.py"]
    answer = run_json([*program, *clouds, "--radius", str(radius)], threads=os.cpu_count() or 1)
    return [np.load(path.with_suffix(".npy")) for path in clouds], answer["processor_seconds"]


def write_clouds(pairs: ScanPairs, folder: Path) -> list[Path]:
    """Write all scans for the peers."""
    paths = []
    for name, scan in pairs.scans.items():
        paths.append(folder / f"{name}.npz")
        support = surfsig.extract(scan.points, pairs.radius * NORMALS, voxel=pairs.radius * SPACING).indices
        assert support is not None
        write_cloud(paths[-1], scan, support, pairs.radius * NORMALS)
    return paths


def fpfh(pairs: ScanPairs, share: float, folder: Path) -> Vectors:
    """FPFH with a radius of this share of ours."""
    histograms, _ = run_fpfh(write_clouds(pairs, folder), pairs.radius * share)
    return dict(zip(pairs.scans, histograms, strict=True))


def shot(pairs: ScanPairs, share: float, folder: Path) -> Vectors:
    """SHOT with a radius of this share of ours; places without one get zeros, like nothing else."""
    program, vectors = shot_program(), {}
    for name, path in zip(pairs.scans, write_clouds(pairs, folder), strict=True):
        arrays = np.load(path)
        cloud, answers = path.with_suffix(".f32"), path.with_suffix(".shot")
        np.hstack([arrays["points"], arrays["normals"]]).astype("<f4").tofile(cloud)
        command = [*program, str(pairs.radius * share), cloud, str(arrays["count"]), answers]
        run_json(command, threads=os.cpu_count() or 1)
        vectors[name] = np.nan_to_num(np.fromfile(answers, "<f4").reshape(-1, SHOT))
    return vectors


def quality_rows(pairs: ScanPairs, folder: Path) -> list[Row]:
    """Return a row for surfsig, and one for each peer and radius."""
    methods: list[tuple[str, Callable[[], Vectors]]] = [
        (f"surfsig, radius {pairs.radius:g}", lambda: ours(pairs))
    ]
    for peer, describe in (("FPFH (Open3D)", fpfh), ("SHOT (PCL)", shot)):
        for share in SHARES:
            label = f"{peer}, radius {pairs.radius * share:g}"
            methods.append((label, partial(describe, pairs, share, folder)))
    rows: list[Row] = []
    for label, vectors_of in methods:
        try:
            right, mutual, count = score(pairs, vectors_of())
        except PeerUnavailable as reason:
            rows.append((label, f"not measured: {reason}", "", ""))
        else:
            rows.append((label, f"{right:.3f}", f"{mutual:.3f}", f"{count:.0f}"))
    return rows


def speed_row(title: str, scan: Scan, radius: float, folder: Path) -> Row:
    """Time both on all points of a cloud at the same radius."""
    every = Scan(scan.points, scan.sides, np.arange(len(scan.points)))
    _, spent = times_of(lambda: surfsig.extract_field_signatures(scan.points, radius, normals=scan.sides))
    probe = np.arange(0, len(scan.points), max(1, len(scan.points) // 500))
    neighbours = surfsig.extract(scan.points, radius, at=probe).count.mean()
    path = folder / "all.npz"
    write_cloud(path, every, every.places, radius * NORMALS)
    count = len(scan.points)
    try:
        _, (peer,) = run_fpfh([path], radius)
    except PeerUnavailable as reason:
        return (
            title, f"{count:,}", f"{neighbours:,.0f}", f"not measured: {reason}",
            f"{1e3 * spent / count:.3f}", "",
        )  # fmt: skip
    return (
        title, f"{count:,}", f"{neighbours:,.0f}", f"{1e3 * peer / count:.3f}", f"{1e3 * spent / count:.3f}",
        f"{peer / spent:.0f}",
    )  # fmt: skip


def speed_rows(every: list[ScanPairs], folder: Path) -> list[Row]:
    """Time the first scan of the last set as it is, and that of the first set thinned."""
    rows = []
    for pairs, voxel in ((every[-1], 0.0), (every[0], SPACING)):
        name, scan = next(iter(pairs.scans.items()))
        title = f"{pairs.title.partition(',')[0]} {name}, radius {pairs.radius:g}"
        if voxel:
            kept = surfsig.extract(scan.points, pairs.radius * NORMALS, voxel=pairs.radius * voxel).indices
            scan = Scan(scan.points[kept], scan.sides[kept], scan.places)
            title += f", one point per {pairs.radius * voxel:g}"
        rows.append(speed_row(title, scan, pairs.radius, folder))
    return rows


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
    parser.add_argument("data", type=Path, nargs="?", default=default, help="folder of the real scans")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    every = read_pairs(arguments.data)
    if not every:
        sys.exit(f"{arguments.data} has no registration/redkitchen or registration/bunny")
    results: Results = measured_here()
    for peer, command in (
        ("Open3D", lambda: [peer_python("open3d"), HERE / "descriptors_open3d.py"]),
        ("PCL", shot_program),
    ):
        try:
            results["versions"] |= run_json([*command(), "versions"], threads=1)
        except PeerUnavailable as reason:
            print(f"{peer} is left out: {reason}", file=sys.stderr)
    parts = []
    with tempfile.TemporaryDirectory() as name:
        for pairs in [*every, *read_objects(arguments.data), simulated_objects()]:
            print(pairs.title, file=sys.stderr, flush=True)
            unit = "pair" if len(pairs.motions) == 1 else "pairs"
            parts.append(f"### {pairs.title[0].upper()}{pairs.title[1:]}: {len(pairs.motions)} {unit}")
            parts.append(markdown_table(COLUMNS, quality_rows(pairs, Path(name))))
        parts.append("### Processor time, all points of a cloud")
        parts.append(markdown_table(SPEED_COLUMNS, speed_rows(every, Path(name))))
    parts.append("\n".join(f"- {line}" for line in measured_on(results)))
    text = "\n\n".join(parts)
    publish(text, COMMAND, arguments.write)


if __name__ == "__main__":
    main()
