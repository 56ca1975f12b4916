"""Noisy patches of surfaces whose curvature is known everywhere: what the errors of fits are measured on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Sampled = tuple[Array, Array, Array]

# Noise hardly ever moves a point farther than this many standard deviations.
REACH = 5


@dataclass(frozen=True)
class Surface:
    """A surface through the origin that bulges towards +z, and the curvature that is asked of it there.

    `sample` takes a radius of curvature, how far the points reach, how many there are to be and a
    generator. It gives points and their normals, (n, 3), and the area that each stands for, at most 1, (n,).
    """

    name: str
    quantity: str
    truth: float
    """In units of one over the radius of curvature."""
    sample: Callable[[float, float, int, np.random.Generator], Sampled]


def half_angle(radius: float, reach: float) -> float:
    """Return the angle at the centre of a circle over a chord; half a turn where the chord is too long."""
    return float(2 * np.arcsin(min(1.0, reach / (2 * radius))))


def sphere(radius: float, reach: float, count: int, rng: np.random.Generator) -> Sampled:
    """Sample the cap of a sphere that is within reach."""
    cosine = rng.uniform(np.cos(half_angle(radius, reach)), 1, count)
    turn, sine = rng.uniform(0, 2 * np.pi, count), np.sqrt(1 - cosine**2)
    normals = np.column_stack([sine * np.cos(turn), sine * np.sin(turn), cosine])
    return radius * normals - [0, 0, radius], normals, np.ones(count)


def cylinder(radius: float, reach: float, count: int, rng: np.random.Generator) -> Sampled:
    """Sample a cylinder along y."""
    angle = rng.uniform(-1, 1, count) * half_angle(radius, reach)
    normals = np.column_stack([np.sin(angle), np.zeros(count), np.cos(angle)])
    points = radius * normals - [0, 0, radius]
    points[:, 1] = rng.uniform(-reach, reach, count)
    return points, normals, np.ones(count)


def saddle(radius: float, reach: float, count: int, rng: np.random.Generator) -> Sampled:
    """Sample the saddle z = (y^2 - x^2) / 2 radius."""
    x, y = rng.uniform(-reach, reach, (2, count))
    normals = np.column_stack([x / radius, -y / radius, np.ones(count)])
    area = np.linalg.norm(normals, axis=1)
    points = np.column_stack([x, y, (y**2 - x**2) / (2 * radius)])
    return points, normals / area[:, None], area / np.sqrt(1 + 2 * (reach / radius) ** 2)


def torus(radius: float, reach: float, count: int, rng: np.random.Generator) -> Sampled:
    """Sample a ring about x at its outside: a tube of that radius, its centre 2 radii from the axis."""
    tube = rng.uniform(-1, 1, count) * half_angle(radius, reach)
    # The inside of the tube, one radius from the axis, is within reach for longest.
    ring = rng.uniform(-1, 1, count) * half_angle(np.sqrt(3) * radius, reach)
    normals = np.column_stack([np.sin(tube), np.cos(tube) * np.sin(ring), np.cos(tube) * np.cos(ring)])
    centres = 2 * radius * np.column_stack([np.zeros(count), np.sin(ring), np.cos(ring)])
    points = centres + radius * normals - [0, 0, 3 * radius]
    return points, normals, (2 + np.cos(tube)) / 3


SURFACES = (
    Surface("sphere", "H", 1.0, sphere),
    Surface("cylinder", "k1", 1.0, cylinder),
    Surface("saddle", "k1", 1.0, saddle),
    Surface("torus", "k1", 1.0, torus),
)


def draw_patches(
    surface: Surface, radius: float, ball: float, noise: float, shape: tuple[int, int], seed: tuple[int, int]
) -> Array:
    """Draw patches, (draws, points, 3), spread evenly over the surface, with noise along its normal.

    The first point of each is the surface's at the origin, moved by its noise; all others are within the ball
    around it, so that a fit that is asked about this point has exactly these neighbours.
    """
    rng = np.random.default_rng(seed)
    draws, points = shape
    patches = np.zeros((draws, points, 3))
    patches[:, 0, 2] = rng.normal(0, noise, draws)
    filled = np.ones(draws, dtype=np.int64)
    while np.any(filled < points):
        base, normals, area = surface.sample(radius, ball + REACH * noise, draws * points, rng)
        moved = base + normals * rng.normal(0, noise, (len(base), 1))
        kept = rng.uniform(size=len(base)) < area
        for draw, part in enumerate(np.split(np.arange(len(base)), draws)):
            near = moved[part][kept[part] & (np.linalg.norm(moved[part] - patches[draw, 0], axis=1) < ball)]
            near = near[: points - filled[draw]]
            patches[draw, filled[draw] : filled[draw] + len(near)] = near
            filled[draw] += len(near)
    return patches
