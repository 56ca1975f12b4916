"""Scenes of random solids, each scanned from two sides: of them the frame of field signatures is learned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from surfsig import PointCloud, simulate

Array = NDArray[np.float64]

UNIT = 0.1
"""Radius of a patch of middle size, in metres; everything else is in proportion."""

NEAR = 0.08 * UNIT
"""Between two places that are taken to be the same, at most."""


@dataclass(frozen=True, eq=False)
class TwoScans:
    """Two scans of one scene: `places` are the same in both, (n, 3) each; `motion` is T_second_first."""

    clouds: tuple[PointCloud, PointCloud]
    places: tuple[Array, Array]
    motion: Array


def two_scans(seed: int, places: int) -> TwoScans:
    """Scan a random scene from two sides, 5 to 25 degrees off the vertical each, with noise of their own."""
    rng = np.random.default_rng([77, seed])
    scene = _scene(rng)
    noise = UNIT * _log_uniform(rng, 0.003, 0.02)
    clouds, motions = [], []
    for view in range(2):
        across = (*rng.normal(size=2), 0.0)
        tilt = simulate.turn(across, np.radians(rng.uniform(5.0, 25.0)))
        turned = tilt @ simulate.turn((0.0, 0.0, 1.0), rng.uniform(0.0, 2.0 * np.pi))
        motion = simulate.pose(tuple(rng.uniform(-0.5, 0.5, 3) * UNIT), turned)
        step = 0.05 * UNIT * rng.uniform(0.7, 1.3)
        scanner = simulate.Scanner(
            baseline=9.0 * UNIT,
            pixel=step / 5,
            column_step=5,
            sheet_step=step,
            field_width=11.0 * UNIT,
            scan_length=11.0 * UNIT,
            depth_range=(-6.0 * UNIT, 3.0 * UNIT),
            max_incidence=np.radians(80.0),
            row_step=0.0,
            noise=noise,
            outlier_rate=0.0,
        )
        clouds.append(scanner.scan(scene.moved(motion), seed=[seed, view]))
        motions.append(motion)
    motion = motions[1] @ simulate.inverse(motions[0])
    first, second = (cloud.points for cloud in clouds)
    chosen = first[rng.choice(len(first), min(len(first), 3 * places), replace=False)]
    distance, partner = cKDTree(second).query(simulate.transform_points(motion, chosen))
    same = np.flatnonzero(distance < NEAR)[:places]
    return TwoScans((clouds[0], clouds[1]), (chosen[same], second[partner[same]]), motion)


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _scene(rng: np.random.Generator) -> simulate.Scene:
    """Draw a floor, flat or wavy, up to two walls, and solids of a third to three patches' radius."""
    upright = simulate.facing(simulate.UP)
    size = (16.0 * UNIT, 16.0 * UNIT)
    floor: simulate.Surface = simulate.Rectangle(size)
    if rng.random() < 0.5:
        rms = float(rng.uniform(0.05, 0.4)) * UNIT
        waves = (1.2 * UNIT, 8.0 * UNIT)
        floor = simulate.HeightField.random(int(rng.integers(1 << 30)), size=size, rms=rms, wavelengths=waves)
    placed = [simulate.Placed(floor, simulate.pose((0.0, 0.0, 0.0), upright))]
    for _ in range(rng.integers(0, 3)):
        angle, distance = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(1.5, 4.0) * UNIT
        wall = simulate.Box((20.0 * UNIT, UNIT, 6.0 * UNIT))
        centre = (distance * np.cos(angle), distance * np.sin(angle), 0.0)
        placed.append(
            simulate.Placed(wall, simulate.pose(centre, simulate.turn((0.0, 0.0, 1.0), angle + np.pi / 2)))
        )
    for _ in range(rng.integers(15, 45)):
        extent = UNIT * _log_uniform(rng, 0.3, 3.0)
        rotation = Rotation.random(random_state=rng).as_matrix()
        if rng.random() < 0.5:
            rotation = simulate.turn((0.0, 0.0, 1.0), rng.uniform(0.0, 2.0 * np.pi)) @ upright
        x, y = rng.uniform(-5.0, 5.0, 2) * UNIT
        centre = (x, y, -float(rng.uniform(-0.2 * UNIT, 0.6 * extent)))
        placed.append(simulate.Placed(_solid(rng, extent), simulate.pose(centre, rotation)))
    return simulate.Scene(placed)


def _solid(rng: np.random.Generator, extent: float) -> simulate.Surface:
    """Draw a box (two times in five), a cylinder, a sphere or a frustum, within `extent`."""
    kind = rng.integers(0, 5)
    if kind <= 1:
        x, y, z = (extent * _log_uniform(rng, 0.15, 1.0) for _ in range(3))
        return simulate.Box((x, y, z))
    radius, height = (extent * _log_uniform(rng, 0.3, 1.0) for _ in range(2))
    if kind == 2:
        return simulate.Cylinder(radius / 2, height)
    if kind == 3:
        return simulate.Sphere(radius / 2)
    return simulate.Cone(radius / 2, height, top_radius=radius / 4)
