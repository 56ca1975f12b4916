import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig
from surfsig.files import read, write
from surfsig.point_cloud import PointCloud

RADIUS = 0.05
COLUMNS = [
    *("k1", "k2", "gaussian_curvature", "mean_curvature", "nx", "ny", "nz"),
    *("direction_x", "direction_y", "direction_z", "mean_curvature_std", "k1_std", "k2_std", "noise"),
    *("residual", "condition", "count", "status"),
    *("linearity", "planarity", "scattering"),
]


def test_curvature_of_a_ball(shell: Callable[..., Any], ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.ply"
    finished = shell("extract", ball, "--radius", RADIUS, "-o", out, "--json")
    assert (finished.code, finished.err) == (0, "")
    cloud = read(out)
    assert list(cloud.fields) == ["intensity", *COLUMNS, "input_nx"]
    np.testing.assert_array_equal(cloud.points, read(ball).points)
    np.testing.assert_array_equal(cloud.fields["intensity"], np.arange(9000))
    np.testing.assert_array_equal(cloud.fields["input_nx"], np.full(9000, 7))
    inner = (cloud.fields["status"] == 0) & (cloud.points[:, 2] < 1.7)
    assert inner.sum() > 3500
    # A bump seen from the sensor: positive, 1 / 0.5 per metre.
    assert np.median(cloud.fields["k1"][inner]) == pytest.approx(2, rel=0.02)
    assert np.median(cloud.fields["gaussian_curvature"][inner]) == pytest.approx(4, rel=0.04)
    normals = np.column_stack([cloud.fields[name] for name in ("nx", "ny", "nz")])
    outward = (cloud.points - [0, 0, 2]) / 0.5
    assert np.median((normals * outward).sum(axis=1)[inner]) > 0.999

    summary = json.loads(finished.out)
    assert summary["points"] == 9000
    assert sum(summary["status"].values()) == 9000
    assert summary["status"]["ok"] == int((cloud.fields["status"] == 0).sum())
    assert summary["k1"]["p50"] == pytest.approx(float(np.nanmedian(cloud.fields["k1"])), rel=1e-5)
    assert (summary["radius"], summary["axes"], summary["signatures"]) == (RADIUS, "surface", False)
    assert set(summary["seconds"]) == {"read", "extract", "write"}
    assert summary["points_per_second"] > 0


@pytest.mark.parametrize("extension", ["ply", "pcd", "npz", "parquet"])
def test_signatures_are_those_of_python(
    shell: Callable[..., Any], ball: Path, tmp_path: Path, extension: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if extension == "parquet":
        pytest.importorskip("pyarrow")
    monkeypatch.setattr("surfsig.defaults.SIGNATURE_BLOCK", 1000)
    out = tmp_path / f"out.{extension}"
    arguments = ("--radius", RADIUS, "--signatures", "--axes", "sensor", "--threads", 2)
    assert shell("extract", ball, *arguments, "-o", out).code == 0
    fields = read(out).fields
    if extension == "ply":
        written = np.column_stack([fields[f"signature_{i}"] for i in range(242)])
    else:
        written = fields["signature"]
    result = surfsig.extract(read(ball), RADIUS, axes="sensor")
    expected, status = result.signatures(return_status=True)
    np.testing.assert_array_equal(written, expected)
    np.testing.assert_array_equal(fields["status"], status)
    assert np.isfinite(written).any()


def test_at_positions(shell: Callable[..., Any], ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.npz"
    finished = shell(
        "extract", ball, "--radius", RADIUS, "--at", "0,0,1.5", "--at", "0.1,-0.1,1.52", "-o", out
    )
    assert (finished.code, finished.out, finished.err) == (0, "", "")
    cloud = read(out)
    np.testing.assert_allclose(cloud.points, [[0, 0, 1.5], [0.1, -0.1, 1.52]])
    assert "intensity" not in cloud.fields
    assert cloud.fields["k1"][0] == pytest.approx(2, rel=0.02)


def test_voxel_and_viewpoint(shell: Callable[..., Any], ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.npz"
    arguments = ("--radius", RADIUS, "--voxel", 0.1, "--viewpoint", "0,0,2", "-o", out)
    assert shell("extract", ball, *arguments).code == 0
    cloud = read(out)
    assert 50 < len(cloud) < 1000
    # From the centre the same surface is hollow.
    inner = (cloud.fields["status"] == 0) & (cloud.points[:, 2] < 1.7)
    assert np.median(cloud.fields["k2"][inner]) == pytest.approx(-2, rel=0.05)


LINE = np.outer(np.arange(50.0), [1, 2, 3])


@pytest.mark.parametrize(
    ("points", "radius", "status"),
    [
        (np.zeros((1, 3)), 1, {"too_few_points": 1}),
        (np.ones((30, 3)), 1, {"degenerate": 30}),
        (LINE, 20, {"degenerate": 50}),
        (LINE, 1e-6, {"too_few_points": 50}),
        (np.array([[np.nan] * 3, [np.inf, 0, 0], [0, 0, 0]]), 1, {"not_finite": 2, "too_few_points": 1}),
    ],
)
def test_points_without_a_curvature(
    shell: Callable[..., Any], tmp_path: Path, points: Any, radius: float, status: dict[str, int]
) -> None:
    np.save(tmp_path / "a.npy", points)
    finished = shell("extract", tmp_path / "a.npy", "--radius", radius, "-o", tmp_path / "o.ply", "--json")
    assert finished.code == 0
    summary = json.loads(finished.out)
    assert {name: count for name, count in summary["status"].items() if count} == status
    assert summary["k1"] == {"p05": None, "p50": None, "p95": None}
    assert finished.err.startswith("surfsig: warning: ")
    assert f"no point has a curvature; is the radius {radius:g} right?" in finished.err
    assert np.isnan(read(tmp_path / "o.ply").fields["k1"]).all()


def test_no_points_at_all(shell: Callable[..., Any], tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros((0, 3)))
    finished = shell("extract", tmp_path / "a.npy", "--radius", 1, "--signatures", "-o", tmp_path / "o.ply")
    assert (finished.code, finished.err) == (0, "")
    assert len(read(tmp_path / "o.ply")) == 0


def test_far_coordinates_and_an_outlier_change_nothing(
    shell: Callable[..., Any], ball: Path, tmp_path: Path
) -> None:
    points = np.round(read(ball).points * 2**16) / 2**16
    far = np.concatenate([points + np.array([1e7, 1e7, 0]), [[0, 1e6, 0]]])
    found = []
    for name, cloud, viewpoint in (("near", points, "0,0,0"), ("far", far, "1e7,1e7,0")):
        np.save(tmp_path / f"{name}.npy", cloud)
        arguments = (tmp_path / f"{name}.npy", "--radius", RADIUS, "--viewpoint", viewpoint)
        assert shell("extract", *arguments, "-o", tmp_path / f"{name}.ply").code == 0
        found.append(read(tmp_path / f"{name}.ply").fields["k1"][: len(points)])
    np.testing.assert_allclose(found[0], found[1], atol=1e-3)


def test_the_input_may_be_the_output(shell: Callable[..., Any], ball: Path, tmp_path: Path) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(ball.read_bytes())
    assert shell("extract", path, "--radius", RADIUS, "-o", path).code == 0
    assert "k1" in read(path).fields


def test_nothing_is_shown_in_a_pipe(ball: Path, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "surfsig.cli",
        "extract",
        ball,
        "--radius",
        str(RADIUS),
        "-o",
        tmp_path / "o.ply",
    ]
    finished = subprocess.run([str(word) for word in command], capture_output=True, check=True)
    assert (finished.stdout, finished.stderr) == (b"", b"")


IN_A_SHELL = """
import runpy, signal
# Whoever started the tests may ignore Ctrl-C, and children do as their parents.
signal.signal(signal.SIGINT, signal.default_int_handler)
runpy.run_module("surfsig.cli", run_name="__main__", alter_sys=True)
"""


def start_on_terminal(*arguments: object) -> tuple[subprocess.Popen[bytes], int]:
    """Start a command whose stderr is a terminal; give it and the other end of the terminal."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "100"}
    command = [sys.executable, "-c", IN_A_SHELL, *(str(argument) for argument in arguments)]
    process = subprocess.Popen(command, stderr=theirs, stdout=subprocess.PIPE, env=environment)
    os.close(theirs)
    return process, ours


def read_terminal(end: int, until: bytes | None = None) -> bytes:
    """Read until the words appear or the program closes the terminal."""
    text = b""
    while until is None or until not in text:
        try:
            data = os.read(end, 4096)
        except OSError:
            break
        if not data:
            break
        text += data
    return text


def test_bar_and_table_on_a_terminal(ball: Path, tmp_path: Path) -> None:
    process, end = start_on_terminal("extract", ball, "--radius", RADIUS, "-o", tmp_path / "o.ply")
    shown = read_terminal(end).decode()
    assert process.wait() == 0
    for words in ("extracting", "100%", "ok", "9,000", "k1 per unit", "points/s"):
        assert words in shown
    process, end = start_on_terminal("extract", ball, "--radius", RADIUS, "-o", tmp_path / "o.ply", "--quiet")
    assert read_terminal(end) == b""
    assert process.wait() == 0


def test_ctrl_c_keeps_the_old_output(tmp_path: Path) -> None:
    # Every point has every other as a neighbour, and a number of them spares no look: minutes of work.
    points = np.random.default_rng(0).normal(size=(400_000, 3)).astype(np.float32)
    write(tmp_path / "dense.ply", PointCloud(points))
    out = tmp_path / "out.ply"
    out.write_bytes(b"old")
    process, end = start_on_terminal(
        "extract", tmp_path / "dense.ply", "--radius", 20, "--neighbors", 400_000, "-o", out
    )
    shown = read_terminal(end, until=b"extracting")
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    shown += read_terminal(end)
    assert process.wait() == 130
    assert b"Traceback" not in shown
    assert out.read_bytes() == b"old"
    assert sorted(os.listdir(tmp_path)) == ["dense.ply", "out.ply"]


def test_the_nearest_in_place_of_a_radius(shell: Callable[..., Any], ball: Path, tmp_path: Path) -> None:
    out = tmp_path / "nearest.npz"
    done = shell("extract", ball, "--neighbors", 40, "-o", out, "--like", "0,0,1.5", "--json")
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert (told["radius"], told["neighbors"]) == (None, 40)
    arrays = np.load(out)
    assert (arrays["count"] == 40).all()
    # A ball of radius 0.5, seen from outside; the forty nearest of its points are within 0.06.
    assert np.median(arrays["k2"]) == pytest.approx(2, rel=0.02)
    assert np.median(arrays["zeta"]) > 0.99


def test_like_is_fitted_as_all_the_others(shell: Callable[..., Any], ball: Path, tmp_path: Path) -> None:
    """The place that others are compared with had a paraboloid, where they had a quadric."""
    out = tmp_path / "out.npz"
    done = shell(
        "extract", ball, "--radius", 0.45, "--fit", "quadric", "--like", "0,0,1.5", "-o", out, "--json"
    )
    assert done.code == 0, done.err
    assert (json.loads(done.out)["fit"], json.loads(done.out)["robust"]) == ("quadric", False)
    arrays = np.load(out)
    # A ball of nearly the sphere's own radius: a paraboloid's curvature is half as much again.
    used = (arrays["fit_used"] == surfsig.FitUsed.QUADRIC) & (arrays["points"][:, 2] < 1.7)
    assert used.sum() > 3000
    assert np.median(arrays["k1"][used]) == pytest.approx(2, rel=1e-4)
    assert arrays["zeta"][used].min() > 0.99999
