"""Balls of several radii in one pass, and radii that points choose."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from surface_points import UTM, Array

from surfsig import Extraction, InvalidInputError, PointCloud, extract, extract_radii, read, write

SEED = 61
RADII = (0.05, 0.02, 0.03, 0.0125, 0.003)


def bumps(count: int, noise: float = 5e-4, size: float = 0.5) -> Array:
    rng = np.random.default_rng(SEED)
    x, y = rng.uniform(0, size, (2, count))
    z = 0.05 * np.sin(7 * x) * np.cos(9 * y) + rng.normal(0, noise, count)
    return np.column_stack([x, y, z])


def assert_same(found: Extraction, alone: Extraction, radius: float) -> None:
    assert found.radius == alone.radius == radius
    # A point whose distance is the radius within the last bits of float32 may count in one of them only.
    same = found.count == alone.count
    assert same.mean() > 0.999
    assert (found.status == alone.status).mean() > 0.995
    settled = found.ok & alone.ok & same
    for name in ("k1", "k2"):
        a, b = getattr(found, name)[settled], getattr(alone, name)[settled]
        limit = 1e-5 * np.maximum(abs(b), 1 / radius)
        # Of few points, rounding may be amplified; beside the noise it stays nothing.
        limit += 1e-3 * np.nan_to_num(getattr(alone, name + "_std")[settled])
        assert (abs(a - b) <= limit).all()


@pytest.mark.parametrize("fit", ["paraboloid", "quadric"])
@pytest.mark.parametrize("where", [np.zeros(3), UTM], ids=["here", "UTM"])
def test_several_radii_are_each_as_one_alone(where: Array, fit: str) -> None:
    points = bumps(20_000) + where
    for radius, found in zip(RADII, extract_radii(points, RADII, fit=fit), strict=True):  # type: ignore[arg-type]
        assert_same(found, extract(points, radius, fit=fit), radius)  # type: ignore[arg-type]


def test_dense_places_have_the_same_values() -> None:
    # In the middle a ball of 0.05 holds some 10,000 points, outside 300.
    points = np.concatenate([bumps(20_000), 0.2 + 0.2 * bumps(60_000)[:, :3]])
    points[:, 2] = 0.05 * np.sin(7 * points[:, 0])
    points[:, 2] += np.random.default_rng(SEED).normal(0, 5e-4, len(points))
    radii = (0.05, 0.025)
    for radius, found in zip(radii, extract_radii(points, radii), strict=True):
        assert found.count.max() > 20 * found.count.min()
        assert_same(found, extract(points, radius), radius)


def test_radii_with_robust_and_at_and_twice() -> None:
    points = bumps(5_000)
    points[::40, 2] += 0.01
    at = np.arange(0, 5000, 7)
    twice, small, again = extract_radii(points, [0.05, 0.03, 0.05], robust=True, at=at)
    np.testing.assert_array_equal(twice.k1, again.k1)
    alone = extract(points, 0.05, robust=True, at=at)
    np.testing.assert_array_equal(twice.k1, alone.k1)
    assert small.radius == 0.03
    assert extract_radii(points, []) == []


def test_progress_counts_every_ball() -> None:
    seen: list[tuple[int, int]] = []
    extract_radii(bumps(5_000), [0.05, 0.03], progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (10_000, 10_000)
    # Of a dense cloud each radius has a pass of its own.
    extract_radii(bumps(60_000), [0.05, 0.03], progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (120_000, 120_000)


@pytest.mark.parametrize(
    ("radii", "text"),
    [([0.1, 0], "above 0"), (["x"], "finite number"), ("auto", "some numbers"), (0.1, "some numbers")],
)
def test_bad_radii(radii: list[float], text: str) -> None:
    with pytest.raises(InvalidInputError, match=text):
        extract_radii(bumps(100), radii)


def sphere(radius: float, count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(SEED)
    z, turn = rng.uniform(0, 1, count), rng.uniform(0, 2 * np.pi, count)
    normals = np.column_stack([np.sqrt(1 - z * z) * [np.cos(turn), np.sin(turn)]]).T
    return radius * np.column_stack([normals, z]), np.column_stack([normals, z])


@pytest.mark.parametrize("noise", [0.02, 0.1, 0.3])
def test_a_chosen_radius_errs_hardly_more_than_the_best_fixed_one(noise: float) -> None:
    points, normals = sphere(30, 24_000)
    points += normals * np.random.default_rng(SEED).normal(0, noise, (len(points), 1))
    inner = np.flatnonzero(points[:, 2] > 12)[::5]

    def error(s: Extraction) -> float:
        return float(np.sqrt(np.mean((s.mean_curvature - 1 / 30) ** 2)))

    fixed = extract_radii(points, [2 ** (i / 2) for i in range(2, 9)], at=inner, normals=normals)
    chosen = extract(points, "auto", at=inner, normals=normals)
    best = min(error(s) for s in fixed)
    assert error(chosen) < 2 * best
    assert max(error(s) for s in fixed) > 10 * best


def test_chosen_radii_are_powers_and_reported() -> None:
    s = extract(bumps(5_000), "auto")
    assert isinstance(s.radius, np.ndarray)
    steps = 2 * np.log2(s.radius.astype(np.float64))
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-5)
    assert s.count.min() >= 16
    assert "radius" in s.columns()


@pytest.mark.slow
def test_balls_stop_at_an_edge_and_at_the_other_side_of_a_plate() -> None:
    rng = np.random.default_rng(SEED)
    xy = rng.uniform(-10, 10, (20_000, 2))
    roof = np.column_stack([xy, -0.4 * abs(xy[:, 0]) + rng.normal(0, 0.02, len(xy))])
    s = extract(roof, "auto")
    distance = abs(xy[:, 0])
    inner = (distance > 1) & (abs(xy) < 6).all(axis=1)
    # A ball may reach over the edge a little: until it shows.
    radius = np.asarray(s.radius)
    assert (radius[inner] < 2 * distance[inner]).mean() > 0.98
    assert np.median(radius[inner]) > 0.4 * np.median(distance[inner])
    plate = np.column_stack([xy, 1.0 * (rng.uniform(size=len(xy)) < 0.5) + rng.normal(0, 0.01, len(xy))])
    s = extract(plate, "auto")
    assert (np.asarray(s.radius) <= 1.001).mean() > 0.995


@pytest.mark.slow
def test_a_chosen_radius_does_not_depend_on_threads_scale_or_what_is_far_away() -> None:
    points = bumps(15_000)
    s = extract(points, "auto", threads=1)
    np.testing.assert_array_equal(s.k1, extract(points, "auto", threads=3).k1)
    twice = extract(4 * points, "auto")
    np.testing.assert_array_equal(twice.radius, 4 * np.asarray(s.radius))
    np.testing.assert_array_equal(twice.k1, s.k1 / 4)
    # A tile with a halo of the largest radius.
    largest = float(np.max(s.radius))
    tile = np.flatnonzero((abs(points[:, :2] - 0.25) < 0.1 + 1.001 * largest).all(axis=1))
    core = (abs(points[tile, :2] - 0.25) < 0.1).all(axis=1)
    part = extract(points[tile], "auto")
    np.testing.assert_array_equal(part.k1[core], s.k1[tile][core])
    np.testing.assert_array_equal(np.asarray(part.radius)[core], np.asarray(s.radius)[tile][core])


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.zeros((1, 3)),
        np.zeros((50, 3)),
        np.full((20, 3), np.nan),
        np.column_stack([np.arange(40.0), np.zeros((40, 2))]),
        np.array([[0, 0, 0], [1e6, 0, 0], [0, 1, 0.0]]),
    ],
    ids=["empty", "one", "equal", "nan", "line", "outlier"],
)
def test_no_surface_is_no_curvature(points: Array) -> None:
    s = extract(points, "auto")
    assert len(s) == len(points)
    assert np.isnan(s.k1).all()
    assert not s.ok.any()


def test_an_outlier_far_away_changes_nothing() -> None:
    points = bumps(5_000)
    s = extract(points, "auto")
    with_outlier = extract(np.concatenate([points, [[1e6, 0, 0]]]), "auto")
    np.testing.assert_array_equal(with_outlier.k1[:-1], s.k1)
    assert np.isnan(with_outlier.k1[-1])


def test_what_goes_with_auto() -> None:
    points = bumps(500)
    for options, text in (
        ({"neighbors": 20}, "exclude each other"),
        ({"axes": "sensor"}, "standard errors"),
    ):
        with pytest.raises(InvalidInputError, match=text):
            extract(points, "auto", **options)
    with pytest.raises(InvalidInputError, match="number or 'auto'"):
        extract(points, "automatic")  # type: ignore[arg-type]
    quadric = extract(points, "auto", fit="auto")
    assert quadric.fit_used is not None
    assert quadric.ok.mean() > 0.9


def test_shell(tmp_path: Path) -> None:
    points = bumps(3_000)
    write(tmp_path / "a.ply", PointCloud(points))
    command = [sys.executable, "-m", "surfsig.cli", "extract", f"{tmp_path}/a.ply", "-o", f"{tmp_path}/b.ply"]
    run = subprocess.run([*command, "--radius", "auto", "--json"], capture_output=True, text=True, check=True)
    assert json.loads(run.stdout)["radius"] == "auto"
    fields = read(tmp_path / "b.ply").fields
    s = extract(points, "auto")
    np.testing.assert_array_equal(fields["radius"], np.asarray(s.radius))
    np.testing.assert_array_equal(fields["k1"], s.k1)
    bad = subprocess.run([*command, "--radius", "big"], capture_output=True, text=True)
    assert bad.returncode == 2
    assert "auto" in bad.stderr
