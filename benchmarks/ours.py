"""Time surfsig on one cloud and print one JSON line.

`ours.py curvature` and `ours.py signatures` time whole extractions, from the array to the numbers, with
the index; `ours.py memory` takes the peak of the resident memory of one extraction and needs a process of its
own for it.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
from clouds import NEIGHBOUR_SAMPLE, evenly_spaced
from timing import add_job_arguments, finite_share, median_times, report, seconds_of, times_of

import surfsig

RUNS = 5
SIGNATURE_BLOCK = 250_000
"""Points whose signatures are held at once: 242 MB."""


def extract(cloud: npt.NDArray[np.float32], radius: float, threads: int) -> surfsig.Extraction:
    """Extract at all points, and touch the arrays that count, should one be made only when asked for."""
    extraction = surfsig.extract(cloud, radius=radius, threads=threads)
    values = (extraction.k1, extraction.k2, extraction.normals, extraction.residual)
    errors = (extraction.mean_curvature_std, extraction.k1_std, extraction.k2_std, extraction.noise)
    assert all(len(array) == len(cloud) for array in values + errors)
    return extraction


def extract_with_signatures(
    cloud: npt.NDArray[np.float32], radius: float, threads: int
) -> surfsig.Extraction:
    """Extract at all points and make all their signatures, a block at a time where there are many."""
    extraction = extract(cloud, radius, threads)
    if len(cloud) <= SIGNATURE_BLOCK:
        extraction.signatures()
        return extraction
    for start in range(0, len(cloud), SIGNATURE_BLOCK):
        extraction.signatures(at=np.arange(start, min(start + SIGNATURE_BLOCK, len(cloud))))
    return extraction


METHODS = {"curvature": extract, "signatures": extract_with_signatures}


def mean_count(extraction: surfsig.Extraction) -> float:
    """Average the counts of the same points at which the peers' neighbours are counted."""
    return float(extraction.count[evenly_spaced(NEIGHBOUR_SAMPLE, len(extraction))].mean())


def time_method(method: str, cloud: npt.NDArray[np.float32], radius: float, threads: int) -> None:
    """Print the median time of several runs, and the first one's, which also starts the threads."""
    work = METHODS[method]
    first = seconds_of(lambda: work(cloud, radius, threads))
    times = median_times(lambda: work(cloud, radius, threads), RUNS)
    extraction = extract(cloud, radius, threads)
    report(
        method,
        len(cloud),
        times,
        mean_count(extraction),
        threads,
        first_seconds=first,
        valid=finite_share(np.column_stack([extraction.k1, extraction.k2])),
    )


def resident_bytes(field: str) -> int:
    """Read VmRSS (now) or VmHWM (peak) of this process in bytes."""
    status = Path("/proc/self/status").read_text()
    match = re.search(rf"^{field}:\s+(\d+) kB$", status, re.MULTILINE)
    if match is None:
        sys.exit(f"/proc/self/status has no {field}")
    return int(match[1]) * 1024


def measure_memory(cloud: npt.NDArray[np.float32], radius: float, threads: int) -> None:
    """Print how far one extraction, its results included, rises above what was resident before it."""
    try:
        Path("/proc/self/clear_refs").write_text("5")  # forget the peak of loading the input
        before = resident_bytes("VmRSS")
    except OSError as error:
        sys.exit(f"the peak of the memory can only be taken on Linux: {error}")
    extraction = None

    def work() -> None:
        nonlocal extraction
        extraction = extract(cloud, radius, threads)

    times = times_of(work)
    peak = resident_bytes("VmHWM")
    assert extraction is not None
    report(
        "memory",
        len(cloud),
        times,
        mean_count(extraction),
        threads,
        peak_bytes=peak - before,
        input_bytes=cloud.nbytes,
    )


def main() -> None:
    """Read the command line and measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("method", choices=[*METHODS, "memory"])
    add_job_arguments(parser)
    arguments = parser.parse_args()
    cloud = np.load(arguments.cloud)
    if arguments.method == "memory":
        measure_memory(cloud, arguments.radius, arguments.threads)
    else:
        time_method(arguments.method, cloud, arguments.radius, arguments.threads)


if __name__ == "__main__":
    main()
