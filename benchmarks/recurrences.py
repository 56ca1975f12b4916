"""What recurs in scenes of 30 objects of 8 kinds: adjusted Rand index, kinds merged, errors of poses.

python benchmarks/recurrences.py --picture docs/pictures/recurrences.png
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from recurrence_scene import RecurrenceScene, recurrence_scene
from scipy.special import comb

import surfsig

RIGHT_ANGLE, RIGHT_DISTANCE = np.radians(5.0), 2e-3
"""Radians and metres that a right pose is off at most: two and a half of the scans' point spacings."""
HALF_TURNS = {
    "bracket": [(1.0, 1.0, 1.0)],
    "box": [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)],
    "egg": [(1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0)],
}
"""Of kinds without an axis of revolution, the rotations that change nothing: diagonals of matrices."""


@dataclass(frozen=True)
class Score:
    """How well groups fit the kinds of a scene.

    `rand_index` is Hubert and Arabie's adjusted one, over objects. `merged` are pairs of kinds with objects
    in one group; `alone` are objects that are in no group though their kind occurs again.
    """

    rand_index: float
    groups: int
    merged: list[tuple[str, str]]
    alone: list[str]


def adjusted_rand_index(a: NDArray[np.int64], b: NDArray[np.int64]) -> float:
    """Compare two groupings, (n,) numbers of groups each: 1 for equal ones, 0 on average for random ones."""
    table = np.zeros((int(a.max()) + 1, int(b.max()) + 1))
    np.add.at(table, (a, b), 1)
    together = comb(table, 2).sum()
    rows, columns = comb(table.sum(axis=1), 2).sum(), comb(table.sum(axis=0), 2).sum()
    expected = rows * columns / comb(len(a), 2)
    most = (rows + columns) / 2
    return 1.0 if most == expected else float((together - expected) / (most - expected))


def group_of_objects(scene: RecurrenceScene, found: surfsig.Recurrences) -> NDArray[np.int64]:
    """Give each object's group: that of the piece with most of its points; one of its own without any."""
    count = len(scene.poses)
    group = np.arange(count) + len(found)
    piece, grouped = found.labels[0], found.group_labels[0]
    for number in range(count):
        own = np.flatnonzero((scene.object_of_point == number) & (piece >= 0))
        if len(own):
            best = int(np.bincount(piece[own]).argmax())
            label = int(grouped[own[piece[own] == best][0]])
            group[number] = label if label >= 0 else group[number]
    return group


def scored(scene: RecurrenceScene, found: surfsig.Recurrences) -> Score:
    """Compare groups with kinds."""
    group = group_of_objects(scene, found)
    names = scene.kinds
    kind = scene.kind_of_object
    merged = {
        (names[min(a, b)], names[max(a, b)])
        for label in np.unique(group)
        for a in kind[group == label]
        for b in kind[group == label]
        if a != b
    }
    alone = [
        names[kind[number]]
        for number in range(len(kind))
        if (group == group[number]).sum() == 1 and (kind == kind[number]).sum() > 1
    ]
    return Score(adjusted_rand_index(group, kind), len(np.unique(group)), sorted(merged), alone)


def trusted_poses(scene: RecurrenceScene, found: surfsig.Recurrences) -> tuple[int, int]:
    """Count the poses on first pieces that are trusted, and those of them that are wrong.

    A pose is right where it is within `RIGHT_ANGLE` and `RIGHT_DISTANCE`, at the object's middle, of one that
    brings the first object onto the other. Surfaces of revolution have no right pose: theirs is never known.
    """
    own = [scene.object_of_point[piece.points] for piece in found.pieces]
    object_of = [int(np.bincount(numbers[numbers >= 0]).argmax()) for numbers in own]
    trusted = wrong = 0
    for group in found.groups:
        first = object_of[group.members[0].piece]
        for member in group.members[1:]:
            if member.trusted:
                trusted += 1
                wrong += not _is_right(scene, first, object_of[member.piece], member.T_member_first)
    return trusted, wrong


def _is_right(scene: RecurrenceScene, first: int, other: int, pose: NDArray[np.float64]) -> bool:
    kind = scene.kind_of_object[first]
    if scene.kind_of_object[other] != kind:
        return False
    for signs in HALF_TURNS.get(scene.kinds[kind], ()):
        true = scene.poses[other] @ np.diag([*signs, 1.0]) @ np.linalg.inv(scene.poses[first])
        turn = pose[:3, :3] @ true[:3, :3].T
        angle = np.arccos(np.clip((np.trace(turn) - 1.0) / 2.0, -1.0, 1.0))
        distance = np.linalg.norm((pose - true) @ scene.poses[first][:, 3])
        if angle <= RIGHT_ANGLE and distance <= RIGHT_DISTANCE:
            return True
    return False


def picture(scene: RecurrenceScene, found: surfsig.Recurrences, path: Path) -> None:
    """Draw the scan, its kinds beside the groups that were found; the same colour where they agree."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import to_rgb

    palette = np.array([to_rgb(f"C{number}") for number in range(10)])
    points = scene.cloud.offsets
    kinds = np.where(scene.object_of_point >= 0, scene.kind_of_object[scene.object_of_point], -1)
    group = found.group_labels[0]
    # A group has the colour of the kind that most of its points have.
    color_of = [int(np.bincount(kinds[(group == g) & (kinds >= 0)]).argmax()) for g in range(len(found))]
    colors = np.array([*color_of, -1])[group]
    alone = (found.labels[0] >= 0) & (group < 0)
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.9), layout="constrained")
    for axis, numbers, title in zip(
        axes, (kinds, colors), ("Kinds of the 30 objects", "Groups that were found"), strict=True
    ):
        shades = np.where(numbers[:, None] >= 0, palette[numbers], 0.85)
        if numbers is colors:
            shades[alone] = 0.0
        axis.scatter(points[:, 0], points[:, 1], s=0.15, c=shades, linewidths=0, rasterized=True)
        axis.set(aspect="equal", title=title, xticks=[], yticks=[])
    for number, group_found in enumerate(found.groups):
        for piece in group_found.pieces:
            x, y, _ = found.pieces[piece].center
            axes[1].text(x, y, str(number), ha="center", va="center", fontsize=9, weight="bold")
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main() -> None:
    """Run the scenes, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=[*range(1, 7), *range(11, 19)])
    parser.add_argument("--any-way", action="store_true", help="turn objects in any way, as if they hung")
    parser.add_argument("--picture", type=Path, help="draw the first scene")
    options = parser.parse_args()
    for seed in options.seeds:
        scene = recurrence_scene(seed, any_way=options.any_way)
        start = time.perf_counter()
        surfaces = surfsig.find_surfaces(scene.cloud)
        middle = time.perf_counter()
        found = surfsig.find_recurrences(surfaces)
        end = time.perf_counter()
        score = scored(scene, found)
        trusted, wrong = trusted_poses(scene, found)
        print(
            f"seed {seed}: adjusted Rand index {score.rand_index:.3f}, {score.groups} groups of "
            f"{len(scene.kinds)} kinds; "
            f"merged: {score.merged or 'none'}; alone: {score.alone or 'none'}; "
            f"poses trusted: {trusted}, {wrong} of them wrong; "
            f"surfaces {middle - start:.1f} s, recurrences {end - middle:.1f} s",
            flush=True,
        )
        if options.picture and seed == options.seeds[0]:
            picture(scene, found, options.picture)


if __name__ == "__main__":
    main()
