"""Colours mean what their type says, in every format; in text, what the text says."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.files import read, write
from surfsig.files.colours import with_colours
from surfsig.point_cloud import PointCloud

NAMES = ("red", "green", "blue")
# What is in the file, and what the cloud has: by type, not by value.
TYPES: list[tuple[NDArray[Any], NDArray[Any]]] = [
    (np.array([0, 1, 1], np.uint8), np.array([0, 1, 1], np.uint8)),
    (np.array([0, 1, 255], np.uint16), np.array([0, 1, 255], np.uint16)),
    (np.array([0, 1, 255], np.int64), np.array([0, 1, 255], np.uint8)),
    (np.array([0, 1, 65535], np.int32), np.array([0, 1, 65535], np.uint16)),
    (np.array([0, 1, 70000], np.int32), np.array([0, 1, 70000], np.int32)),
    (np.array([0, 1, 1], np.float32), np.array([0, 255, 255], np.uint8)),
    (np.array([0, 0.5, 1 + 1e-7]), np.array([0, 128, 255], np.uint8)),
    (np.array([0, 1, 255], np.float32), np.array([0, 1, 255], np.float32)),
    (np.array([0, np.nan, 1], np.float32), np.array([0, np.nan, 1], np.float32)),
]


@pytest.mark.parametrize("kind", ["npy", "npz", "parquet", "pandas", "numpy"])
@pytest.mark.parametrize(("given", "expected"), TYPES)
def test_colours_keep_their_meaning(
    tmp_path: Path, kind: str, given: NDArray[Any], expected: NDArray[Any]
) -> None:
    columns: dict[str, NDArray[Any]] = {axis: np.arange(3.0) for axis in "xyz"}
    columns |= dict.fromkeys("rgb", given)
    rows = np.zeros(3, [(name, values.dtype) for name, values in columns.items()])
    for name, values in columns.items():
        rows[name] = values
    if kind == "npy":
        np.save(tmp_path / "a.npy", rows)
        cloud = read(tmp_path / "a.npy")
    elif kind == "npz":
        np.savez(tmp_path / "a.npz", **columns)  # type: ignore[arg-type]
        cloud = read(tmp_path / "a.npz")
    elif kind == "numpy":
        cloud = PointCloud.of(rows)
    else:
        pandas = pytest.importorskip("pandas")
        frame = pandas.DataFrame(columns)
        if kind == "parquet":
            pytest.importorskip("pyarrow")
            frame.to_parquet(tmp_path / "a.parquet")
        cloud = PointCloud.of(frame) if kind == "pandas" else read(tmp_path / "a.parquet")
    found = list(cloud.fields.values())
    for values in found:
        np.testing.assert_array_equal(values, expected)
        assert values.dtype == expected.dtype


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["0 128 255", "1 1 1"], [[0, 128, 255], [1, 1, 1]]),
        (["0.0 0.5 1.0", "1 1 1"], [[0, 128, 255], [255, 255, 255]]),
        (["0.0 0.0 1.0", "1.0 0.0 1.0"], [[0, 0, 255], [255, 0, 255]]),
        (["0 0 1e0", "1 0 1"], [[0, 0, 255], [255, 0, 255]]),
        (["255.0 0.0 7.0", "1.0 0.0 1.0"], [[255, 0, 7], [1, 0, 1]]),
        (["0 0 0", "0 0 0"], [[0, 0, 0], [0, 0, 0]]),
        (["0 300 65535", "1 1 1"], [[0, 300, 65535], [1, 1, 1]]),
    ],
)
def test_colours_in_text_are_what_the_text_says(
    tmp_path: Path, rows: list[str], expected: list[list[int]]
) -> None:
    text = "x y z red green blue\n" + "".join(f"1.5 2.5 3.5 {row}\n" for row in rows)
    (tmp_path / "a.txt").write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = read(tmp_path / "a.txt")
    found = np.column_stack([cloud.fields[name] for name in NAMES])
    np.testing.assert_array_equal(found, expected)
    assert found.dtype == (np.uint16 if np.max(expected) > 255 else np.uint8)


def test_colours_of_0_and_1_in_text_may_mean_two_things(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("x,y,z,red,green,blue\n1,2,3,0,0,1\n4,5,6,1,0,1\n")
    with pytest.warns(UserWarning, match="its colours are 0 and 1 alone, written as whole numbers"):
        cloud = read(tmp_path / "a.csv")
    assert cloud.fields["blue"].tolist() == [1, 1]


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("255 0 7 1", [255, 0, 7, 1]),
        ("0.5 0 1.0 0.2", [128, 0, 255, 51]),
        ("255 0 7 0.2", [255, 0, 7, 51]),
    ],
)
def test_alpha_in_text(tmp_path: Path, row: str, expected: list[int]) -> None:
    (tmp_path / "a.txt").write_text(f"x y z r g b a\n1 2 3 {row}\n")
    cloud = read(tmp_path / "a.txt")
    assert [int(values[0]) for values in cloud.fields.values()] == expected
    assert list(cloud.fields) == [*NAMES, "alpha"]


def test_what_is_no_colour_stays_as_it_is() -> None:
    whole, floating = np.array([1, 2]), np.array([0.5, 1])
    for fields in (
        {"red": whole, "green": whole},
        {"red": whole, "green": floating, "blue": whole},
        {"red": whole, "r": whole, "green": whole, "blue": whole},
        {"red": whole[:, None], "green": whole[:, None], "blue": whole[:, None]},
        {"r": -whole, "g": whole, "b": whole},
        {"r": 2 * floating, "g": floating, "b": floating},
    ):
        found = with_colours(fields)
        assert list(found) == list(fields)
        assert all(found[name] is fields[name] for name in fields)


def test_an_empty_cloud_has_colours() -> None:
    for kind in (np.uint8, np.float32, np.int64):
        fields = {name: np.zeros(0, kind) for name in "rgb"}
        assert [values.dtype for values in with_colours(fields).values()] == [np.uint8] * 3


def test_16_bits_survive_every_format_that_has_types(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    dark = {name: np.array([0, 1, 255], np.uint16) for name in NAMES}
    cloud = PointCloud(np.arange(9.0, dtype=np.float32).reshape(3, 3), fields=dark)
    for suffix in (".ply", ".pcd", ".npz", ".parquet"):
        write(tmp_path / f"a{suffix}", cloud)
        for values in read(tmp_path / f"a{suffix}").fields.values():
            assert values.dtype == np.uint16
            assert values.tolist() == [0, 1, 255]
    # LAS has no other colours than those of 16 bits, which many programs fill with 8.
    write(tmp_path / "a.las", cloud)
    assert read(tmp_path / "a.las").fields["red"].dtype == np.uint8
