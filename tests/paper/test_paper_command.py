"""`surfsig paper`: its files, and that they hold what was measured."""

import contextlib
import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surfsig.cli import run
from surfsig.paper.printed import SIMILARITIES

pytest.importorskip("matplotlib")

PICTURES = {f"figure{i}" for i in range(1, 8)} | {
    "overview",
    "decisions_by_pose",
    "flat_limit",
    "random_self",
    "random_confusion",
    "radius_ratio",
    "vocabulary_end",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("paper") / "made" / "here"
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert run(["paper", "--out", str(out), "--seeds", "1", "--json"]) == 0
    (out / "stdout").write_text(printed.getvalue())
    return out


@pytest.fixture(scope="module")
def report(folder: Path) -> dict[str, Any]:
    values: dict[str, Any] = json.loads((folder / "tables.json").read_text())
    return values


@pytest.mark.slow
def test_files(folder: Path) -> None:
    assert {p.stem for p in folder.glob("*.png")} == PICTURES
    for picture in folder.glob("*.png"):
        assert picture.read_bytes().startswith(b"\x89PNG")
    assert {p.name for p in folder.iterdir() if p.suffix != ".png"} == {
        "index.html",
        "tables.csv",
        "tables.json",
        "stdout",
    }


@pytest.mark.slow
def test_json_on_stdout_is_the_file(folder: Path, report: dict[str, Any]) -> None:
    assert json.loads((folder / "stdout").read_text()) == report


@pytest.mark.slow
def test_decisions(report: dict[str, Any]) -> None:
    counts = report["decisions"]
    assert (counts["of_positives"], counts["of_negatives"]) == (8, 49)
    assert counts["positives"] == 8
    assert counts["negatives"] >= 48
    frames = {(f["as_printed"], f["offset_levels"]): f for f in report["decisions_by_frame"]}
    assert set(frames) == {(p, n) for p in (True, False) for n in (3, 9)}
    assert frames[True, 3]["stated"]["median_seed"] == counts
    assert frames[True, 3]["smallest_eigenvalue"]["ours"] == pytest.approx(2.37e-4, abs=1e-6)
    # What is counted is what the tables hold.
    rows = [row for name in ("IV", "V", "VI") for row in report["tables"][name]["rows"]]
    assert len(rows) == 57
    same = [row["printed_decision"] == (row["stated"]["median"] >= 0.5) for row in rows]
    assert sum(same) == counts["positives"] + counts["negatives"]
    named = {(d["reference"], d["acquisition"]) for d in report["differences"]["stated"]}
    assert len(named) == 57 - sum(same)
    assert all(len(d["why"]) > 50 for found in report["differences"].values() for d in found)
    assert [row["scale"] for row in report["sweep"]] == [0.0, 0.5, 1.0, 2.0]


@pytest.mark.slow
def test_table_one_holds_with_the_power_three_halves_only(report: dict[str, Any]) -> None:
    plane, cylinder, sphere = report["tables"]["I"]
    assert (plane["K"]["value"], plane["H"]["value"]) == (0.0, 0.0)
    assert cylinder["H"]["value"] == pytest.approx(1 / (2 * 0.02427))
    assert sphere["K"]["value"] == pytest.approx(1 / 0.0297**2)
    for row in (cylinder, sphere):
        assert row["K"]["eq3_tilted"] == pytest.approx(row["K"]["value"], rel=1e-9)
        assert row["H"]["eq4_tilted"] == pytest.approx(row["H"]["value"], rel=1e-9)
        printed = row["H"]["value"] * np.cos(np.radians(30))
        assert row["H"]["eq4_as_printed_tilted"] == pytest.approx(printed, rel=1e-9)
        assert row["H_scanned"]["median"] == pytest.approx(row["H"]["value"], rel=0.05)


@pytest.mark.slow
def test_tables_two_and_three(report: dict[str, Any]) -> None:
    two = {row["parameter"]: row for row in report["tables"]["II"]}
    for name in "abcdf":
        assert two[name]["ours"] == pytest.approx(two[name]["printed"])
    assert two["e"]["ours"] == pytest.approx([-50, 50])
    assert [two[name]["levels"] for name in "abcdef"] == [21, 21, 5, 5, 11, 3]
    three = report["tables"]["III"]
    # The paraboloid's bias on a ball of 20 mm.
    assert three[8]["k1"]["median"] == pytest.approx(27.5, abs=0.3)
    assert three[8]["true_curvature"] == pytest.approx(1 / 0.03827)
    assert three[13]["k1"]["median"] > 90 > three[13]["true_curvature"]


@pytest.mark.slow
def test_random_poses(report: dict[str, Any]) -> None:
    paper, own, own_half = report["random_poses"]
    assert paper["self_similarity"]["cylinder"] < 0.5
    for way in (own, own_half):
        assert way["self_similarity"]["cylinder"] >= 0.9
        assert way["false_matches"]["largest_share"] <= 0.01
    assert min(own_half["self_similarity"].values()) >= 0.9
    assert min(a["alike_with_itself"] for a in own_half["acquisitions"][:19]) >= 0.9
    assert np.sum(own_half["confusion"]["shares"], axis=1) == pytest.approx(np.ones(11))


@pytest.mark.slow
def test_csv_holds_the_tables(folder: Path, report: dict[str, Any]) -> None:
    with (folder / "tables.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    zeta = [row for row in rows if row["quantity"] == "zeta"]
    assert [row["table"] for row in zeta] == ["IV"] * 19 + ["V"] * 19 + ["VI"] * 19
    assert sum(float(row["printed"]) for row in zeta) == pytest.approx(
        sum(table.zeta.sum() for table in SIMILARITIES)
    )
    ours = [row["stated"]["median"] for name in ("IV", "V", "VI") for row in report["tables"][name]["rows"]]
    assert [float(row["median"]) for row in zeta] == pytest.approx(ours)
    assert {row["table"] for row in rows} >= {"I", "II", "III", "frame", "random poses"}


@pytest.mark.slow
def test_the_page_needs_nothing_else(folder: Path) -> None:
    page = (folder / "index.html").read_text()
    assert page.count('src="data:image/png;base64,') == len(PICTURES)
    assert page.count("<img ") == len(PICTURES)
    for outside in ("http://", "https://", "<script", "<link", "url("):
        assert outside not in page
    assert "0.5951" in page
    assert page.count("<table>") == 8


def test_bad_input_is_one_line(shell: Callable[..., Any], tmp_path: Path) -> None:
    occupied = tmp_path / "file"
    occupied.write_text("")
    for arguments in (["--seeds", "0", "--out", tmp_path / "x"], ["--out", occupied], []):
        finished = shell("paper", *arguments)
        assert finished.code == 2
        assert finished.err.startswith("surfsig: error: ")
        assert finished.err.count("\n") == 1
    assert not (tmp_path / "x").exists()
