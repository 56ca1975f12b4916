"""Whether poses that are trusted are right, and right ones trusted, in places that are made to deceive.

python benchmarks/trust.py --write

Each case is drawn by a seed (`surfsig.simulate`): pairs of scans with a known pose, pairs that no pose fits,
and pairs whose pose is open in a direction or has equals.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from machine import measured_here
from numpy.typing import NDArray
from report import markdown_table, measured_on, publish
from rich.progress import track
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import PointCloud, simulate

COMMAND = "python benchmarks/trust.py --write"
Array = NDArray[np.float64]
DEGREES, SHARE = 2.0, 0.01
"""A pose is right within so many degrees, and so large a share of the target's extent."""
CLEAR = 0.2
"""Metres from a sensor within which nothing is."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two scans; the poses that are right (none where no pose is); the free translation, if there is one."""

    source: PointCloud
    target: PointCloud
    right: list[Array]
    T_target_scene: Array
    free: Array | None = None


def _lidar(lines: int) -> simulate.Lidar:
    return simulate.Lidar(lines=lines, elevation=(-15.0, 15.0) if lines == 16 else (-25.0, 25.0), noise=0.01)


def _two_places(
    scene: simulate.Scene, sensor: simulate.Lidar | simulate.DepthCamera, seed: int, **how: float
) -> Pair:
    """Scan from two places: `apart` metres, any yaw for lidars, within `turned` radians for cameras.

    Where a sensor would stand in something, another pair is drawn, from farther apart.
    """
    rng = np.random.default_rng([7, seed])
    while True:
        pair = _drawn(scene, sensor, seed, rng, **how)
        if all(np.linalg.norm(cloud.points, axis=1).min() > CLEAR for cloud in (pair.source, pair.target)):
            return pair
        how["apart"] = 1.2 * how.get("apart", 1.0)


def _drawn(
    scene: simulate.Scene,
    sensor: simulate.Lidar | simulate.DepthCamera,
    seed: int,
    rng: np.random.Generator,
    **how: float,
) -> Pair:
    height = how.get("height", 1.3)
    step = rng.uniform(0.3, 1.0) * how.get("apart", 1.0)
    about = how.get("heading", rng.uniform(0.0, 2.0 * np.pi))
    poses = []
    yaws = (rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, 2.0 * np.pi))
    if isinstance(sensor, simulate.DepthCamera):
        yaws = (yaws[0], yaws[0] + rng.uniform(-0.4, 0.4))
    for side, yaw in zip((-0.5, 0.5), yaws, strict=True):
        x, y = side * step * np.cos(about), side * step * np.sin(about)
        pose = simulate.upright_pose(x, y, height, yaw, rng.normal(0.0, 0.03, 2).tolist())
        if isinstance(sensor, simulate.DepthCamera):
            # The camera's z axis looks ahead, its y axis down.
            pose[:3, :3] = pose[:3, :3] @ np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
        poses.append(pose)
    source, target = (
        simulate.scan(scene, sensor, pose, seed=2 * seed + number) for number, pose in enumerate(poses)
    )
    to_target = simulate.inverse(poses[1])
    return Pair(source, target, [to_target @ poses[0]], to_target)


def _room(lines: int) -> Callable[[int], Pair]:
    return lambda seed: _two_places(simulate.room(seed), _lidar(lines), seed)


def _camera(seed: int) -> Pair:
    return _two_places(simulate.room(seed), simulate.DepthCamera(), seed, apart=0.5)


def _different(lines: int) -> Callable[[int], Pair]:
    def pair(seed: int) -> Pair:
        one = _two_places(simulate.room(2 * seed), _lidar(lines), seed)
        other = _two_places(simulate.room(2 * seed + 1), _lidar(lines), seed + 1000)
        return replace(other, source=one.source, right=[])

    return pair


def _distorted(scale: float, mirrored: bool) -> Callable[[int], Pair]:
    def pair(seed: int) -> Pair:
        whole = _room(32)(seed)
        source = simulate.distorted(whole.source, scale=scale, mirrored=mirrored)
        return replace(whole, source=source, right=[])

    return pair


def _along_x(build: Callable[[int], simulate.Scene], lines: int) -> Callable[[int], Pair]:
    """Along a place that is the same along x: no yaw is drawn, so that x stays x."""

    def pair(seed: int) -> Pair:
        rng = np.random.default_rng([8, seed])
        poses = [
            simulate.upright_pose(x, rng.uniform(-0.3, 0.3), 1.2, rng.uniform(0.0, 2.0 * np.pi))
            for x in (0.0, rng.uniform(0.4, 1.2))
        ]
        sensor = simulate.Lidar(lines=lines, elevation=(-15.0, 15.0), noise=0.01, max_range=12.0)
        scene = build(seed)
        source, target = (
            simulate.scan(scene, sensor, pose, seed=2 * seed + number) for number, pose in enumerate(poses)
        )
        to_target = simulate.inverse(poses[1])
        return Pair(source, target, [to_target @ poses[0]], to_target, free=to_target[:3, 0])

    return pair


def _niches(seed: int) -> Pair:
    return replace(_along_x(lambda seed: simulate.corridor(seed, niches=24), 32)(seed), free=None)


def _plane(seed: int) -> Pair:
    pair = _two_places(simulate.plane(), _lidar(32), seed)
    return replace(pair, free=pair.T_target_scene[:3, 0])


def _empty_room(square: bool) -> Callable[[int], Pair]:
    def pair(seed: int) -> Pair:
        rng = np.random.default_rng([9, seed])
        x, y = rng.uniform((5.0, 4.0), (9.0, 7.0))
        x = y if square else max(x, 1.2 * y)
        scene = simulate.room(seed, size=(x, y, 3.0), furniture=0)
        return _with_equals(_two_places(scene, _lidar(32), seed), 4 if square else 2)

    return pair


def _with_equals(pair: Pair, count: int) -> Pair:
    """Add the poses that a scene has that looks the same after so many turns about its z axis."""
    poses = []
    for number in range(count):
        turned = np.eye(4)
        turned[:3, :3] = simulate.turn((0.0, 0.0, 1.0), 2.0 * np.pi * number / count)
        poses.append(pair.T_target_scene @ turned @ np.linalg.inv(pair.T_target_scene) @ pair.right[0])
    return replace(pair, right=poses)


def _block(seed: int) -> Pair:
    rng = np.random.default_rng([10, seed])
    size = np.sort(rng.uniform((0.3, 0.6, 0.9), (0.5, 0.8, 1.2)))
    truth = np.eye(4)
    truth[:3, :3] = Rotation.random(rng=rng).as_matrix()
    truth[:3, 3] = rng.uniform(-1.0, 1.0, 3)
    source, target = (_box_points(size, 6000, rng) for _ in range(2))
    right = []
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
        turned = np.diag([*signs, 1.0]).astype(float)
        right.append(truth @ turned)
    moved = target @ truth[:3, :3].T + truth[:3, 3]
    return Pair(PointCloud(source), PointCloud(moved), right, truth)


def _box_points(size: Array, count: int, rng: np.random.Generator) -> Array:
    area = np.array([size[1] * size[2], size[0] * size[2], size[0] * size[1]])
    axis = rng.choice(3, count, p=area / area.sum())
    points = rng.uniform(-0.5, 0.5, (count, 3))
    points[np.arange(count), axis] = rng.choice((-0.5, 0.5), count)
    return np.asarray(points * size + rng.normal(0.0, 0.001, (count, 3)))


CASES: dict[str, Callable[[int], Pair]] = {
    "room, 32 lines": _room(32),
    "room, 16 lines": _room(16),
    "room, depth camera": _camera,
    "corridor with niches": _niches,
    "hall": lambda seed: _two_places(simulate.hall(seed), _lidar(32), seed, apart=3.0),
    "pipes": lambda seed: _two_places(simulate.pipes(seed), _lidar(32), seed),
    "forest": lambda seed: _two_places(simulate.forest(seed), _lidar(32), seed, apart=3.0),
    "two rooms, 32 lines": _different(32),
    "two rooms, 16 lines": _different(16),
    "1.1 times as large": _distorted(1.1, False),
    "1.02 times as large": _distorted(1.02, False),
    "mirrored": _distorted(1.0, True),
    "corridor": _along_x(simulate.corridor, 16),
    "tunnel": _along_x(simulate.tunnel, 32),
    "plane": _plane,
    "empty room": _empty_room(False),
    "empty square room": _empty_room(True),
    "box": _block,
}


def is_right(found: Array, right: list[Array], extent: float) -> list[bool]:
    """Say which of the poses that are right was found."""
    if not np.isfinite(found).all():
        return [False for _ in right]
    offs = [np.linalg.inv(pose) @ found for pose in right]
    angles = [np.degrees(Rotation.from_matrix(off[:3, :3]).magnitude()) for off in offs]
    return [
        bool(angle < DEGREES and np.linalg.norm(off[:3, 3]) < SHARE * extent)
        for angle, off in zip(angles, offs, strict=True)
    ]


def measured(
    case: str, seeds: list[int], detail: bool, settings: surfsig.RegistrationSettings
) -> tuple[str, ...]:
    """Register all pairs of a case; give its row."""
    trusted_right = trusted = right = named = listed = 0
    seconds = []
    free = equals = False
    for seed in track(seeds, description=case, transient=True):
        pair = CASES[case](seed)
        free, equals = pair.free is not None, len(pair.right) > 1
        start = time.process_time()
        found = surfsig.register(pair.source, pair.target, settings=settings)
        seconds.append(time.process_time() - start)
        extent = float(np.linalg.norm(np.ptp(pair.target.points, axis=0)))
        agree = is_right(found.T_target_source, pair.right, extent)
        poses = [found.T_target_source, *(other.T_target_source for other in found.alternatives)]
        covered = [any(is_right(pose, [one], extent)[0] for pose in poses) for one in pair.right]
        trusted += found.trusted
        right += any(agree)
        # Of poses that are open, none is right for certain.
        trusted_right += found.trusted and any(agree) and not free and not equals
        named += free and _is_named(found.free_directions, pair.free)
        listed += equals and all(covered)
        if detail:
            parts = [
                f"{case} {seed}: right {any(agree):d} trusted {found.trusted:d}",
                f"inliers {found.inliers}/{found.matches} overlap {found.overlap:.2f}",
                f"explained {found.explained:.2f} free space {found.free_space:.3f}",
                f"scale {found.scale:.4f}+-{found.scale_standard_error:.4f}",
                f"listed {sum(covered)}/{len(covered)}",
                "; ".join(map(str, found.free_directions)),
                f"| {'; '.join(found.reasons)} ({seconds[-1]:.1f} s)",
            ]
            print(" ".join(parts), flush=True)
    count = len(seeds)
    return (
        case,
        f"{right} of {count}",
        f"{trusted} of {count}",
        f"{trusted_right} of {trusted}" if trusted else "-",
        f"{named} of {count}" if free else "-",
        f"{listed} of {count}" if equals else "-",
        f"{np.median(seconds):.2f}",
    )


def _is_named(directions: list[surfsig.FreeDirection], axis: Array | None) -> bool:
    """Say whether an axis lies within 15 degrees of what the free translations span."""
    free = [direction.axis for direction in directions if direction.motion == "translation"]
    if axis is None or not free:
        return False
    basis, _ = np.linalg.qr(np.array(free).T)
    return bool(np.linalg.norm(basis.T @ axis) > np.cos(np.radians(15.0)))


COLUMNS = (
    "case",
    "right",
    "trusted",
    "right of trusted",
    "free direction named",
    "all equal poses listed",
    "processor seconds, median",
)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--cases", nargs="*", choices=list(CASES), default=list(CASES))
    parser.add_argument(
        "--seeds", type=int, nargs=2, default=(100, 120), help="first seed, and the one after the last"
    )
    parser.add_argument("--detail", action="store_true", help="a line for each pair")
    parser.add_argument(
        "--setting",
        nargs=2,
        action="append",
        default=[],
        metavar=("NAME", "VALUE"),
        help="of RegistrationSettings, as rival_deficit 0.02",
    )
    parser.add_argument("--write", action="store_true", help="into BENCHMARKS.md")
    arguments = parser.parse_args()
    seeds = list(range(*arguments.seeds))
    kinds = {name: type(getattr(surfsig.RegistrationSettings(), name)) for name, _ in arguments.setting}
    settings = surfsig.RegistrationSettings(**{name: kinds[name](value) for name, value in arguments.setting})
    rows = [measured(case, seeds, arguments.detail, settings) for case in arguments.cases]
    table = markdown_table(COLUMNS, rows)
    notes = [*measured_on(measured_here({})), f"The seeds are {seeds[0]} to {seeds[-1]}."]
    publish("\n\n".join([table, "\n".join(f"- {line}" for line in notes)]), COMMAND, arguments.write)


if __name__ == "__main__":
    main()
