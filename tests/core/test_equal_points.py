"""Many points at the same place, and outliers among nearest neighbours: answered at once, and rightly."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig
from surfsig import Status


def places(count: int, copies: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Give places on a ball, each so many times, one copy after all others."""
    directions = np.random.default_rng(8).normal(size=(count, 3))
    return np.tile(0.5 * directions / np.linalg.norm(directions, axis=1, keepdims=True), (copies, 1))


def test_neighbors_among_copies_of_one_place_are_degenerate() -> None:
    found = surfsig.extract(places(2400, 25), neighbors=20)
    assert (found.status == Status.DEGENERATE).all()
    assert (found.count == 20).all()
    assert np.isnan(found.k1).all()


def test_copies_beyond_the_neighbors_change_nothing() -> None:
    """With 2 copies everywhere the 20 nearest are 10 places; a heap of 30,000 elsewhere is not among them."""
    surface = places(3000, 2)
    heap = np.zeros((30_000, 3))
    hybrid = {"neighbors": 20, "radius": 0.1}
    for how in ({"neighbors": 20}, hybrid, {**hybrid, "robust": True}):
        alone = surfsig.extract(surface, **how)
        beside = surfsig.extract(np.concatenate([heap, surface]), **how)
        # The lattice of nearest points follows from the whole cloud, and rounding with it.
        tolerance = 0.0 if "radius" in how else 5e-3
        np.testing.assert_allclose(alone.k1, beside.k1[len(heap) :], rtol=tolerance, atol=tolerance)
        np.testing.assert_array_equal(alone.count, beside.count[len(heap) :])
        assert (beside.status[: len(heap)] == Status.DEGENERATE).all()


def test_all_points_equal() -> None:
    for how in ({"neighbors": 20}, {"neighbors": 20, "radius": 1.0}, {"radius": 1.0}):
        found = surfsig.extract(np.full((5000, 3), 7.25, np.float32), **how)
        assert (found.status == Status.DEGENERATE).all()


def test_outliers_that_leave_are_not_looked_for_in_larger_balls() -> None:
    """A neighbourhood of k points that loses outliers has fewer: once its ball grew until none was found."""
    rng = np.random.default_rng(9)
    surface = places(4000, 1) * (1 + 1e-4 * rng.normal(size=(4000, 1)))
    surface[::20] *= 1.02
    found = surfsig.extract(surface, neighbors=40, robust=True)
    assert found.count.max() <= 40
    assert (found.count < 40).mean() > 0.5
    plain = surfsig.extract(surface, neighbors=40)
    inliers = np.arange(len(surface)) % 20 != 0
    errors = [np.median(np.abs(np.abs(result.mean_curvature[inliers]) - 2.0)) for result in (found, plain)]
    assert errors[0] < 0.3 * errors[1]


def test_a_warning_names_neighbors_and_no_radius(shell: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "copies.ply"
    surfsig.write(file, places(50, 25))
    finished = shell("extract", file, "--neighbors", 20, "-o", tmp_path / "out.ply", "-q")
    assert finished.code == 0
    assert "no point has a curvature; is the number of neighbors 20 right?" in finished.err
    assert "radius" not in finished.err


def test_odd_file_dup25(shared_data: Path) -> None:
    cloud = surfsig.read(shared_data / "odd_files" / "extract_duplicates_slow" / "dup25.ply")
    assert surfsig.extract(cloud, neighbors=20).status_counts() == {"degenerate": 7500}


@pytest.mark.parametrize("copies", [19, 20, 21])
def test_as_many_copies_as_neighbors(copies: int) -> None:
    found = surfsig.extract(places(200, copies), neighbors=20)
    assert (found.count == 20).all()
    assert (found.status == Status.DEGENERATE).all()
