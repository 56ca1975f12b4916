"""What surfsig writes, read by other programs, value by value; skipped where these are not installed."""

import shutil
import subprocess
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.files import read, write
from surfsig.point_cloud import PointCloud

COUNT = 60
RNG = np.random.default_rng(17)
POINTS = RNG.uniform(-1, 1, (COUNT, 3))
NORMALS = RNG.normal(size=(COUNT, 3)).astype(np.float32)
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
COLOURS = RNG.integers(0, 256, (COUNT, 3)).astype(np.uint8)
INTENSITY = RNG.integers(0, 65536, COUNT).astype(np.uint16)
LABEL = np.arange(COUNT, dtype=np.int32) - 5
UTM = np.array([500_000, 4_500_000, 100])

CLOUDS = ("near", "missing", "far")


def cloud(name: str) -> PointCloud:
    """Points near 0 in float32, the same with one that is no number, or points in UTM coordinates."""
    points = (POINTS + UTM).round(3) if name == "far" else POINTS.astype(np.float32)
    if name == "missing":
        points[7] = np.nan
    fields: dict[str, NDArray[Any]] = dict(zip(("nx", "ny", "nz"), NORMALS.T.copy(), strict=True))
    fields |= dict(zip(("red", "green", "blue"), COLOURS.T.copy(), strict=True))
    fields |= {"intensity": INTENSITY, "label": LABEL, "scale": POINTS[:, 0].copy()}
    return PointCloud(points, fields=fields)


def written(folder: Path, name: str, suffix: str) -> tuple[Path, PointCloud]:
    path, whole = folder / f"{name}{suffix}", cloud(name)
    with warnings.catch_warnings():
        # What a format cannot hold, other tests compare.
        warnings.simplefilter("ignore")
        write(path, whole)
    return path, whole


def same_points(found: Any, expected: NDArray[Any]) -> None:
    np.testing.assert_array_equal(np.asarray(found, np.float64), expected.astype(np.float64))


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("suffix", [".ply", ".pcd"])
def test_open3d(tmp_path: Path, name: str, suffix: str) -> None:
    o3d: Any = pytest.importorskip("open3d")
    path, whole = written(tmp_path, name, suffix)
    legacy = o3d.io.read_point_cloud(str(path), remove_nan_points=False)
    found = o3d.t.io.read_point_cloud(str(path), remove_nan_points=False).point
    if suffix == ".ply" or name != "far":
        same_points(legacy.points, whole.points)
        same_points(found.positions.numpy(), whole.points)
    else:
        # Most readers of PCD take float32 for coordinates: what is read must be the cloud's shape at least.
        for points in (np.asarray(legacy.points), found.positions.numpy()):
            moved = points - points.mean(axis=0)
            np.testing.assert_allclose(moved, POINTS - POINTS.mean(axis=0), atol=2e-3)
    same_points(np.round(np.asarray(legacy.colors) * 255), COLOURS)
    np.testing.assert_allclose(np.asarray(legacy.normals), NORMALS, atol=1e-7)
    same_points(found.colors.numpy(), COLOURS)
    np.testing.assert_allclose(found.normals.numpy(), NORMALS, atol=1e-7)
    # Of PLY, Open3D passes over whole numbers of 16 bits.
    for field in ("label", "scale") if suffix == ".ply" else ("intensity", "label", "scale"):
        same_points(found[field].numpy()[:, 0], whole.fields[field])


@pytest.mark.parametrize("name", CLOUDS)
def test_trimesh(tmp_path: Path, name: str) -> None:
    trimesh: Any = pytest.importorskip("trimesh")
    path, whole = written(tmp_path, name, ".ply")
    found = trimesh.load(path)
    same_points(found.vertices, whole.points)
    same_points(found.colors[:, :3], COLOURS)
    data = found.metadata["_ply_raw"]["vertex"]["data"]
    for field, values in whole.fields.items():
        same_points(np.asarray(data[field]).ravel(), values)


@pytest.mark.parametrize("name", ["near", "far"])
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_laspy(tmp_path: Path, name: str, suffix: str) -> None:
    laspy: Any = pytest.importorskip("laspy")
    path, whole = written(tmp_path, name, suffix)
    found = laspy.read(path)
    assert str(found.header.version) == "1.4"
    np.testing.assert_allclose(found.xyz, whole.points, atol=float(found.header.scales.max()) / 2)
    if name == "far":
        same_points(np.round(found.xyz, 3), np.round(whole.points, 3))
    for i, colour in enumerate(("red", "green", "blue")):
        same_points(found[colour], COLOURS[:, i])
    for field in ("nx", "ny", "nz", "intensity", "label", "scale"):
        same_points(found[field], whole.fields[field])


def test_laspy_has_no_points_that_are_no_numbers(tmp_path: Path) -> None:
    laspy: Any = pytest.importorskip("laspy")
    path, whole = written(tmp_path, "missing", ".laz")
    found = laspy.read(path)
    np.testing.assert_allclose(found.xyz, whole.points[whole.finite], atol=1e-8)
    same_points(found["label"], LABEL[whole.finite])


@pytest.mark.parametrize("name", CLOUDS)
def test_pye57(tmp_path: Path, name: str) -> None:
    pye57: Any = pytest.importorskip("pye57")
    path, whole = written(tmp_path, name, ".e57")
    # Of the standard's extensions, normals among them, it reads none.
    found = pye57.E57(str(path)).read_scan_raw(0, ignore_unsupported_fields=True)
    points = np.column_stack([found[f"cartesian{axis}"] for axis in "XYZ"])
    same_points(points[whole.finite], whole.points[whole.finite])
    if name == "missing":
        assert (found["cartesianInvalidState"] == np.where(whole.finite, 0, 2)).all()
    for i, colour in enumerate(("Red", "Green", "Blue")):
        same_points(found[f"color{colour}"], COLOURS[:, i])
    same_points(found["intensity"], INTENSITY)
    with_pose = pye57.E57(str(path)).read_scan(0, colors=True, intensity=True, ignore_missing_fields=True)
    points = np.column_stack([with_pose[f"cartesian{axis}"] for axis in "XYZ"])
    # It leaves invalid points out.
    same_points(points, whole.points[whole.finite])


@pytest.mark.parametrize("name", CLOUDS)
def test_numpy(tmp_path: Path, name: str) -> None:
    path, whole = written(tmp_path, name, ".npz")
    with np.load(path) as found:
        same_points(found["points"], whole.points)
        assert found["points"].dtype == whole.points.dtype
        for field, values in whole.fields.items():
            np.testing.assert_array_equal(found[field], values)
            assert found[field].dtype == values.dtype


@pytest.mark.parametrize("name", CLOUDS)
def test_pandas_and_pyarrow(tmp_path: Path, name: str) -> None:
    pytest.importorskip("pyarrow")
    pandas: Any = pytest.importorskip("pandas")
    parquet: Any = pytest.importorskip("pyarrow.parquet")
    path, whole = written(tmp_path, name, ".parquet")
    frame, table = pandas.read_parquet(path), parquet.read_table(path)
    for found in (frame[["x", "y", "z"]].to_numpy(), np.column_stack([table[axis] for axis in "xyz"])):
        same_points(found, whole.points)
    for field, values in whole.fields.items():
        for column in (frame[field].to_numpy(), table[field].to_numpy()):
            np.testing.assert_array_equal(column, values)
            assert column.dtype == values.dtype


def run_pcl(program: str, *arguments: object) -> None:
    """Run a program of PCL; the test is skipped where it is not installed."""
    found = shutil.which(program)
    if found is None:
        pytest.skip(f"{program} of PCL is not installed")
    done = subprocess.run([found, *map(str, arguments)], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def rows_of_ascii_pcd(path: Path) -> dict[str, NDArray[Any]]:
    """Read what PCL wrote, without surfsig."""
    lines = path.read_text().splitlines()
    start = lines.index("DATA ascii") + 1
    names = next(line for line in lines if line.startswith("FIELDS")).split()[1:]
    return dict(zip(names, np.loadtxt(lines[start:], ndmin=2).T, strict=True))


@pytest.mark.parametrize("name", ["near", "missing"])
def test_pcl_reads_pcd(tmp_path: Path, name: str) -> None:
    path, whole = written(tmp_path, name, ".pcd")
    run_pcl("pcl_convert_pcd_ascii_binary", path, tmp_path / "ascii.pcd", 0)
    found = rows_of_ascii_pcd(tmp_path / "ascii.pcd")
    # PCL prints seven digits.
    np.testing.assert_allclose(np.column_stack([found[axis] for axis in "xyz"]), whole.points, atol=1e-6)
    normals = np.column_stack([found[f"normal_{axis}"] for axis in "xyz"])
    np.testing.assert_allclose(normals, NORMALS, atol=1e-6)
    packed = found["rgb"].astype(np.uint32)
    same_points(np.column_stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255]), COLOURS)
    same_points(found["intensity"], INTENSITY)
    same_points(found["label"], LABEL)
    # And surfsig reads what PCL wrote.
    again = read(tmp_path / "ascii.pcd")
    np.testing.assert_allclose(again.points, whole.points, atol=1e-6)
    np.testing.assert_allclose(again.fields["nx"], NORMALS[:, 0], atol=1e-6)


@pytest.mark.parametrize("name", ["near", "missing", "far"])
def test_pcl_turns_pcd_into_ply(tmp_path: Path, name: str) -> None:
    path, whole = written(tmp_path, name, ".pcd")
    run_pcl("pcl_pcd2ply", path, tmp_path / "pcl.ply")
    found = read(tmp_path / "pcl.ply")
    if name == "far":
        np.testing.assert_allclose(
            found.points - found.points.mean(axis=0), POINTS - POINTS.mean(axis=0), atol=2e-3
        )
    else:
        same_points(found.points, whole.points)
    for field in ("nx", "ny", "nz", "red", "green", "blue", "label"):
        same_points(found.fields[field], whole.fields[field])


@pytest.mark.parametrize("name", CLOUDS)
def test_pcl_turns_ply_into_pcd(tmp_path: Path, name: str) -> None:
    path, whole = written(tmp_path, name, ".ply")
    run_pcl("pcl_ply2pcd", path, tmp_path / "pcl.pcd")
    found = read(tmp_path / "pcl.pcd")
    same_points(found.points, whole.points)
    for field in ("nx", "ny", "nz", "red", "green", "blue", "intensity", "label"):
        same_points(found.fields[field], whole.fields[field])
