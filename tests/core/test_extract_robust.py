"""Outliers: found by their distance from the surface, and left out."""

import numpy as np
import pytest
from surface_points import Array

from surfsig import extract

SEED = 29
RADIUS, BALL = 100.0, 20.0


def sphere_with_outliers(share: float, noise: float = 0.1, count: int = 500) -> tuple[Array, Array]:
    """Two hundred caps of a sphere, far from each other, and outliers spread evenly over the balls."""
    rng = np.random.default_rng(SEED)
    places = np.zeros((200, 3))
    places[:, 0] = 10 * BALL * np.arange(len(places))
    clouds = []
    for place in places:
        radius, angle = BALL * np.sqrt(rng.random(count)), rng.random(count) * 2 * np.pi
        cap = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)])
        cap[:, 2] = np.sqrt(RADIUS**2 - radius**2) - RADIUS + rng.normal(0, noise, count)
        bad = rng.uniform(-BALL, BALL, (4 * count, 3))
        bad = bad[np.linalg.norm(bad, axis=1) < BALL][: int(share * count)]
        clouds.append(np.vstack([cap, bad]) + place)
    return np.concatenate(clouds), places


def test_a_tenth_of_outliers_hardly_changes_k1() -> None:
    clean, places = sphere_with_outliers(0.0)
    dirty, _ = sphere_with_outliers(0.1)
    far = [0, 0, 1e9]
    expected = np.median(extract(clean, BALL, at=places, viewpoint=far).k1)
    pulled = extract(dirty, BALL, at=places, viewpoint=far)
    robust = extract(dirty, BALL, at=places, viewpoint=far, robust=True)
    assert np.median(robust.k1) == pytest.approx(expected, rel=0.02)
    assert (abs(robust.k1 / expected - 1) < 0.2).mean() > 0.95
    assert abs(np.median(pulled.k1) / expected - 1) > 0.08
    assert np.median(robust.noise) == pytest.approx(0.1, rel=0.2)
    # The points that stay: the cap's, and those outliers that happen to be near it.
    assert np.median(robust.count) == pytest.approx(500, abs=15)


def test_without_outliers_little_is_left_out() -> None:
    clean, places = sphere_with_outliers(0.0)
    plain, robust = (extract(clean, BALL, at=places, robust=flag) for flag in (False, True))
    assert (robust.count / plain.count > 0.97).all()
    np.testing.assert_allclose(robust.mean_curvature, plain.mean_curvature, atol=6e-4)


def test_exact_points_all_stay() -> None:
    clean, places = sphere_with_outliers(0.0, noise=0.0)
    plain, robust = (extract(clean, BALL, at=places, robust=flag) for flag in (False, True))
    assert (robust.count >= 0.8 * plain.count).all()
    np.testing.assert_allclose(robust.k1, plain.k1, rtol=0.05)


def test_a_plane_of_exact_points_loses_its_outliers_to_the_last() -> None:
    rng = np.random.default_rng(SEED)
    plane = np.column_stack([rng.uniform(-1, 1, (900, 2)), np.zeros(900)])
    spikes = plane[:50] + np.array([0, 0, 0.3])
    s = extract(np.vstack([plane, spikes]), 0.5, at=np.arange(900), robust=True)
    inner = (abs(plane[:, :2]) < 0.5).all(axis=1)
    assert abs(s.k1[inner]).max() < 1e-4
    assert abs(s.normals[inner, 2]).min() > 1 - 1e-6


def test_the_same_bits_for_any_number_of_threads_and_with_neighbors() -> None:
    dirty, places = sphere_with_outliers(0.1)
    for options in ({"radius": BALL}, {"neighbors": 300}):
        one, many = (extract(dirty, **options, at=places, robust=True, threads=n) for n in (1, 3))
        np.testing.assert_array_equal(one.k1, many.k1)
        np.testing.assert_array_equal(one.count, many.count)
