"""Sound LAS and LAZ files, and bytes of them changed."""

import contextlib
import io
import struct
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import laspy
import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import read
from surfsig.point_cloud import PointCloud

COUNT = 700
START = (96, "I")
"""Where a header says where the points start."""


def points(count: int = COUNT) -> NDArray[np.float64]:
    i = np.arange(count)
    return np.column_stack([0.1 * i, 0.2 * i + 1, 0.05 * i**2])


def las(
    point_format: int = 6,
    version: str = "1.4",
    *,
    compressed: bool = False,
    extra: Mapping[str, NDArray[Any]] = MappingProxyType({}),
) -> bytearray:
    """Make a file of laspy's with `points` and these extra dimensions."""
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.scales = np.full(3, 0.001)
    header.add_extra_dims(
        [laspy.ExtraBytesParams(name, f"{values.shape[1]}u1") for name, values in extra.items()]
    )
    data = laspy.LasData(header)
    data.xyz = points()
    data.return_number[:] = np.ones(COUNT, np.uint8)
    for name, values in extra.items():
        data[name] = values
    file = io.BytesIO()
    data.write(file, do_compress=compressed)
    return bytearray(file.getvalue())


def patched(content: bytes | bytearray, *changes: tuple[int, str, float]) -> bytearray:
    changed = bytearray(content)
    for place, kind, value in changes:
        struct.pack_into("<" + kind, changed, place, value)
    return changed


def cloud_of(folder: Path, content: bytes | bytearray, **options: Any) -> PointCloud:
    path = folder / "a.las"
    path.write_bytes(content)
    return read(path, **options)


@contextlib.contextmanager
def no_warning() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def assert_whole(cloud: PointCloud, count: int = COUNT) -> None:
    np.testing.assert_allclose(cloud.points, points(count), atol=6e-4)


def refused(folder: Path, content: bytes | bytearray, message: str) -> None:
    with pytest.raises(FileFormatError, match=message) as error:
        cloud_of(folder, content)
    assert "\n" not in str(error.value)
