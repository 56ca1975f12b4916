"""Keypoints: on what is distinctive, spread over the scan, as many as were asked for."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import surfsig
from surfsig import InvalidInputError

Array = NDArray[np.float64]

RADIUS = 0.2
VIEW = (2.0, 1.0, 5.0)


@functools.cache
def scan() -> Array:
    """A sheet of 4 x 2: flat for x below 2, with bumps of several shapes beyond."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0.0, 4.0, 40_000), rng.uniform(0.0, 2.0, 40_000)
    z = np.zeros_like(x)
    for _ in range(25):
        px, py = rng.uniform(2.2, 3.8), rng.uniform(0.1, 1.9)
        a, b = rng.uniform(60.0, 300.0, 2)
        z += rng.uniform(-0.15, 0.15) * np.exp(-a * (x - px) ** 2 - b * (y - py) ** 2)
    return np.column_stack([x, y, z])


def test_flat_places_come_last_and_are_not_left_out() -> None:
    found = surfsig.find_keypoints(scan(), RADIUS, spacing=RADIUS / 2, viewpoint=VIEW)
    bumpy = found.points[:, 0] > 2.0
    assert bumpy[: bumpy.sum() // 2].mean() > 0.9
    assert (~bumpy).sum() > 0.3 * len(found)


def test_spacing_is_kept_and_the_scan_is_covered() -> None:
    found = surfsig.find_keypoints(scan(), RADIUS, spacing=0.15, viewpoint=VIEW)
    tree = cKDTree(found.points)
    assert tree.query(found.points, k=2)[0][:, 1].min() >= 0.15
    # A candidate is as near as the spacing; every point has a candidate within a voxel's diagonal.
    assert tree.query(scan())[0].max() < 0.15 + np.sqrt(3.0) * RADIUS / 8


def test_the_number_is_kept_and_the_bumps_get_them_all_over() -> None:
    found = surfsig.find_keypoints(scan(), RADIUS, count=60, viewpoint=VIEW)
    assert len(found) == 60
    assert found.ok.all()
    assert found.indices is not None
    np.testing.assert_array_equal(found.points, scan()[found.indices])
    assert np.mean(found.points[:, 0] > 2.0 - RADIUS) > 0.9
    cells = np.unique((found.points[found.points[:, 0] > 2.0, :2] // 1.0).astype(int), axis=0)
    assert len(cells) == 4


def test_where_many_are_asked_for_flat_places_get_some_too() -> None:
    found = surfsig.find_keypoints(scan(), RADIUS, count=100_000, viewpoint=VIEW)
    assert np.mean(found.points[:, 0] < 2.0 - RADIUS) > 0.3


@pytest.mark.slow
def test_of_keypoints_more_matches_are_right_than_of_random_points() -> None:
    points = scan()
    rng = np.random.default_rng(2)
    noisy = points[rng.permutation(len(points))[:25_000]] + rng.normal(0.0, 5e-4, (25_000, 3))
    shares = []
    for pair in (
        [surfsig.find_keypoints(cloud, RADIUS, count=150, viewpoint=VIEW) for cloud in (points, noisy)],
        [
            surfsig.extract_field_signatures(
                cloud, RADIUS, at=rng.choice(len(cloud), 150, replace=False), viewpoint=VIEW
            )
            for cloud in (points, noisy)
        ],
    ):
        matches = surfsig.match_fields(pair[0], pair[1])
        apart = pair[0].points[matches.source] - pair[1].points[matches.target]
        shares.append(np.mean(np.linalg.norm(apart, axis=1) < 0.05))
    assert shares[0] > 1.5 * shares[1]


def test_threads_do_not_matter() -> None:
    one, two = (surfsig.find_keypoints(scan(), RADIUS, count=60, viewpoint=VIEW, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.indices, two.indices)
    np.testing.assert_array_equal(one.vectors, two.vectors)
    matches = [surfsig.match_fields(one, two, threads=n) for n in (1, 2)]
    np.testing.assert_array_equal(matches[0].poses, matches[1].poses)


def test_nothing_is_chosen_of_nothing() -> None:
    assert len(surfsig.find_keypoints(np.zeros((0, 3)), RADIUS)) == 0


def test_count_and_spacing_exclude_each_other() -> None:
    with pytest.raises(InvalidInputError, match="exclude"):
        surfsig.find_keypoints(scan(), RADIUS, count=3, spacing=0.1)
    with pytest.raises(InvalidInputError, match="count must be"):
        surfsig.find_keypoints(scan(), RADIUS, count=0)
