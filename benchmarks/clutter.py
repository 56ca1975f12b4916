"""Known objects found in simulated depth images that are like real ones: how many, how surely, how fast.

python benchmarks/clutter.py --seeds 300 301 302 303 304
"""

from __future__ import annotations

import argparse
import itertools
import resource
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from clutter_scene import LIBRARY, ClutterScene, clutter_scene, diameter, model, model_normals
from numpy.typing import NDArray
from peers import peer_python, run_json
from rich.progress import track
from scipy.spatial import cKDTree

import surfsig

Array = NDArray[np.float64]

HERE = Path(__file__).resolve().parent
PEER_SECONDS = 3600
"""After which a peer is given up, for the objects of one scene."""
RIGHT = 0.1
"""Error of a right pose, at most, in diameters."""
SYMMETRIC = 0.98
"""Share of an object's points that must lie on it in the other pose, for both to be one by symmetry."""
LEAST_VISIBLE = 0.3
"""Share of what could be seen of an object, from which on it should be found."""
BINS = (0.5, 0.7, 0.9, 1.0)
"""Between probabilities, for the table of how many instances of each are right."""


def pose_error(found: Array, true: Array, number: int) -> float:
    """Give the mean distance between the object's points in two poses, in diameters.

    Where nearly all of the object lies on itself in the other pose, both are the same by symmetry: then it is
    twice the distance that `SYMMETRIC` of the points have from the object in the other pose, if that is less.
    """
    points = model(number).points[::100]
    moved = points @ (found[:3, :3] - true[:3, :3]).T + found[:3, 3] - true[:3, 3]
    mean = float(np.linalg.norm(moved, axis=1).mean())
    relative = np.linalg.inv(true) @ found
    from_itself = cKDTree(model(number).points).query(points @ relative[:3, :3].T + relative[:3, 3])[0]
    return min(mean, 2.0 * float(np.quantile(from_itself, SYMMETRIC))) / diameter(number)


@dataclass
class Tally:
    """What was found in some scenes."""

    sought: int = 0
    found: int = 0
    false: int = 0
    scores: list[float] = field(default_factory=list)
    right: list[bool] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def add(self, scene: ClutterScene, found: surfsig.Instances, names: dict[str, int]) -> None:
        """Count one scene's instances: the first right one of an object counts, others are false."""
        left = {int(number): k for k, number in enumerate(scene.numbers)}
        self.sought += int((scene.visible >= LEAST_VISIBLE).sum())
        for instance in found.instances:
            number = names[instance.name]
            k = left.get(number)
            is_right = k is not None and pose_error(instance.T_scene_model, scene.poses[k], number) <= RIGHT
            if is_right:
                self.found += bool(scene.visible[left.pop(number)] >= LEAST_VISIBLE)
            else:
                self.false += 1
            self.scores.append(instance.score)
            self.right.append(is_right)

    def report(self, what: str) -> str:
        """Say it in lines."""
        right, scores = np.array(self.right), np.array(self.scores)
        lines = [
            f"{what}: found {self.found} of {self.sought}, false {self.false}, "
            f"precision {right.mean() if len(right) else np.nan:.2f}, "
            f"processor seconds {np.median(self.seconds):.1f} (median), {np.max(self.seconds):.1f} (most)"
        ]
        for low, high in itertools.pairwise(BINS):
            chosen = (scores >= low) & (scores <= high)
            if chosen.any():
                lines.append(
                    f"  score {low:.1f} to {high:.1f}: {right[chosen].sum()} of {chosen.sum()} right"
                )
        return "\n".join(lines)


def by_peer(method: str, scene: ClutterScene) -> tuple[int, list[float]]:
    """Let a peer look for each object that shows enough; count right poses, and give processor seconds."""
    shown = [k for k in range(len(scene.numbers)) if scene.visible[k] >= LEAST_VISIBLE]
    numbers = [int(scene.numbers[k]) for k in shown]
    points = scene.cloud.points[scene.cloud.finite]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.npz"
        np.savez(
            file,
            scene=points,
            models=np.array([model(number).points for number in numbers]),
            normals=np.array([model_normals(number) for number in numbers]),
            diameters=[diameter(number) for number in numbers],
        )
        program: list[str | Path] = [peer_python(), HERE / "clutter_peers.py", method, file]
        answer = run_json(program, threads=1, seconds=PEER_SECONDS)
    errors = [
        pose_error(np.array(pose), scene.poses[k], number)
        for pose, k, number in zip(answer["poses"], shown, numbers, strict=True)
    ]
    return sum(error <= RIGHT for error in errors), answer["processor"]


def prepared(file: Path, names: dict[str, int]) -> surfsig.Library:
    """Open a library, and add what it has not."""
    library = surfsig.Library(file)
    missing = [name for name in names if name not in set(library.names())]
    for name in track(missing, "preparing", transient=True):
        library.add(name, model(names[name]), threads=1)
        model.cache_clear()
    return library


def main() -> None:
    """Look for each object alone, and for all of the library at once."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(300, 306)))
    parser.add_argument("--alone", action="store_true", help="look for each of the shown objects alone, too")
    parser.add_argument(
        "--models", type=int, default=LIBRARY, help="objects that there are; 8 of them are in a scene"
    )
    parser.add_argument("--store", type=Path, help="the library's file: prepared once, and kept")
    parser.add_argument(
        "--peers", action="store_true", help="let OpenCV and Open3D look for each of them, too"
    )
    arguments = parser.parse_args()
    names = {f"object {number}": number for number in range(arguments.models)}
    store = None if arguments.store is None else prepared(arguments.store, names)
    together, alone = Tally(), Tally()
    for seed in track(arguments.seeds, transient=True):
        scene = clutter_scene(seed, library=arguments.models)
        start = time.process_time()
        models = {name: model(k) for name, k in names.items()} if store is None else store
        found = surfsig.find_instances(models, scene.cloud, threads=1)
        together.seconds.append(time.process_time() - start)
        together.add(scene, found, names)
        if arguments.alone:
            for number in map(int, scene.numbers):
                name = f"object {number}"
                start = time.process_time()
                found = surfsig.find_instances({name: model(number)}, scene.cloud, threads=1)
                alone.seconds.append(time.process_time() - start)
                of_one = ClutterScene(
                    scene.cloud,
                    scene.numbers[scene.numbers == number],
                    scene.poses[scene.numbers == number],
                    scene.visible[scene.numbers == number],
                    scene.distance,
                )
                alone.add(of_one, found, names)
    when = "prepared in the same call" if store is None else "prepared before"
    print(together.report(f"{len(names)} models at once, {when}, {len(arguments.seeds)} scenes"))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(f"  largest memory of the process: {peak / 1e6:.0f} MB")
    if arguments.peers:
        for method in ("opencv", "open3d"):
            told = [by_peer(method, clutter_scene(seed)) for seed in arguments.seeds]
            seconds = [second for _, each in told for second in each]
            print(
                f"{method}: the best pose is right {sum(right for right, _ in told)} of {len(seconds)}, "
                f"processor seconds {np.median(seconds):.1f} (median), {max(seconds):.1f} (most)"
            )
    if arguments.alone:
        print(alone.report("each shown object alone"))


if __name__ == "__main__":
    main()
