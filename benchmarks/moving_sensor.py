"""Two furnished rooms and a corridor between them, scanned by a lidar on its way through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import simulate

Array = NDArray[np.float64]

LIDAR = simulate.Lidar(elevation=(-40.0, 40.0))

HEIGHT = 3.0
# Walls: lowest and highest corner on the floor.
WALLS = (
    (0, -0.1, 8, 0), (0, 6, 8, 6.1), (-0.1, 0, 0, 6), (8, 0, 8.1, 2), (8, 4, 8.1, 6),
    (8.1, 1.9, 20, 2), (8.1, 4, 20, 4.1),
    (20, 0, 20.1, 2), (20, 4, 20.1, 6), (20, -0.1, 28, 0), (20, 6, 28, 6.1), (28, 0, 28.1, 6),
)  # fmt: skip
# What stands in the corridor keeps to its sides.
FRAMES = ((9.5, 2.0), (11.3, 4.0), (13.4, 2.0), (15.2, 2.0), (16.9, 4.0), (18.8, 2.0))
# Through room, corridor, room, and back: places (x, y) that the way passes.
WAY = ((2, 2), (3.5, 3.6), (6, 3.2), (9, 3), (14, 3.1), (19, 3), (22, 3), (24, 3.8), (25.5, 2.6))


def building(seed: int = 0, size: tuple[float, float] = (1.0, 1.0)) -> simulate.Scene:
    """Build the rooms, stretched along x and y by `size`; the furniture is drawn by `seed`."""
    rng = np.random.default_rng([5, seed])
    a, b = size
    placed = [
        _box((14 * a, 3 * b, -0.05), (30 * a, 8 * b, 0.1)),
        _box((14 * a, 3 * b, HEIGHT + 0.05), (30 * a, 8 * b, 0.1)),
        *(
            _box((a * (x0 + x1) / 2, b * (y0 + y1) / 2, HEIGHT / 2), (a * (x1 - x0), b * (y1 - y0), HEIGHT))
            for x0, y0, x1, y1 in WALLS
        ),
        *(_box((a * x, b * y, HEIGHT / 2), (rng.uniform(0.2, 0.8), 0.5, HEIGHT)) for x, y in FRAMES),
    ]
    for room in (0.0, 20.0):
        for side in range(12):
            # Along the walls, so that the way is free.
            x = a * (room + rng.uniform(0.6, 7.4))
            y = b * (rng.uniform(0.3, 1.0) if side % 2 else rng.uniform(5.0, 5.7))
            width, depth, height = rng.uniform(0.3, 1.2, 3)
            turn = simulate.turn((0.0, 0.0, 1.0), rng.uniform(0.0, np.pi))
            if side % 3 == 0:
                surface: simulate.Surface = simulate.Cylinder(width / 3, 2 * height)
                placed.append(simulate.Placed(surface, simulate.pose((x, y, height))))
            elif side % 3 == 1:
                surface = simulate.Sphere(width / 2)
                placed.append(simulate.Placed(surface, simulate.pose((x, y, height + 0.4))))
            else:
                surface = simulate.Box((width, depth, height * 1.8))
                placed.append(simulate.Placed(surface, simulate.pose((x, y, height * 0.9), turn)))
    return simulate.Scene(placed)


def way(count: int, places: Sequence[tuple[float, float]] = WAY) -> Array:
    """Give poses T_building_sensor, (count, 4, 4), along a smooth way; the sensor sways as if carried."""
    spots = np.array(places)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(spots, axis=0), axis=1))])
    curve = CubicSpline(length, spots)
    at = np.linspace(0.0, length[-1], count)
    x, y = curve(at).T
    ahead = curve(at, 1)
    z = 1.4 + 0.1 * np.sin(2.0 * at)
    yaw = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    angles = np.column_stack([yaw, 0.06 * np.sin(1.7 * at), 0.05 * np.cos(1.3 * at)])
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("ZYX", angles).as_matrix()
    poses[:, :3, 3] = np.column_stack([x, y, z])
    return poses


def scan(scene: simulate.Scene, pose: Array, seed: int, lidar: simulate.Lidar = LIDAR) -> surfsig.PointCloud:
    """Scan from a pose T_building_sensor; in the sensor's own frame, in metres, float32."""
    # `simulate.scan` would draw other noise: tables and tests are of these scans.
    rays = lidar.rays()
    hits = scene.cast(np.broadcast_to(pose[:3, 3], rays.shape), rays @ pose[:3, :3].T)
    met = hits.t < lidar.max_range
    distances = hits.t[met] + np.random.default_rng([9, seed]).normal(0.0, lidar.noise, met.sum())
    points = (distances[:, None] * rays[met]).astype(np.float32)
    return surfsig.PointCloud(points, viewpoint=np.zeros(3))


def errors(found: Array, true: Array) -> tuple[Array, Array]:
    """Give how far off poses (n, 4, 4) are, both seen from the first: in metres and in radians, (n,) each."""
    off = np.linalg.inv(np.linalg.inv(true[0]) @ true) @ found
    turned = np.full(len(off), np.nan)
    known = np.isfinite(off).all(axis=(1, 2))
    turned[known] = Rotation.from_matrix(off[known, :3, :3]).magnitude()
    return np.linalg.norm(off[:, :3, 3], axis=1), turned


def missing_motions(found: Array, true: Array) -> Array:
    """Give the small motions m of T_true = T_found exp(m), rotation vector first, (n, 6)."""
    off = np.linalg.inv(found) @ np.linalg.inv(true[0]) @ true
    return np.column_stack([Rotation.from_matrix(off[:, :3, :3]).as_rotvec(), off[:, :3, 3]])


def _box(middle: Sequence[float], size: Sequence[float]) -> simulate.Placed:
    width, depth, height = size
    return simulate.Placed(simulate.Box((width, depth, height)), simulate.pose(middle))
