"""The same bits however a cloud is cut into tiles, and whoever works on them."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import surfsig
from surfsig.tiles import binning, job
from surfsig.tiles.plan import Node, Plan

DIGITS = 16
"""Of hashes that are shown."""

NOT_MEASURED = "not measured"


def hash_of(cloud: surfsig.PointCloud, columns: dict[str, Any]) -> str:
    """Give the SHA-256 of all fields, columns and coordinates."""
    values = {**{name: field for name, field in cloud.fields.items() if name != "file"}, **columns}
    digest = hashlib.sha256()
    for name in sorted(values):
        digest.update(name.encode() + np.ascontiguousarray(values[name]).tobytes())
    digest.update(np.ascontiguousarray(cloud.points).tobytes())
    return digest.hexdigest()[:DIGITS]


def sorted_hash(found: surfsig.TileDataset) -> str:
    """Give the SHA-256 of a result, its points in the order of the input."""
    cloud = found.read()
    return hash_of(cloud.at(np.argsort(cloud.fields["point_number"])), {})


@contextmanager
def shifted_cuts() -> Iterator[None]:
    """Move all cuts by half a tile, of tiles as they are otherwise."""
    cut_by_count = binning.cut_by_count

    def cut(*arguments: Any) -> Callable[[Any], Plan]:
        plan_of = cut_by_count(*arguments)

        def shifted(survey: Any) -> Plan:
            plan = plan_of(survey)
            sides = np.diff(plan.boxes, axis=1)[:, 0]
            half = [0.5 * float(np.median(side[np.isfinite(side)])) for side in sides.T[:2]]
            return Plan(_moved(plan.root, [*half, 0.0]))

        return shifted

    with mock.patch.object(job, "cut_by_count", cut):
        yield


def _moved(node: Node, by: Sequence[float]) -> Node:
    if isinstance(node, int):
        return node
    axis, at, left, right = node
    return axis, at + by[axis], _moved(left, by), _moved(right, by)


@contextmanager
def workers(number: int) -> Iterator[Any]:
    """Give a Dask cluster of workers in processes of their own."""
    import distributed

    with (
        tempfile.TemporaryDirectory() as folder,
        distributed.LocalCluster(  # type: ignore[no-untyped-call]
            number, threads_per_worker=1, dashboard_address=None, local_directory=folder
        ) as cluster,
    ):
        yield cluster


@contextmanager
def killed_workers(cluster: Any, out: Path, times: int, killed: list[int]) -> Iterator[None]:
    """Kill a worker as often, once some more tiles are done each time."""
    finished = threading.Event()

    def kill() -> None:
        while len(killed) < times and not finished.is_set():
            pids = [worker.pid for worker in cluster.workers.values() if worker.pid not in killed]
            if pids and len(list(out.glob("tile_*"))) > 2 * len(killed):
                os.kill(pids[0], signal.SIGKILL)
                killed.append(pids[0])
            time.sleep(0.05)

    thread = threading.Thread(target=kill)
    thread.start()
    try:
        yield
    finally:
        finished.set()
        thread.join()


def same_bits(folder: Path, paths: Sequence[Path], radius: float) -> list[tuple[str, str]]:
    """Hash the results of several manners of cutting and working: what was done, and the hash."""
    import distributed

    rows: list[tuple[str, str]] = []

    def add(what: str, **more: Any) -> None:
        out, store = folder / "out", folder / "store"
        surfsig.extract_tiles(list(paths), out, radius, numbers=True, suffix=".npz", store=store, **more)
        rows.append((what, sorted_hash(surfsig.TileDataset(out))))
        shutil.rmtree(out)
        shutil.rmtree(store)

    cloud = surfsig.read(list(paths))
    columns = {**surfsig.extract(cloud, radius).columns(), "point_number": np.arange(len(cloud))}
    rows.append(("whole cloud in memory", hash_of(cloud, columns)))
    for tiles in (1, 4, 16, 64):
        add(f"{tiles} tiles", tiles=tiles)
    with shifted_cuts():
        add("16 tiles, shifted by half a tile", tiles=16)
    for number in (1, 2):
        with workers(number) as cluster, distributed.Client(cluster) as client:  # type: ignore[no-untyped-call]
            add(f"16 tiles, {number} Dask worker{'s' if number > 1 else ''}", tiles=16, client=client)
    killed: list[int] = []
    with (
        workers(2) as cluster,
        distributed.Client(cluster) as client,  # type: ignore[no-untyped-call]
        killed_workers(cluster, folder / "out", 3, killed),
    ):
        add("", tiles=16, client=client)
    rows[-1] = (f"16 tiles, two Dask workers of which one was killed {len(killed)} times", rows[-1][1])
    return rows
