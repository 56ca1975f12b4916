"""Surfaces that go on from tile to tile: as many as there are, measured as all points together tell."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import Finished
from numpy.typing import NDArray
from surface_tile_scenes import LENGTH, NOISE, ORIGIN, RADIUS, pipe, plant, plant_files
from tile_scenes import in_order

import surfsig
from surfsig import InvalidInputError, TilesFailedError
from surfsig.tiles import surface_parts, surface_pieces

TILES = 12


def run(paths: Any, out: Path, **more: Any) -> surfsig.TileSurfaces:
    asked = {"tiles": TILES, "numbers": True, "suffix": ".npz", "halo": 1.5, **more}
    return surfsig.find_surfaces_tiles(paths, out, **asked)


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return plant_files(tmp_path_factory.mktemp("plant") / "in")


@pytest.fixture(scope="module")
def found(paths: list[Path], tmp_path_factory: pytest.TempPathFactory) -> surfsig.TileSurfaces:
    return run(paths, tmp_path_factory.mktemp("found") / "out")


def labels_of(found: surfsig.TileSurfaces) -> NDArray[np.int32]:
    """Give the labels in the order of the input."""
    return np.asarray(in_order(found.read()).fields["surface"])


def hashes(out: Path) -> dict[str, str]:
    records = json.loads((out / "manifest.json").read_text())["tiles"]
    return {record["part"]: record["sha256"] for record in records}


def test_surfaces_over_all_tiles_are_one_each(found: surfsig.TileSurfaces) -> None:
    cloud, truth = plant()
    labels = labels_of(found)
    assert [surface.kind for surface in found].count("cylinder") == 2
    assert len(found) == 5
    # Each surface is one of the true ones, and has nearly all of its points.
    owner = [np.bincount(truth[labels == number]).argmax() for number in range(5)]
    assert sorted(owner) == [0, 1, 2, 3, 4]
    right = np.array([*owner, -1])[labels] == truth
    assert right.mean() > 0.97
    for number, surface in enumerate(found):
        assert surface.count == (labels == number).sum()
        half = truth[labels == number][0] > 2
        assert len(surface.tiles) >= (TILES // 2 if half else TILES)
        assert surface.length == pytest.approx(LENGTH / 2 if half else LENGTH, abs=0.3)
        assert surface.rms == pytest.approx(NOISE, rel=0.1)
        members = cloud.at(labels == number)
        deviation = surface.distances(members)
        part = in_order(found.read()).at(labels == number)
        np.testing.assert_allclose(part.fields["deviation"], deviation, atol=1e-6)


def test_sizes_are_right_within_their_errors(found: surfsig.TileSurfaces) -> None:
    whole = surfsig.find_surfaces(plant()[0])
    for surface in found:
        same = min(whole, key=lambda other: float(np.linalg.norm(other.center - surface.center)))
        assert same.kind == surface.kind
        assert surface.count == pytest.approx(same.count, rel=0.03)
        assert surface.area == pytest.approx(same.area, rel=0.1)
        if surface.kind == "cylinder":
            assert abs(surface.radius - RADIUS) < 4 * surface.radius_std
            assert 0.5 < surface.radius_std / same.radius_std < 2
            assert abs(surface.radius - same.radius) < surface.radius_std
            assert surface.arc == pytest.approx(same.arc, abs=0.05)
            assert abs(surface.axis[0]) > 1 - 1e-6
        else:
            true = ORIGIN[1] + min(
                (0, 6, 6 + 8 * NOISE), key=lambda y: abs(ORIGIN[1] + y - surface.center[1])
            )
            assert abs(surface.center[1] - true) < 4 * surface.center_std[1]
            assert surface.width == pytest.approx(same.width, abs=0.05)
        np.testing.assert_allclose(surface.center, same.center, atol=0.2)


def test_tables_have_all_surfaces(found: surfsig.TileSurfaces) -> None:
    folder = found.tiles.folder
    values = json.loads((folder / "surfaces.json").read_text())
    assert [one["count"] for one in values["surfaces"]] == [surface.count for surface in found]
    assert values["summary"] == found.summary()
    assert "5 surfaces: 3 planes, 2 cylinders" in found.summary()
    lines = (folder / "surfaces.csv").read_text().splitlines()
    assert len(lines) == 6
    table = found.to_pandas()
    parquet = pytest.importorskip("pyarrow.parquet").read_table(folder / "surfaces.parquet").to_pandas()
    np.testing.assert_allclose(parquet["radius"], table["radius"])
    assert parquet["kind"].tolist() == [surface.kind for surface in found]
    header, rows = found.table()
    assert len(rows) == 5
    assert len(rows[0]) == len(header)
    again = surfsig.TileSurfaces(folder)
    for one, other in zip(again, found, strict=True):
        np.testing.assert_array_equal(one.covariance, other.covariance)
        np.testing.assert_array_equal(one.axis, other.axis)
        np.testing.assert_array_equal(one.interval, other.interval)
    # What was needed on the way is gone.
    assert not (folder / "pieces").exists()


def test_the_columns_are_those_of_a_whole_cloud(found: surfsig.TileSurfaces, paths: list[Path]) -> None:
    whole = surfsig.read(paths)
    parts = in_order(found.read())
    columns = surfsig.find_surfaces(whole).columns()
    assert columns.keys() <= parts.fields.keys()
    for name, values in columns.items():
        assert parts.fields[name].dtype == values.dtype, name
    same = (parts.fields["surface"] >= 0) & (columns["surface"] >= 0)
    assert same.mean() > 0.97
    for name in ("surface_kind", "point_class"):
        assert (parts.fields[name] == columns[name])[same].mean() > 0.99
    np.testing.assert_allclose(parts.fields["confidence"][same], columns["confidence"][same], atol=0.05)
    np.testing.assert_array_equal(parts.points, whole.points)


def test_a_run_that_was_stopped_goes_on(
    found: surfsig.TileSurfaces, paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[tuple[str, int]] = []

    def counted(task: Any, name: str, stop: int) -> Any:
        work = task.__call__

        def call(self: Any, tile: int, *rest: Any) -> Any:
            if (name, stop) not in done and tile == stop:
                done.append((name, stop))
                raise KeyboardInterrupt
            done.append((name, tile))
            return work(self, tile, *rest)

        monkeypatch.setattr(task, "__call__", call)

    counted(surface_pieces.FindTask, "find", 3)
    counted(surface_parts.MeasureTask, "measure", 5)
    counted(surface_parts.WriteTask, "write", 7)
    # What is begun goes on with its own tiles, whatever is asked for then.
    for tiles in (TILES, 3, 2 * TILES):
        with pytest.raises(KeyboardInterrupt):
            run(paths, tmp_path / "out", tiles=tiles)
    run(paths, tmp_path / "out")
    # Each was stopped once and worked on once.
    for name, stop in (("find", 3), ("measure", 5), ("write", 7)):
        worked_on = [tile for what, tile in done if what == name]
        assert sorted(worked_on) == sorted([*range(TILES), stop]), name
    assert hashes(tmp_path / "out") == hashes(found.tiles.folder)
    number = len(done)
    run(paths, tmp_path / "out")
    assert len(done) == number


@pytest.mark.slow
def test_the_number_of_threads_changes_nothing(
    found: surfsig.TileSurfaces, paths: list[Path], tmp_path: Path
) -> None:
    run(paths, tmp_path / "out", threads=1)
    assert hashes(tmp_path / "out") == hashes(found.tiles.folder)
    table = "surfaces.json"
    assert (tmp_path / "out" / table).read_text() == (found.tiles.folder / table).read_text()


@pytest.mark.slow
def test_workers_of_a_cluster_change_nothing(
    found: surfsig.TileSurfaces, paths: list[Path], tmp_path: Path
) -> None:
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        run(paths, tmp_path / "out", client=client)
    assert hashes(tmp_path / "out") == hashes(found.tiles.folder)


def test_other_arguments_and_other_runs_are_refused(found: surfsig.TileSurfaces, paths: list[Path]) -> None:
    folder = found.tiles.folder
    with pytest.raises(InvalidInputError, match=r"kinds .*, not \['plane'\]"):
        run(paths, folder, kinds=["plane"])
    with pytest.raises(InvalidInputError, match="was begun with"):
        surfsig.extract_tiles(paths, folder, 0.5)
    with pytest.raises(InvalidInputError, match="halo must be"):
        run(paths, folder, halo=-1.0)
    with pytest.raises(InvalidInputError, match="noise must be"):
        run(paths, folder, noise=-1.0)


def test_an_extraction_is_no_run_of_surfaces(paths: list[Path], tmp_path: Path) -> None:
    surfsig.extract_tiles(paths, tmp_path / "out", 0.5, tiles=2)
    with pytest.raises(InvalidInputError, match="was begun with"):
        run(paths, tmp_path / "out")
    with pytest.raises(InvalidInputError, match=r"holds no surfaces.json"):
        surfsig.TileSurfaces(tmp_path / "out")


def test_a_small_surface_on_a_border_is_whole(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    points = pipe(rng, 12_000, 0.0, (0.0, 20.0))
    towards = rng.normal(size=(1500, 3))
    ball = 0.25 * towards / np.linalg.norm(towards, axis=1)[:, None] + rng.normal(0, 0.002, (1500, 3))
    # In the middle, where the one cut is.
    ball += [10.0, 5.0, 1.0]
    cloud = surfsig.PointCloud(np.concatenate([points, ball]), ORIGIN)
    surfsig.write(tmp_path / "in.ply", cloud)
    found = run(tmp_path / "in.ply", tmp_path / "out", tiles=2)
    spheres = [surface for surface in found if surface.kind == "sphere"]
    assert len(spheres) == 1
    assert spheres[0].tiles == (0, 1)
    assert spheres[0].count > 1450
    assert abs(spheres[0].radius - 0.25) < 4 * spheres[0].radius_std
    assert abs(spheres[0].center[0] - ORIGIN[0] - 10) < 0.01


def test_tiles_without_points_and_surfaces(tmp_path: Path) -> None:
    few = surfsig.PointCloud(np.array([[0.0, 0, 0], [1, 0, 0], [7, 1, 1], [8, 2, 5], [np.nan, 0, 0]]))
    surfsig.write(tmp_path / "few.ply", few)
    for tiles in (1, 2, 9):
        found = run(tmp_path / "few.ply", tmp_path / f"{tiles}", tiles=tiles)
        assert len(found) == 0
        assert found.summary() == "no surface found in 5 points"
        assert (found.read().fields["surface"] == -1).all()
        assert found.tiles.is_finished


@pytest.mark.parametrize(
    ("task", "tile"), [("FindTask", 4), pytest.param("MeasureTask", 2, marks=pytest.mark.slow)]
)
def test_a_tile_that_fails_once_is_as_if_it_never_had(
    found: surfsig.TileSurfaces, paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    task: str, tile: int,
) -> None:  # fmt: skip
    module: Any = surface_pieces if task == "FindTask" else surface_parts
    work = getattr(module, task).__call__

    def fails(self: Any, number: int, *rest: Any) -> Any:
        return {"tile": number, "error": "no"} if number == tile else work(self, number, *rest)

    with monkeypatch.context() as patched:
        patched.setattr(getattr(module, task), "__call__", fails)
        with pytest.raises(TilesFailedError, match=f"1 of {TILES} tiles could not be read.*tile {tile}: no"):
            run(paths, tmp_path / "out")
        # What all others have is there.
        assert len(surfsig.TileSurfaces(tmp_path / "out")) >= 5
    run(paths, tmp_path / "out")
    assert hashes(tmp_path / "out") == hashes(found.tiles.folder)
    for table in ("surfaces.json", "surfaces.csv"):
        assert (tmp_path / "out" / table).read_text() == (found.tiles.folder / table).read_text()


def test_a_file_that_cannot_be_read_costs_its_tiles_only(tmp_path: Path) -> None:
    cloud, _ = plant(density=40.0)
    paths = [tmp_path / f"{i}.laz" for i in range(4)]
    for i, path in enumerate(paths):
        surfsig.write(path, cloud.at((cloud.offsets[:, 0] // 15).astype(int) == i))
    data = paths[3].read_bytes()
    paths[3].write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(TilesFailedError, match=r"tiles could not be read.*3\.laz"):
        run(paths, tmp_path / "out", tiles=8)
    found = surfsig.TileSurfaces(tmp_path / "out")
    assert not found.tiles.is_finished
    assert [surface.kind for surface in found].count("cylinder") == 2
    assert max(surface.length for surface in found) > 35


def test_the_command_line(shell: Callable[..., Finished], paths: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = shell("surfaces", *paths, "-o", out, "--tiles", 3, "--csv", tmp_path / "t.csv")
    assert done.code == 0, done.err
    assert "5 surfaces: 3 planes, 2 cylinders" in done.out
    assert len((tmp_path / "t.csv").read_text().splitlines()) == 6
    assert (out / "tile_000002.laz").exists()
    for wrong, why in (
        (["-o", out, "--recurrences"], "--recurrences is not for work in tiles"),
        (["--tiles", "3"], "--tiles needs a folder"),
        (["-o", tmp_path / "one.ply", "--restart"], "--restart needs a folder"),
    ):
        refused = shell("surfaces", *paths, *wrong)
        assert refused.code == 2
        assert why in refused.err
