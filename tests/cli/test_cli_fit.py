"""`surfsig fit`: values for a program, words for a person, one line for what is wrong."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig
from surfsig import PointCloud


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sphere of radius 0.5 at (0, 0, 2) above the plane z = 0, with noise of 0.001."""
    rng = np.random.default_rng(31)
    ball = rng.normal(size=(2000, 3))
    ball *= (0.5 + 0.001 * rng.normal(size=(2000, 1))) / np.linalg.norm(ball, axis=1)[:, None]
    floor = np.column_stack([rng.uniform(-2, 2, (5000, 2)), 0.001 * rng.normal(size=5000)])
    path = tmp_path_factory.mktemp("fit") / "scan.ply"
    surfsig.write(path, PointCloud(np.concatenate([ball + np.array([0, 0, 2]), floor])))
    return path


def test_a_sphere_for_a_program(shell: Callable[..., Any], scan: Path) -> None:
    finished = shell("fit", "sphere", scan, "--near", "0,0,1.5", "--json")
    assert (finished.code, finished.err) == (0, "")
    values = json.loads(finished.out)
    expected = surfsig.fit_sphere(surfsig.read(scan), near=[0, 0, 1.5])
    assert values["kind"] == "sphere"
    assert values["radius"] == expected.radius == pytest.approx(0.5, abs=2e-4)
    assert values["radius_std"] == expected.radius_std
    assert values["interval"] == list(expected.interval)
    assert values["interval"][0] < 0.5 < values["interval"][1]
    assert values["center"] == pytest.approx([0, 0, 2], abs=2e-4)
    assert values["rms"] == pytest.approx(0.001, rel=0.05)
    assert values["points"] == 7000
    # Some are farther than 3 deviations, some alone in a gap.
    assert 1950 < values["count"] <= 2000
    np.testing.assert_array_equal(values["covariance"], expected.covariance)
    assert "axis" not in values


def test_a_sphere_for_a_person(shell: Callable[..., Any], scan: Path) -> None:
    out = shell("fit", "sphere", scan, "--near", "0,0,1.5", "--radius", 0.3).out
    shape = surfsig.fit_sphere(surfsig.read(scan), near=[0, 0, 1.5], radius=0.3)
    low, high = shape.interval
    assert (
        f"radius        {shape.radius:.6f} +- {shape.radius_std:.2g}, 95% interval {low:.6f} to {high:.6f}"
        in out
    )
    assert f"{shape.count:,} of 7,000" in out


def test_a_plane(shell: Callable[..., Any], scan: Path) -> None:
    values = json.loads(shell("fit", "plane", scan, "--near", "1,1,0", "--json").out)
    assert values["axis"] == pytest.approx([0, 0, 1], abs=1e-3)
    assert "radius" not in values
    assert "normal" in shell("fit", "plane", scan, "--near", "1,1,0").out
    # Without a place all points count, and in this box those are the floor's.
    boxed = json.loads(shell("fit", "plane", scan, "--box", "-2,-2,-1,2,2,1", "--json").out)
    assert boxed["count"] == 5000
    assert boxed["rms"] == pytest.approx(0.001, rel=0.05)


def test_a_cylinder(shell: Callable[..., Any], tmp_path: Path) -> None:
    rng = np.random.default_rng(32)
    turn = rng.uniform(0, np.pi, 900)
    points = np.column_stack([rng.uniform(-1, 1, 900), 20 * np.cos(turn), 20 * np.sin(turn)])
    points[:, 0] *= 30
    surfsig.write(tmp_path / "pipe.ply", PointCloud(points + rng.normal(0, 0.02, points.shape)))
    values = json.loads(shell("fit", "cylinder", tmp_path / "pipe.ply", "--unit", "mm", "--json").out)
    assert values["radius"] == pytest.approx(0.020, abs=2e-5)
    assert abs(values["axis"][0]) == pytest.approx(1, abs=1e-4)
    assert values["count"] == 900


def test_robust_leaves_out_strays(shell: Callable[..., Any], ball: Path, tmp_path: Path) -> None:
    points = surfsig.read(ball).points
    strays = np.random.default_rng(33).uniform([-0.4, -0.4, 1.5], [0.4, 0.4, 2.3], (300, 3))
    surfsig.write(tmp_path / "a.ply", PointCloud(np.concatenate([points, strays])))
    values = json.loads(shell("fit", "sphere", tmp_path / "a.ply", "--robust", "--json").out)
    assert values["radius"] == pytest.approx(0.5, abs=1e-6)
    assert values["count"] == 9000


@pytest.mark.parametrize("kind", ["cone", "torus", "circle", "line"])
def test_every_kind_has_a_command(shell: Callable[..., Any], tmp_path: Path, kind: str) -> None:
    turn, other = np.random.default_rng(34).uniform(0, 2 * np.pi, (2, 200))
    away = {
        "cone": 0.5 + 0.1 * other,
        "torus": 1 + 0.2 * np.cos(other),
        "circle": np.ones(200),
        "line": np.zeros(200),
    }
    height = {"cone": 0.1 * other, "torus": 0.2 * np.sin(other), "circle": 0 * turn, "line": turn}
    points = np.column_stack([away[kind] * np.cos(turn), away[kind] * np.sin(turn), height[kind]])
    surfsig.write(tmp_path / "a.ply", PointCloud(points))
    values = json.loads(shell("fit", kind, tmp_path / "a.ply", "--axis", "0,0,2", "--json").out)
    assert values["kind"] == kind
    assert values["axis"] == pytest.approx([0, 0, 1], abs=1e-12)
    assert values["form_error"] < 1e-6
    out = shell("fit", kind, tmp_path / "a.ply").out
    assert f"from the {kind}" in out
    assert ("half angle" in out) == (kind == "cone")
    assert ("major radius" in out) == (kind == "torus")


def test_a_radius_that_noise_hides_is_not_told(shell: Callable[..., Any], tmp_path: Path) -> None:
    rng = np.random.default_rng(35)
    turn = rng.uniform(-0.26, 0.26, 300)
    points = np.column_stack([np.cos(turn), np.sin(turn), rng.uniform(0, 1, 300)])
    surfsig.write(tmp_path / "a.ply", PointCloud(points + 0.1 * rng.normal(size=points.shape)))
    assert "not determined" in shell("fit", "cylinder", tmp_path / "a.ply").out
    values = json.loads(shell("fit", "cylinder", tmp_path / "a.ply", "--json").out)
    assert values["radius_determined"] is False
    assert values["interval"][1] is None
    assert "radius" not in values


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("sphere", "SCAN", "--near", "50,50,50", "--radius", 1), "scan.ply: near is 84.34 from"),
        (("plane", "SCAN", "--radius", 1), "give near, too"),
        (("sphere", "SCAN", "--near", "1,2"), "'1,2' is not three numbers"),
        (("egg", "SCAN"), "No such command 'egg'"),
        (("cone", "SCAN", "--criterion", "minimum_zone"), "No such option"),
        (("plane", "absent.ply"), "No such file"),
    ],
)
def test_what_is_wrong_is_one_line(
    shell: Callable[..., Any], scan: Path, options: tuple[object, ...], message: str
) -> None:
    finished = shell("fit", *[scan if option == "SCAN" else option for option in options])
    assert (finished.code, finished.out) == (2, "")
    assert finished.err.startswith("surfsig: error: ")
    assert finished.err.count("\n") == 1
    assert message in finished.err


def test_a_field_gives_the_weights(shell: Callable[..., Any], tmp_path: Path) -> None:
    rng = np.random.default_rng(32)
    points = np.column_stack([rng.uniform(-1, 1, (60, 2)), 0.01 * rng.normal(size=60)])
    weights = rng.uniform(0, 2, 60).astype(np.float32)
    path = tmp_path / "plate.ply"
    surfsig.write(path, PointCloud(points, fields={"trust": weights}))
    values = json.loads(shell("fit", "plane", path, "--weights", "trust", "--json").out)
    expected = surfsig.fit_plane(surfsig.read(path), weights=weights)
    np.testing.assert_array_equal(values["axis"], expected.axis)
    assert values["deviation"] == expected.deviation
    assert values["axis"] != json.loads(shell("fit", "plane", path, "--json").out)["axis"]
    finished = shell("fit", "plane", path, "--weights", "faith")
    assert finished.code != 0
    assert "no field is called 'faith': there are trust" in finished.err
