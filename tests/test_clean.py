"""Boxes, voxels and outliers: values against slow references, and against Open3D."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, PointCloud
from surfsig.clean import _groups


def scan(count: int = 3000, strays: int = 30) -> NDArray[np.float64]:
    """Give a wavy sheet with noise, and points strewn around it."""
    rng = np.random.default_rng(11)
    x, y = rng.uniform(-1, 1, (2, count))
    sheet = np.column_stack([x, y, 0.2 * np.sin(3 * x) + rng.normal(0, 0.002, count)])
    points = np.concatenate([sheet, rng.uniform(-1, 1, (strays, 3))])
    return points[rng.permutation(len(points))]


def slow_voxels(points: NDArray[Any], edge: float) -> dict[tuple[int, ...], list[int]]:
    voxels: dict[tuple[int, ...], list[int]] = {}
    for number, point in enumerate(points):
        if np.isfinite(point).all():
            voxels.setdefault(tuple(int(np.floor(c / edge)) for c in point), []).append(number)
    return voxels


def slow_outliers(points: NDArray[np.float64], neighbors: int, ratio: float) -> NDArray[np.int64]:
    """Give the numbers of those that stay."""
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    means = np.sort(distances, axis=1)[:, 1 : neighbors + 1].mean(axis=1)
    return np.flatnonzero(means <= means.mean() + ratio * means.std(ddof=1))


def test_crop_keeps_both_corners() -> None:
    points = np.array([[0, 0, 0], [1, 1, 1], [1, 1, 1.01], [np.nan, 0, 0], [0.5, -0.01, 0.5]])
    kept = surfsig.crop(points, [[0, 0, 0], [1, 1, 1]])
    assert kept.points.tolist() == [[0, 0, 0], [1, 1, 1]]
    with pytest.raises(InvalidInputError, match="box must be two corners"):
        surfsig.crop(points, [[1, 1, 1], [0, 0, 0]])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_voxel_has_the_mean_of_its_points(dtype: type) -> None:
    points: NDArray[Any] = scan().astype(dtype)
    points[::100, 1] = np.nan
    height = points[:, 2] * 3
    cloud = PointCloud(points, fields={"number": np.arange(len(points)), "height": height})
    result = surfsig.downsample(cloud, 0.1)
    expected = list(slow_voxels(points, 0.1).values())
    # A voxel's first point is its first key: the order of insertion is that of the result.
    assert result.fields["number"].tolist() == [members[0] for members in expected]
    means = np.array([points[members].astype(np.float64).mean(axis=0) for members in expected])
    tolerance = 1e-6 if dtype is np.float32 else 1e-14
    np.testing.assert_allclose(result.points, means, rtol=0, atol=tolerance)
    np.testing.assert_allclose(result.fields["height"], 3 * means[:, 2], rtol=0, atol=3 * tolerance)
    assert result.offsets.dtype == dtype
    assert result.fields["height"].dtype == dtype


def test_fields_of_a_voxel() -> None:
    points = np.array([[0.1, 0.1, 0.1], [1.5, 0, 0], [0.3, 0.1, 0.1], [0.2, 0.4, 0.1]])
    fields: dict[str, NDArray[Any]] = {
        "label": np.array([7, 8, 9, 9]),
        "flag": np.array([True, False, False, False]),
        "red": np.array([10, 0, 20, 26], np.uint8),
        "green": np.array([255, 0, 255, 255], np.uint8),
        "blue": np.array([0, 0, 0, 1], np.uint8),
        "pair": np.array([[1.0, 2], [0, 0], [3, 4], [5, 9]]),
        "none": np.zeros((4, 0)),
        "k1": np.array([1.0, 2.0, np.nan, 3.0], np.float32),
        "nx": np.array([1.0, 0, 0, 1.0], np.float32),
        "ny": np.array([0.0, 0, 1, 0], np.float32),
        "nz": np.array([0.0, 1, 0, 0], np.float32),
        "scan": np.array([1, 0, 1, 1]),
    }
    viewpoints = np.array([[0.0, 0, 5], [5, 0, 0]])
    cloud = PointCloud(points, fields=fields, grid=(2, 2), viewpoints=viewpoints)
    result = surfsig.downsample(cloud, 1.0)
    np.testing.assert_allclose(result.points, [[0.2, 0.2, 0.1], [1.5, 0, 0]], rtol=0, atol=1e-15)
    assert list(result.fields) == list(fields)
    assert result.fields["label"].tolist() == [7, 8]
    assert result.fields["flag"].tolist() == [True, False]
    assert [result.fields[name][0] for name in ("red", "green", "blue")] == [19, 255, 0]
    assert result.fields["red"].dtype == np.uint8
    assert result.fields["pair"].tolist() == [[3, 5], [0, 0]]
    np.testing.assert_array_equal(result.fields["k1"], np.array([np.nan, 2], np.float32))
    normals: NDArray[Any] = np.column_stack([result.fields[name] for name in ("nx", "ny", "nz")])
    np.testing.assert_allclose(normals, [[0.8**0.5, 0.2**0.5, 0.0], [0.0, 0.0, 1.0]], rtol=1e-6)
    assert (result.grid, result.viewpoints is not None) == (None, True)
    assert cloud.fields["red"].tolist() == [10, 0, 20, 26]


def test_normals_that_cancel_each_other_out_stay_zero() -> None:
    fields = {"nx": np.zeros(2), "ny": np.zeros(2), "nz": np.array([1.0, -1.0])}
    result = surfsig.downsample(PointCloud(np.full((2, 3), 0.5), fields=fields), 1.0)
    assert result.fields["nz"].tolist() == [0]


def test_voxels_at_far_coordinates_lose_nothing() -> None:
    origin = np.array([500_000.0, 4_500_000.0, 100.0])
    near = surfsig.downsample(scan(), 0.25)
    far = surfsig.downsample(PointCloud(scan(), origin=origin), 0.25)
    np.testing.assert_array_equal(far.origin, origin)
    # Coordinates this large round to 1e-9 before they are divided: a point on an edge may change sides.
    assert len(far) == len(near)
    np.testing.assert_allclose(far.offsets, near.offsets, rtol=0, atol=1e-12)


def test_voxels_that_are_many_or_too_small() -> None:
    steps = np.array([[0, 0, 0], [1 << 40, 0, 5], [0, 1 << 40, 0], [1 << 40, 0, 5], [0, 0, 0]])
    first, group = _groups(steps.T)
    assert first.tolist() == [0, 1, 2]
    assert group.tolist() == [0, 1, 2, 1, 0]
    with pytest.raises(InvalidInputError, match="voxel 1e-15 is too small"):
        surfsig.downsample([[1.0, 0, 0]], 1e-15)
    for edge in (0, -1, np.nan, "a"):
        with pytest.raises(InvalidInputError, match="voxel must be a finite number"):
            surfsig.downsample([[1.0, 0, 0]], edge)  # type: ignore[arg-type]
    assert len(surfsig.downsample(np.full((3, 3), np.nan), 1.0)) == 0


def test_voxels_are_those_of_open3d() -> None:
    pytest.importorskip("open3d", exc_type=ImportError)
    # Open3D's lattice begins half a voxel before the lowest corner: at -1.1.
    points = np.vstack([scan(), [[-1.05, -1.05, -1.05]]])
    ours = surfsig.downsample(points, 0.1).points
    theirs = np.asarray(PointCloud(points).to_open3d().voxel_down_sample(0.1).points)
    assert ours.shape == theirs.shape
    np.testing.assert_allclose(
        ours[np.lexsort(ours.round(9).T)], theirs[np.lexsort(theirs.round(9).T)], rtol=0, atol=1e-12
    )


@pytest.mark.parametrize(("neighbors", "ratio"), [(20, 2.0), (5, 1.0), (1, 0.0), (50, 3.0)])
def test_outliers_are_those_of_the_definition(neighbors: int, ratio: float) -> None:
    points = scan(800, 20)
    stays = slow_outliers(points, neighbors, ratio)
    assert 300 < len(stays) < len(points)
    cloud = PointCloud(points, fields={"number": np.arange(len(points))}, viewpoint=np.ones(3))
    result = surfsig.remove_outliers(cloud, neighbors, ratio)
    assert result.fields["number"].tolist() == stays.tolist()
    assert result.viewpoint is not None


def test_outliers_are_those_of_open3d() -> None:
    pytest.importorskip("open3d", exc_type=ImportError)
    cloud = PointCloud(scan(20_000, 200), fields={"number": np.arange(20_200)})
    for neighbors, ratio in ((20, 2.0), (8, 1.0)):
        # Open3D counts the point itself.
        _, stays = cloud.to_open3d().remove_statistical_outlier(neighbors + 1, ratio)
        result = surfsig.remove_outliers(cloud, neighbors, ratio)
        assert result.fields["number"].tolist() == list(stays)


@pytest.mark.slow
def test_outliers_do_not_depend_on_threads() -> None:
    cloud = PointCloud(scan(), fields={"number": np.arange(3030)})
    expected = surfsig.remove_outliers(cloud, threads=1).fields["number"]
    assert (surfsig.remove_outliers(cloud, threads=4).fields["number"] == expected).all()


@pytest.mark.filterwarnings("error")
def test_a_limit_beyond_float32_overflows_nothing() -> None:
    points = scan(300, 3).astype(np.float32)
    assert 200 < len(surfsig.remove_outliers(points)) < 303


def test_outliers_of_small_and_odd_clouds() -> None:
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [np.nan, 0, 0], [90, 0, 0]], np.float32)
    assert surfsig.remove_outliers(line, std_ratio=1).points[:, 0].tolist() == [0, 1, 2, 3]
    # All in one place: none is farther than any other.
    assert len(surfsig.remove_outliers(np.ones((500, 3)))) == 500
    for count in (0, 1, 2):
        assert len(surfsig.remove_outliers(np.arange(3.0 * count).reshape(count, 3))) == count
    huge = 1e30 * scan(300, 3)
    assert len(surfsig.remove_outliers(huge)) == len(surfsig.remove_outliers(scan(300, 3)))
    with pytest.raises(InvalidInputError, match="coordinates must be within 1e\\+150"):
        surfsig.remove_outliers(1e200 * scan(300, 3))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"neighbors": 0}, "neighbors must be 1 to [0-9]+, not 0"),
        ({"neighbors": 2.5}, "neighbors must be a whole number"),
        ({"std_ratio": "few"}, "std_ratio must be a number, not 'few'"),
        ({"std_ratio": -1}, "std_ratio must be a finite number from 0 on, not -1"),
        ({"std_ratio": float("nan")}, "std_ratio must be a finite number from 0 on, not nan"),
        ({"std_ratio": float("inf")}, "std_ratio must be a finite number from 0 on, not inf"),
        ({"threads": 0}, "threads must be 1 to 1024"),
    ],
)
def test_arguments_without_meaning(more: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        surfsig.remove_outliers(scan(50, 0), **more)


def test_clean_on_the_command_line(shell: Callable[..., Any], tmp_path: Path) -> None:
    file, out = tmp_path / "scan.ply", tmp_path / "out.ply"
    cloud = PointCloud(scan(), fields={"label": np.arange(3030, dtype=np.int32)})
    surfsig.write(file, cloud)
    options = ("--box", "-1,-1,-0.5,0.5,1,0.5", "--outliers", "--neighbors", 8, "--std-ratio", 1.5)
    finished = shell("clean", file, out, *options, "--voxel", 0.05, "--json")
    assert (finished.code, finished.err) == (0, "")
    inside = surfsig.crop(cloud, [[-1, -1, -0.5], [0.5, 1, 0.5]])
    stays = surfsig.remove_outliers(inside, 8, 1.5)
    expected = surfsig.downsample(stays, 0.05)
    written = surfsig.read(out)
    np.testing.assert_array_equal(written.points, expected.points)
    np.testing.assert_array_equal(written.fields["label"], expected.fields["label"])
    counts = {"read": len(inside), "not_outliers": len(stays), "voxels": len(expected)}
    assert json.loads(finished.out)["points"] == counts
    assert 3030 > len(inside) > len(stays) > len(expected) > 100


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "nothing to do: give --box, --no-returns, --outliers or --voxel"),
        (("--box", "1,2,3"), "'1,2,3' is not six numbers"),
        (("--box", "1,1,1,0,0,0"), "box must be two corners"),
        (("--voxel", "0"), "voxel must be a finite number above 0"),
        (("--outliers", "--neighbors", "0"), "neighbors must be 1 to "),
    ],
)
def test_mistakes_on_the_command_line(
    shell: Callable[..., Any], ball: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    finished = shell("clean", ball, tmp_path / "out.ply", *options)
    assert finished.code == 2
    assert finished.err.count("\n") == 1
    assert message in finished.err
    assert not (tmp_path / "out.ply").exists()


def test_a_stereo_scan_without_its_strays(shared_data: Path) -> None:
    cloud = surfsig.read(shared_data / "surfaces" / "table_scene_mug.pcd")
    kept = surfsig.remove_outliers(cloud)
    assert 0.9 * cloud.finite.sum() < len(kept) < cloud.finite.sum()
    assert kept.finite.all()
    assert kept.grid is None
