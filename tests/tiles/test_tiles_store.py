"""Binning: all points, each once, as `surfsig.read` gives them; and any box of them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tile_scenes import town, town_files

import surfsig
from surfsig import PointCloud
from surfsig.files.read_file import ReadOptions
from surfsig.tiles import binning
from surfsig.tiles.binning import store_of
from surfsig.tiles.plan import Plan, planned
from surfsig.tiles.source import Source
from surfsig.tiles.store import Store
from surfsig.tiles.survey import Survey


def cut_into(tiles: int) -> binning.Cut:
    def cut(survey: Survey) -> Plan:
        return planned(survey.cells, 10**9, tiles)

    return cut


def made(paths: Any, folder: Path, tiles: int = 7, **options: Any) -> Store:
    return store_of(Source.of(paths, ReadOptions(**options)), folder, cut_into(tiles))


def check_same(found: PointCloud, expected: PointCloud) -> None:
    assert found.points.tobytes() == expected.points.tobytes()
    assert found.offsets.dtype == expected.offsets.dtype
    np.testing.assert_array_equal(found.origin, expected.origin)
    assert list(found.fields) == list(expected.fields)
    for name, values in expected.fields.items():
        assert found.fields[name].dtype == values.dtype, name
        assert found.fields[name].tobytes() == values.tobytes(), name
    for name in ("viewpoint", "viewpoints"):
        mine, theirs = getattr(found, name), getattr(expected, name)
        assert (mine is None) == (theirs is None)
        if theirs is not None:
            np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize(
    "suffix", [".laz", ".las", ".ply", ".xyz", ".csv", ".pcd", ".npz", ".parquet", ".e57"]
)
@pytest.mark.parametrize("files", [1, 3])
def test_everything_is_what_read_gives(tmp_path: Path, suffix: str, files: int) -> None:
    paths = town_files(tmp_path / "in", 3000, suffix, files)
    source = paths[0] if files == 1 else paths
    whole = surfsig.read(source)
    store = made(source, tmp_path / "store")
    assert store.facts.count == len(whole) == sum(store.counts)
    everything = np.array([[-np.inf] * 3, [np.inf] * 3])
    check_same(store.read_box(everything), whole)
    numbers = []
    for tile in range(len(store.plan)):
        points = store.read(tile, 1.5)
        # In the order of the input, as they are there.
        assert (np.diff(points.numbers.astype(np.int64)) > 0).all()
        check_same(points.cloud, whole.at(points.numbers.astype(np.int64)))
        numbers.append(points.numbers[points.own])
        assert len(numbers[-1]) == store.counts[tile]
        # All points around the tile are there.
        box = store.plan.boxes[tile] + np.array([[-1.5], [1.5]])
        inside = ((whole.points >= box[0]) & (whole.points <= box[1])).all(axis=1)
        assert set(np.flatnonzero(inside)) <= set(points.numbers.tolist())
    np.testing.assert_array_equal(np.sort(np.concatenate(numbers)), np.arange(len(whole)))


def test_small_blocks_and_buffers_change_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = town_files(tmp_path / "in", 5000)
    monkeypatch.setattr(binning, "BLOCK_ROWS", 100)
    monkeypatch.setattr(binning, "BUFFER_BYTES", 50_000)
    monkeypatch.setattr("surfsig.files.blocks.BLOCK_POINTS", 700)
    store = made(paths, tmp_path / "store")
    whole = surfsig.read(paths)
    box = np.array([[389_010.0, 5_819_005.0, 0.0], [389_015.5, 5_819_009.0, 100.0]])
    inside = ((whole.points >= box[0]) & (whole.points <= box[1])).all(axis=1)
    assert 50 < inside.sum() < 1000
    check_same(store.read_box(box), whole.at(inside))


def test_points_on_borders_and_corners_are_in_one_tile(tmp_path: Path) -> None:
    # A grid of quarters: cuts lie on multiples of powers of two, so on rows of points.
    grid = (
        np.stack(np.meshgrid(np.arange(64), np.arange(48), [0, 1], indexing="ij"), axis=-1).reshape(-1, 3) / 4
    )
    surfsig.write(tmp_path / "grid.ply", grid)
    store = made(tmp_path / "grid.ply", tmp_path / "store", 13)
    owned = [store.read(tile, 0.0) for tile in range(13)]
    numbers = np.concatenate([tile.numbers[tile.own] for tile in owned])
    np.testing.assert_array_equal(np.sort(numbers), np.arange(len(grid)))
    borders = np.concatenate([grid[tile.numbers[~tile.own].astype(int)] for tile in owned])
    # A halo of nothing has the points on the upper faces, which belong to the next tile.
    assert len(borders) > 0
    for tile, points in enumerate(owned):
        mine = points.cloud.points[points.own]
        low, high = store.plan.boxes[tile]
        assert ((mine >= low) & (mine < high)).all()


def test_colours_and_types_that_only_all_points_tell(tmp_path: Path) -> None:
    cloud = town(2000)
    cloud.fields["red"] = np.zeros(2000, np.uint16)
    cloud.fields["green"] = cloud.fields["blue"] = cloud.fields["red"]
    one, two = tmp_path / "a.laz", tmp_path / "b.laz"
    surfsig.write(one, cloud)
    cloud.fields["red"] = np.where(np.arange(2000) == 1234, 4000, 7).astype(np.uint16)
    surfsig.write(two, cloud)
    for name, paths in (("1", one), ("2", [one, two]), ("3", [two, one])):
        whole = surfsig.read(paths)
        store = made(paths, tmp_path / name, 5)
        for tile in range(5):
            points = store.read(tile, 0.5)
            check_same(points.cloud, whole.at(points.numbers.astype(np.int64)))


def test_fields_and_precisions_that_differ_between_files(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    points = rng.uniform(0, 10, (900, 3))
    parts = [
        PointCloud(points[:300].astype(np.float32), fields={"a": np.arange(300, dtype=np.uint8)}),
        PointCloud(
            points[300:600], np.array([100.0, 0, 0]), fields={"a": np.arange(300) / 7, "b": np.ones(300)}
        ),
        PointCloud(points[600:] + np.nan),
        PointCloud(
            points[600:], fields={"a": np.arange(300, dtype=np.int32)}, viewpoint=np.array([0.0, 0, 30])
        ),
    ]
    paths = [tmp_path / f"{i}.{kind}" for i, kind in enumerate(["ply", "npz", "npz", "ply"])]
    for path, part in zip(paths, parts, strict=True):
        part.fields.setdefault("a", np.zeros(len(part), np.int16))
        surfsig.write(path, part)
    with pytest.warns(UserWarning, match="left out"):
        whole = surfsig.read(paths)
    with pytest.warns(UserWarning, match="left out"):
        store = made(paths, tmp_path / "store", 6)
    points_of_all = []
    for tile in range(6):
        points_read = store.read(tile, 1.0)
        check_same(points_read.cloud, whole.at(points_read.numbers.astype(np.int64)))
        points_of_all.append(points_read.numbers[points_read.own])
    np.testing.assert_array_equal(np.sort(np.concatenate(points_of_all)), np.arange(1200))


def test_a_store_is_reused_until_the_input_changes(tmp_path: Path) -> None:
    paths = town_files(tmp_path / "in", 2000)
    looks = []
    source = Source.of(paths)

    def store() -> Store:
        return store_of(source, tmp_path / "store", cut_into(4), reading=lambda *told: looks.append(told))

    first = store()
    count = len(looks)
    assert count > 0
    again = store()
    assert len(looks) == count
    assert again.counts == first.counts
    check_same(again.read(2, 1.0).cloud, first.read(2, 1.0).cloud)
    surfsig.write(paths[1], town(500))
    assert store().facts.count == 667 + 500 + 666
    assert len(looks) > count


def test_box_and_unit_are_those_of_read(tmp_path: Path) -> None:
    paths = town_files(tmp_path / "in", 3000)
    box = [[389_005, 5_819_002, 0], [389_030, 5_819_020, 43]]
    whole = surfsig.read(paths, box=box, unit="ft")
    store = made(paths, tmp_path / "store", 3, box=box, unit="ft")
    check_same(store.read_box(np.array([[-np.inf] * 3, [np.inf] * 3])), whole)


def test_a_first_look_that_misleads_is_made_again(tmp_path: Path) -> None:
    # Sorted along x: the beginning of the only chunk says nothing of the rest.
    cloud = town(60_000)
    surfsig.write(tmp_path / "in.laz", cloud.at(np.argsort(cloud.offsets[:, 0])))
    looks: list[int] = []
    store = store_of(
        Source.of(tmp_path / "in.laz"),
        tmp_path / "store",
        cut_into(8),
        reading=lambda done, total: looks.append(done),
    )
    assert looks != sorted(looks)
    assert max(store.counts) < 1.1 * 60_000 / 8


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    paths = town_files(tmp_path / "in", 3000)
    monkeypatch.setattr("surfsig.tiles.binning.rows_path", lambda *_: Path("/dev/full"))
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        made(paths, tmp_path / "store")
