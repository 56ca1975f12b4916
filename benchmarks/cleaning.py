"""Time surfsig's cleaning and conversions beside Open3D's on one cloud: a table for BENCHMARKS.md.

python benchmarks/cleaning.py [POINTS]

Open3D must be installed in the same environment. Each pair runs in turns; the medians are printed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from clouds import bumpy_square
from timing import seconds_of

import surfsig
from surfsig import PointCloud

ROUNDS = 5


def main(points: int) -> None:
    """Print a row for each job, and how long it takes to take a cloud over."""
    cloud = PointCloud.of(bumpy_square(points).astype(np.float64))
    legacy, tensor = cloud.to_open3d(), cloud.to_open3d(tensor=True)
    jobs: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
        f"voxels of {edge}": (
            lambda edge=edge: surfsig.downsample(cloud, edge),  # type: ignore[misc]
            lambda edge=edge: legacy.voxel_down_sample(edge),  # type: ignore[misc]
        )
        for edge in (0.002, 0.01)
    }
    jobs["outliers, 20 neighbours"] = (
        lambda: surfsig.remove_outliers(cloud, 20),
        # Open3D counts the point itself.
        lambda: legacy.remove_statistical_outlier(21, 2.0),
    )
    print(f"{points:,} points, medians of {ROUNDS} in turns\n")
    print("| job | surfsig [s] | Open3D [s] |\n| --- | --- | --- |")
    for name, pair in jobs.items():
        seconds = [[seconds_of(job) for job in pair] for _ in range(ROUNDS)]
        ours, theirs = np.median(seconds, axis=0)
        print(f"| {name} | {ours:.3g} | {theirs:.3g} |")
    taken = np.median([seconds_of(lambda: PointCloud.of(tensor)) for _ in range(ROUNDS)])
    print(f"\nfrom an Open3D tensor cloud: {1e6 * taken:.0f} microseconds")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
