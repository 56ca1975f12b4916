"""What happens to a run: it goes on, is refused, fails in part, or finds no room."""

import errno
import json
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tile_scenes import RADIUS, check_equal, town, town_files

import surfsig
from surfsig import InvalidInputError, TilesFailedError
from surfsig.tiles import task as task_module
from surfsig.tiles.lock import locked
from surfsig.tiles.memory import memory_bytes, points_per_tile


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return town_files(tmp_path_factory.mktemp("town"), 4000)


def hashes(out: Path) -> dict[int, str]:
    return {
        record["tile"]: record["sha256"]
        for record in json.loads((out / "manifest.json").read_text())["tiles"]
    }


def run(paths: Any, out: Path, radius: float = RADIUS, **more: Any) -> surfsig.TileDataset:
    return surfsig.extract_tiles(paths, out, radius, **{"tiles": 6, "numbers": True, **more})


def test_the_manifest_says_how_and_what(paths: list[Path], tmp_path: Path) -> None:
    found = run(paths, tmp_path / "out")
    manifest = found.manifest
    assert manifest["finished"] is True
    assert manifest["arguments"]["radius"] == RADIUS
    assert [file["path"] for file in manifest["inputs"]["files"]] == [str(path) for path in paths]
    assert sum(record["points"] for record in manifest["tiles"]) == manifest["points"] == 4000
    for record in manifest["tiles"]:
        part = tmp_path / "out" / record["part"]
        assert part.stat().st_size == record["bytes"]
        assert record["read"] > record["points"]
        assert sum(record["status"].values()) == record["points"]


def test_what_a_killed_process_had_begun_to_write_is_removed(paths: list[Path], tmp_path: Path) -> None:
    found = run(paths, tmp_path / "out")
    assert found.status_counts() == surfsig.TileDataset(tmp_path / "out").status_counts()
    assert sum(found.status_counts().values()) == 4000
    left = [tmp_path / "out" / ".tile_000000.laz.0123.tmp", tmp_path / "out/records/.000000.json.45.tmp"]
    for file in left:
        file.write_bytes(b"half")
    run(paths, tmp_path / "out")
    assert not any(file.exists() for file in left)


def test_a_run_that_was_stopped_goes_on(
    paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run(paths, tmp_path / "whole")
    done: list[int] = []
    work = task_module.ExtractTask._extracted

    def stops(self: Any, tile: int, *rest: Any) -> Any:
        if len(done) == 2 and tile == 2:
            raise KeyboardInterrupt
        done.append(tile)
        return work(self, tile, *rest)

    monkeypatch.setattr(task_module.ExtractTask, "_extracted", stops)
    with pytest.raises(KeyboardInterrupt):
        run(paths, tmp_path / "out")
    state = surfsig.open(tmp_path / "out")
    assert isinstance(state, surfsig.TileDataset)
    assert not state.is_finished
    assert [part.path is not None for part in state.tiles] == [True, True, False, False, False, False]
    assert not list((tmp_path / "out").glob(".*.tmp"))
    done.append(-1)
    run(paths, tmp_path / "out")
    assert done == [0, 1, -1, 2, 3, 4, 5]
    assert hashes(tmp_path / "out") == hashes(tmp_path / "whole")
    run(paths, tmp_path / "out")
    assert len(done) == 7


def test_a_store_that_was_removed_is_made_again_with_the_same_tiles(
    paths: list[Path], tmp_path: Path
) -> None:
    run(paths, tmp_path / "out")
    before = hashes(tmp_path / "out")
    shutil.rmtree(tmp_path / "out" / "store")
    (tmp_path / "out" / "records" / "000003.json").unlink()
    run(paths, tmp_path / "out", tiles=2)
    assert hashes(tmp_path / "out") == before


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 0.5}, "radius 0.9, not 0.5"),
        ({"robust": True}, "robust False, not True"),
        ({"suffix": ".ply"}, "suffix .laz, not .ply"),
        ({"box": [[0, 0, 0], [1e7, 1e7, 1e7]]}, r"\(box\) changed"),
    ],
    ids=str,
)
def test_other_arguments_are_refused_or_begin_anew(
    paths: list[Path], tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    run(paths, tmp_path / "out")
    before = hashes(tmp_path / "out")
    with pytest.raises(InvalidInputError, match=message):
        run(paths, tmp_path / "out", **change)
    assert hashes(tmp_path / "out") == before
    found = run(paths, tmp_path / "out", restart=True, **change)
    assert found.is_finished
    assert hashes(tmp_path / "out") != before
    assert len(list((tmp_path / "out").glob("tile_*"))) == 6


def test_inputs_that_changed_are_refused(tmp_path: Path) -> None:
    paths = town_files(tmp_path / "in", 2000)
    run(paths, tmp_path / "out")
    with pytest.raises(InvalidInputError, match=r"part_2.laz was left out"):
        run(paths[:2], tmp_path / "out")
    with pytest.raises(InvalidInputError, match="order of the inputs"):
        run(paths[::-1], tmp_path / "out")
    surfsig.write(paths[1], town(700))
    with pytest.raises(InvalidInputError, match=r"part_1.laz changed"):
        run(paths, tmp_path / "out")
    assert run(paths, tmp_path / "out", restart=True).manifest["points"] == 667 + 700 + 666


def test_a_file_that_is_cut_off_costs_its_tiles_only(tmp_path: Path) -> None:
    cloud = town(8000)
    folder = tmp_path / "in"
    folder.mkdir()
    # Four files, side by side.
    paths = [folder / f"{i}.laz" for i in range(4)]
    for i, path in enumerate(paths):
        surfsig.write(path, cloud.at((cloud.offsets[:, 0] // 10).astype(int) == i))
    data = paths[3].read_bytes()
    paths[3].write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(TilesFailedError, match=r"tiles could not be read.*3\.laz"):
        run(paths, tmp_path / "out", tiles=12)
    state = surfsig.open(tmp_path / "out")
    assert isinstance(state, surfsig.TileDataset)
    assert not state.is_finished
    missing = [part for part in state.tiles if part.error is not None]
    assert 0 < len(missing) < 6
    assert all("3.laz" in str(part.error) for part in missing)
    # What is there is what all readable files give, and far from what is missing.
    whole = surfsig.read(paths[:3])
    found = surfsig.extract(whole, RADIUS)
    box = [[389_000, 5_819_000, 0], [389_012, 5_819_024, 100]]
    parts = state.read(box)
    numbers = parts.fields["point_number"]
    np.testing.assert_array_equal(parts.fields["k1"], found.k1[numbers])
    with pytest.raises(surfsig.FileFormatError, match=r"3\.laz"):
        state.read()
    with pytest.raises(surfsig.FileFormatError, match="cut off"):
        run(paths[3], tmp_path / "alone")


def test_a_store_that_is_damaged_costs_its_tiles_only(paths: list[Path], tmp_path: Path) -> None:
    run(paths, tmp_path / "out")
    blocks = tmp_path / "out" / "store" / "tile_000002_0.npz"
    blocks.write_bytes(blocks.read_bytes()[:100])
    for record in (tmp_path / "out" / "records").glob("*.json"):
        record.unlink()
    with pytest.raises(TilesFailedError, match=r"tile_000002_0\.npz: broken"):
        run(paths, tmp_path / "out")
    state = json.loads((tmp_path / "out" / "manifest.json").read_text())["tiles"]
    assert "error" in next(record for record in state if record["tile"] == 2)
    assert any("part" in record for record in state)


def test_a_full_disk_stops_the_run_and_loses_nothing(
    paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = surfsig.write

    def fails(path: Path, *rest: Any, **more: Any) -> None:
        if path.name == "tile_000003.laz":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        write(path, *rest, **more)

    monkeypatch.setattr(task_module, "write", fails)
    with pytest.raises(OSError, match="No space left"):
        run(paths, tmp_path / "out")
    assert len(list((tmp_path / "out").glob("tile_*.laz"))) == 3
    monkeypatch.setattr(task_module, "write", write)
    assert run(paths, tmp_path / "out").is_finished


def test_outputs_that_cannot_be(paths: list[Path], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InvalidInputError, match="is a file"):
        run(paths, tmp_path / "file")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "thesis.tex").write_text("x")
    with pytest.raises(InvalidInputError, match=r"holds other files \(thesis.tex\)"):
        run(paths, tmp_path / "other")
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "manifest.json").write_text('{"name": "an app"}')
    with pytest.raises(InvalidInputError, match="no manifest of surfsig"):
        run(paths, tmp_path / "foreign")
    with pytest.raises(InvalidInputError, match="extension must be one of"):
        run(paths, tmp_path / "out", suffix=".doc")
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_to(paths: list[Path], tmp_path: Path) -> None:
    (tmp_path / "out").mkdir(mode=0o555)
    with pytest.raises(PermissionError):
        run(paths, tmp_path / "out")


def test_two_runs_in_one_folder(paths: list[Path], tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    script = (
        "import sys, pathlib; from surfsig.tiles.lock import locked\n"
        "with locked(pathlib.Path(sys.argv[1])): print('held', flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, tmp_path / "out"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(InvalidInputError, match=rf"another run \(process {other.pid}\)"):
            run(paths, tmp_path / "out")
        other.kill()
    # The system takes the lock back.
    with locked(tmp_path / "out"):
        pass
    assert run(paths, tmp_path / "out").is_finished


def test_progress_is_told_in_order(paths: list[Path], tmp_path: Path) -> None:
    told: list[tuple[str, int, int]] = []
    run(paths, tmp_path / "out", progress=lambda *all_of_it: told.append(all_of_it))
    assert list(dict.fromkeys(what for what, _, _ in told)) == ["reading", "binning", "extracting"]
    for what in ("reading", "binning", "extracting"):
        done = [count for name, count, _ in told if name == what]
        assert done == sorted(done)
        assert done[-1] == told[[name for name, _, _ in told].index(what)][2]


def test_map_tiles_calls_with_the_halo(paths: list[Path], tmp_path: Path) -> None:
    whole = surfsig.read(paths)

    def nearest(cloud: surfsig.PointCloud, own: Any) -> Any:
        return cloud.fields["gps_time"][own], surfsig.extract(cloud, RADIUS, at=own).count

    results = list(surfsig.map_tiles(nearest, paths, tmp_path / "store", halo=RADIUS * 1.001, tiles=5))
    assert [tile for tile, _ in results] == [0, 1, 2, 3, 4]
    times = np.concatenate([times for _, (times, _) in results])
    counts = np.concatenate([counts for _, (_, counts) in results])
    expected = surfsig.extract(whole, RADIUS).count
    order, theirs = np.argsort(times), np.argsort(whole.fields["gps_time"])
    np.testing.assert_array_equal(times[order], whole.fields["gps_time"][theirs])
    np.testing.assert_array_equal(counts[order], expected[theirs])
    with pytest.raises(InvalidInputError, match="halo must be"):
        next(surfsig.map_tiles(nearest, paths, tmp_path / "store", halo=np.nan))


def test_opened_files_and_folders(paths: list[Path], tmp_path: Path) -> None:
    whole = surfsig.read(paths)
    files = surfsig.open(paths)
    assert isinstance(files, surfsig.FileDataset)
    assert files.points == 4000
    assert files.bounds is not None
    np.testing.assert_allclose(files.bounds, [whole.points.min(axis=0), whole.points.max(axis=0)], atol=2e-3)
    box = [[389_010, 5_819_005, 0], [389_020, 5_819_012, 100]]
    np.testing.assert_array_equal(files.read(box).points, surfsig.read(paths, box=box).points)
    run(paths, tmp_path / "out", suffix=".parquet")
    tiles = surfsig.open(tmp_path / "out")
    assert isinstance(tiles, surfsig.TileDataset)
    found = tiles.read(box)
    inside = files.read(box)
    assert len(found) == len(inside)
    assert sorted(found.fields["gps_time"]) == sorted(inside.fields["gps_time"])
    assert {"k1", "file", "intensity"} <= found.fields.keys()
    table = tiles.to_arrow().to_table(columns=["x", "k1"])
    assert table.num_rows == 4000
    assert sum(map(len, tiles.clouds())) == 4000
    assert repr(tiles).startswith("TileDataset(")


@pytest.mark.parametrize(
    ("words", "size"),
    [("4GB", 4e9), ("2 GiB", 2**31), ("1.5g", 1.5e9), (2_000_000_000, 2e9), ("900MB", 9e8)],
)
def test_sizes_in_words(words: Any, size: float) -> None:
    assert memory_bytes(words) == int(size)


@pytest.mark.parametrize("words", ["many", "4 PB", "-3GB", "", 0, -1, "10MB", "1e3"])
def test_sizes_that_are_none(words: Any) -> None:
    with pytest.raises(InvalidInputError, match="memory must be"):
        memory_bytes(words)


def test_more_memory_gives_larger_tiles() -> None:
    sizes = [points_per_tile(int(gigabytes * 1e9), 70) for gigabytes in (1, 2, 4, 8)]
    assert sizes == sorted(sizes)
    assert 2_000_000 < sizes[1] < 8_000_000


def test_without_dask_an_address_is_refused(
    paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InvalidInputError, match=r"pip install 'surfsig\[scale\]'"):
        run(paths, tmp_path / "out", client="tcp://127.0.0.1:1")


def test_points_of_the_parts_are_those_of_the_input(paths: list[Path], tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = run(paths, tmp_path / "out", suffix=".npz")
    whole = surfsig.read(paths)
    check_equal(found.read(), whole, surfsig.extract(whole, RADIUS))


def test_a_folder_of_tiles_is_a_source_of_its_parts(paths: list[Path], tmp_path: Path) -> None:
    found = run(paths, tmp_path / "out", suffix=".parquet")
    # Tables lie beside the parts, too.
    for name in ("surfaces.csv", "surfaces.json", "surfaces.parquet"):
        (tmp_path / "out" / name).write_text("x")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = surfsig.read(tmp_path / "out")
    assert len(cloud) == len(found) == 4000
    again = surfsig.extract_tiles(tmp_path / "out", tmp_path / "again", 1.5, tiles=2)
    assert len(again) == 4000
