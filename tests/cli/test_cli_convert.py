"""`surfsig convert`, and the options that all commands which read files share."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surfsig.files import read, write
from surfsig.point_cloud import PointCloud


@pytest.fixture(scope="module")
def millimetres(ball: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The ball, with its numbers in millimetres."""
    cloud = read(ball)
    path = tmp_path_factory.mktemp("millimetres") / "ball.ply"
    write(path, PointCloud(cloud.points * 1000, viewpoint=np.array([0, 0, -100]), fields=cloud.fields))
    return path


@pytest.mark.parametrize("extension", ["ply", "pcd", "npz", "parquet"])
def test_everything_is_kept(shell: Callable[..., Any], tmp_path: Path, extension: str) -> None:
    if extension == "parquet":
        pytest.importorskip("pyarrow")
    rng = np.random.default_rng(8)
    fields: dict[str, Any] = {name: rng.integers(0, 256, 6, np.uint8) for name in ("red", "green", "blue")}
    fields |= {"time": rng.normal(size=6), "label": rng.integers(0, 9, 6, np.uint16)}
    cloud = PointCloud(rng.normal(size=(6, 3)), viewpoint=np.array([1.5, 2, -3]), fields=fields, grid=(2, 3))
    write(tmp_path / "a.npz", cloud)
    out = tmp_path / f"b.{extension}"
    finished = shell("convert", tmp_path / "a.npz", out)
    assert (finished.code, finished.out, finished.err) == (0, "", "")
    again = read(out)
    np.testing.assert_array_equal(again.points, cloud.points)
    np.testing.assert_array_equal(again.viewpoint, [1.5, 2, -3])
    assert again.grid == (2, 3)
    assert list(again.fields) == list(fields)
    for name, values in fields.items():
        assert again.fields[name].dtype == values.dtype
        np.testing.assert_array_equal(again.fields[name], values)


def test_a_part_in_metres(shell: Callable[..., Any], millimetres: Path, tmp_path: Path) -> None:
    # The box is in the file's unit; the output, the viewpoint included, is in metres.
    box = "-100,-50,1500,100,50,1600"
    assert shell("convert", millimetres, tmp_path / "a.npz", "--unit", "mm", "--box", box).code == 0
    points, cloud = read(millimetres).points, read(tmp_path / "a.npz")
    chosen = (np.abs(points[:, 0]) <= 100) & (np.abs(points[:, 1]) <= 50) & (points[:, 2] <= 1600)
    assert 50 < chosen.sum() < 500
    np.testing.assert_array_equal(cloud.points, points[chosen] * 0.001)
    np.testing.assert_array_equal(cloud.fields["intensity"], np.flatnonzero(chosen))
    assert cloud.viewpoint is not None
    np.testing.assert_allclose(cloud.viewpoint, [0, 0, -0.1])


def test_extract_in_metres(shell: Callable[..., Any], millimetres: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.npz"
    arguments = ("--unit", "mm", "--radius", 0.05, "--at", "0,0,1.5", "-o", out)
    assert shell("extract", millimetres, *arguments).code == 0
    # A ball of radius 0.5 m: 2 per metre, 0.002 per millimetre.
    assert read(out).fields["k1"][0] == pytest.approx(2, rel=0.02)


def test_info_of_a_part_in_metres(shell: Callable[..., Any], millimetres: Path) -> None:
    values = json.loads(
        shell("info", millimetres, "--unit", "mm", "--box", "-9e9,-9e9,0,9e9,9e9,1700", "--json").out
    )
    assert values["points"] == int((read(millimetres).points[:, 2] <= 1700).sum())
    assert values["maximum"][2] == pytest.approx(1.7, abs=1e-3)
    assert 0.011 < values["spacing"] < 0.015


def test_compare_in_metres(shell: Callable[..., Any], millimetres: Path) -> None:
    places = ("--at", "0,0,1.5", "--at", "0.1,-0.1,1.5204")
    finished = shell("compare", millimetres, millimetres, *places, "--radius", 0.05, "--unit", "mm", "--json")
    values = json.loads(finished.out)
    assert values["a"]["k1"] == pytest.approx(2, rel=0.02)
    assert values["b"]["k2"] == pytest.approx(2, rel=0.02)
    assert values["zeta"] > 0.99


def test_options_reach_the_reader(
    shell: Callable[..., Any], ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}

    def remember(path: Path, **options: Any) -> PointCloud:
        asked.update(options)
        return PointCloud(np.zeros((1, 3)))

    monkeypatch.setattr("surfsig.files.read", remember)
    words = (
        "--columns",
        "x,y,z",
        "--scan",
        2,
        "--samples",
        70,
        "--intrinsics",
        "500,510,320,240.5",
        "--depth-scale",
        5000,
    )
    assert shell("convert", ball, tmp_path / "o.npz", *words).code == 0
    del asked["progress"]
    assert asked == {
        "unit": None,
        "box": None,
        "columns": "x,y,z",
        "scan": 2,
        "samples": 70,
        "intrinsics": [500, 510, 320, 240.5],
        "depth_scale": 5000,
    }


def test_columns_are_named_and_csv_is_written(shell: Callable[..., Any], tmp_path: Path) -> None:
    rows = np.random.default_rng(1).normal(size=(40, 7)).astype("<f4")
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    assert "columns=" in shell("convert", tmp_path / "a.bin", tmp_path / "a.csv").err
    words = ("--columns", "x,y,z,_,_,speed,_")
    assert shell("convert", tmp_path / "a.bin", tmp_path / "a.csv", *words).code == 0
    assert (tmp_path / "a.csv").read_text().startswith("x,y,z,speed\n")
    again = read(tmp_path / "a.csv")
    np.testing.assert_array_equal(again.points.astype(np.float32), rows[:, :3])
    np.testing.assert_array_equal(again.fields["speed"].astype(np.float32), rows[:, 5])
    finished = shell("convert", tmp_path / "a.csv", tmp_path / "b.ply", "--columns", "x,y,z")
    assert finished.code != 0
    assert "has 4 columns, and 'columns' names 3" in finished.err
