"""The part of a surface that its points cover, as a mesh: cells of a map that have points, joined."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.geometry import axes_across
from surfsig.shapes.area import cell_width, unrolled
from surfsig.shapes.geodesic import Faces, halved, sphere_with_points
from surfsig.shapes.geometry import Array, directions_of, middle_direction
from surfsig.shapes.overlap import member_points

if TYPE_CHECKING:
    from surfsig.point_cloud import PointCloud
    from surfsig.shapes.surface import Surface

_MOST_CELLS = 2000
"""Along one side of the map: of points of very uneven density the cells would be more than memory holds."""

_FEWEST_AROUND = 8
"""Cells around a full turn, so that what is opposite is never in neighbouring cells."""

_LARGEST_STEP = math.radians(10.0)
"""By which the normal may rotate along a side of a face: its middle is then 0.4 % of the radius inside."""


_WIDE = math.pi
"""Width of a sphere's points, as seen from its center, from which it is meshed without a map: half of it."""

_COVERED = 0.9
"""Share of the points whose cells must be joined to three others. Of a depth camera's points 0.97 or more are
at once; where points are in rows or clusters (two thirds) it takes wider cells."""

_WIDTHS = 5
"""Of cells that are tried, each the root of two times the one before, unless enough points are covered; wider
ones reach too far beyond narrow pieces. Then the one that covers most is taken."""

_CORNERS = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
"""Of a square of four cells, counterclockwise."""


@dataclass(frozen=True, eq=False)
class SurfacePatch:
    """The bounded part of a surface as a mesh of triangles: `Surface.patch`."""

    origin: Array
    """(3,): where the vertices are counted from, so that they keep their digits far from 0: the surface's
    `center`, or where the radius is not determined, which may put that far away, the vertices' mean."""
    vertices: Array
    """(v, 3), less the origin; all are on the surface."""
    faces: Faces
    """(f, 3), numbers of vertices, counterclockwise as seen from outside or from where the normal points."""

    @property
    def area(self) -> float:
        """The sum of the triangles' areas."""
        corners = self.vertices[self.faces]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return float(0.5 * np.linalg.norm(across, axis=1).sum())


@dataclass(frozen=True, eq=False)
class _Chart:
    """A map of a surface: two coordinates, each a length or an angle."""

    flat: Array
    """(n, 2), the points' coordinates."""
    sizes: tuple[float, float]
    """Of a unit of each coordinate, as a length: 1, or of an angle its radius."""
    are_angles: tuple[bool, bool]
    """Which coordinates are angles, the same after a full turn."""
    bends: tuple[float, float]
    """By how many radians the normal rotates along a unit of each coordinate, at most."""
    lifted: Callable[[Array, Array], Array]
    """Takes coordinates back to points (n, 3) of the surface, less its point."""


@dataclass(frozen=True)
class _Grid:
    """The cells along one coordinate: their centers are at start, start + step, ..., count of them."""

    start: float
    step: float
    count: int
    is_angle: bool
    closed: bool = False
    """Whether the cells go round: the first one follows the last."""


def patch_of(surface: Surface, cloud: PointCloud) -> SurfacePatch:
    """Make the mesh; see `Surface.patch`."""
    if surface.kind in ("circle", "line"):
        raise InvalidInputError(f"a {surface.kind} has no area, and so no patch")
    offset = surface.center - surface.point
    points = member_points(surface, cloud) + offset
    chart = _chart(surface, points)
    side = cell_width(unrolled(surface._placement, points))
    if surface.kind == "sphere" and surface.arc > _WIDE:
        return _wide_sphere(surface, points, side)
    first, second, counts = _cells(chart, side)
    triangles = _triangles(counts > 0, first, second)
    if not len(triangles):
        # Points along a line have no cells side by side: then the whole of the map counts.
        triangles = _triangles(np.ones_like(counts, np.bool_), first, second)
    bend = max(abs(chart.bends[0]) * first.step, abs(chart.bends[1]) * second.step)
    halvings = _halvings(bend)
    corners = _subdivided(triangles, halvings)
    fine = 2**halvings
    for column, grid in enumerate((first, second)):
        if grid.closed:
            corners[..., column] %= grid.count * fine
    lattice, numbers = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    along = [grid.start + grid.step / fine * lattice[:, i] for i, grid in enumerate((first, second))]
    vertices = chart.lifted(*along) - offset
    middle = np.zeros(3) if surface.radius_determined else vertices.mean(axis=0)
    return SurfacePatch(surface.center + middle, vertices - middle, numbers.reshape(-1, 3).astype(np.int64))


def _wide_sphere(surface: Surface, points: Array, side: float) -> SurfacePatch:
    """Mesh a sphere without a map, which would be torn at its rim."""
    steps = [side / surface.fitted_radius * 2.0 ** (0.5 * power) for power in range(_WIDTHS)]
    tried = [(*sphere_with_points(points, step), -step) for step in steps]
    enough = [mesh for mesh in tried if mesh[2] >= _COVERED]
    vertices, faces, _, step = enough[0] if enough else max(tried, key=lambda mesh: mesh[2:])
    for _ in range(_halvings(-step)):
        vertices, faces = halved(vertices, faces)
    return SurfacePatch(surface.center, surface.fitted_radius * vertices, faces)


def _halvings(bend: float) -> int:
    """Say how often to halve cells along which the normal rotates by an angle in radians."""
    return math.ceil(math.log2(max(1.0, bend / _LARGEST_STEP)))


def _cells(chart: _Chart, side: float) -> tuple[_Grid, _Grid, Faces]:
    """Choose cells of about this width, or wider ones, and count the points in them."""
    tried = []
    for power in range(_WIDTHS):
        first, second = (_grid(chart, coordinate, side * 2.0 ** (0.5 * power)) for coordinate in (0, 1))
        counts = _counts(chart.flat, first, second)
        tried.append((_covered_share(counts, first, second), -power, (first, second, counts)))
        if tried[-1][0] >= _COVERED:
            break
    # Of those that cover the same, the narrowest.
    return max(tried, key=lambda entry: entry[:2])[2]


def _chart(surface: Surface, points: Array) -> _Chart:
    """Choose the map of a kind; the points are less the surface's point."""
    if surface.kind == "plane":
        return _plane_chart(surface, points)
    if surface.kind == "sphere":
        return _sphere_chart(surface, points)
    placement, axis = surface._placement, surface.axis
    first, second = axes_across(axis)
    angles, heights, away = placement.turns(points), placement.heights(points), placement.away(points)
    radius, major, slope = surface.fitted_radius, surface.major_radius, math.tan(surface.half_angle)

    def around(angle: Array, distance: Array | float, height: Array) -> Array:
        outward = np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second)
        return np.asarray(np.reshape(distance, (-1, 1)) * outward + np.outer(height, axis))

    if surface.kind == "torus":
        tube = np.arctan2(heights, away - major)
        return _Chart(
            np.column_stack([angles, tube]),
            (major, radius),
            (True, True),
            (1.0, 1.0),
            lambda angle, t: around(angle, major + radius * np.cos(t), radius * np.sin(t)),
        )
    if surface.kind == "cone":
        return _Chart(
            np.column_stack([angles, heights]),
            (float(away.mean()), 1.0 / math.cos(surface.half_angle)),
            (True, False),
            (1.0, 0.0),
            lambda angle, height: around(angle, radius + slope * height, height),
        )
    return _Chart(
        np.column_stack([angles, heights]),
        (radius, 1.0),
        (True, False),
        (1.0, 0.0),
        lambda angle, height: around(angle, radius, height),
    )


def _plane_chart(surface: Surface, points: Array) -> _Chart:
    """Lay the coordinates along the points' principal axes, so that a strip is not across the cells."""
    axes = np.stack(axes_across(surface.axis))
    flat = points @ axes.T
    principal = np.linalg.eigh(np.cov(flat.T))[1][:, ::-1]
    # A right-handed pair, so that faces are seen counterclockwise from the normal's side.
    principal[:, 1] *= np.sign(np.linalg.det(principal))
    axes = principal.T @ axes
    return _Chart(
        points @ axes.T,
        (1.0, 1.0),
        (False, False),
        (0.0, 0.0),
        lambda x, y: np.asarray(np.outer(x, axes[0]) + np.outer(y, axes[1])),
    )


def _sphere_chart(surface: Surface, points: Array) -> _Chart:
    """Take Lambert's azimuthal map about the middle of the points; its rim is the opposite point."""
    radius, middle = surface.fitted_radius, middle_direction(directions_of(points))
    axes = np.stack(axes_across(middle))

    def lifted(x: Array, y: Array) -> Array:
        flat = np.column_stack([x, y]) / radius
        # The distance on the map is 2 sin(angle / 2); cells at the rim may have their centers beyond it.
        distance = np.linalg.norm(flat, axis=1, keepdims=True)
        angle = 2.0 * np.arcsin(np.minimum(0.5 * distance, 1.0))
        beside = flat / np.where(distance > 0.0, distance, 1.0) @ axes
        return np.asarray(radius * (np.cos(angle) * middle + np.sin(angle) * beside))

    flat = unrolled(surface._placement, points)
    return _Chart(flat, (1.0, 1.0), (False, False), (1.0 / radius, 1.0 / radius), lifted)


def _grid(chart: _Chart, coordinate: int, side: float) -> _Grid:
    """Divide a coordinate, so that the centers of the first and last cells are where its points end."""
    values, size = chart.flat[:, coordinate], chart.sizes[coordinate]
    if chart.are_angles[coordinate]:
        count = max(_FEWEST_AROUND, min(_MOST_CELLS, math.floor(2.0 * math.pi * size / side)))
        step = 2.0 * math.pi / count
        ordered = np.sort(values)
        gaps = np.diff(ordered, append=ordered[0] + 2.0 * math.pi)
        widest = int(gaps.argmax())
        if gaps[widest] < step:
            return _Grid(0.0, step, count, is_angle=True, closed=True)
        start = float(ordered[(widest + 1) % len(ordered)])
        extent = 2.0 * math.pi - float(gaps[widest])
    else:
        start, extent = float(values.min()), float(np.ptp(values))
    intervals = max(1, min(_MOST_CELLS, round(extent * size / side)))
    step = extent / intervals if extent > 0.0 else side / size
    return _Grid(start, step, intervals + 1, is_angle=chart.are_angles[coordinate])


def _counts(flat: Array, first: _Grid, second: _Grid) -> Faces:
    """Count the points in each cell."""
    cells = []
    for values, grid in zip(flat.T, (first, second), strict=True):
        from_start = values - grid.start
        if grid.is_angle:
            # Angles run on from half a cell before the first center.
            from_start = (from_start + 0.5 * grid.step) % (2.0 * math.pi) - 0.5 * grid.step
        numbers = np.round(from_start / grid.step).astype(np.int64)
        cells.append(numbers % grid.count if grid.closed else np.clip(numbers, 0, grid.count - 1))
    numbers = cells[0] * second.count + cells[1]
    return np.bincount(numbers, minlength=first.count * second.count).reshape(first.count, second.count)


def _covered_share(counts: Faces, first: _Grid, second: _Grid) -> float:
    """Give the share of the points that are in cells of a square of four with points."""
    corners = np.concatenate([np.argwhere(_corners_with_points(counts > 0, first, second)[1] == 4)] * 4)
    corners += np.repeat(_CORNERS, len(corners) // 4, axis=0)
    inside = np.zeros(counts.shape, np.bool_)
    inside[corners[:, 0] % first.count, corners[:, 1] % second.count] = True
    return float(counts[inside].sum() / counts.sum())


def _corners_with_points(
    occupied: NDArray[np.bool_], first: _Grid, second: _Grid
) -> tuple[list[NDArray[np.bool_]], Faces]:
    """Tell of each square of four cells which corners have points, as `_CORNERS` are, and how many."""
    # What follows the last cell of a full turn is the first.
    wrapped = np.pad(occupied, ((0, int(first.closed)), (0, int(second.closed))), mode="wrap")
    square = [wrapped[:-1, :-1], wrapped[1:, :-1], wrapped[1:, 1:], wrapped[:-1, 1:]]
    return square, np.sum(square, axis=0)


def _triangles(occupied: NDArray[np.bool_], first: _Grid, second: _Grid) -> Faces:
    """Join the centers of neighbouring cells that have points: two faces between four, one between three.

    Cells at the border reach beyond it by half on average, so that their centers are at the border.
    """
    square, count = _corners_with_points(occupied, first, second)
    faces = []
    for names, chosen in [
        ((0, 1, 2), count == 4),
        ((0, 2, 3), count == 4),
        *(([i for i in range(4) if i != missing], (count == 3) & ~square[missing]) for missing in range(4)),
    ]:
        faces.append(np.argwhere(chosen)[:, None] + _CORNERS[list(names)])
    return np.concatenate(faces)


def _subdivided(triangles: Faces, halvings: int) -> Faces:
    """Cut each triangle into four at the middles of its sides, some times; coordinates double each time."""
    for _ in range(halvings):
        a, b, c = (2 * triangles).swapaxes(0, 1)
        ab, bc, ca = (a + b) // 2, (b + c) // 2, (c + a) // 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return triangles
