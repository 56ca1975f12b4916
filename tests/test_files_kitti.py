"""KITTI's scans, which nothing but extension, size and numbers tell."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import format_name, read


def scan(count: int) -> NDArray[np.float32]:
    rng = np.random.default_rng(count)
    rows = np.column_stack([rng.normal(size=(count, 3)) * 30, rng.random(count)])
    return rows.astype(np.float32)


@pytest.mark.parametrize("count", [1, 255, 256, 40_000])
def test_a_scan(tmp_path: Path, count: int) -> None:
    path = tmp_path / "000000.bin"
    scan(count).astype("<f4").tofile(path)
    seen: list[tuple[int, int]] = []
    cloud = read(path, progress=lambda done, total: seen.append((done, total)))
    assert format_name(path) == "KITTI"
    np.testing.assert_array_equal(cloud.points, scan(count)[:, :3])
    assert cloud.points.dtype == np.float32
    assert list(cloud.fields) == ["intensity"]
    np.testing.assert_array_equal(cloud.fields["intensity"], scan(count)[:, 3])
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [0, 0, 0]
    assert seen[-1] == (16 * count, 16 * count)


@pytest.mark.parametrize("content", [scan(9).tobytes()[:-1], bytes(160), scan(9).astype(">f4").tobytes()])
def test_bytes_that_are_no_scan(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(content)
    with pytest.raises(FileFormatError, match="is not a KITTI file, nor any other"):
        read(path)


def test_a_scan_under_another_extension(tmp_path: Path) -> None:
    scan(9).tofile(tmp_path / "a.dat")
    with pytest.raises(FileFormatError, match="is no point cloud that can be read"):
        read(tmp_path / "a.dat")


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e6])
def test_a_coordinate_that_makes_no_sense_far_into_the_file(tmp_path: Path, value: Any) -> None:
    rows = scan(5000)
    rows[4321, 1] = value
    rows.tofile(tmp_path / "a.bin")
    with pytest.raises(FileFormatError, match="no KITTI scan: its point 4321 would be at"):
        read(tmp_path / "a.bin")


def test_a_table_called_bin_is_text(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_text("1.5 2.5 3.5\n1 2 3.00\n" * 16)
    assert (tmp_path / "a.bin").stat().st_size % 16 == 0
    assert format_name(tmp_path / "a.bin") == "text"
    assert read(tmp_path / "a.bin").points[:2].tolist() == [[1.5, 2.5, 3.5], [1, 2, 3]]
