"""Two parallel sheets nearer to each other than their points are: two surfaces from five noises on."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_points import Array

import surfsig


def sheets(
    count: int, separation: float, noise: float, curvature: float = 0.0
) -> tuple[Array, NDArray[np.bool_]]:
    """Give points of two sheets of 2 x 2, one of them upper, which bend about the y axis."""
    rng = np.random.default_rng(round(separation / noise))
    x, y = rng.uniform(-1, 1, (2, count))
    is_upper = rng.uniform(size=count) < 0.5
    away = separation * is_upper + noise * rng.normal(size=count)
    if curvature == 0:
        return np.column_stack([x, y, away]), is_upper
    radius = 1 / curvature + away
    return np.column_stack([radius * np.sin(x * curvature), y, radius * np.cos(x * curvature)]), is_upper


@pytest.mark.parametrize("ratio", [5, 7, 10, 20, 50])
def test_two_planes_are_two(ratio: int) -> None:
    """The points of each are 50 noises apart."""
    noise = 1e-3
    points, is_upper = sheets(6000, ratio * noise, noise)
    found = surfsig.find_surfaces(points)
    assert [surface.kind for surface in found][:2] == ["plane", "plane"]
    # A few points may be left of both.
    assert sum(surface.count for surface in list(found)[2:]) < 0.005 * len(points)
    for number, surface in enumerate(list(found)[:2]):
        own = is_upper[found.labels == number]
        assert max(own.mean(), 1 - own.mean()) > (0.95 if ratio == 5 else 0.99)
        assert surface.rms == pytest.approx(noise, rel=0.2 if ratio == 5 else 0.05)
    gap = found[0].distance_to(found[1], surfsig.PointCloud(points)).value
    assert gap == pytest.approx(ratio * noise, rel=0.05)


def test_two_planes_that_noise_hides_are_one() -> None:
    points, _ = sheets(6000, 2e-3, 1e-3)
    (one,) = surfsig.find_surfaces(points)
    # The root of 1 + 1, the square of half the separation.
    assert one.rms == pytest.approx(1e-3 * 2**0.5, rel=0.03)


def test_the_wall_of_a_pipe_has_two_sides() -> None:
    points, is_upper = sheets(12_000, 0.01, 5e-4, curvature=1.0)
    found = surfsig.find_surfaces(points)
    assert [surface.kind for surface in found][:2] == ["cylinder", "cylinder"]
    assert sorted(surface.radius for surface in list(found)[:2]) == pytest.approx([1.0, 1.01], abs=1e-3)
    for number in range(2):
        own = is_upper[found.labels == number]
        assert max(own.mean(), 1 - own.mean()) > 0.98


def test_two_scans_that_do_not_quite_fit(shared_data: Path) -> None:
    """10 mm apart, noise 0.5 mm, points 37 mm apart: nothing at all was found."""
    scene = surfsig.read(shared_data / "hard_scenes" / "surfaces_two_planes" / "two_planes.ply")
    found = surfsig.find_surfaces(scene)
    assert [surface.kind for surface in found] == ["plane", "plane"]
    assert [surface.rms for surface in found] == pytest.approx([5e-4, 5e-4], rel=0.1)
    assert found[0].distance_to(found[1], scene).value == pytest.approx(0.01, rel=0.01)
