"""Text that is written: what comes back, and what other programs see."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.files import Chunks, format_name, read, write
from surfsig.point_cloud import PointCloud

RNG = np.random.default_rng(4)


def example(count: int = 50) -> tuple[PointCloud, dict[str, NDArray[Any]]]:
    points = (RNG.normal(size=(count, 3)) * [1e-3, 1, 1e5]).astype(np.float32)
    points[3, 1] = np.nan
    points[4] = np.inf
    fields: dict[str, NDArray[Any]] = {
        "intensity": np.arange(count, dtype=np.uint16) + 60_000,
        "red": np.arange(count, dtype=np.uint8),
        "green": np.arange(count, dtype=np.uint8),
        "blue": np.arange(count, dtype=np.uint8),
        "time of flight": RNG.normal(size=count) * 1e-9,
    }
    columns: dict[str, NDArray[Any]] = {
        "k1": RNG.normal(size=count).astype(np.float32),
        "direction": RNG.normal(size=(count, 2)),
        "count": np.arange(count, dtype=np.int64) - 2**53,
        "good": np.arange(count) % 2 == 0,
    }
    return PointCloud(points, viewpoint=np.array([0.1, -2, 1e6]), fields=fields), columns


NAMES = [
    "intensity", "red", "green", "blue", "time_of_flight", "k1", "direction_0", "direction_1", "count",
    "good",
]  # fmt: skip


@pytest.mark.parametrize("extension", ["xyz", "txt", "asc", "csv", "CSV"])
def test_numbers_come_back_with_the_same_bits(tmp_path: Path, extension: str) -> None:
    cloud, columns = example()
    path = tmp_path / f"a.{extension}"
    write(path, cloud, columns, notes={"radius": "0.02"})
    again = read(path)
    # Not "PTS", which the number at the end of a comment could be taken for.
    assert format_name(path) == "text"
    np.testing.assert_array_equal(again.points.astype(np.float32), cloud.points)
    assert list(again.fields) == NAMES
    written = [
        *cloud.fields.values(),
        columns["k1"],
        *columns["direction"].T,
        columns["count"],
        columns["good"],
    ]
    for values, found in zip(written, again.fields.values(), strict=True):
        np.testing.assert_array_equal(found.astype(values.dtype), values)
    assert again.fields["red"].dtype == np.uint8
    if extension.lower() == "csv":
        assert again.viewpoint is None
    else:
        assert again.viewpoint is not None
        assert again.viewpoint.tolist() == [0.1, -2, 1e6]


def test_csv_as_other_programs_read_it(tmp_path: Path) -> None:
    cloud, columns = example()
    write(tmp_path / "a.csv", cloud, columns, notes={"radius": "0.02"})
    frame = pytest.importorskip("pandas").read_csv(tmp_path / "a.csv")
    assert list(frame.columns) == ["x", "y", "z", *NAMES]
    np.testing.assert_array_equal(frame[["x", "y", "z"]].to_numpy(np.float32), cloud.points)
    assert frame["count"].tolist() == columns["count"].tolist()


def test_text_as_other_programs_read_it(tmp_path: Path) -> None:
    # Open3D reads the first three numbers of each line that begins with them; CloudCompare's header is //.
    cloud, columns = example()
    write(tmp_path / "a.xyz", cloud, columns, notes={"radius": "0.02\nand more"})
    lines = (tmp_path / "a.xyz").read_text().splitlines()
    assert lines[:3] == [
        "//x y z " + " ".join(NAMES),
        "// surfsig viewpoint 0.1 -2.0 1000000.0",
        "// surfsig radius 0.02 and more",
    ]
    table = np.loadtxt(io.StringIO("\n".join(lines)), comments="//")
    np.testing.assert_array_equal(table[:, :3].astype(np.float32), cloud.points)
    bare = PointCloud(np.array([[0.1, 0.25, 1e-9], [1 / 3, 5e5, np.nan]]))
    write(tmp_path / "b.xyz", bare)
    assert (tmp_path / "b.xyz").read_text() == "0.1 0.25 1e-09\n0.3333333333333333 500000.0 nan\n"
    write(tmp_path / "c.csv", PointCloud(np.array([[0.1, 0.25, 100]], np.float32)))
    assert (tmp_path / "c.csv").read_text() == "x,y,z\n0.1,0.25,100.0\n"


def test_names_that_need_quotes(tmp_path: Path) -> None:
    fields = {"a,b": np.arange(2), 'say "x"': np.arange(2) + 5, "X": np.arange(2) + 7}
    cloud = PointCloud(np.arange(6.0).reshape(2, 3), fields=fields)
    for name in ("a.csv", "a.txt"):
        write(tmp_path / name, cloud)
        again = read(tmp_path / name)
        assert again.points.tolist() == cloud.points.tolist()
        assert [values.tolist() for values in again.fields.values()] == [[0, 1], [5, 6], [7, 8]]
        assert next(iter(again.fields)) == "a,b"


def test_blocks_and_progress(tmp_path: Path) -> None:
    count = 40_000
    cloud = PointCloud(RNG.normal(size=(count, 3)), origin=np.array([400000.0, 5e6, 0]))
    values = RNG.normal(size=(count, 2)).astype(np.float32)
    told: list[tuple[int, int]] = []
    chunks = Chunks("w", 2, np.float32, (values[start : start + 17_000] for start in range(0, count, 17_000)))
    write(
        tmp_path / "a.csv",
        cloud,
        {"n": np.arange(count)},
        chunks=chunks,
        progress=lambda *at: told.append(at),
    )
    again = read(tmp_path / "a.csv")
    np.testing.assert_array_equal(again.points, cloud.points)
    assert list(again.fields) == ["n", "w_0", "w_1"]
    np.testing.assert_array_equal(again.fields["w_1"].astype(np.float32), values[:, 1])
    assert told[-1] == (count, count)
