"""Scans of objects that stand on a tilted table, as `recurrence_scene` has, but each as a test wants it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from recurrence_scene import KINDS, PITCH, SCANNER, TABLE_TILT
from surface_points import Array

import surfsig
from surfsig import simulate

Solids = list[tuple[simulate.Surface, Array]]

BOSSED: Solids = [
    *KINDS["bracket"],
    (simulate.Box((0.012, 0.010, 0.012)), simulate.pose((0.014, 0.008, -0.005))),
]
"""A bracket with a block on its base, beside the middle: no rotation makes its mirror image of it."""
MIRRORED: Solids = [
    *KINDS["bracket"],
    (simulate.Box((0.012, 0.010, 0.012)), simulate.pose((0.014, -0.008, -0.005))),
]
AROUND = 0.02
"""Of the table, in sight around the cells of the objects, in metres."""
LEVEL = 2e-3
"""From the table to what an object stands on, for each one before it, in metres."""


def enlarged(solids: Solids, scale: float) -> Solids:
    """Make boxes larger, and set them apart as far."""
    made: Solids = []
    for surface, pose in solids:
        assert isinstance(surface, simulate.Box)
        x, y, z = surface.size
        made.append((simulate.Box((scale * x, scale * y, scale * z)), simulate.pose(scale * pose[:3, 3])))
    return made


def near_objects(cloud: surfsig.PointCloud, columns: int, rows: int) -> NDArray[np.bool_]:
    """Tell which points are near the cells of the objects: the rest is table, and most of a scan."""
    half = np.array([columns, rows]) * PITCH / 2 + AROUND
    return np.asarray((np.abs(cloud.offsets[:, :2]) < half).all(axis=1))


def scanned(
    objects: Sequence[tuple[Solids, float, float]], *, columns: int, seed: int
) -> tuple[surfsig.PointCloud, list[Array]]:
    """Scan objects that stand in rows.

    Parameters
    ----------
    objects
        Of each its solids, how high its origin is above what it stands on, and its angle about the vertical.
    columns
        Objects in a row.
    seed
        Of the noise.

    Returns
    -------
    The cloud, whose field ``object`` has the number of each point's object, and their count for the table;
    and the objects' poses T_scan_object.
    """
    tilt = simulate.pose((0.0, 0.0, 0.0), simulate.turn((1.0, 0.0, 0.0), TABLE_TILT))
    flat = simulate.pose((0.0, 0.0, 0.0), simulate.facing(simulate.UP))
    placed = [simulate.Placed(simulate.Rectangle((0.7, 0.7)), tilt @ flat, "table")]
    object_of_surface, poses = [len(objects)], []
    rows = -(-len(objects) // columns)
    for number, (solids, height, turn) in enumerate(objects):
        column, row = number % columns, number // columns
        x, y = (column - (columns - 1) / 2) * PITCH, (row - (rows - 1) / 2) * PITCH
        # Each on its own level: faces of objects on one level are parts of one plane, which carries the rest.
        height += LEVEL * number
        # Away from the scanner is up in its axes: the table's own z points down.
        stand = simulate.turn((1.0, 0.0, 0.0), np.pi)
        turned = simulate.turn((0.0, 0.0, 1.0), turn)
        pose = tilt @ simulate.pose((x, y, -height), turned @ stand)
        poses.append(pose)
        placed += [simulate.Placed(surface, pose @ own, "object") for surface, own in solids]
        object_of_surface += [number] * len(solids)
    cloud = SCANNER.scan(simulate.Scene(placed), seed=[seed, 1])
    cloud = cloud.at(near_objects(cloud, columns, rows))
    sheets, scan = np.unique(cloud.offsets[:, 1], return_inverse=True)
    cloud.fields["scan"] = scan.astype(np.int32)
    cloud.fields["object"] = np.array(object_of_surface)[cloud.fields["surface"]]
    seen_from = SCANNER.laser_at(sheets)
    return surfsig.PointCloud(offsets=cloud.offsets, fields=cloud.fields, viewpoints=seen_from), poses
