"""Simulated scenes of one surface among its neighbours, whose sizes are known.

Points lie on scan lines across each surface. The scenes have borders of all sorts: a surface that stands on
a floor, one that is cut by walls, and one that its neighbours continue without an edge.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ARCS = (20.0, 360.0)
"""Degrees of a surface that there are: the least and the most."""

NOISES = ("independent", "correlated")
"""Independent: normal in x, y and z. Correlated: along the surface's normal, half of the variance in common
with neighbours on the scan line, and 1 / e of that half with those at `CORRELATION_LENGTH` points."""

CORRELATION_LENGTH = 10.0


class Patch(NamedTuple):
    """Points of one surface on scan lines, with its normals there."""

    points: Array
    normals: Array
    lines: NDArray[np.intp]
    """The number of each point's scan line; its points follow one another."""

    def where(self, kept: NDArray[np.bool_]) -> Patch:
        """Give the part that is kept."""
        return Patch(self.points[kept], self.normals[kept], self.lines[kept])


@dataclass(frozen=True, eq=False)
class Truth:
    """The surface that a scene is about, of radius 1 but for a torus's tube."""

    kind: str
    point: Array
    """On its axis or plane; its center."""
    axis: Array
    radius: float
    """Of a cone, at `point`; of a plane, that of its neighbour."""
    major_radius: float = math.nan
    half_angle: float = 0.0

    def radius_beside(self, position: Array) -> float:
        """Give the radius beside a position near the axis."""
        return self.radius + float((position - self.point) @ self.axis) * math.tan(self.half_angle)


@dataclass(frozen=True, eq=False)
class IntervalScene:
    """A scan, and what is known of one of its surfaces."""

    points: Array
    members: NDArray[np.bool_]
    """Which points are the surface's."""
    truth: Truth
    arc: float
    """Degrees of it that there are (beside a plane, of its neighbour)."""


def _rows(
    lengths: Sequence[float], spacing: float, rng: np.random.Generator
) -> tuple[NDArray[np.intp], Array]:
    """Put points on scan lines of some lengths: the number of each one's line, and how far along it is."""
    lines, along = [], []
    for line, length in enumerate(lengths):
        count = max(int(length / spacing), 1)
        jitter = rng.uniform(-0.2, 0.2, count)
        lines.append(np.full(count, line))
        along.append((np.arange(count) + rng.uniform(0.2, 0.8) + jitter) * spacing)
    number = np.concatenate(lines)
    position = np.concatenate(along)
    kept = position < np.asarray(lengths)[number]
    return number[kept], position[kept]


def _steps(length: float, spacing: float) -> Array:
    """Give positions from 0 to a length, so far apart."""
    return np.asarray((np.arange(max(int(length / spacing), 1)) + 0.5) * spacing)


def _flat(corner: Array, first: Array, second: Array, spacing: float, rng: np.random.Generator) -> Patch:
    """Give a parallelogram of a plane, its lines along the first side."""
    sides = np.linalg.norm(first), np.linalg.norm(second)
    across = _steps(float(sides[1]), spacing)
    lines, along = _rows([float(sides[0])] * len(across), spacing, rng)
    points = corner + np.outer(along, first / sides[0]) + np.outer(across[lines], second / sides[1])
    normal = np.cross(first, second)
    return Patch(points, np.tile(normal / np.linalg.norm(normal), (len(points), 1)), lines)


def _floor(size: float, spacing: float, rng: np.random.Generator, height: float = 0.0) -> Patch:
    """Give the square z = height about the z axis, so far to all sides."""
    corner = np.array([-size, -size, height])
    return _flat(corner, np.array([2 * size, 0, 0]), np.array([0, 2 * size, 0]), spacing, rng)


def _around_z(
    radii: Array, heights: Array, arc: float, spacing: float, rng: np.random.Generator, slope: float = 0.0
) -> Patch:
    """Give rings about z, or arcs of them, of a surface whose normal rises by -slope for each 1 outwards."""
    lines, along = _rows([float(radius) * arc for radius in radii], spacing, rng)
    angle = along / radii[lines]
    outward = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])
    points = radii[lines, None] * outward
    points[:, 2] = heights[lines]
    normals = outward - [0, 0, slope]
    return Patch(points, normals / np.linalg.norm(normals, axis=1, keepdims=True), lines)


def _distance_from_z(patch: Patch) -> Array:
    return np.asarray(np.hypot(patch.points[:, 0], patch.points[:, 1]))


Made = tuple[Patch, list[Patch], Truth]
"""The surface, its neighbours, and what is true of it."""


def _sphere(arc: float, spacing: float, rng: np.random.Generator) -> Made:
    """Cut a ball by a floor: as wide as the arc, seen from its center."""
    edge = arc / 2
    polar = _steps(edge, spacing)
    lines, along = _rows([float(2 * math.pi * math.sin(angle)) for angle in polar], spacing, rng)
    sine, cosine = np.sin(polar[lines]), np.cos(polar[lines])
    turn = along / sine
    normals = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), cosine])
    floor = _floor(math.sin(edge) + 1.2 if arc < math.pi else 2.2, spacing, rng, math.cos(edge))
    truth = Truth("sphere", np.zeros(3), np.full(3, math.nan), 1.0)
    return Patch(normals, normals, lines), [floor.where(_distance_from_z(floor) > math.sin(edge))], truth


def _between_walls(arc: float, spacing: float, rng: np.random.Generator) -> Made:
    """Continue a cylinder along z by a wall at either end of its arc, with an edge or without."""
    length = rng.uniform(1, 3)
    heights = _steps(length, spacing)
    patch = _around_z(np.ones(len(heights)), heights, arc, spacing, rng)
    # 0: the wall is tangent.
    angle = 0.0 if arc < math.pi and rng.uniform() < 0.5 else math.radians(rng.uniform(30, 100))
    walls = []
    for end, side in ((0.0, -1.0), (arc, 1.0)):
        outward = np.array([math.cos(end), math.sin(end), 0.0])
        tangent = side * np.array([-math.sin(end), math.cos(end), 0.0])
        direction = math.cos(angle) * tangent + math.sin(angle) * outward
        upwards = np.array([0.0, 0.0, length])
        # Half a step on, so that no line is there twice.
        walls.append(_flat(outward + 0.5 * spacing * direction, 1.2 * direction, upwards, spacing, rng))
    return patch, walls, Truth("cylinder", np.zeros(3), np.array([0.0, 0, 1]), 1.0)


def _on_a_floor(arc: float, spacing: float, rng: np.random.Generator) -> Made:
    """Stand a cylinder, or an arc of one, on a floor."""
    heights = _steps(rng.uniform(1, 3), spacing)
    patch = _around_z(np.ones(len(heights)), heights, arc, spacing, rng)
    floor = _floor(2.2, spacing, rng)
    closed = arc > math.radians(300)
    outside = floor.where(_distance_from_z(floor) > 1) if closed else floor
    return patch, [outside], Truth("cylinder", np.zeros(3), np.array([0.0, 0, 1]), 1.0)


def _cone(arc: float, spacing: float, rng: np.random.Generator) -> Made:
    """Stand the stump of a cone on a floor, its wider or its narrower end below."""
    half_angle = math.radians(rng.uniform(8, 50))
    widening = math.tan(half_angle)
    height = min(rng.uniform(0.8, 2.0), 1.2 / widening)
    # The radius is 1 in the middle.
    side = _steps(height / math.cos(half_angle), spacing) * math.cos(half_angle)
    radii = 1 + (side - height / 2) * widening
    patch = _around_z(radii, side, arc, spacing, rng, widening)
    below, above = _floor(2.5, spacing, rng), _floor(2.0, spacing, rng, height)
    ends = 1 - height / 2 * widening, 1 + height / 2 * widening
    neighbours = [below.where(_distance_from_z(below) > ends[0])]
    if arc > math.radians(300):
        neighbours.append(above.where(_distance_from_z(above) < ends[1]))
    truth = Truth("cone", np.array([0, 0, height / 2]), np.array([0.0, 0, 1]), 1.0, half_angle=half_angle)
    return patch, neighbours, truth


def _on_tube(angles: Array, tube_arc: float, tube: float, spacing: float, rng: np.random.Generator) -> Patch:
    """Give lines around the tube of a torus of major radius 1 about z, at some angles about it."""
    lines, along = _rows([tube * tube_arc] * len(angles), spacing, rng)
    turn, lift = angles[lines], along / tube
    outward = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(turn))])
    normals = np.cos(lift)[:, None] * outward
    normals[:, 2] = np.sin(lift)
    # On the inner side lines are closer.
    kept = rng.uniform(0, 1 + tube, len(lift)) < 1 + tube * np.cos(lift)
    return Patch(outward + tube * normals, normals, lines).where(kept)


def _elbow(arc: float, spacing: float, rng: np.random.Generator) -> Made:
    """Bend a pipe: a torus between two cylinders, which continue it without an edge."""
    tube = rng.uniform(0.2, 0.6)
    patch = _on_tube(_steps(arc, spacing), 2 * math.pi, tube, spacing, rng)
    pipes = []
    for end, side in ((0.0, -1.0), (arc, 1.0)):
        outward = np.array([math.cos(end), math.sin(end), 0.0])
        along = side * np.array([-math.sin(end), math.cos(end), 0.0])
        heights = _steps(1.2, spacing)
        pipe = _around_z(np.full(len(heights), tube), heights, 2 * math.pi, spacing, rng)
        axes = np.array([outward, np.cross(along, outward), along])
        pipes.append(Patch(pipe.points @ axes + outward, pipe.normals @ axes, pipe.lines))
    return patch, pipes, Truth("torus", np.zeros(3), np.array([0.0, 0, 1]), tube, 1.0)


def _ring(arc: float, spacing: float, rng: np.random.Generator) -> Made:
    """Lay a torus, or an arc of it, on a floor in which it is half sunk."""
    tube = rng.uniform(0.2, 0.6)
    patch = _on_tube(_steps(arc, spacing), math.pi, tube, spacing, rng)
    floor = _floor(2.2, spacing, rng)
    away = _distance_from_z(floor)
    turn = np.arctan2(floor.points[:, 1], floor.points[:, 0]) % (2 * math.pi)
    floor = floor.where((abs(away - 1) > tube) | (turn > arc))
    return patch, [floor], Truth("torus", np.zeros(3), np.array([0.0, 0, 1]), tube, 1.0)


def _flat_piece(arc: float, spacing: float, rng: np.random.Generator) -> Made:
    """Put a plane between a wall, with an edge, and a cylinder that continues it without one."""
    length = rng.uniform(1, 3)
    upwards = np.array([0.0, 0, length])
    patch = _flat(np.array([1.0, 0, 0]), np.array([0, -2.0, 0]), upwards, spacing, rng)
    heights = _steps(length, spacing)
    rounded = _around_z(np.ones(len(heights)), heights, min(arc, math.pi), spacing, rng)
    angle = math.radians(rng.uniform(30, 150))
    away = np.array([math.sin(angle), -math.cos(angle), 0.0])
    wall = _flat(np.array([1, -2.0, 0]) + 0.5 * spacing * away, 1.2 * away, upwards, spacing, rng)
    return patch, [rounded, wall], Truth("plane", np.array([1.0, 0, 0]), np.array([1.0, 0, 0]), 1.0)


Maker = Callable[[float, float, np.random.Generator], Made]

MAKERS: dict[str, tuple[Maker, ...]] = {
    "plane": (_flat_piece,),
    "sphere": (_sphere,),
    "cylinder": (_between_walls, _on_a_floor),
    "cone": (_cone,),
    "torus": (_elbow, _ring),
}
"""What makes the scenes of a kind, one after the other."""

KINDS = tuple(MAKERS)

MOST_ARCS: dict[Maker, float] = {_between_walls: 300.0, _elbow: 180.0}
"""Degrees of a cylinder between walls, and of an elbow: these meet where there is more."""


def interval_scene(kind: str, noise: str, seed: int) -> IntervalScene:
    """Make a scene: arc, sizes, spacing, noise and pose by chance, the same for each seed.

    Parameters
    ----------
    kind
        Of `KINDS`.
    noise
        Of `NOISES`. Its standard deviation is a thousandth to a hundredth of the radius.
    """
    rng = np.random.default_rng([seed, KINDS.index(kind), NOISES.index(noise)])
    makers = MAKERS[kind]
    maker = makers[seed % len(makers)]
    most = MOST_ARCS.get(maker, ARCS[1])
    arc, spacing = rng.uniform(ARCS[0], most), rng.uniform(0.03, 0.06)
    patch, neighbours, truth = maker(math.radians(arc), spacing, rng)
    deviation = 10 ** rng.uniform(-3, -2) * truth.radius
    parts = [patch, *neighbours]
    points = np.concatenate([_noisy(part, noise, deviation, rng) for part in parts])
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    axes *= np.linalg.det(axes)
    away = rng.uniform(-20, 20, 3)
    members = np.arange(len(points)) < len(patch.points)
    # In no order: a scan's points need not come line by line.
    order = rng.permutation(len(points))
    moved = Truth(
        kind, axes @ truth.point + away, axes @ truth.axis, truth.radius, truth.major_radius, truth.half_angle
    )
    return IntervalScene((points @ axes.T + away)[order], members[order], moved, arc)


def _noisy(patch: Patch, noise: str, deviation: float, rng: np.random.Generator) -> Array:
    if noise == "independent":
        return patch.points + deviation * rng.normal(size=patch.points.shape)
    white = rng.normal(size=(2, len(patch.points)))
    decay = math.exp(-1 / CORRELATION_LENGTH)
    begins = np.diff(patch.lines, prepend=-1) != 0
    common = white[0].copy()
    for number in np.flatnonzero(~begins):
        common[number] = decay * common[number - 1] + math.sqrt(1 - decay**2) * white[0, number]
    along = deviation * math.sqrt(0.5) * (common + white[1])
    return np.asarray(patch.points + along[:, None] * patch.normals)
