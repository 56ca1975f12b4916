"""Numbers for people: the digits that the standard error asks for."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig
from surfsig.digits import position_text, rounded, with_error


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (389000.123172, 0.00012, "389000.12317 +- 0.00012"),
        (5819000.456, 0.05, "5819000.456 +- 0.05"),
        (0.5, 0.001, "0.5000 +- 0.001"),
        (-0.000096, 9.1e-05, "-0.000096 +- 9.1e-05"),
        (1234.5, 30.0, "1234 +- 30"),
        (1e-7, 2e-9, "0.0000001000 +- 2e-09"),
        (2.0, 0.0, "2 +- 0"),
        (5819000.25, 1e-20, "5819000.2500000 +- 1e-20"),
        (np.nan, np.nan, "nan +- nan"),
    ],
)
def test_a_value_has_the_digits_of_its_error(value: float, error: float, text: str) -> None:
    assert with_error(value, error) == text
    assert float(rounded(value, error)) == pytest.approx(value, abs=max(error, 1e-6), nan_ok=True)


def test_positions_keep_what_counts_at_utm() -> None:
    assert position_text([389000.123456, 5819000.4, 40.789]) == "389000.123456, 5819000.4, 40.789"
    assert position_text([0.1, 0.25, -3.0], ",") == "0.1,0.25,-3"
    assert position_text([0.0, 0.0, 0.0]) == "0, 0, 0"


def sphere_at(center: list[float]) -> Any:
    rng = np.random.default_rng(11)
    directions = rng.normal(size=(600, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return center + (0.5 + 0.0005 * rng.normal(size=(600, 1))) * directions


def test_fit_prints_centers_at_utm(shell: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "ball.ply"
    surfsig.write(file, sphere_at([389000.123, 5819000.456, 40.789]))
    out = shell("fit", "sphere", file).out
    line = next(line for line in out.splitlines() if line.startswith("center"))
    values = [part.split(" +- ") for part in line.removeprefix("center").split(",")]
    for (value, error), truth in zip(values, [389000.123, 5819000.456, 40.789], strict=True):
        assert abs(float(value) - truth) < 6 * float(error) < 1e-3
        assert len(value.strip().partition(".")[2]) >= 5


def test_odd_files_fit_center_digits(shared_data: Path, shell: Callable[..., Any]) -> None:
    folder = shared_data / "odd_files" / "fit_center_digits"
    ball = shell("fit", "sphere", folder / "ball_utm.xyz").out
    pipe = shell("fit", "cylinder", folder / "pipe_utm.xyz").out
    for out in (ball, pipe):
        assert "center        389000.12" in out
        assert "5819000.45" in out or "5819000.46" in out
        assert "e+0" not in out


def test_near_that_no_surface_reaches_is_refused(shell: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "ball.ply"
    surfsig.write(file, sphere_at([0.0, 0.0, 2.0]))
    finished = shell("fit", "sphere", file, "--near", "389000,5819000,40")
    assert finished.code == 2
    assert "from the nearest point, farther than the cloud's extent" in finished.err
    assert "389000, 5819000, 40" in finished.err
    with pytest.raises(surfsig.InvalidInputError, match="no point is within the radius"):
        surfsig.fit_sphere(surfsig.read(file), near=[0, 0, 1.0], radius=0.1)
    assert surfsig.fit_sphere(surfsig.read(file), near=[0, 0, 1.4]).radius == pytest.approx(0.5, abs=1e-3)


def test_found_instances_have_the_digits_of_their_errors() -> None:
    from surfsig.finding.instances import Instance, Instances

    pose = np.eye(4)
    pose[:3, 3] = [389000.123456, 5819000.654321, 40.5]
    covariance = np.diag([1e-6] * 3 + [1e-8, 4e-8, 1e-4])
    instance = Instance(
        name="cup",
        T_scene_model=pose,
        covariance=covariance,
        center=pose[:3, 3],
        score=0.5,
        measures={},
        visible=0.5,
        overlap=0.5,
        rms=0.001,
        free_directions=[],
        alternatives=[],
        scale=1.0,
        scale_standard_error=0.01,
        doubts=[],
        reasons=[],
        indices=np.arange(3),
    )
    found = Instances([instance], surfsig.PointCloud(np.zeros((3, 3))), {})
    header, rows = found.table()
    assert rows[0][header.index("at")] == "389000.12346 5819000.65432 40.500"


def test_compare_prints_curvatures_with_their_errors(shell: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "ball.ply"
    surfsig.write(file, sphere_at([389000.0, 5819000.0, 40.0]))
    at = "389000,5819000,40.5"
    out = shell("compare", file, file, "--at", at, "--at", at, "--radius", 0.25).out
    assert "at 389000, 5819000, 40.5" in out
    there = surfsig.extract(surfsig.read(file), 0.25, at=[[389000.0, 5819000.0, 40.5]])
    assert f"k1 {with_error(float(there.k1[0]), float(there.k1_std[0]))}" in out
