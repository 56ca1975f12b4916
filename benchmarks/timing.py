"""How every Python program here takes a time and reports it: one JSON line on stdout."""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt


def seconds_of(work: Callable[[], object]) -> float:
    """Run `work` once and return the seconds it took."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def times_of(work: Callable[[], object]) -> tuple[float, float]:
    """Run `work` once and return the seconds it took, and those of the processor, all threads together."""
    start = time.process_time()
    seconds = seconds_of(work)
    return seconds, time.process_time() - start


def median_times(work: Callable[[], object], runs: int) -> tuple[float, float]:
    """Run `work` several times and return the medians of what `times_of` gives."""
    seconds, processor_seconds = zip(*(times_of(work) for _ in range(runs)), strict=True)
    return statistics.median(seconds), statistics.median(processor_seconds)


def finite_share(values: npt.ArrayLike) -> float:
    """Return the share of the first axis in which every value is finite."""
    array = np.asarray(values, dtype=np.float64)
    return float(np.isfinite(array.reshape(len(array), -1)).all(axis=1).mean())


def report(
    method: str, points: int, times: tuple[float, float], mean_neighbours: float, threads: int, **more: Any
) -> None:
    """Print one measurement, whose times are those of `times_of`, as a line of JSON."""
    seconds, processor_seconds = times
    measurement = {
        "method": method,
        "points": points,
        "seconds": seconds,
        "processor_seconds": processor_seconds,
        "points_per_second": points / seconds,
        "mean_neighbours": mean_neighbours,
        "threads": threads,
    }
    print(json.dumps(measurement | more))


def add_job_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that every timed program takes."""
    parser.add_argument("cloud", type=Path, help="(n, 3) float32 array as .npy")
    parser.add_argument("radius", type=float, help="radius of the neighbourhood")
    parser.add_argument("threads", type=int, help="threads to use")
