import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from register_scenes import moved, pose, terrain

from surfsig.files import read, write
from surfsig.point_cloud import PointCloud


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, np.ndarray]:
    rng = np.random.default_rng(5)
    folder = tmp_path_factory.mktemp("scans")
    truth = pose(rng)
    write(folder / "a.ply", PointCloud(moved(terrain(rng, 20_000, -1.2, 0.8), np.linalg.inv(truth))))
    write(folder / "b.ply", PointCloud(terrain(rng, 20_000, -0.8, 1.2)))
    return folder / "a.ply", folder / "b.ply", truth


def test_a_pose_and_the_moved_scan(
    shell: Callable[..., Any], scans: tuple[Path, Path, np.ndarray], tmp_path: Path
) -> None:
    source, target, truth = scans
    output = tmp_path / "aligned.ply"
    finished = shell("register", source, target, "-o", output, "--json")
    assert (finished.code, finished.err) == (0, "")
    values = json.loads(finished.out)
    assert values["trusted"] is True
    np.testing.assert_allclose(values["T_target_source"], truth, atol=0.003)
    np.testing.assert_allclose(read(output).points, moved(read(source).points, truth), atol=0.005)


def test_a_page(shell: Callable[..., Any], scans: tuple[Path, Path, np.ndarray], tmp_path: Path) -> None:
    source, target, _ = scans
    page = tmp_path / "page.html"
    assert shell("register", source, target, "--report", page).code == 0
    assert "<title>a.ply in b.ply</title>" in page.read_text(encoding="utf-8")
    wrong = shell("register", source, target, "--report", "nowhere/page.html")
    assert (wrong.code, wrong.out) == (2, "")
    assert "nowhere/page.html: No such file or directory" in wrong.err


def test_a_table(shell: Callable[..., Any], scans: tuple[Path, Path, np.ndarray], tmp_path: Path) -> None:
    source, target, truth = scans
    start = tmp_path / "start.txt"
    np.savetxt(start, truth)
    finished = shell("register", source, target, "--init", start)
    assert finished.code == 0
    assert "T_target_source" in finished.out
    assert finished.out.rstrip().endswith("yes")


def test_nothing_is_written_where_nothing_is_found(shell: Callable[..., Any], tmp_path: Path) -> None:
    few, output = tmp_path / "few.xyz", tmp_path / "aligned.ply"
    few.write_text("0 0 0\n1 0 0\n0 1 0\n")
    finished = shell("register", few, few, "-o", output)
    assert finished.code == 0
    assert "none found" in finished.out
    assert not output.exists()


def test_a_start_that_is_none(
    shell: Callable[..., Any], scans: tuple[Path, Path, np.ndarray], tmp_path: Path
) -> None:
    start = tmp_path / "start.txt"
    start.write_text("1 2 3\n")
    finished = shell("register", *scans[:2], "--init", start)
    assert finished.code == 2
    assert "16 numbers of a pose" in finished.err
    assert "Traceback" not in finished.err
