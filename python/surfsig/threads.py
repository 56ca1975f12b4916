"""Work that is shared among threads, with the same results for any number of them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from surfsig.progress import ProgressCallback

Item = TypeVar("Item")
Result = TypeVar("Result")


def map_in_threads(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    threads: int | None,
    progress: ProgressCallback | None = None,
) -> list[Result]:
    """Apply a function to items, and give the results in the order of the items.

    Parameters
    ----------
    function
        What NumPy, SciPy or the core does in it runs beside the other threads; the rest of Python does not.
    items
        What it is applied to.
    threads
        Number of threads; None for one of each core.
    progress
        Called in the caller's thread with the number of items done, in their order, and of all.
    """
    found: list[Result] = []
    for result in _results(function, items, min(threads or os.cpu_count() or 1, len(items))):
        found.append(result)
        if progress is not None:
            progress(len(found), len(items))
    return found


def _results(function: Callable[[Item], Result], items: Sequence[Item], threads: int) -> Iterator[Result]:
    if threads <= 1:
        yield from map(function, items)
        return
    pool = ThreadPoolExecutor(threads)
    try:
        yield from pool.map(function, items)
    finally:
        # Where the caller stopped, what has not begun is not begun.
        pool.shutdown(cancel_futures=True)
