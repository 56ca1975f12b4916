"""Open3D's clouds, in and out."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, PointCloud

# Where a library that Open3D needs is missing, its import fails with an ImportError.
o3d: Any = pytest.importorskip("open3d", exc_type=ImportError)

POINTS = np.arange(12, dtype=np.float32).reshape(4, 3)
NORMALS = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0.6, 0, 0.8]], np.float32)
COLOURS = np.array([[0, 1, 2], [127, 128, 129], [200, 201, 202], [253, 254, 255]], np.uint8)


def tensor(values: NDArray[Any]) -> Any:
    return o3d.core.Tensor.from_numpy(values)


def three(cloud: PointCloud, names: str) -> NDArray[Any]:
    return np.column_stack([cloud.fields[name] for name in names.split()])


def test_a_tensor_cloud_is_shared() -> None:
    given = o3d.t.geometry.PointCloud(tensor(POINTS))
    given.point["normals"] = tensor(NORMALS)
    given.point["colors"] = tensor(COLOURS)
    given.point["intensity"] = tensor(np.array([[1], [2], [3], [4]], np.uint16))
    given.point["pair"] = tensor(np.arange(8.0).reshape(4, 2))
    cloud = PointCloud.of(given)
    assert np.shares_memory(cloud.offsets, POINTS)
    assert cloud.points.tolist() == POINTS.tolist()
    assert three(cloud, "nx ny nz").tolist() == NORMALS.tolist()
    assert np.shares_memory(cloud.fields["nx"], NORMALS)
    assert three(cloud, "red green blue").tolist() == COLOURS.tolist()
    assert cloud.fields["red"].dtype == np.uint8
    assert cloud.fields["intensity"].tolist() == [1, 2, 3, 4]
    assert cloud.fields["intensity"].dtype == np.uint16
    assert cloud.fields["pair"].tolist() == [[0, 1], [2, 3], [4, 5], [6, 7]]


def test_a_legacy_cloud_is_shared() -> None:
    given = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(POINTS.astype(np.float64)))
    given.normals = o3d.utility.Vector3dVector(NORMALS.astype(np.float64))
    given.colors = o3d.utility.Vector3dVector(COLOURS / 255.0)
    cloud = PointCloud.of(given)
    assert np.shares_memory(cloud.offsets, np.asarray(given.points))
    assert cloud.points.tolist() == POINTS.tolist()
    np.testing.assert_array_equal(three(cloud, "nx ny nz"), NORMALS.astype(np.float64))
    assert three(cloud, "red green blue").tolist() == COLOURS.tolist()


def test_colours_from_0_to_1() -> None:
    given = o3d.t.geometry.PointCloud(tensor(POINTS))
    given.point["colors"] = tensor(np.array([[0, 0.5, 1]] * 4, np.float32))
    assert three(PointCloud.of(given), "red green blue")[0].tolist() == [0, 128, 255]


@pytest.mark.parametrize("make", [o3d.geometry.PointCloud, o3d.t.geometry.PointCloud])
def test_an_empty_cloud(make: Any) -> None:
    assert PointCloud.of(make()).points.shape == (0, 3)
    empty = PointCloud(np.zeros((0, 3))).to_open3d(tensor=make is o3d.t.geometry.PointCloud)
    assert type(empty) is make
    assert len(PointCloud.of(empty)) == 0


def test_attributes_with_more_axes_are_left_out() -> None:
    given = o3d.t.geometry.PointCloud(tensor(POINTS))
    given.point["covariances"] = tensor(np.zeros((4, 3, 3)))
    with pytest.warns(UserWarning, match=r"attribute 'covariances' of the shape \(4, 3, 3\)"):
        assert PointCloud.of(given).fields == {}


def test_what_else_open3d_has() -> None:
    assert np.shares_memory(PointCloud.of(tensor(POINTS)).offsets, POINTS)
    vector = o3d.utility.Vector3dVector(POINTS.astype(np.float64))
    assert PointCloud.of(vector).points.tolist() == POINTS.tolist()
    with pytest.raises(InvalidInputError, match=r"not open3d.*TriangleMesh"):
        PointCloud.of(o3d.geometry.TriangleMesh.create_box())


def test_a_cloud_on_a_gpu_is_refused() -> None:
    class Device:
        def get_type(self) -> Any:
            return o3d.core.Device.DeviceType.CUDA

        def __str__(self) -> str:
            return "CUDA:0"

    class OnGpu(o3d.t.geometry.PointCloud):  # type: ignore[misc]
        device = Device()

    with pytest.raises(InvalidInputError, match=r"the Open3D cloud lies on CUDA:0: take cloud.cpu\(\) first"):
        PointCloud.of(OnGpu())


def whole() -> PointCloud:
    fields: dict[str, NDArray[Any]] = dict(zip(("nx", "ny", "nz"), NORMALS.T, strict=True))
    fields |= dict(zip(("red", "green", "blue"), COLOURS.T, strict=True))
    fields |= {
        "label": np.array([4, 3, 2, 1], np.int32),
        "flag": np.array([True, False, True, False]),
        "half": np.array([0.5, 1, 1.5, 2], np.float16),
        "pair": np.arange(8.0).reshape(4, 2),
        "positions": np.arange(4.0),
    }
    return PointCloud(POINTS, fields=fields)


def test_to_a_tensor_cloud_and_back() -> None:
    cloud = whole()
    made = cloud.to_open3d(tensor=True)
    assert np.shares_memory(made.point.positions.numpy(), POINTS)
    np.testing.assert_array_equal(made.point.normals.numpy(), NORMALS)
    np.testing.assert_array_equal(made.point.colors.numpy(), COLOURS)
    assert made.point["label"].numpy().tolist() == [[4], [3], [2], [1]]
    back = PointCloud.of(made)
    np.testing.assert_array_equal(back.points, POINTS)
    assert sorted(back.fields) == sorted({*cloud.fields, "input_positions"} - {"positions"})
    for name, values in cloud.fields.items():
        other = back.fields["input_positions" if name == "positions" else name]
        np.testing.assert_array_equal(other, values)


def test_to_a_legacy_cloud_and_back() -> None:
    made = whole().to_open3d()
    assert type(made) is o3d.geometry.PointCloud
    np.testing.assert_array_equal(np.asarray(made.points), POINTS)
    np.testing.assert_array_equal(np.asarray(made.normals), NORMALS)
    np.testing.assert_allclose(np.asarray(made.colors), COLOURS / 255, rtol=0, atol=1e-12)
    back = PointCloud.of(made)
    assert sorted(back.fields) == ["blue", "green", "nx", "ny", "nz", "red"]
    assert three(back, "red green blue").tolist() == COLOURS.tolist()


def test_far_coordinates_keep_their_digits() -> None:
    far = PointCloud(POINTS, origin=np.array([500_000.25, 4_500_000.5, 100]))
    for as_tensor in (False, True):
        np.testing.assert_array_equal(PointCloud.of(far.to_open3d(tensor=as_tensor)).points, far.points)


def test_memory_that_must_not_be_written_is_copied() -> None:
    points = POINTS.copy()
    points.flags.writeable = False
    made = PointCloud(points).to_open3d(tensor=True)
    made.point.positions[0] = tensor(np.array([9, 9, 9], np.float32))
    assert points[0].tolist() == [0, 1, 2]


def test_extract_takes_both_kinds() -> None:
    rng = np.random.default_rng(3)
    points = (rng.uniform(-1, 1, (500, 3)) * [1, 1, 0.1]).astype(np.float32)
    cloud = PointCloud(points)
    expected = surfsig.extract(points, 0.5)
    for made in (cloud.to_open3d(), cloud.to_open3d(tensor=True)):
        np.testing.assert_array_equal(surfsig.extract(made, 0.5).k1, expected.k1)


def test_colours_of_16_bits() -> None:
    colours = np.array([[0, 1, 65535]] * 4, np.uint16)
    fields = dict(zip(("red", "green", "blue"), colours.T.copy(), strict=True))
    cloud = PointCloud(POINTS, fields=fields)
    np.testing.assert_allclose(np.asarray(cloud.to_open3d().colors), colours / 65535, rtol=1e-12)
    back = PointCloud.of(cloud.to_open3d(tensor=True))
    assert three(back, "red green blue").tolist() == colours.tolist()
    assert back.fields["red"].dtype == np.uint16
