"""NPY, NPZ and Parquet: arrays by other names than surfsig's, and what is no cloud."""

import decimal
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import read

POINTS = np.random.default_rng(8).normal(size=(40, 3))


def points_of(path: Path) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return np.asarray(read(path).points)


@pytest.mark.parametrize("name", ["xyz", "pos", "coords", "Points", "vertices"])
def test_a_triple_of_coordinates_has_many_names(tmp_path: Path, name: str) -> None:
    arrays: dict[str, Any] = {name: POINTS, "colour": POINTS}
    np.savez(tmp_path / "scan.npz", **arrays)
    np.testing.assert_array_equal(points_of(tmp_path / "scan.npz"), POINTS)
    rows = np.zeros(len(POINTS), [(name, "f8", 3), ("other", "f8", 3)])
    rows[name] = POINTS
    np.save(tmp_path / "scan.npy", rows)
    np.testing.assert_array_equal(points_of(tmp_path / "scan.npy"), POINTS)


def test_upper_case_arrays(tmp_path: Path) -> None:
    np.savez(tmp_path / "scan.npz", X=POINTS[:, 0], Y=POINTS[:, 1], Z=POINTS[:, 2])
    np.testing.assert_array_equal(points_of(tmp_path / "scan.npz"), POINTS)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"points": POINTS, "x": POINTS[:, 0] + 1}, "both 'points' and 'x' may be the coordinates"),
        ({"xyz": POINTS, "pos": POINTS}, "no array 'points'"),
        ({"points": POINTS, "grid": np.array([np.nan, 1])}, "grid must be two whole numbers"),
        ({"points": POINTS, "grid": np.array([1, 2, 3])}, "grid must be two whole numbers"),
        ({"points": POINTS, "grid": np.array(5)}, "grid must be two whole numbers"),
    ],
)
def test_arrays_that_contradict_each_other(tmp_path: Path, arrays: dict[str, Any], message: str) -> None:
    np.savez(tmp_path / "scan.npz", **arrays)
    with pytest.raises(FileFormatError, match=re.escape(message)):
        read(tmp_path / "scan.npz")


def test_a_transposed_array_is_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", POINTS.T)
    np.savetxt(tmp_path / "scan.txt", POINTS.T)
    for name in ("scan.npy", "scan.txt"):
        with pytest.raises(FileFormatError, match="3 rows of 40 numbers without names are hardly points"):
            read(tmp_path / name)
        names = ["x", "y", "z", *(f"n{i}" for i in range(37))]
        assert len(read(tmp_path / name, columns=names)) == 3


def test_parquet_says_which_columns_hold_no_numbers(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = dict(zip("xyz", POINTS.T, strict=True))
    parquet.write_table(pa.table({**columns, "name": ["a"] * len(POINTS)}), tmp_path / "scan.parquet")
    with pytest.warns(UserWarning, match="left out what holds no numbers: 'name'"):
        cloud = read(tmp_path / "scan.parquet")
    np.testing.assert_array_equal(cloud.points, POINTS)


def test_exact_decimals_of_parquet_are_numbers(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    exact = {
        axis: pa.array([decimal.Decimal(f"{value:.3f}") for value in column])
        for axis, column in zip("xyz", POINTS.T, strict=True)
    }
    parquet.write_table(pa.table(exact), tmp_path / "scan.parquet")
    np.testing.assert_allclose(points_of(tmp_path / "scan.parquet"), POINTS, atol=5.1e-4)


def test_an_empty_path_is_not_the_current_folder() -> None:
    with pytest.raises(InvalidInputError, match="the path is empty"):
        read("")
