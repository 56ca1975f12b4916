"""COPC files are cut into tiles by their octree, and no store is made."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig
from surfsig.tiles.copc import CopcSource, copc_of
from surfsig.tiles.plan import Plan
from surfsig.tiles.source import Source
from surfsig.tiles.survey import Survey

pytestmark = pytest.mark.filterwarnings("ignore:.*US survey foot")
RADIUS = 220.0


@pytest.fixture
def path(shared_data: Path) -> Path:
    path = shared_data / "formats" / "simple.copc.laz"
    if not path.exists():
        pytest.skip(f"no {path}")
    return path


def in_quarters(survey: Survey) -> Plan:
    """Cut a cloud in four, at the middle of its box."""
    x, y, _ = (survey.lowest + survey.highest) / 2
    return Plan((0, float(x), (1, float(y), 0, 1), (1, float(y), 2, 3)))


def made(path: Path, cut: Any = in_quarters) -> CopcSource:
    found = copc_of(Source.of(path), cut)
    assert found is not None
    return found


def test_each_point_has_one_tile_and_its_whole_halo(path: Path) -> None:
    whole, source = surfsig.read(path), made(path)
    assert source.facts.count == len(whole) == sum(source.counts)
    own = []
    for tile in range(4):
        points = source.read(tile, RADIUS)
        low, high = source.plan.boxes[tile]
        mine = points.cloud.points[points.own]
        assert ((mine >= low) & (mine < high)).all()
        inside = ((whole.points >= low - RADIUS) & (whole.points <= high + RADIUS)).all(axis=1)
        np.testing.assert_array_equal(points.cloud.points, whole.points[inside])
        for name, values in whole.fields.items():
            np.testing.assert_array_equal(points.cloud.fields[name], values[inside])
            assert points.cloud.fields[name].dtype == values.dtype
        own.append(mine)
    np.testing.assert_array_equal(
        np.sort(np.concatenate(own), axis=0), np.sort(whole.points, axis=0), "each point is written once"
    )


@pytest.mark.parametrize("how", [{"radius": RADIUS}, {"neighbors": 20}, {"radius": "auto"}], ids=str)
def test_tiles_have_the_bits_of_the_whole(
    path: Path, tmp_path: Path, how: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("surfsig.tiles.job.cut_by_count", lambda *_: in_quarters)
    found = surfsig.extract_tiles(path, tmp_path / "out", suffix=".npz", **how)
    assert not list((tmp_path / "out" / "store").glob("*")) if (tmp_path / "out" / "store").exists() else True
    parts, whole = found.read(), surfsig.read(path)
    assert len(parts) == len(whole)
    expected = surfsig.extract(whole, **how)
    # By time: each point has its own.
    order = np.lexsort([parts.points[:, 0], parts.fields["gps_time"]])
    theirs = np.lexsort([whole.points[:, 0], whole.fields["gps_time"]])
    np.testing.assert_array_equal(parts.points[order], whole.points[theirs])
    for name, values in expected.columns().items():
        assert parts.fields[name][order].tobytes() == np.ascontiguousarray(values[theirs]).tobytes(), name


def test_what_only_all_points_tell_is_looked_up(path: Path) -> None:
    from surfsig import _surfsig

    whole, facts = surfsig.read(path), made(path).facts
    single, lattice = _surfsig.coordinate_resolution(whole.offsets, origin=whole.origin.tolist())
    assert (facts.single_precision, list(facts.lattice)) == (single, list(lattice))
    places = _surfsig.different_places(whole.points[_surfsig.sampled_numbers(len(whole))])
    np.testing.assert_array_equal(facts.places, places)


def test_a_box_or_a_unit_needs_the_store(path: Path, tmp_path: Path) -> None:
    found = surfsig.extract_tiles(path, tmp_path / "out", 70.0, unit="ft", tiles=2)
    assert (tmp_path / "out" / "store" / "index.json").exists()
    assert found.is_finished
