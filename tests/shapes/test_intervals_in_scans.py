"""How often the 95 % interval of a shape that is grown from a place in a scan holds the true radius.

A ball or a pipe of radius 1 on a table or half in it is scanned from above with noise along the rays, or in
all directions. Before points at the border were left out, and standard errors knew of points left out, 75 to
90 of 100 intervals of balls held the radius at noise of 1 %.
"""

import math
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from surface_points import Array

from surfsig import InvalidInputError, Surface, fit_cylinder, fit_sphere


def table_scan(
    rng: np.random.Generator, fit: Callable[..., Surface], noise: float, rays: bool
) -> list[Array]:
    """Give the points of a scan, and one of them on the object's side that faces the scanner."""
    viewpoint = np.array([*rng.uniform(-2, 2, 2), rng.uniform(5, 8)])
    count = int(rng.choice([60, 100]))
    grid = (np.arange(count) + rng.uniform()) / count * 5 - 2.5
    x, y = (coordinates.ravel() for coordinates in np.meshgrid(grid, grid))
    table = np.column_stack([x, y, np.full(len(x), rng.choice([-1.0, -0.5, 0.0]))])
    direction = table - viewpoint
    ranges = np.linalg.norm(direction, axis=1)
    direction /= ranges[:, None]
    # A pipe is along x.
    first = 0 if fit is fit_sphere else 1
    across, beside = direction[:, first:], viewpoint[first:]
    a, b, c = (across**2).sum(axis=1), across @ beside, beside @ beside - 1
    root = b * b - a * c
    to_object = (-b - np.sqrt(np.maximum(root, 0))) / a
    hit = (root > 0) & (to_object < ranges)
    if first:
        hit &= np.abs(viewpoint[0] + to_object * direction[:, 0]) < 2
    points = viewpoint + np.where(hit, to_object, ranges)[:, None] * direction
    points += noise * (
        rng.normal(size=(len(points), 1)) * direction if rays else rng.normal(size=points.shape)
    )
    facing = np.zeros(3)
    facing[first:] = beside / np.linalg.norm(beside)
    on_object = points[hit]
    wanted = facing + 0.3 * rng.normal(size=3)
    return [points, on_object[np.linalg.norm(on_object - wanted, axis=1).argmin()]]


@cache
def share_held(fit: Callable[..., Surface], noise: float, rays: bool, count: int) -> float:
    rng = np.random.default_rng(81)
    held = []
    for _ in range(count):
        points, near = table_scan(rng, fit, noise, rays)
        try:
            low, high = fit(points, near=near).interval
        except InvalidInputError:
            continue
        held.append(low <= 1 <= high)
    assert len(held) > 0.95 * count
    return float(np.mean(held))


def test_most_intervals_of_balls_on_a_table_hold_the_radius() -> None:
    assert share_held(fit_sphere, 0.01, False, 40) >= 0.88


@pytest.mark.slow
@pytest.mark.parametrize("fit", [fit_sphere, fit_cylinder])
@pytest.mark.parametrize("rays", [False, True])
def test_intervals_of_grown_shapes_hold_the_radius(fit: Callable[..., Surface], rays: bool) -> None:
    # Of 200 scans each 92 to 96 of 100 held it; here fewer are tried, at a third of a second each.
    count = 40
    # Two standard errors of a share of 0.95 of so many below the 0.9 that is promised.
    assert share_held(fit, 0.01, rays, count) >= 0.9 - 2 * math.sqrt(0.95 * 0.05 / count)
