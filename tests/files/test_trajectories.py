"""Trajectories as text: what is written is read back, digit by digit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import FileFormatError, InvalidInputError

NAN_LINE = "nan " * 11 + "nan"


def some_poses(count: int = 5) -> NDArray[np.float64]:
    rng = np.random.default_rng(3)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Rotation.random(count, rng).as_matrix()
    poses[:, :3, 3] = rng.normal(0.0, 1e4, (count, 3))
    return poses


def test_kitti_has_three_rows_of_each_matrix(tmp_path: Path) -> None:
    poses = some_poses()
    poses[2] = np.nan
    file = tmp_path / "way.txt"
    surfsig.write_trajectory(file, poses)
    lines = file.read_text().splitlines()
    assert lines[2] == NAN_LINE
    assert [float(word) for word in lines[1].split()] == poses[1, :3].ravel().tolist()
    back = surfsig.read_trajectory(file)
    np.testing.assert_array_equal(back.poses, poses)
    assert back.timestamps.tolist() == [0, 1, 2, 3, 4]


def test_tum_has_timestamp_place_and_quaternion(tmp_path: Path) -> None:
    poses = some_poses()
    poses[2] = np.nan
    times = 1305031102.175304 + 0.1 * np.arange(5)
    file = tmp_path / "way.tum"
    surfsig.write_trajectory(file, poses, times)
    kept = [0, 1, 3, 4]
    back = surfsig.read_trajectory(file)
    np.testing.assert_array_equal(back.timestamps, times[kept])
    np.testing.assert_array_equal(back.poses[:, :3, 3], poses[kept, :3, 3])
    np.testing.assert_allclose(back.poses[:, :3, :3], poses[kept, :3, :3], atol=1e-15)
    # 90 degrees about z.
    turned = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    surfsig.write_trajectory(file, turned[None], [7.5])
    numbers = [float(word) for word in file.read_text().split()]
    np.testing.assert_allclose(numbers, [7.5, 1, 2, 3, 0, 0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-15)


def test_the_format_counts_before_the_name(tmp_path: Path) -> None:
    surfsig.write_trajectory(tmp_path / "way.tum", some_poses(), format="kitti")
    assert len((tmp_path / "way.tum").read_text().splitlines()[0].split()) == 12
    surfsig.write_trajectory(tmp_path / "way.txt", np.full((2, 4, 4), np.nan), format="tum")
    assert (tmp_path / "way.txt").read_text() == ""
    assert surfsig.read_trajectory(tmp_path / "way.txt").poses.shape == (0, 4, 4)


def test_mistakes_are_told(tmp_path: Path) -> None:
    file = tmp_path / "way.txt"
    with pytest.raises(InvalidInputError, match="format must be kitti or tum"):
        surfsig.write_trajectory(file, some_poses(), format="csv")  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=r"the shape \(n, 4, 4\), not \(4, 4\)"):
        surfsig.write_trajectory(file, np.eye(4))
    with pytest.raises(InvalidInputError, match="timestamps must be one for each of 5"):
        surfsig.write_trajectory(file, some_poses(), [1.0])
    assert not file.exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("1 2 3\n", "line 1 has 3 numbers"),
        (f"# a remark\n{NAN_LINE}\n1 2 3 4 5 6 7 8\n", "line 3 has 8 numbers"),
        ("1 2 3 4 5 6 7 eight\n", "line 1 holds something other"),
        ("1 2 3 4 0 0 0 0\n", "its quaternion is 0"),
        ("nan 2 3 4 0 0 0 1\n", "is not finite"),
    ],
)
def test_what_is_no_trajectory_is_refused(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "way.txt"
    file.write_text(text)
    with pytest.raises(FileFormatError, match=told) as caught:
        surfsig.read_trajectory(file)
    assert str(caught.value).startswith(str(file))


def test_covariances_without_6_rows_are_refused(tmp_path: Path) -> None:
    with pytest.raises(surfsig.InvalidInputError, match=r"shape \(n, 6, 6\), not \(2, 3, 3\)"):
        surfsig.write_covariances(tmp_path / "file.txt", np.zeros((2, 3, 3)))
