"""Depth images as real cameras take them: known objects in clutter on a table, and their truth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import simulate
from surfsig.simulate.ellipsoid import Ellipsoid

Array = NDArray[np.float64]
Parts = list[tuple[simulate.Surface, Array]]

DIAMETERS = (0.100, 0.260)
"""Of the smallest and the largest object, in metres."""
LIBRARY = 20
"""Objects that there are; 8 of them are in a scene."""
SHOWN = 8
CLUTTER = 8
DISTANCES = (0.5, 2.0)
"""From the camera to the middle of the objects, in metres."""
NARROW = 1.1
"""Distance from which on the camera has the longer focal length."""
FOCAL = (575.0, 1075.0)
CROWD = 0.28
"""Half the width of the part of the table where all stands, at most: what is near hides what is behind it."""


def _random_part(rng: np.random.Generator, size: float) -> simulate.Surface:
    """Draw a solid of about a size."""
    a, b, c = size * rng.uniform(0.5, 1.0, 3)
    kind = rng.integers(5)
    if kind == 0:
        return simulate.Box((a, b, c))
    if kind == 1:
        return simulate.Cylinder(0.4 * a, b)
    if kind == 2:
        return simulate.Cone(0.5 * a, b, 0.2 * c)
    if kind == 3:
        return simulate.Sphere(0.45 * a)
    return Ellipsoid((0.55 * a, 0.45 * b, 0.4 * c))


@cache
def object_parts(number: int) -> tuple[tuple[simulate.Surface, Array], ...]:
    """Give a solid object made of parts: a body and two to four others that stick out of it.

    The same number is the same object; its diameter is within `DIAMETERS`.
    """
    rng = np.random.default_rng([2020, number])
    diameter = rng.uniform(*DIAMETERS)
    parts: Parts = [(_random_part(rng, 0.7), np.eye(4))]
    for _ in range(int(rng.integers(2, 5))):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        surface = _random_part(rng, rng.uniform(0.2, 0.5))
        turn = np.asarray(Rotation.random(random_state=rng).as_matrix())
        parts.append((surface, simulate.pose(rng.uniform(0.25, 0.45) * direction, turn)))
    points = _surface_points(parts, 4000)
    hull = points[rng.permutation(len(points))[:1500]]
    widest = max(float(np.linalg.norm(hull - point, axis=1).max()) for point in hull)
    scale = diameter / widest
    return tuple((_scaled(surface, scale), _moved(pose, scale)) for surface, pose in parts)


def _moved(pose: Array, scale: float) -> Array:
    moved = pose.copy()
    moved[:3, 3] *= scale
    return moved


def _scaled(surface: simulate.Surface, scale: float) -> simulate.Surface:
    if isinstance(surface, simulate.Box):
        return simulate.Box(tuple(scale * edge for edge in surface.size))  # type: ignore[arg-type]
    if isinstance(surface, simulate.Cylinder):
        return simulate.Cylinder(scale * surface.radius, scale * surface.length)
    if isinstance(surface, simulate.Cone):
        return simulate.Cone(scale * surface.radius, scale * surface.height, scale * surface.top_radius)
    if isinstance(surface, simulate.Sphere):
        return simulate.Sphere(scale * surface.radius)
    assert isinstance(surface, Ellipsoid)
    return Ellipsoid(tuple(scale * axis for axis in surface.semi_axes))  # type: ignore[arg-type]


def _surface_points(parts: Parts | tuple[tuple[simulate.Surface, Array], ...], count: int) -> Array:
    """Give points of the outer surface: what rays from all around meet first."""
    return _surface(parts, count)[0]


def _surface(parts: Parts | tuple[tuple[simulate.Surface, Array], ...], count: int) -> tuple[Array, Array]:
    """Give them with their outward unit normals."""
    rng = np.random.default_rng(0)
    scene = simulate.Scene([simulate.Placed(surface, own) for surface, own in parts])
    reach = max(surface.extent + float(np.linalg.norm(own[:3, 3])) for surface, own in parts)
    rays = rng.normal(size=(6 * count, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    aims = rng.uniform(-0.5 * reach, 0.5 * reach, rays.shape)
    hits = scene.cast(aims - 3.0 * reach * rays, rays)
    known = np.flatnonzero(np.isfinite(hits.points[:, 0]))[:count]
    return np.asarray(hits.points[known]), np.asarray(hits.normals[known])


@cache
def model(number: int, points: int = 20_000) -> surfsig.PointCloud:
    """Give an object's whole outer surface, without normals."""
    return surfsig.PointCloud(_surface_points(object_parts(number), points))


@cache
def model_normals(number: int, points: int = 20_000) -> Array:
    """Give the outward normals of its points, for those who need them."""
    return _surface(object_parts(number), points)[1]


@cache
def diameter(number: int) -> float:
    """Give the largest distance between points of an object, in metres."""
    points = model(number).points[::20]
    return max(float(np.linalg.norm(points - point, axis=1).max()) for point in points)


@dataclass(frozen=True, eq=False)
class ClutterScene:
    """A depth image and its truth.

    `numbers` are those of the objects in it, `poses` are T_scene_object, (objects, 4, 4), and `visible` says
    at what share of each object's pixels it was measured, and nothing is before it.
    """

    cloud: surfsig.PointCloud
    numbers: NDArray[np.int64]
    poses: Array
    visible: Array
    distance: float


def clutter_scene(seed: int, *, shown: int = SHOWN, library: int = LIBRARY) -> ClutterScene:
    """Place objects of the library and clutter on a table before a wall, and take a depth image.

    Parameters
    ----------
    seed
        Of kinds, places, the camera, and its errors.
    shown
        Objects of the library that are there.
    library
        Objects that there are.
    """
    rng = np.random.default_rng([77, seed])
    distance = float(rng.uniform(*DISTANCES))
    camera = simulate.StereoCamera(
        focal=FOCAL[0] if distance < NARROW else FOCAL[1],
        disparity_noise=rng.uniform(0.04, 0.09),
        disparity_step=float(rng.choice([0.0, 0.0625, 0.125])),
        smoothing=rng.uniform(1.0, 2.0),
        bleeding=rng.uniform(0.5, 1.5),
    )
    elevation = np.radians(rng.uniform(20.0, 60.0))
    # Scene axes: z up, the table at z = 0; the camera looks at the middle of the objects.
    eye = distance * np.array([0.0, -np.cos(elevation), np.sin(elevation)]) + [0.0, 0.0, 0.05]
    forward = np.array([0.0, 0.0, 0.05]) - eye
    forward /= np.linalg.norm(forward)
    right = np.array([1.0, 0.0, 0.0])
    T_table_camera = np.eye(4)
    T_table_camera[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    T_table_camera[:3, 3] = eye

    up = np.eye(3)
    wall_away = rng.uniform(0.5, 1.2)
    placed = [
        simulate.Placed(simulate.Rectangle((1.6, 1.2)), simulate.pose((0.0, 0.0, 0.0), up), "table"),
        simulate.Placed(simulate.Rectangle((8.0, 8.0)), simulate.pose((0.0, 0.0, -0.75), up), "floor"),
        simulate.Placed(
            simulate.Rectangle((8.0, 8.0)),
            simulate.pose((0.0, wall_away, 0.0), simulate.facing((0.0, -1.0, 0.0))),
            "wall",
        ),
    ]
    owner, reflectance = [-1, -1, -1], [0.9, 0.5, 0.9]
    numbers = rng.permutation(library)[:shown]
    discs: list[tuple[Array, float]] = []
    poses: list[Array] = []
    # What a camera shows of the table, so that nothing is placed out of sight.
    half_width = min(0.4 * distance * camera.width / camera.focal, CROWD)
    for number in range(shown + CLUTTER):
        parts = list(object_parts(int(numbers[number]))) if number < shown else _clutter(rng)
        turn = np.asarray(Rotation.random(random_state=rng).as_matrix())
        points = _surface_points(parts, 600) @ turn.T
        radius = float(np.linalg.norm(points[:, :2], axis=1).max())
        where = _free_place(rng, discs, radius, half_width)
        discs.append((where, radius))
        pose = simulate.pose((*where, -float(points[:, 2].min())), turn)
        albedo = rng.uniform(0.4, 1.0)
        for surface, own in parts:
            placed.append(simulate.Placed(surface, pose @ own))
            owner.append(number if number < shown else -1)
            reflectance.append(albedo)
        if number < shown:
            poses.append(pose)
    scene = simulate.Scene(placed)
    cloud = camera.scan(scene, T_table_camera, seed=seed, reflectance=reflectance)
    seen = np.where(
        cloud.fields["surface"] >= 0, np.array(owner)[cloud.fields["surface"].astype(np.int64)], -1
    )
    directions = camera.rays() @ T_table_camera[:3, :3].T
    origins = np.broadcast_to(eye, directions.shape)
    visible = []
    for number in range(shown):
        alone = simulate.Scene([placed[i] for i in range(len(placed)) if owner[i] == number])
        bare = alone.cast(origins, directions).surface >= 0
        measured = (seen == number) & np.isfinite(cloud.points[:, 2])
        # What is beyond the image's borders counts as hidden, roughly: objects stand within them.
        visible.append(measured.sum() / max(bare.sum(), 1))
    T_camera_table = np.linalg.inv(T_table_camera)
    in_camera = np.array([T_camera_table @ pose for pose in poses]).reshape(-1, 4, 4)
    return ClutterScene(cloud, numbers, in_camera, np.array(visible), distance)


def _clutter(rng: np.random.Generator) -> Parts:
    """Draw an everyday shape: a box, a book, a can, a ball, a bottle, or something of several parts."""
    kind = rng.integers(6)
    if kind == 0:
        return [(simulate.Box(tuple(rng.uniform(0.04, 0.2, 3))), np.eye(4))]
    if kind == 1:
        return [(simulate.Box((0.15, 0.21, float(rng.uniform(0.01, 0.04)))), np.eye(4))]
    if kind == 2:
        return [(simulate.Cylinder(float(rng.uniform(0.02, 0.05)), float(rng.uniform(0.06, 0.2))), np.eye(4))]
    if kind == 3:
        return [(simulate.Sphere(float(rng.uniform(0.02, 0.06))), np.eye(4))]
    if kind == 4:
        radius = float(rng.uniform(0.025, 0.04))
        return [
            (simulate.Cylinder(radius, 0.12), np.eye(4)),
            (simulate.Cone(radius, 0.05, 0.4 * radius), simulate.pose((0.0, 0.0, 0.06))),
            (simulate.Cylinder(0.4 * radius, 0.03), simulate.pose((0.0, 0.0, 0.125))),
        ]
    return list(object_parts(int(rng.integers(10_000, 20_000))))


def _free_place(
    rng: np.random.Generator, discs: list[tuple[Array, float]], radius: float, half_width: float
) -> Array:
    """Find a place on the table where a disc overlaps the others little; the longer it takes, the more."""
    for trial in range(2000):
        where = rng.uniform(-1.0, 1.0, 2) * [half_width, 0.8 * half_width]
        share = 0.85 - 0.4 * trial / 2000
        if all(np.linalg.norm(where - other) > share * (radius + size) for other, size in discs):
            return where
    return where
