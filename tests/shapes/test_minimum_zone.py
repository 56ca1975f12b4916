"""Minimum zones beside slow references: every zone through its support points, and a fine search."""

import itertools
import math

import numpy as np
import pytest
from scipy.optimize import minimize
from surface_points import Array, rotation

from surfsig import InvalidInputError, fit_circle, fit_cylinder, fit_plane


def flatness_by_trial(points: Array) -> float:
    """Give the least width of all zones whose normal three points in a plane, or two edges, tell."""
    normals = []
    for a, b, c in itertools.combinations(points, 3):
        normals.append(np.cross(b - a, c - a))
    pairs = [b - a for a, b in itertools.combinations(points, 2)]
    for first, second in itertools.combinations(pairs, 2):
        normals.append(np.cross(first, second))
    directions = np.array(normals)
    lengths = np.linalg.norm(directions, axis=1)
    directions = directions[lengths > 1e-12] / lengths[lengths > 1e-12, None]
    return float(np.ptp(points @ directions.T, axis=0).min())


def test_flatness_is_the_least_width() -> None:
    rng = np.random.default_rng(71)
    for _ in range(5):
        points = np.column_stack([rng.uniform(-1, 1, (9, 2)), 0.02 * rng.normal(size=9)]) @ rotation(rng).T
        zone = fit_plane(points, criterion="minimum_zone")
        assert zone.form_error == pytest.approx(flatness_by_trial(points), rel=1e-9)
        assert zone.form_error <= fit_plane(points).form_error
        distances = zone.distances(points)
        assert distances.max() == pytest.approx(-distances.min(), rel=1e-9)


@pytest.mark.parametrize(("unit", "away"), [(1e-6, 0.0), (1.0, 1e6), (1e3, 0.0)])
def test_a_zone_moves_with_the_points(unit: float, away: float) -> None:
    rng = np.random.default_rng(72)
    points = np.column_stack([rng.uniform(-1, 1, (500, 2)), 0.02 * rng.normal(size=500)])
    turned = rotation(rng)
    here = fit_plane(points, criterion="minimum_zone")
    there = fit_plane(unit * points @ turned.T + away, criterion="minimum_zone")
    assert there.form_error == pytest.approx(unit * here.form_error, rel=1e-6)
    assert np.linalg.norm(np.cross(there.axis, turned @ here.axis)) < 1e-7


def test_roundness_is_the_least_ring() -> None:
    rng = np.random.default_rng(73)
    turn = rng.uniform(0, 2 * math.pi, 60)
    radii = 1 + 0.01 * np.cos(3 * turn) + 0.003 * rng.normal(size=60)
    flat = np.column_stack([radii * np.cos(turn), radii * np.sin(turn)])
    zone = fit_circle(np.column_stack([flat, np.zeros(60)]), criterion="minimum_zone")

    def width(x: Array) -> float:
        return float(np.ptp(np.linalg.norm(flat - x, axis=1)))

    searched = minimize(
        width, zone.center[:2] + 1e-3, method="Nelder-Mead", options={"xatol": 1e-12, "fatol": 1e-14}
    )
    assert zone.form_error <= searched.fun * (1 + 1e-9)
    assert zone.form_error < fit_circle(np.column_stack([flat, np.zeros(60)])).form_error


def test_cylindricity_is_no_more_than_of_least_squares() -> None:
    rng = np.random.default_rng(74)
    for _ in range(5):
        turn, height = rng.uniform(0, 2 * math.pi, 200), rng.uniform(-1, 1, 200)
        radii = 1 + rng.uniform(-0.01, 0.01, 200)
        points = np.column_stack([radii * np.cos(turn), radii * np.sin(turn), height])
        zone, fit = fit_cylinder(points, criterion="minimum_zone"), fit_cylinder(points)
        assert zone.form_error < fit.form_error
        # Uniform noise of a width of 0.02 cannot make a wider zone.
        assert zone.form_error < 0.02
        distances = zone.distances(points)
        assert distances.max() == pytest.approx(-distances.min(), rel=1e-6)
        # As many points bound a zone as it has parameters, and one.
        assert np.sum(np.abs(np.abs(distances) - 0.5 * zone.form_error) < 1e-9) >= 6


def test_a_zone_about_a_known_axis_keeps_it() -> None:
    rng = np.random.default_rng(75)
    points = np.column_stack([rng.uniform(-1, 1, (50, 2)), rng.uniform(-0.01, 0.01, 50)])
    zone = fit_plane(points, axis=[0, 0, 1], criterion="minimum_zone")
    assert zone.form_error == pytest.approx(np.ptp(points[:, 2]))
    np.testing.assert_array_equal(zone.axis, [0, 0, 1])
    assert np.isnan(zone.covariance).all()


def test_exact_points_have_a_zone_of_rounding() -> None:
    turn = np.linspace(0, 6, 30)
    points = np.column_stack([np.cos(turn), np.sin(turn), np.sin(5 * turn)])
    assert fit_cylinder(points, criterion="minimum_zone").form_error < 1e-12
    with pytest.raises(InvalidInputError, match="neither near"):
        fit_cylinder(points, near=points[0], criterion="minimum_zone")
