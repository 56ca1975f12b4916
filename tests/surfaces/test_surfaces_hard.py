"""What is hard to find surfaces in: an answer that says so, never an error."""

import numpy as np
import pytest
import surface_scenes

import surfsig

HARD = {
    "empty": np.zeros((0, 3)),
    "all NaN": np.full((100, 3), np.nan),
    "two points": np.eye(3)[:2],
    "one place": np.ones((500, 3)),
    "a line": np.linspace(0, 1, 500)[:, None] * [1, 2, 3],
    "noise": np.random.default_rng(11).normal(size=(3000, 3)),
}


@pytest.mark.parametrize("name", list(HARD))
def test_nothing_is_found_where_nothing_is(name: str) -> None:
    found = surfsig.find_surfaces(HARD[name])
    assert len(found) == 0
    assert (found.labels == -1).all()
    assert "no surface found: " in found.summary()
    assert len(found.classes) == len(found.confidence) == len(HARD[name])
    assert not np.isnan(found.confidence).any()
    assert len(found.columns()["surface"]) == len(HARD[name])
    assert len(found.colors) == len(HARD[name])


def test_a_single_plane_is_one_plane() -> None:
    rng = np.random.default_rng(12)
    flat = np.column_stack([rng.uniform(0, 1, (5000, 2)), 0.001 * rng.normal(size=5000)])
    found = surfsig.find_surfaces(flat)
    assert [surface.kind for surface in found] == ["plane"]
    assert (found.labels == 0).mean() > 0.98


def test_points_that_are_not_finite_belong_to_none() -> None:
    points = surface_scenes.on_a_plane().points
    points[::7] = np.nan
    found = surfsig.find_surfaces(points)
    assert [surface.kind for surface in found] == ["plane", "cylinder", "sphere"]
    assert (found.labels[::7] == -1).all()
    assert (found.classes[::7] == surfsig.PointClass.UNKNOWN).all()
    assert (found.confidence[::7] == 0).all()
