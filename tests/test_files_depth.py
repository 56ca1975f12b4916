"""Depth images against the pinhole camera's formula and Open3D; images that are none."""

import io
import json
import struct
import sys
import tracemalloc
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import format_name, read

Image = pytest.importorskip("PIL.Image")

CAMERA = (525.0, 520.0, 31.5, 20.25)


def depths(dtype: Any = np.uint16) -> NDArray[Any]:
    rng = np.random.default_rng(4)
    image = rng.integers(1, np.iinfo(dtype).max, (40, 64), dtype)
    image[rng.random(image.shape) < 0.1] = 0
    return image


def png(image: NDArray[Any], **options: Any) -> bytes:
    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG", **options)
    return file.getvalue()


def saved(folder: Path, content: bytes) -> Path:
    path = folder / "depth.png"
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("dtype", [np.uint16, np.uint8])
@pytest.mark.parametrize("scale", [None, 5000.0])
def test_pixels_become_points(tmp_path: Path, dtype: Any, scale: float | None) -> None:
    image = depths(dtype)
    path = saved(tmp_path, png(image))
    cloud = read(path, intrinsics=CAMERA, depth_scale=scale)
    assert format_name(path) == "PNG image"
    assert cloud.grid == (40, 64)
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [0, 0, 0]
    assert cloud.points.dtype == np.float32
    fx, fy, cx, cy = CAMERA
    v, u = np.indices(image.shape)
    z = np.where(image == 0, np.nan, image / (scale or 1000.0))
    expected = np.stack([(u - cx) * z / fx, (v - cy) * z / fy, z], axis=2).astype(np.float32)
    np.testing.assert_array_equal(cloud.points.reshape(40, 64, 3), expected)
    assert not cloud.finite[image.ravel() == 0].any()
    assert cloud.finite[image.ravel() > 0].all()


def test_as_open3d_projects(tmp_path: Path) -> None:
    o3d = pytest.importorskip("open3d")
    path = saved(tmp_path, png(depths()))
    camera = o3d.camera.PinholeCameraIntrinsic(64, 40, *CAMERA)
    theirs = o3d.geometry.PointCloud.create_from_depth_image(
        o3d.io.read_image(str(path)), camera, depth_scale=1000.0, depth_trunc=1e9
    )
    ours = read(path, intrinsics=CAMERA)
    np.testing.assert_allclose(ours.points[ours.finite], np.asarray(theirs.points), rtol=2e-7)


def test_box_and_unit_apply(tmp_path: Path) -> None:
    path = saved(tmp_path, png(depths()))
    whole = read(path, intrinsics=CAMERA)
    cloud = read(path, intrinsics=CAMERA, depth_scale=1, unit="mm", box=[[-1e9, -1e9, 0], [0, 1e9, 30_000]])
    chosen = whole.finite & (whole.points[:, 0] <= 0) & (whole.points[:, 2] <= 30)
    assert 100 < len(cloud) == chosen.sum()
    np.testing.assert_allclose(cloud.points, whole.points[chosen], rtol=2e-7)


def test_intrinsics_are_asked_for(tmp_path: Path) -> None:
    path = saved(tmp_path, png(depths()))
    with pytest.raises(InvalidInputError, match=r"--intrinsics fx,fy,cx,cy") as error:
        read(path)
    assert str(error.value).startswith(str(path))


@pytest.mark.parametrize("intrinsics", [1, [1, 2, 3], "wide", [0, 1, 2, 3], [1, -1, 2, 3], [1, 1, np.nan, 0]])
def test_intrinsics_that_make_no_sense(tmp_path: Path, intrinsics: Any) -> None:
    with pytest.raises(InvalidInputError, match="must be four numbers"):
        read(saved(tmp_path, png(depths())), intrinsics=intrinsics)


@pytest.mark.parametrize("scale", [0, -1, np.nan, np.inf, "large"])
def test_scales_that_make_no_sense(tmp_path: Path, scale: Any) -> None:
    with pytest.raises(InvalidInputError, match="depth_scale must be a positive number"):
        read(saved(tmp_path, png(depths())), intrinsics=CAMERA, depth_scale=scale)


@pytest.mark.parametrize("scale", [1e-40, 1e-320])
def test_a_tiny_scale_warns_of_nothing(tmp_path: Path, scale: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = read(saved(tmp_path, png(depths())), intrinsics=CAMERA, depth_scale=scale)
    assert not cloud.finite.any()


def test_other_formats_take_no_intrinsics(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("1 2 3\n")
    with pytest.raises(InvalidInputError, match="holds text data, for which 'intrinsics' means nothing"):
        read(tmp_path / "a.xyz", intrinsics=CAMERA)


def header_only(width: int, height: int, bits: int = 16) -> bytes:
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    data = b"IDAT" + zlib.compress(bytes(100))
    chunks = [
        struct.pack(">I", len(chunk) - 4) + chunk + struct.pack(">I", zlib.crc32(chunk))
        for chunk in (head, data)
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (png(np.zeros((4, 4, 3), np.uint8)), "is a colour image, not one of depths"),
        (png(np.zeros((4, 4, 4), np.uint8)), "is a colour image, not one of depths"),
        (png(np.zeros((4, 4), bool)), "its pixels have 1 bits, depths 8 or 16"),
        (png(depths())[:20], "the PNG image is cut off"),
        (png(depths())[:-500], "the PNG image is cut off or broken"),
        (header_only(40_000, 40_000), "its header promises 40000 x 40000 pixels"),
        (header_only(2**31, 2**31), "its header promises 2147483648 x 2147483648 pixels"),
    ],
)
def test_images_that_are_no_depths(tmp_path: Path, content: bytes, message: str) -> None:
    path = saved(tmp_path, content)
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match=message) as error:
            read(path, intrinsics=CAMERA)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    assert "\n" not in str(error.value)


def test_without_pillow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = saved(tmp_path, png(depths()))
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(InvalidInputError, match=r"needs? Pillow: pip install 'surfsig\[image\]'") as error:
        read(path, intrinsics=CAMERA)
    assert str(error.value).startswith(str(path))


def test_a_colour_image_is_named_before_intrinsics_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="is a colour image"):
        read(saved(tmp_path, png(np.zeros((4, 4, 3), np.uint8))))


def test_a_chunk_that_claims_gigabytes_allocates_none(tmp_path: Path) -> None:
    content = png(depths()).replace(struct.pack(">I", 13) + b"IHDR", struct.pack(">I", 0xF0000000) + b"IHDR")
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match="cut off or broken"):
            read(saved(tmp_path, content), intrinsics=CAMERA)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_an_image_of_many_short_rows(tmp_path: Path) -> None:
    image = np.full((200_000, 1), 7, np.uint16)
    points = read(saved(tmp_path, png(image)), intrinsics=(1, 1, 0, 0)).points
    expected = np.column_stack([np.zeros(200_000), np.arange(200_000) * 0.007, np.full(200_000, 0.007)])
    np.testing.assert_allclose(points, expected, rtol=1e-7)


def test_what_pillow_warns_of_is_no_matter(tmp_path: Path) -> None:
    # An animation without pictures.
    chunk = b"acTL" + bytes(8)
    extra = struct.pack(">I", 8) + chunk + struct.pack(">I", zlib.crc32(chunk))
    whole = png(depths())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = read(saved(tmp_path, whole[:33] + extra + whole[33:]), intrinsics=CAMERA)
    assert cloud.grid == (40, 64)


def test_from_the_shell(shell: Callable[..., Any], tmp_path: Path) -> None:
    path = saved(tmp_path, png(depths()))
    asked = shell("info", path)
    assert asked.code == 2
    assert "--intrinsics fx,fy,cx,cy" in asked.err
    camera = ("--intrinsics", "525,520,31.5,20.25", "--depth-scale", 5000)
    assert shell("convert", path, tmp_path / "a.ply", *camera).code == 0
    cloud = read(tmp_path / "a.ply")
    assert cloud.grid == (40, 64)
    np.testing.assert_array_equal(cloud.points, read(path, intrinsics=CAMERA, depth_scale=5000).points)
    values = json.loads(shell("info", path, *camera, "--json").out)
    assert (values["format"], values["grid"], values["viewpoint"]) == ("PNG image", [40, 64], [0, 0, 0])
