"""KITTI's scans by value, and what is none."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import format_name, read


def rows(count: int) -> NDArray[np.float32]:
    return np.random.default_rng(5).normal(0, 30, (count, 4)).astype("<f4")


@pytest.mark.parametrize("count", [1, 5, 70_001])
def test_values(tmp_path: Path, count: int) -> None:
    path = tmp_path / "000000.BIN"
    path.write_bytes(rows(count).tobytes())
    told: list[tuple[int, int]] = []
    cloud = read(path, progress=lambda done, total: told.append((done, total)))
    np.testing.assert_array_equal(cloud.points, rows(count)[:, :3])
    np.testing.assert_array_equal(cloud.fields["intensity"], rows(count)[:, 3])
    assert cloud.points.dtype == cloud.fields["intensity"].dtype == np.float32
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [0, 0, 0]
    assert told[-1] == (16 * count, 16 * count)
    assert format_name(path) == "KITTI"


def test_text_called_bin_stays_text(tmp_path: Path) -> None:
    # Digits are plausible floats: "1 2 " is 1e-19.
    path = tmp_path / "a.bin"
    path.write_text("1 2 3.5\n4 5 6.5\n")
    assert path.stat().st_size == 16
    np.testing.assert_array_equal(read(path).points, [[1, 2, 3.5], [4, 5, 6.5]])


def test_zeros_called_bin_are_no_scan(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(bytes(160))
    with pytest.raises(FileFormatError, match="is not a KITTI file"):
        read(tmp_path / "a.bin")


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e6, -2e6])
@pytest.mark.parametrize(("place", "message"), [(3, "is not a KITTI file"), (9_000, "is not a KITTI scan")])
def test_values_that_make_no_sense(tmp_path: Path, place: int, message: str, value: float) -> None:
    table = rows(10_000)
    table[place, 2] = value
    path = tmp_path / "a.bin"
    path.write_bytes(table.tobytes())
    with pytest.raises(FileFormatError, match=message):
        read(path)


@pytest.mark.parametrize(
    ("name", "message"), [("a.bin", "is not a KITTI file"), ("a.dat", "is no point cloud")]
)
def test_other_sizes_and_names(tmp_path: Path, name: str, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(rows(100).tobytes()[: -1 if name == "a.bin" else None])
    with pytest.raises(FileFormatError, match=message):
        read(path)
