"""The table of surfaces as CSV and Excel, in Python and in the shell."""

import csv
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import surface_scenes
from conftest import Finished

import surfsig
from surfsig import InvalidInputError, PointCloud, Surfaces

Shell = Callable[..., Finished]


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tables") / "scan.ply"
    surfsig.write(path, PointCloud(surface_scenes.on_a_plane().points))
    return path


@pytest.fixture(scope="module")
def found(scan: Path) -> Surfaces:
    return surfsig.find_surfaces(surfsig.read(scan))


def check(header: list[str], rows: list[list[Any]], found: Surfaces) -> None:
    """Compare a table that was read with the surfaces; what is empty is None or ""."""
    values = [dict(zip(header, row, strict=True)) for row in rows]
    assert [int(row["number"]) for row in values] == [0, 1, 2]
    assert [row["kind"] for row in values] == ["plane", "cylinder", "sphere"]
    for row, surface in zip(values, found, strict=True):
        for name in ("radius", "radius_std", "length", "width", "area", "rms", "count"):
            expected = getattr(surface, name)
            assert (row[name] in ("", None)) == math.isnan(expected)
            assert math.isnan(expected) or float(row[name]) == pytest.approx(expected, rel=1e-15)
        assert [float(row[f"center_{axis}"]) for axis in "xyz"] == pytest.approx(surface.center)
    assert float(values[2]["radius_low"]) == pytest.approx(found[2].interval[0], rel=1e-15)


def test_csv(found: Surfaces, tmp_path: Path) -> None:
    found.write_csv(tmp_path / "table.csv")
    header, *rows = csv.reader((tmp_path / "table.csv").open(encoding="utf-8", newline=""))
    check(header, rows, found)


def test_csv_has_the_columns_of_pandas(found: Surfaces, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    found.write_csv(tmp_path / "table.csv")
    pandas.testing.assert_frame_equal(
        pandas.read_csv(tmp_path / "table.csv", index_col="number"),
        found.to_pandas(),
        check_names=False,
        check_dtype=False,
    )


def test_excel(found: Surfaces, tmp_path: Path) -> None:
    pytest.importorskip("xlsxwriter")
    openpyxl = pytest.importorskip("openpyxl")
    found.write_excel(tmp_path / "table.xlsx")
    header, *rows = openpyxl.load_workbook(tmp_path / "table.xlsx")["surfaces"].values
    check(list(header), [list(row) for row in rows], found)


def test_tables_without_surfaces(tmp_path: Path) -> None:
    nothing = surfsig.find_surfaces(np.zeros((0, 3)))
    nothing.write_csv(tmp_path / "table.csv")
    assert (tmp_path / "table.csv").read_text().startswith("number,kind,radius,")
    pytest.importorskip("xlsxwriter")
    nothing.write_excel(tmp_path / "table.xlsx")
    assert (tmp_path / "table.xlsx").read_bytes()[:2] == b"PK"


def test_the_shell_writes_tables(shell: Shell, scan: Path, found: Surfaces, tmp_path: Path) -> None:
    pytest.importorskip("xlsxwriter")
    finished = shell("surfaces", scan, "-q", "--csv", tmp_path / "a.csv", "--excel", tmp_path / "a.xlsx")
    assert (finished.code, finished.err) == (0, "")
    found.write_csv(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert (tmp_path / "a.xlsx").stat().st_size > 4000


def test_what_cannot_be_written_is_said_before_the_work(
    shell: Shell, scan: Path, found: Surfaces, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finished = shell("surfaces", scan, "--csv", "nowhere/table.csv")
    assert (finished.code, finished.err.count("\n")) == (2, 1)
    assert "nowhere/table.csv" in finished.err
    monkeypatch.setitem(sys.modules, "xlsxwriter", None)
    finished = shell("surfaces", scan, "--excel", tmp_path / "table.xlsx")
    assert (finished.code, finished.err.count("\n")) == (2, 1)
    assert "XlsxWriter is not installed: pip install surfsig[excel]" in finished.err
    assert not (tmp_path / "table.xlsx").exists()
    with pytest.raises(InvalidInputError, match="XlsxWriter is not installed"):
        found.write_excel(tmp_path / "table.xlsx")
    assert not list(tmp_path.iterdir())
