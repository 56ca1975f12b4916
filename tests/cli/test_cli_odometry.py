"""`surfsig odometry` from the shell."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import moving_sensor
import numpy as np
import pytest
from moving_lidar import moving_scans

import surfsig
from surfsig import PointCloud

Shell = Callable[..., Any]

TRUE = moving_sensor.way(120)[:5]
LENGTH = float(np.linalg.norm(np.diff(TRUE[:, :3, 3], axis=0), axis=1).sum())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five scans and an empty one, with seconds as names: 8.5 to 11."""
    scene = moving_sensor.building()
    place = tmp_path_factory.mktemp("scans")
    for number, pose in enumerate(TRUE):
        cloud = moving_sensor.scan(scene, pose, number)
        surfsig.write(place / f"{8.5 + 0.5 * number}.ply", cloud)
    surfsig.write(place / "11.0.ply", PointCloud(np.zeros((0, 3))))
    return place


def test_files_in_any_order_become_a_kitti_file(folder: Path, tmp_path: Path, shell: Shell) -> None:
    output = tmp_path / "way.txt"
    # As a shell sorts them: 10.0, 10.5, 11.0, 8.5, ...
    errors = tmp_path / "covariances.txt"
    scans = sorted(folder.glob("*.ply"))
    done = shell("odometry", *scans, "-o", output, "--covariances", errors, "--json")
    assert done.code == 0
    values = json.loads(done.out)
    assert values.pop("length") == pytest.approx(LENGTH, rel=0.01)
    assert 0.1 < values.pop("voxel") < 0.3
    assert values == {
        "output": str(output), "format": "kitti", "scans": 6,
        "tracked": 5, "relocalised": 0, "lost": 0, "too_few_points": 1, "segments": 1, "loops": 0,
    }  # fmt: skip
    expected = surfsig.estimate_odometry(folder)
    np.testing.assert_array_equal(surfsig.read_trajectory(output).poses, expected.poses)
    np.testing.assert_array_equal(np.loadtxt(errors).reshape(-1, 6, 6), expected.covariances)


def test_the_name_or_the_option_says_tum(folder: Path, tmp_path: Path, shell: Shell) -> None:
    for output, options in (("way.tum", ()), ("way.txt", ("--format", "tum"))):
        done = shell("odometry", folder, "-o", tmp_path / output, *options)
        assert (done.code, done.out, done.err) == (0, "", "")
        assert surfsig.read_trajectory(tmp_path / output).timestamps.tolist() == [8.5, 9, 9.5, 10, 10.5]
    assert (tmp_path / "way.txt").read_text() == (tmp_path / "way.tum").read_text()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("{folder}/none.ply", "-o", "{out}/way.txt"), "none.ply: No such file"),
        (("{folder}", "-o", "{out}/none/way.txt"), "way.txt: No such file"),
        (("{folder}/11.0.ply", "-o", "{out}/way.txt"), "11.0.ply: no scan has enough points"),
        (("{folder}", "-o", "{out}/way.txt", "--voxel", "-1"), "voxel must be a finite number above 0"),
        (("{folder}", "-o", "{out}/way.txt", "--topic", "/a"), "has no topic '/a'"),
        (("{folder}", "-o", "{out}/way.txt", "--format", "csv"), "'csv' is not one of"),
    ],
)
def test_mistakes_are_one_line_and_write_nothing(
    folder: Path, tmp_path: Path, shell: Shell, arguments: tuple[str, ...], told: str
) -> None:
    done = shell("odometry", *(word.format(folder=folder, out=tmp_path) for word in arguments))
    assert done.code == 2
    assert told in done.err
    assert done.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_scans_that_are_cut_off_do_not_stop_the_rest(folder: Path, tmp_path: Path, shell: Shell) -> None:
    for file in folder.glob("*.ply"):
        whole = file.read_bytes()
        (tmp_path / file.name).write_bytes(whole[: len(whole) // 2] if file.name == "9.5.ply" else whole)
    output = tmp_path / "way.tum"
    done = shell("odometry", tmp_path, "-o", output)
    assert done.code == 0
    assert "9.5.ply" in done.err
    assert done.err.count("\n") == 1
    assert surfsig.read_trajectory(output).timestamps.tolist() == [8.5, 9, 10, 10.5]


def test_one_scan_is_a_trajectory(folder: Path, tmp_path: Path, shell: Shell) -> None:
    output = tmp_path / "way.txt"
    assert shell("odometry", folder / "8.5.ply", "-o", output).code == 0
    assert output.read_text() == "1.0 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 0.0 1.0 0.0\n"


def test_ctrl_c_leaves_the_old_file(
    folder: Path, tmp_path: Path, shell: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    output = tmp_path / "way.txt"
    output.write_text("old")

    def stopped(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("surfsig.estimate_odometry", stopped)
    assert shell("odometry", folder, "-o", output).code == 130
    assert output.read_text() == "old"
    assert list(tmp_path.iterdir()) == [output]


def test_scans_are_written_without_the_motion_within_them_and_fused(tmp_path: Path, shell: Shell) -> None:
    scans, _ = moving_scans(5)
    (tmp_path / "scans").mkdir()
    for number, cloud in enumerate(scans):
        surfsig.write(tmp_path / "scans" / f"{number}.ply", cloud)
    done = shell(
        "odometry", tmp_path / "scans", "-o", tmp_path / "way.txt",
        "--deskewed", tmp_path / "straight", "--map", tmp_path / "map.ply",
    )  # fmt: skip
    assert (done.code, done.err) == (0, "")
    found = surfsig.estimate_odometry(tmp_path / "scans")
    assert len(list((tmp_path / "straight").glob("*.ply"))) == 5
    expected = surfsig.deskew(surfsig.read(tmp_path / "scans" / "3.ply"), found.twists[3])
    np.testing.assert_array_equal(surfsig.read(tmp_path / "straight" / "3.ply").points, expected.points)
    fused = surfsig.read(tmp_path / "map.ply")
    assert fused.fields["scans"].max() == 5
    assert len(fused) > 2000


def test_without_times_there_is_nothing_to_deskew(folder: Path, tmp_path: Path, shell: Shell) -> None:
    done = shell("odometry", folder, "-o", tmp_path / "way.txt", "--deskewed", tmp_path / "straight")
    assert done.code != 0
    assert "--spin-rate" in done.err
