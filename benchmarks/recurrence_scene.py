"""Scans of 30 simulated objects of 8 kinds on a table, turned at random and partly hidden."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import surfsig
from surfsig import simulate
from surfsig.simulate.ellipsoid import Ellipsoid

Array = NDArray[np.float64]

SCANNER = simulate.Scanner(
    baseline=0.4,
    column_step=8,
    sheet_step=8e-4,
    field_width=0.56,
    scan_length=0.46,
    depth_range=(-0.25, 0.25),
    noise=1e-4,
)
COLUMNS, ROWS, PITCH = 6, 5, 0.072
TABLE_TILT = np.radians(30.0)
"""Towards the scanner, which so sees tops and sides."""


def _upright(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    return simulate.pose((x, y, z))


# Each kind is made of solids; lengths in metres, each about the object's own origin.
KINDS: dict[str, list[tuple[simulate.Surface, Array]]] = {
    "thick can": [(simulate.Cylinder(0.019, 0.046), _upright())],
    "thin can": [(simulate.Cylinder(0.012, 0.056), _upright())],
    "large ball": [(simulate.Sphere(0.021), _upright())],
    "small ball": [(simulate.Sphere(0.016), _upright())],
    "box": [(simulate.Box((0.052, 0.036, 0.022)), _upright())],
    "frustum": [(simulate.Cone(0.023, 0.040, 0.010), _upright(z=-0.02))],
    "bracket": [
        (simulate.Box((0.050, 0.030, 0.008)), _upright(z=-0.014)),
        (simulate.Box((0.008, 0.030, 0.036)), _upright(x=-0.021)),
    ],
    "egg": [(Ellipsoid((0.028, 0.019, 0.015)), _upright())],
}


@dataclass(frozen=True, eq=False)
class RecurrenceScene:
    """A scan and its truth: each point's object (-1 for the table), each object's kind and pose.

    `kind_of_object` are numbers of `kinds`; `poses` are T_scan_object, (objects, 4, 4).
    """

    cloud: surfsig.PointCloud
    object_of_point: NDArray[np.int64]
    kind_of_object: NDArray[np.int64]
    poses: Array
    kinds: tuple[str, ...]


def recurrence_scene(
    seed: int,
    *,
    columns: int = COLUMNS,
    rows: int = ROWS,
    kinds: tuple[str, ...] = tuple(KINDS),
    any_way: bool = False,
) -> RecurrenceScene:
    """Place objects on a jittered grid and scan them.

    Parameters
    ----------
    seed
        Of kinds, places, orientations and noise.
    columns, rows
        Of the grid; one object per cell.
    kinds
        Names of `KINDS` that occur, each about equally often.
    any_way
        Whether objects are turned in any way; otherwise each stands or lies on one of its sides, turned about
        the vertical. Some of those turned in any way show one flat face only.
    """
    rng = np.random.default_rng(seed)
    kind_of_object = rng.permutation(np.arange(columns * rows) % len(kinds))
    tilt = simulate.pose((0.0, 0.0, 0.0), simulate.turn((1.0, 0.0, 0.0), TABLE_TILT))
    flat = simulate.pose((0.0, 0.0, 0.0), simulate.facing(simulate.UP))
    placed = [simulate.Placed(simulate.Rectangle((0.7, 0.7)), tilt @ flat, "table")]
    object_of_surface, poses = [-1], []
    for number, kind in enumerate(kind_of_object):
        column, row = number % columns, number // columns
        x, y = (np.array([column - (columns - 1) / 2, row - (rows - 1) / 2]) * PITCH) + rng.uniform(
            -0.006, 0.006, 2
        )
        parts = KINDS[kinds[kind]]
        rotation = _random_rotation(rng) if any_way else _resting(rng)
        lowest = max(_reach(surface, pose, rotation) for surface, pose in parts)
        pose = tilt @ simulate.pose((x, y, -lowest), rotation)
        poses.append(pose)
        for surface, own in parts:
            placed.append(simulate.Placed(surface, pose @ own, kinds[kind]))
            object_of_surface.append(number)
    cloud = SCANNER.scan(simulate.Scene(placed), seed=[seed, 1])
    # The laser moves along y: each sheet is seen from its own place.
    sheets, scan = np.unique(cloud.offsets[:, 1], return_inverse=True)
    cloud.fields["scan"] = scan.astype(np.int32)
    cloud = surfsig.PointCloud(
        offsets=cloud.offsets, fields=cloud.fields, viewpoints=SCANNER.laser_at(sheets)
    )
    objects = np.array(object_of_surface)[cloud.fields["surface"]]
    return RecurrenceScene(cloud, objects, kind_of_object, np.array(poses), kinds)


def _random_rotation(rng: np.random.Generator) -> Array:
    """Draw a rotation, all equally likely."""
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _resting(rng: np.random.Generator) -> Array:
    """Put one of the six sides down, and turn about the vertical."""
    side = np.eye(3)[rng.permutation(3)] * rng.choice((-1.0, 1.0), 3)[:, None]
    side[0] *= np.linalg.det(side)
    return np.asarray(simulate.turn((0.0, 0.0, 1.0), rng.uniform(0.0, 2.0 * np.pi)) @ side)


def _reach(surface: simulate.Surface, pose: Array, rotation: Array) -> float:
    """How far a solid reaches along +z, away from the scanner, when it is turned: 0.1 mm steps."""
    side = np.linspace(-0.045, 0.045, 91)
    grid = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = surface.implicit(grid) <= 0.0
    return float((simulate.transform_points(pose, grid[inside]) @ rotation[2]).max())
