"""Instances found in simulated scenes of five half hidden copies, and in scenes without any.

python benchmarks/finding.py
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np
from finding_scene import OBJECTS, FindingScene, finding_scene, whole
from numpy.typing import NDArray

import surfsig

Array = NDArray[np.float64]

SHIFT, TURN = 0.005, 2.0
"""Errors of a pose that is right, at most: metres, degrees."""


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


def main() -> None:
    """Run the scenes, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--objects", choices=list(OBJECTS), nargs="+", default=list(OBJECTS))
    options = parser.parse_args()
    for name in options.objects:
        model = whole(name)
        for seed in options.seeds:
            for copies in (5, 0):
                scene = finding_scene(name, seed, copies=copies)
                start = time.perf_counter()
                found = surfsig.find(model, scene.cloud)
                taken = time.perf_counter() - start
                score = scored(scene, found)
                hidden = " ".join(f"{share:.2f}" for share in scene.hidden) or "-"
                print(
                    f"{name}, seed {seed}: {score.right} of {copies} found, {score.false} false; largest "
                    f"errors {score.shift * 1000:.2f} mm, {score.turn:.2f} degrees; hidden {hidden}; "
                    f"scores {' '.join(f'{i.score:.2f}' for i in found.instances) or '-'}; {taken:.1f} s",
                    flush=True,
                )


if __name__ == "__main__":
    main()
