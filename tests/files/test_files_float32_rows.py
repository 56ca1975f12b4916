"""Rows of float32 without a header: KITTI's, nuScenes' and others, told apart by their numbers or refused."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import format_name, read

RINGS = 32


def room(count: int, seed: int = 5) -> NDArray[np.float64]:
    """Points on the walls of a room of 20 x 15 x 3 m, as a scanner in its middle sees them."""
    ring = np.arange(count) % RINGS
    turn = (np.arange(count) // RINGS) / -(-count // RINGS) * 2 * np.pi
    up = np.deg2rad(ring * 40 / RINGS - 25)
    ray = np.column_stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
    reach = np.min(np.array([10, 7.5, 1.5]) / np.maximum(np.abs(ray), 1e-9), axis=1)
    points: NDArray[np.float64] = ray * reach[:, None] + np.random.default_rng(seed).normal(
        0, 0.01, (count, 3)
    )
    return points


def columns(count: int) -> dict[str, NDArray[np.float64]]:
    """What may stand beside the coordinates."""
    rng = np.random.default_rng(6)
    normals = rng.normal(size=(count, 3))
    return {
        "reflectance": rng.uniform(0, 1, (count, 1)),
        "intensity": rng.integers(0, 256, (count, 1)).astype(float),
        "ring": (np.arange(count) % RINGS)[:, None].astype(float),
        "time": np.linspace(0, 0.1, count)[:, None],
        "colours": rng.integers(0, 256, (count, 3)).astype(float),
        "normals": normals / np.linalg.norm(normals, axis=1)[:, None],
    }


KINDS = {
    (): [],
    ("reflectance",): ["intensity"],
    ("intensity",): ["intensity"],
    ("intensity", "ring"): ["intensity", "ring"],
    ("intensity", "time"): ["intensity", "time"],
    ("colours",): ["red", "green", "blue"],
    ("normals",): ["nx", "ny", "nz"],
    ("reflectance", "ring", "time"): ["intensity", "ring", "time"],
}


@pytest.mark.parametrize("shift", [0, 50], ids=["around 0", "all positive"])
@pytest.mark.parametrize("count", [600, 4200, 70_020])
@pytest.mark.parametrize("kind", KINDS, ids=" ".join)
def test_rows_are_told_apart(tmp_path: Path, kind: tuple[str, ...], count: int, shift: float) -> None:
    # 600, 4200 and 70,020 rows have a number of values that 3, 4, 5 and 6 divide.
    parts = columns(count)
    rows = np.hstack([room(count) + shift, *(parts[name] for name in kind)]).astype("<f4")
    path = tmp_path / "scan.pcd.bin"
    path.write_bytes(rows.tobytes())
    cloud = read(path)
    np.testing.assert_array_equal(cloud.points, rows[:, :3])
    assert cloud.points.dtype == np.float32
    assert list(cloud.fields) == KINDS[kind]
    for i, values in enumerate(cloud.fields.values(), 3):
        np.testing.assert_array_equal(values, rows[:, i])
    if "intensity" in cloud.fields:
        assert cloud.viewpoint is not None
        assert cloud.viewpoint.tolist() == [0, 0, 0]
    else:
        assert cloud.viewpoint is None


@pytest.mark.parametrize("order", ["by chance", "laser by laser"])
def test_the_order_of_points_does_not_matter(tmp_path: Path, order: str) -> None:
    count = 4200
    points = room(count)
    places = (
        np.random.default_rng(1).permutation(count)
        if order == "by chance"
        else np.lexsort([np.arange(count) % RINGS])
    )
    rows = np.hstack([points, columns(count)["intensity"], columns(count)["ring"]])[places].astype("<f4")
    for width in (3, 4, 5):
        (tmp_path / "a.bin").write_bytes(np.ascontiguousarray(rows[:, :width]).tobytes())
        cloud = read(tmp_path / "a.bin")
        np.testing.assert_array_equal(cloud.points, rows[:, :3])
        assert len(cloud.fields) == width - 3


@pytest.mark.parametrize("more", [("intensity", "colours"), ("intensity", "ring", "colours")])
def test_longer_rows_are_not_taken_for_shorter_ones(tmp_path: Path, more: tuple[str, ...]) -> None:
    parts = columns(4200)
    rows = np.hstack([room(4200), *(parts[name] for name in more)]).astype("<f4")
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    with pytest.raises(FileFormatError, match="columns="):
        read(tmp_path / "a.bin")


def test_several_layouts_are_named(tmp_path: Path) -> None:
    # Values by chance between 0 and 1 may be anything.
    rows = np.random.default_rng(2).uniform(0, 1, (4200, 3)).astype("<f4")
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    with pytest.raises(
        FileFormatError, match=r"4200 of x y z, or 3150 of x y z intensity.*columns="
    ) as error:
        read(tmp_path / "a.bin")
    assert "\n" not in str(error.value)
    np.testing.assert_array_equal(read(tmp_path / "a.bin", columns="x,y,z").points, rows)


def test_columns_say_what_a_row_is(tmp_path: Path) -> None:
    rows = np.random.default_rng(3).normal(0, 1, (700, 7)).astype("<f4")
    rows[5, 2] = np.nan
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    cloud = read(tmp_path / "a.bin", columns=["x", "_", "y", "z", "-", "_", "Velocity"])
    np.testing.assert_array_equal(cloud.points, rows[:, [0, 2, 3]])
    assert list(cloud.fields) == ["Velocity"]
    np.testing.assert_array_equal(cloud.fields["Velocity"], rows[:, 6])
    assert cloud.viewpoint is None
    with pytest.raises(InvalidInputError, match="19600 bytes, which are no whole rows of 8 float32"):
        read(tmp_path / "a.bin", columns="x,y,z,a,b,c,d,e")


def test_odd_files_of_other_rows(shared_data: Path) -> None:
    folder = shared_data / "odd_files" / "bin_layouts"
    five = read(folder / "nuscenes_5_floats.pcd.bin")
    rows = np.fromfile(folder / "nuscenes_5_floats.pcd.bin", "<f4").reshape(-1, 5)
    assert len(five) == 4000
    np.testing.assert_array_equal(five.points, rows[:, :3])
    np.testing.assert_array_equal(five.fields["intensity"], rows[:, 3])
    np.testing.assert_array_equal(five.fields["ring"], rows[:, 4])
    three = read(folder / "xyz_3_floats.bin")
    assert len(three) == 4000
    np.testing.assert_array_equal(three.points.ravel(), np.fromfile(folder / "xyz_3_floats.bin", "<f4"))


def kitti(count: int) -> NDArray[np.float32]:
    rows = np.random.default_rng(5).normal(0, 30, (count, 4)).astype("<f4")
    rows[:, 3] = np.abs(rows[:, 3]) / 200
    return rows


@pytest.mark.parametrize("count", [1, 5, 70_001])
def test_kitti(tmp_path: Path, count: int) -> None:
    path = tmp_path / "000000.BIN"
    path.write_bytes(kitti(count).tobytes())
    told: list[tuple[int, int]] = []
    cloud = read(path, progress=lambda done, total: told.append((done, total)))
    np.testing.assert_array_equal(cloud.points, kitti(count)[:, :3])
    np.testing.assert_array_equal(cloud.fields["intensity"], kitti(count)[:, 3])
    assert cloud.points.dtype == cloud.fields["intensity"].dtype == np.float32
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [0, 0, 0]
    assert told[-1] == (16 * count, 16 * count)
    assert format_name(path) == "float32 rows"


def test_negative_intensities_of_kitti_are_read_with_a_warning(tmp_path: Path) -> None:
    rows = kitti(70_001)
    rows[::7, 3] *= -1
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    with pytest.warns(UserWarning, match="although intensities are negative"):
        cloud = read(tmp_path / "a.bin")
    np.testing.assert_array_equal(cloud.fields["intensity"], rows[:, 3])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path / "a.bin", columns="x,y,z,intensity")


def test_text_called_bin_stays_text(tmp_path: Path) -> None:
    # Digits are plausible floats: "1 2 " is 1e-19.
    path = tmp_path / "a.bin"
    path.write_text("1 2 3.5\n4 5 6.5\n")
    assert path.stat().st_size == 16
    np.testing.assert_array_equal(read(path).points, [[1, 2, 3.5], [4, 5, 6.5]])


def test_zeros_called_bin_are_no_scan(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(bytes(160))
    with pytest.raises(FileFormatError, match="is not a float32 rows file"):
        read(tmp_path / "a.bin")


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e6, -2e6])
@pytest.mark.parametrize("place", [3, 5_000, 9_999])
def test_values_that_make_no_sense(tmp_path: Path, place: int, value: float) -> None:
    table = kitti(10_000)
    table[place, 2] = value
    path = tmp_path / "a.bin"
    path.write_bytes(table.tobytes())
    with pytest.raises(FileFormatError, match=r"columns=") as error:
        read(path)
    assert "\n" not in str(error.value)


def test_a_row_that_is_unlike_the_sample_is_named(tmp_path: Path) -> None:
    # The sample is six blocks; most of a large file is not in it.
    rows = np.hstack([room(70_020), columns(70_020)["intensity"], columns(70_020)["ring"]]).astype("<f4")
    rows[20_001, 4] = 2.5
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    with pytest.raises(FileFormatError, match=r"row 20001 .* cannot be x y z intensity ring"):
        read(tmp_path / "a.bin")


@pytest.mark.parametrize(
    ("name", "message"), [("a.bin", "1599 bytes, which are no float32"), ("a.dat", "is no point cloud")]
)
def test_other_sizes_and_names(tmp_path: Path, name: str, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(kitti(100).tobytes()[: -1 if name == "a.bin" else None])
    with pytest.raises(FileFormatError, match=message):
        read(path)
