import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surfsig.cli.spacing import median_spacing
from surfsig.files import write
from surfsig.point_cloud import PointCloud


def test_info_for_a_program(shell: Callable[..., Any], ball: Path) -> None:
    finished = shell("info", ball, "--json")
    assert (finished.code, finished.err) == (0, "")
    values = json.loads(finished.out)
    assert values["format"] == "PLY"
    assert values["points"] == values["finite_points"] == 9000
    assert values["viewpoint"] == [0, 0, 0]
    assert values["grid"] is None
    assert values["fields"] == {"intensity": "uint16", "nx": "float32"}
    assert values["coordinates"] == "float64"
    np.testing.assert_allclose(values["minimum"], [-0.5, -0.5, 1.5], atol=1e-3)
    np.testing.assert_allclose(values["maximum"], [0.5, 0.5, 2.0], atol=1e-3)
    # 9,000 points on half a sphere: 0.0132 between them if they stood on a square grid.
    assert 0.011 < values["spacing"] < 0.015


def test_info_for_a_person(shell: Callable[..., Any], ball: Path) -> None:
    finished = shell("info", ball)
    assert finished.code == 0
    for words in ("PLY, coordinates float64", "9,000", "intensity uint16", "0, 0, 0", "to the nearest point"):
        assert words in finished.out


def test_info_of_an_organised_cloud_with_gaps(shell: Callable[..., Any], tmp_path: Path) -> None:
    points = np.full((6, 3), np.nan, np.float32)
    points[1], points[4] = (0, 0, 1), (0, 3, 5)
    write(tmp_path / "a.npz", PointCloud(points, grid=(2, 3), fields={"h": np.zeros((6, 4))}))
    values = json.loads(shell("info", tmp_path / "a.npz", "--json").out)
    assert (values["points"], values["finite_points"], values["grid"]) == (6, 2, [2, 3])
    assert values["spacing"] == 5
    assert values["fields"] == {"h": "float64[4]"}
    text = shell("info", tmp_path / "a.npz").out
    assert "6 (4 not finite)" in text
    assert "2 rows of 3" in text


def test_info_of_nothing(shell: Callable[..., Any], tmp_path: Path) -> None:
    write(tmp_path / "a.ply", PointCloud(np.zeros((0, 3))))
    values = json.loads(shell("info", tmp_path / "a.ply", "--json").out)
    assert (values["points"], values["minimum"], values["spacing"]) == (0, None, None)
    assert shell("info", tmp_path / "a.ply").code == 0


@pytest.mark.parametrize("count", [2, 50, 3000])
def test_spacing_is_the_median_of_all_nearest_distances(count: int) -> None:
    points = np.random.default_rng(count).normal(size=(count, 3))
    # From all pairs, which only a small cloud allows.
    squares = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    np.fill_diagonal(squares, np.inf)
    nearest = np.sqrt(squares.min(axis=1))
    found = median_spacing(points)
    assert found is not None
    # Of 3,000 points 2,000 are sampled, so the median is a little off.
    assert found == pytest.approx(np.median(nearest), rel=1e-9 if count <= 2000 else 0.05)


def test_spacing_of_a_large_cloud() -> None:
    x, y = np.meshgrid(np.arange(800) * 0.25, np.arange(800) * 0.25)
    points = np.column_stack([x.ravel(), y.ravel(), np.sin(x.ravel())]).astype(np.float32)
    points[:1000] = np.random.default_rng(2).normal(size=(1000, 3)) * 1e6
    assert median_spacing(points) == pytest.approx(0.25, rel=1e-4)


def test_spacing_with_doubles_outliers_and_far_coordinates() -> None:
    grid = np.stack(np.meshgrid(np.arange(60), np.arange(60), [0]), axis=-1).reshape(-1, 3) * 0.25
    far = grid + np.array([500000, 4500000, 100])
    outliers = np.array([[1e6, 0, 0], [0, -1e9, 5]])
    assert median_spacing(np.concatenate([far, far, outliers])) == pytest.approx(0.25, rel=1e-6)
    assert median_spacing(np.ones((5, 3))) is None
    assert median_spacing(np.ones((1, 3))) is None
    assert median_spacing(np.array([[0, 0, 0], [0, 0, 0], [0, 0, 1e-3]])) == pytest.approx(1e-3)
