"""Dense scans: sums of whole cells come from trees, and the results are those of the points themselves."""

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_points import Array

from surfsig import Extraction, extract

SEED, RADIUS = 53, 0.1
COLUMNS = ("k1", "k2", "normals", "residual", "k1_std", "count", "status")


def surface(count: int, noise: float = 1e-3, size: float = 1.0) -> Array:
    rng = np.random.default_rng(SEED)
    xy = rng.uniform(0, size, (count, 2))
    z = 0.05 * np.sin(7 * xy[:, 0]) * np.cos(5 * xy[:, 1]) + rng.normal(0, noise, count)
    return np.column_stack([xy, z])


def volume(count: int) -> Array:
    return np.random.default_rng(SEED).uniform(0, 0.3, (count, 3))


def clusters(count: int) -> Array:
    rng = np.random.default_rng(SEED)
    centres = rng.uniform(0, 1, (20, 3)) * [1, 1, 0.02]
    return centres[rng.integers(0, 20, count)] + rng.normal(0, 0.02, (count, 3)) * [1, 1, 0.1]


def twice(count: int) -> Array:
    points = surface(count // 2)
    return np.concatenate([points, points])


CLOUDS = {"surface": surface, "volume": volume, "clusters": clusters, "duplicates": twice}


def assert_as_direct(points: NDArray[np.floating], radius: float, fit: str = "paraboloid") -> None:
    """Compare results, most of which come from trees, with those of the nearest 2^31 of the ball's points."""
    whole = extract(points, radius, fit=fit)  # type: ignore[arg-type]
    at = np.random.default_rng(SEED).choice(len(points), 150, replace=False)
    alone = extract(points, radius, neighbors=2**31, at=at, fit=fit)  # type: ignore[arg-type]
    assert np.median(alone.count) > 800
    np.testing.assert_array_equal(whole.count[at], alone.count)
    settled = alone.ok & whole.ok[at]
    assert (alone.ok == whole.ok[at]).mean() > 0.97
    for name in ("k1", "k2"):
        direct, found = getattr(alone, name)[settled], getattr(whole, name)[at][settled]
        limit = 1e-5 * np.maximum(abs(direct), 1 / radius)
        assert (abs(found - direct) <= limit).all()
    assert (alone.k1 == whole.k1[at]).mean() < 0.9, "nothing came from a tree"


@pytest.mark.parametrize("utm", [False, True])
@pytest.mark.parametrize("kind", CLOUDS)
def test_as_the_direct_sum(kind: str, utm: bool) -> None:
    points = CLOUDS[kind](60_000) + (np.array([5e5, 4.5e6, 100]) if utm else 0)
    assert_as_direct(points, RADIUS)


def test_as_the_direct_sum_at_ten_thousand_neighbours() -> None:
    assert_as_direct(surface(80_000, size=0.5), RADIUS)


def test_as_the_direct_sum_where_there_is_no_noise_and_with_quadrics() -> None:
    assert_as_direct(surface(60_000, noise=0.0), RADIUS)
    assert_as_direct(surface(60_000), RADIUS, fit="quadric")


def test_points_of_a_grid_that_lie_on_the_sphere_are_counted() -> None:
    step = RADIUS / 25
    x, y = np.meshgrid(np.arange(150), np.arange(150))
    grid = np.column_stack([x.ravel() * step, y.ravel() * step, np.zeros(x.size)])
    within = sum(i * i + j * j <= 25 * 25 for i in range(-25, 26) for j in range(-25, 26))
    for origin in ([0, 0, 0], [5e5, 4.5e6, 100]):
        s = extract(grid + origin, RADIUS)
        inner = ((x > 26) & (x < 123) & (y > 26) & (y < 123)).ravel()
        assert (s.count[inner] == within).all()


def assert_same_bits(a: Extraction, b: Extraction, of: NDArray[np.int64]) -> None:
    for name in COLUMNS:
        assert getattr(a, name)[of].tobytes() == getattr(b, name).tobytes(), name


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_same_bits_for_any_number_of_threads(dtype: type) -> None:
    points: NDArray[np.floating] = surface(60_000).astype(dtype)
    one = extract(points, RADIUS, threads=1)
    for threads in (2, 8):
        assert_same_bits(one, extract(points, RADIUS, threads=threads), np.arange(len(points)))


@pytest.mark.parametrize("offset", [[0.0, 0.0, 0.0], [500_000.0, 4_500_000.0, 100.0]])
def test_a_tile_with_a_margin_of_one_radius_has_the_bits_of_the_whole(offset: list[float]) -> None:
    points = surface(80_000) + offset
    whole = extract(points, RADIUS)
    x = points[:, 0] - offset[0]
    for low, high in ((0.0, 0.37), (0.37, 0.81), (0.81, 1.0)):
        kept = np.flatnonzero((x > low - 1.001 * RADIUS) & (x < high + 1.001 * RADIUS))
        tile = extract(points[kept], RADIUS)
        inner = (x[kept] >= low) & (x[kept] < high)
        for name in COLUMNS:
            expected = getattr(whole, name)[kept[inner]]
            assert getattr(tile, name)[inner].tobytes() == expected.tobytes(), name


def test_some_places_have_the_bits_of_all() -> None:
    points, at = surface(60_000), np.arange(0, 60_000, 777)
    assert_same_bits(extract(points, RADIUS), extract(points, RADIUS, at=at), at)


def test_an_outlier_a_million_metres_away_changes_no_bit() -> None:
    points = surface(40_000)
    whole = extract(points, RADIUS)
    more = extract(np.vstack([points, [1e6, -1e6, 1e6]]), RADIUS)
    assert_same_bits(more, whole, np.arange(len(points)))
