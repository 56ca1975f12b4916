"""Instances found in simulated scenes and in real ones, and where there is none.

python benchmarks/finding.py --write
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from descriptor_pairs import read_pairs
from finding_scene import NOISE, OBJECTS, FindingScene, finding_scene, whole
from machine import measured_here
from numpy.typing import NDArray
from peers import ROOT
from report import Results, Row, markdown_table, measured_on, publish
from rich.progress import track

import surfsig

Array = NDArray[np.float64]

COMMAND = "python benchmarks/finding.py --write"
SHIFT, TURN = 0.005, 2.0
"""Errors of a pose that is right, at most: metres, degrees."""
SIMULATED = (
    "object",
    "noise, mm",
    "scenes",
    "right",
    "false",
    "largest errors of right",
    "false without a copy",
    "seconds, median",
)
REAL = ("model", "scene", "found", "score", "off its true pose", "seconds")
TRUTHS = {"milk": "T_scene_from_milk_DERIVED.txt", "chef": "T_rs1_from_chef_DERIVED.txt"}
EMPTY = (
    "registration/redkitchen/cloud_bin_0.ply",
    "labelled_tables/learn0.pcd",
    "surfaces/table_scene_mug.pcd",
)
"""Scenes that have none of the real objects."""
BUNNY = 1.5
"""Size of the bunny that is looked for there, so that it is as large as the others."""


@dataclass(frozen=True)
class Score:
    """How many copies were found with the right pose, how many instances are none, and the largest errors."""

    right: int
    false: int
    shift: float
    turn: float


def errors(found: Array, true: Array) -> tuple[float, float]:
    """Give the way between two poses' origins, in metres, and the turn between them, in degrees."""
    cosine = (np.trace(found[:3, :3].T @ true[:3, :3]) - 1.0) / 2.0
    turn = float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    return float(np.linalg.norm(found[:3, 3] - true[:3, 3])), turn


def scored(scene: FindingScene, found: surfsig.Instances) -> Score:
    """Compare instances with the truth; each copy counts once."""
    left = list(scene.poses)
    shifts, turns, false = [0.0], [0.0], 0
    for instance in found.instances:
        for number, pose in enumerate(left):
            shift, turn = errors(instance.T_scene_model, pose)
            if shift <= SHIFT and turn <= TURN:
                shifts.append(shift)
                turns.append(turn)
                del left[number]
                break
        else:
            false += 1
    return Score(len(scene.poses) - len(left), false, max(shifts), max(turns))


def simulated_row(name: str, noise: float, seeds: list[int]) -> Row:
    """Look for five copies, and for one where there is none."""
    model = whole(name)
    scores, wrong, seconds = [], 0, []
    for seed in track(seeds, description=f"{name}, {noise * 1000:g} mm", transient=True):
        for copies in (5, 0):
            scene = finding_scene(name, seed, copies=copies, noise=noise)
            start = time.perf_counter()
            found = surfsig.find_instances(model, scene.cloud)
            seconds.append(time.perf_counter() - start)
            if copies:
                scores.append(scored(scene, found))
            else:
                wrong += len(found)
    shift, turn = max(score.shift for score in scores), max(score.turn for score in scores)
    return (
        name, f"{noise * 1000:g}", f"{len(seeds)}",
        f"{sum(score.right for score in scores)} of {5 * len(seeds)}",
        f"{sum(score.false for score in scores)}", f"{shift * 1000:.2f} mm, {turn:.2f} degrees", f"{wrong}",
        f"{np.median(seconds):.1f}",
    )  # fmt: skip


def real_rows(data: Path) -> list[Row]:
    """Look for real objects in scenes that hold them, and in others."""
    models, rows = {}, []
    for name, truth in TRUTHS.items():
        folder = data / "objects" / name
        models[name] = surfsig.read(folder / f"{name}.pcd")
        scene = surfsig.read(folder / "scene.pcd")
        rows.append(real_row(name, models[name], f"{name}'s", scene, np.loadtxt(folder / truth)))
    views = {pairs.title.split(",")[0]: pairs for pairs in read_pairs(data)}["bunny"]
    for (a, b), motion in views.motions.items():
        one, other = (surfsig.PointCloud(views.scans[i].points, viewpoint=np.zeros(3)) for i in (a, b))
        rows.append(real_row(a, one, b, other, motion))
        rows.append(real_row(b, other, a, one, np.asarray(np.linalg.inv(motion), np.float64)))
    models["bunny"] = surfsig.PointCloud(BUNNY * views.scans["bun000"].points)
    for path in EMPTY:
        scene = surfsig.read(data / path)
        rows += [real_row(name, model, path.split("/")[-1], scene, None) for name, model in models.items()]
    return rows


def real_row(
    name: str, model: surfsig.PointCloud, where: str, scene: surfsig.PointCloud, truth: Array | None
) -> Row:
    """Look for one object in one scene; the true pose is None where it is not there."""
    start = time.perf_counter()
    found = surfsig.find_instances(model, scene)
    seconds = time.perf_counter() - start
    middle = np.eye(4)
    middle[:3, 3] = np.median(model.points[model.finite], axis=0)
    off = "-"
    if truth is not None and len(found):
        shift, turn = errors(found[0].T_scene_model @ middle, truth @ middle)
        off = f"{shift * 1000:.2f} mm, {turn:.2f} degrees"
    scores = " ".join(f"{instance.score:.2f}" for instance in found.instances) or "-"
    count = f"{len(found)}" if truth is not None else f"{len(found)}, and none is there"
    return name, where, count, scores, off, f"{seconds:.1f}"


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
    parser.add_argument("data", type=Path, nargs="?", default=default, help="folder of the real scans")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5, 6])
    parser.add_argument("--objects", choices=list(OBJECTS), nargs="+", default=list(OBJECTS))
    parser.add_argument("--noise", type=float, nargs="+", default=[NOISE, 5 * NOISE], help="metres")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    results: Results = measured_here()
    rows = [
        simulated_row(name, noise, arguments.seeds) for name in arguments.objects for noise in arguments.noise
    ]
    parts = [markdown_table(SIMULATED, rows)]
    if arguments.data.is_dir():
        parts.append(markdown_table(REAL, real_rows(arguments.data)))
    notes = [*measured_on(results), f"Seeds of the scenes: {', '.join(map(str, arguments.seeds))}."]
    text = "\n\n".join([*parts, "\n".join(f"- {line}" for line in notes)])
    publish(text, COMMAND, arguments.write)


if __name__ == "__main__":
    main()
