"""How far a scan deviates from its surfaces: as a scalar field and as a picture."""

from pathlib import Path

import numpy as np
import pytest
import surface_scenes
from page_data import report_of

import surfsig
from surfsig import PointCloud, Surfaces
from surfsig.colors import symmetric_limit


@pytest.fixture(scope="module")
def found() -> Surfaces:
    return surfsig.find_surfaces(surface_scenes.on_a_plane().points)


def test_deviations_are_signed_distances_from_each_points_own_surface(found: Surfaces) -> None:
    deviations, points = found.deviations(), found.cloud.points
    np.testing.assert_array_equal(np.isnan(deviations), found.labels < 0)
    ball = found[2].members
    expected = np.linalg.norm(points[ball] - found[2].center, axis=1) - found[2].radius
    np.testing.assert_allclose(deviations[ball], expected, atol=1e-12)
    floor = found[0].members
    np.testing.assert_allclose(
        deviations[floor], (points[floor] - found[0].point) @ found[0].axis, atol=1e-12
    )
    assert np.nanstd(deviations) == pytest.approx(0.001, rel=0.05)
    deviations[:] = 0.0
    assert np.nanmax(found.deviations()) > 0.0


def test_points_without_a_surface_have_no_deviation() -> None:
    found = surfsig.find_surfaces(PointCloud(np.full((9, 3), np.nan)))
    assert np.isnan(found.deviations()).all()
    assert found.columns()["deviation"].dtype == np.float32


def test_the_page_colours_points_by_their_deviation(found: Surfaces, tmp_path: Path) -> None:
    found.write_report(tmp_path / "page.html")
    (layer,) = report_of(tmp_path / "page.html")["layers"]
    shown, deviations = layer["columns"]["deviation"], found.deviations()
    assert np.isnan(shown).sum() == np.isnan(deviations).sum()
    assert np.nanstd(shown) == pytest.approx(np.nanstd(deviations), rel=1e-3)
    np.testing.assert_array_equal(np.isnan(shown), layer["labels"] < 0)


def test_a_scale_is_symmetric_and_spans_nearly_all_values() -> None:
    values = np.concatenate([np.linspace(-1, 1, 99), [50.0, np.nan, np.inf]])
    assert symmetric_limit(values) == pytest.approx(0.95, abs=0.05)
    assert symmetric_limit(np.full(3, np.nan)) == 1.0
