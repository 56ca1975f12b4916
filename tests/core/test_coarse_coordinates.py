"""Coordinates that are stored too coarsely for the radius: said, and no curvature."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import PointCloud, Status
from surfsig.resolution import number_step

UTM = np.array([389_000.0, 5_819_000.0, 40.0])


def sphere(radius: float = 0.5, count: int = 8000) -> NDArray[np.float64]:
    directions = np.random.default_rng(5).normal(size=(count, 3))
    return np.asarray(radius * directions / np.linalg.norm(directions, axis=1, keepdims=True))


def test_float32_at_utm_coordinates_is_said_and_has_no_curvature() -> None:
    points = (UTM + sphere()).astype(np.float32)
    for cloud in (points, points.astype(np.float64)):
        with pytest.warns(UserWarning, match=r"steps of 0\.5 \(float32.*8000 of 8000 places"):
            found = surfsig.extract(cloud, 0.08)
        assert (found.status == Status.TOO_COARSE).all()
        for values in (found.k1, found.k2, found.mean_curvature_std, found.residual, found.directions):
            assert np.isnan(values).all()
        assert not found.ok.any()


def test_the_same_surface_in_float64_or_with_an_origin_is_fine() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        whole = surfsig.extract(UTM + sphere(), 0.08)
        parts = surfsig.extract(PointCloud(sphere().astype(np.float32), UTM), 0.08)
    assert whole.ok.mean() > 0.99
    assert parts.ok.mean() > 0.99
    assert np.abs(np.median(np.abs(whole.mean_curvature)) - 2.0) < 0.05


def test_only_the_points_that_suffer_have_the_status() -> None:
    near, far = sphere(), UTM + sphere()
    points = np.concatenate([near, far]).astype(np.float32)
    with pytest.warns(UserWarning, match="8000 of 16000"):
        found = surfsig.extract(points, 0.08)
    assert (found.status[8000:] == Status.TOO_COARSE).all()
    np.testing.assert_array_equal(found.k1[:8000], surfsig.extract(near.astype(np.float32), 0.08).k1)


@pytest.mark.parametrize("step", [0.03, 0.06])
def test_terraces_of_rounded_heights_are_too_coarse(step: float) -> None:
    """Heights that were rounded to whole steps: flat terraces, on which curvature would be 0 +- 0."""
    rng = np.random.default_rng(6)
    flat = rng.uniform(-1, 1, (20_000, 2))
    height = step * np.round(0.3 * (flat**2).sum(axis=1) / step)
    with pytest.warns(UserWarning, match="steps of"):
        found = surfsig.extract(np.column_stack([flat, height]), 0.1)
    # Where the surface is steep, the steps are across it as much as along it, and standard errors show them.
    level = np.linalg.norm(flat, axis=1) < 0.5
    assert (found.status[level] == Status.TOO_COARSE).mean() > 0.9


def test_a_raster_and_scan_lines_are_not_coarse() -> None:
    """Columns and lines as far apart as a third of the radius, with heights in full precision."""
    x, y = np.meshgrid(np.arange(60) * 0.01, np.arange(60) * 0.01)
    raster = np.column_stack([x.ravel(), y.ravel(), 0.3 * (x.ravel() ** 2 + y.ravel() ** 2)])
    rng = np.random.default_rng(7)
    lines = np.column_stack([rng.uniform(0, 0.6, 9000), 0.01 * rng.integers(0, 60, 9000)])
    profile = np.column_stack([lines, 0.3 * (lines**2).sum(axis=1)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for points in (raster, profile):
            found = surfsig.extract(points, 0.03)
            assert (found.status != Status.TOO_COARSE).all()
            assert found.ok.mean() > 0.9


def test_steps_below_a_fifth_of_the_radius_are_fine() -> None:
    points = 0.01 * np.round(sphere() / 0.01)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert surfsig.extract(points, 0.1).ok.mean() > 0.99
    with pytest.warns(UserWarning, match=r"steps of 0\.01,"):
        assert not surfsig.extract(points, 0.03).ok.any()


def test_all_kinds_of_neighbourhood_say_it() -> None:
    points = (UTM + sphere()).astype(np.float32)
    for how in ({"radius": 0.08, "neighbors": 50}, {"radius": 0.08, "robust": True}, {"neighbors": 20}):
        with pytest.warns(UserWarning, match="too coarse"):
            found = surfsig.extract(points, **how)
        assert (found.status == Status.TOO_COARSE).mean() > 0.4
        assert not found.ok.any()
    with pytest.warns(UserWarning, match="too coarse"):
        several = surfsig.extract_radii(points, [0.08, 5.0])
    assert (several[0].status == Status.TOO_COARSE).all()
    assert (several[1].status != Status.TOO_COARSE).all()


def test_coarse_scans_that_are_registered_are_said() -> None:
    scan = (UTM + sphere(count=2000)).astype(np.float32)
    with pytest.warns(UserWarning, match="source: patches"):
        surfsig.register(scan, scan)


def test_surfaces_and_fits_say_that_the_surface_is_lost() -> None:
    scan = (UTM + sphere(count=2000)).astype(np.float32)
    with pytest.warns(UserWarning, match="steps of 0.5 .*larger than the distance between points"):
        surfsig.find_surfaces(scan)
    with pytest.warns(UserWarning, match="the surface is lost in them"):
        surfsig.fit_sphere(scan)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surfsig.find_surfaces(sphere(count=2000).astype(np.float32))
        assert surfsig.fit_sphere(UTM + sphere(count=2000)).radius == pytest.approx(0.5)


def test_the_step_of_float32_numbers() -> None:
    assert number_step(PointCloud((UTM + sphere()).astype(np.float32))) == 0.5
    assert number_step(PointCloud(UTM + sphere())) == 0.0


def test_odd_file_float32_utm(shared_data: Path, shell: Callable[..., Any], tmp_path: Path) -> None:
    file = shared_data / "odd_files" / "float32_utm" / "ball_utm_float32.ply"
    finished = shell("extract", file, "--radius", 0.08, "-o", tmp_path / "out.ply", "--json")
    assert finished.code == 0
    assert "surfsig: warning: coordinates come in steps of 0.5" in finished.err
    assert '"too_coarse": 8000' in finished.out


def test_points_at_one_place_are_not_too_coarse_for_patches_of_0() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surfsig.register(np.ones((50, 3)), np.ones((50, 3)))
