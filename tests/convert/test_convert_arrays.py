"""Arrays of other libraries: shared memory, structured arrays, DLPack."""

import enum
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, PointCloud

POINTS = np.arange(12, dtype=np.float32).reshape(4, 3)


class Shared:
    """A tensor of a library that knows DLPack only."""

    def __init__(self, array: NDArray[Any], device: int = 1) -> None:
        self.array, self.device = array, device

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.device, 0

    def __dlpack__(self, **more: Any) -> Any:
        return self.array.__dlpack__(**more)


class Interface:
    """An image or buffer with the array interface."""

    def __init__(self, array: NDArray[Any]) -> None:
        self.array = array
        self.__array_interface__ = array.__array_interface__


class Refusing(Shared):
    """A tensor that must not leave its library, as PyTorch's with gradients."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> NDArray[Any]:
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.\nUse tensor.detach().numpy()")


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("wrapped", [np.asarray, Shared, Interface, memoryview])
def test_memory_is_shared(dtype: type, wrapped: Any) -> None:
    points: NDArray[Any] = POINTS.astype(dtype)
    cloud = PointCloud.of(wrapped(points))
    assert np.shares_memory(cloud.offsets, points)
    assert cloud.offsets.dtype == dtype
    assert cloud.points.tolist() == points.tolist()


def test_a_cloud_is_taken_as_it_is() -> None:
    cloud = PointCloud(POINTS)
    assert PointCloud.of(cloud) is cloud


def test_rows_that_are_not_contiguous_are_copied() -> None:
    wide = np.arange(16, dtype=np.float32).reshape(4, 4)
    cloud = PointCloud.of(Shared(wide[:, :3]))
    assert cloud.points.tolist() == wide[:, :3].tolist()
    assert cloud.offsets.flags.c_contiguous


def test_numpy_reads_a_cloud() -> None:
    cloud = PointCloud(POINTS)
    assert np.asarray(cloud) is cloud.offsets
    assert not np.shares_memory(np.array(cloud), POINTS)
    assert np.asarray(cloud, np.float64).dtype == np.float64
    far = PointCloud(POINTS, origin=np.array([1000.0, 0, 0]))
    assert np.asarray(far)[1].tolist() == [1003, 4, 5]
    for whole, dtype in ((far, None), (cloud, np.float64)):
        with pytest.raises(ValueError, match="without a copy"):
            whole.__array__(dtype, copy=False)
    assert cloud.__array__(copy=False) is cloud.offsets


def test_a_structured_array_is_points_and_fields() -> None:
    kind = [
        ("intensity", "<u2"),
        ("X", "<f4"),
        ("Y", "<f4"),
        ("Z", "<f4"),
        ("name", "U3"),
        ("pair", "<f8", (2,)),
    ]
    rows = np.zeros(4, kind)
    rows["intensity"] = [5, 6, 7, 8]
    rows["pair"] = [[1, 2], [3, 4], [5, 6], [7, 8]]
    for i, axis in enumerate("XYZ"):
        rows[axis] = POINTS[:, i]
    with pytest.warns(UserWarning, match="left out the field 'name'"):
        cloud = PointCloud.of(rows)
    assert cloud.points.tolist() == POINTS.tolist()
    assert cloud.fields["intensity"].tolist() == [5, 6, 7, 8]
    assert cloud.fields["pair"].tolist() == rows["pair"].tolist()
    assert list(cloud.fields) == ["intensity", "pair"]


def test_a_structured_array_of_coordinates_alone_is_shared() -> None:
    rows = POINTS.view([("x", "<f4"), ("y", "<f4"), ("z", "<f4")])[:, 0]
    cloud = PointCloud.of(rows)
    assert np.shares_memory(cloud.offsets, POINTS)
    assert cloud.points.tolist() == POINTS.tolist()
    swapped = POINTS.view([("z", "<f4"), ("y", "<f4"), ("x", "<f4")])[:, 0]
    assert PointCloud.of(swapped).points.tolist() == POINTS[:, ::-1].tolist()
    big = POINTS.astype(">f4").view([("x", ">f4"), ("y", ">f4"), ("z", ">f4")])[:, 0]
    assert PointCloud.of(big).points.tolist() == POINTS.tolist()


def test_an_organised_structured_array_has_a_grid() -> None:
    rows = POINTS.view([("x", "<f4"), ("y", "<f4"), ("z", "<f4")]).reshape(2, 2)
    cloud = PointCloud.of(rows)
    assert cloud.grid == (2, 2)
    assert cloud.points.tolist() == POINTS.tolist()


def test_memory_of_a_gpu_is_refused() -> None:
    with pytest.raises(InvalidInputError, match=r"Shared lies on a GPU: copy it to the CPU first"):
        PointCloud.of(Shared(POINTS, device=2))

    class Numba:
        __cuda_array_interface__ = POINTS.__array_interface__

    with pytest.raises(InvalidInputError, match="lies on a GPU"):
        PointCloud.of(Numba())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (Refusing(POINTS), r"Refusing does not give its numbers: Can't call numpy.* Use tensor.detach"),
        (object(), r"\(n, 3\) array, or a cloud of another library, not builtins.object"),
        (np.zeros(4, [("x", "f4"), ("y", "f4")]), "the structured array: no column 'z'"),
        (np.zeros(4, [("x", "U1"), ("y", "f4"), ("z", "f4")]), "no column 'x'"),
        ([[1, 2, 3], [4, 5]], "rows differ in length"),
    ],
)
@pytest.mark.filterwarnings("ignore:the structured array")
def test_what_is_no_cloud(data: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message) as caught:
        PointCloud.of(data)
    assert "\n" not in str(caught.value)


def test_a_device_named_by_an_enumeration_is_understood() -> None:
    class Kind(enum.Enum):
        CPU = 1

    class Named(Shared):
        def __dlpack_device__(self) -> Any:
            return Kind.CPU, 0

    assert np.shares_memory(PointCloud.of(Named(POINTS)).offsets, POINTS)


def test_functions_take_other_libraries_clouds() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, (500, 3)).astype(np.float32) * [1, 1, 0.1]
    expected = surfsig.extract(points, 0.5)
    result = surfsig.extract(Shared(points), 0.5)  # type: ignore[arg-type]
    np.testing.assert_array_equal(result.k1, expected.k1)
    assert np.shares_memory(result.points, points)


def test_importing_surfsig_imports_no_other_library() -> None:
    names = "('pandas', 'pyarrow', 'open3d', 'torch', 'small_gicp', 'matplotlib')"
    program = f"import sys, surfsig; print([name for name in {names} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_torch_tensors() -> None:
    torch = pytest.importorskip("torch")
    tensor = torch.arange(12, dtype=torch.float32).reshape(4, 3)
    assert np.shares_memory(PointCloud.of(tensor).offsets, tensor.numpy())
    with pytest.raises(InvalidInputError, match="requires grad"):
        PointCloud.of(tensor.requires_grad_())
