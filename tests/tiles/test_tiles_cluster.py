"""Tiles on a Dask cluster: the same bits, whatever happens to its workers."""

import json
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from tile_scenes import RADIUS, town_files

import surfsig
from surfsig.tiles import run as run_module

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return town_files(tmp_path_factory.mktemp("town"), 20_000)


@pytest.fixture(scope="module")
def expected(paths: list[Path], tmp_path_factory: pytest.TempPathFactory) -> dict[int, str]:
    out = tmp_path_factory.mktemp("here") / "out"
    surfsig.extract_tiles(paths, out, RADIUS, tiles=24)
    return hashes(out)


@contextmanager
def two_workers(folder: Path) -> Iterator[Any]:
    """Start a cluster of two processes, which takes each some seconds."""
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        memory_limit="1500MB",
        dashboard_address=None,
        local_directory=str(folder),
    ) as found:
        yield found


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A cluster for all tests that leave its workers as they are."""
    with two_workers(tmp_path_factory.mktemp("dask")) as found:
        yield found


def hashes(out: Path) -> dict[int, str]:
    tiles = json.loads((out / "manifest.json").read_text())["tiles"]
    return {record["tile"]: record["sha256"] for record in tiles}


def test_an_address_gives_the_same_parts(
    paths: list[Path], expected: dict[int, str], cluster: Any, tmp_path: Path
) -> None:
    surfsig.extract_tiles(paths, tmp_path / "out", RADIUS, tiles=24, client=cluster.scheduler_address)
    assert hashes(tmp_path / "out") == expected


def test_workers_that_are_killed_cost_nothing(
    paths: list[Path], expected: dict[int, str], tmp_path: Path
) -> None:
    killed: list[int] = []
    out = tmp_path / "out"
    finished = threading.Event()

    def kill(cluster: Any) -> None:
        seen: set[int] = set()
        while len(killed) < 3 and not finished.is_set():
            pids = [worker.pid for worker in cluster.workers.values() if worker.pid not in seen]
            if pids and len(list(out.glob("tile_*.laz"))) > 2 * len(killed):
                seen.add(pids[0])
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])
            time.sleep(0.05)

    with two_workers(tmp_path / "dask") as mortal:
        thread = threading.Thread(target=kill, args=[mortal])
        thread.start()
        try:
            with distributed.Client(mortal) as client:
                surfsig.extract_tiles(paths, out, RADIUS, tiles=24, client=client)
        finally:
            finished.set()
            thread.join()
    assert killed
    assert hashes(out) == expected
    assert not list(out.glob("*.tmp"))


def test_a_tile_that_cannot_be_read_on_a_worker(paths: list[Path], cluster: Any, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with distributed.Client(cluster) as client:
        surfsig.extract_tiles(paths, out, RADIUS, tiles=6, client=client)
        for record in (out / "records").glob("*.json"):
            record.unlink()
        (out / "store" / "tile_000001_0.npz").write_bytes(b"no archive")
        with pytest.raises(surfsig.TilesFailedError, match="tiles could not be read"):
            surfsig.extract_tiles(paths, out, RADIUS, tiles=6, client=client)
    tiles = json.loads((out / "manifest.json").read_text())["tiles"]
    assert len(tiles) == 6
    assert any("part" in record for record in tiles)


def test_what_a_task_raises_is_raised_here(cluster: Any) -> None:
    def fails(tile: int, threads: int) -> int:
        if tile == 3:
            raise PermissionError(13, "the folder is read-only")
        return tile

    with distributed.Client(cluster) as client, pytest.raises(PermissionError):
        list(run_module.run_on_cluster(fails, range(5), client))


def test_map_tiles_on_a_cluster(paths: list[Path], cluster: Any, tmp_path: Path) -> None:
    def count(cloud: surfsig.PointCloud, own: Any) -> int:
        return int(own.sum())

    results = surfsig.map_tiles(
        count, paths, tmp_path / "store", halo=1.0, tiles=8, client=cluster.scheduler_address
    )
    assert sum(points for _, points in results) == 20_000
