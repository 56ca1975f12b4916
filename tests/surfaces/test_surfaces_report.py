"""The page about surfaces: points, labels and table. web/tests shows it in a browser."""

from pathlib import Path

import numpy as np
import pytest
import surface_scenes
from page_data import report_of
from surface_points import UTM, Array

import surfsig
from surfsig import PointCloud


@pytest.mark.parametrize("origin", [np.zeros(3), UTM])
def test_the_page_holds_points_labels_and_table(tmp_path: Path, origin: Array) -> None:
    found = surfsig.find_surfaces(PointCloud(surface_scenes.on_a_plane().points, origin))
    found.write_report(tmp_path / "report.html", title="a < b & c")
    assert "<title>a &lt; b &amp; c</title>" in (tmp_path / "report.html").read_text(encoding="utf-8")
    report = report_of(tmp_path / "report.html")
    (layer,) = report["layers"]
    assert report["rows"] == [list(row) for row in found.table()[1]]
    assert report["quantity"] == "surface"
    for number in range(-1, len(found)):
        members = found.cloud.points[found.labels == number]
        shown = layer["points"][layer["labels"] == number]
        assert len(shown) == len(members)
        np.testing.assert_allclose(shown.mean(axis=0), members.mean(axis=0), atol=1e-4)


def test_a_page_without_surfaces(tmp_path: Path) -> None:
    surfsig.find_surfaces(np.full((9, 3), np.nan)).write_report(tmp_path / "report.html")
    report = report_of(tmp_path / "report.html")
    assert "no surface found: of 9 points none is finite" in report["text"]
    assert report["layers"][0]["count"] == 0
