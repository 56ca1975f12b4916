"""Running a task on every tile: here, one tile after the other, or on the workers of a Dask cluster."""

from __future__ import annotations

import contextlib
import threading
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from surfsig.convert.libraries import library
from surfsig.tiles.memory import release_memory

if TYPE_CHECKING:
    from distributed import Client

Result = TypeVar("Result")

MOST_LOSSES = 5
"""How often a tile whose workers died is given to the cluster again; Dask itself tries some four workers."""

# A worker with several threads works on one tile at a time: the core's own threads are inside.
_ONE_AT_A_TIME = threading.Lock()


def dask_distributed() -> Any:
    """Import Dask's scheduler; an `InvalidInputError` says how to install it."""
    return library("distributed", "Dask", "'surfsig[scale]'")


@contextlib.contextmanager
def connected(client: Client | str | None) -> Iterator[Client | None]:
    """Give the client of a cluster: one that the caller has, or one for an address such as tcp://host:8786.

    Raises
    ------
    InvalidInputError
        If Dask is not installed.
    OSError
        If nobody answers at the address.
    """
    if not isinstance(client, str):
        yield client
        return
    distributed = dask_distributed()
    try:
        found = distributed.Client(client, timeout="20s")
    except (OSError, TimeoutError, ValueError) as error:
        raise ConnectionError(f"{client}: no Dask scheduler answers ({_one_line(error)})") from None
    try:
        yield found
    finally:
        with contextlib.suppress(Exception):
            found.close()


def worker_memory(client: Client) -> int | None:
    """Give the bytes that the smallest worker may have; None where there are no limits."""
    workers: dict[str, Any] = client.scheduler_info(n_workers=-1)["workers"]
    limits = [int(worker["memory_limit"]) for worker in workers.values() if worker.get("memory_limit")]
    return min(limits) if limits else None


def run_here(
    task: Callable[[int], Result], tiles: Sequence[int]
) -> Generator[tuple[int, Result], None, None]:
    """Run a task on tiles in this thread, one after the other; give each tile with its result."""
    for tile in tiles:
        result = task(tile)
        release_memory()
        yield tile, result


def run_on_cluster(
    task: Callable[..., Result], tiles: Sequence[int], client: Client
) -> Generator[tuple[int, Result], None, None]:
    """Run a task on the workers of a cluster; give each tile with its result, as they come.

    A tile whose worker dies is worked on by another one. What a task raises is raised here, and the tiles
    that have not begun are taken back.

    Raises
    ------
    ConnectionError
        If the scheduler is lost, or a tile's workers die again and again.
    """
    distributed = dask_distributed()
    one = _OnWorker(task)
    losses: dict[int, int] = {}
    futures = {
        client.submit(one, tile, pure=False, key=f"surfsig-{id(one)}-{tile}-0"): tile for tile in tiles
    }
    waiting = distributed.as_completed(futures)
    try:
        for future in waiting:
            tile = futures.pop(future)
            try:
                yield tile, future.result()
            except distributed.scheduler.KilledWorker as error:
                losses[tile] = losses.get(tile, 0) + 1
                if losses[tile] >= MOST_LOSSES:
                    raise ConnectionError(
                        f"tile {tile}: its workers died again and again; is memory= too large for them? "
                        f"({_one_line(error)})"
                    ) from None
                key = f"surfsig-{id(one)}-{tile}-{losses[tile]}"
                again = client.submit(one, tile, pure=False, key=key)
                futures[again] = tile
                waiting.add(again)
            except distributed.CancelledError as error:
                raise ConnectionError(f"the Dask scheduler was lost ({_one_line(error)})") from None
    finally:
        with contextlib.suppress(Exception):
            client.cancel(list(futures))  # type: ignore[no-untyped-call]


class _OnWorker(Generic[Result]):
    """A task as a worker runs it."""

    def __init__(self, task: Callable[..., Result]) -> None:
        self._task = task

    def __call__(self, tile: int) -> Result:
        from distributed import get_worker

        try:
            threads = int(get_worker().state.nthreads)
        except ValueError:
            # Called outside of a worker.
            threads = 1
        with _ONE_AT_A_TIME, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = self._task(tile, threads)
            release_memory()
            return result


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())[:200]
