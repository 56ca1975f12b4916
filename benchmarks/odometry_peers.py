"""Follow a sensor by KISS-ICP or small_gicp, and print a line of JSON: poses and processor time.

Runs in the peers' own environment; `odometry_peers.py versions` prints what is installed there.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

RANGE = 100.0
"""Metres, KISS-ICP's default of the largest range; its voxel is a hundredth of it where none is given."""
DETAIL = 0.25
"""Edge of the voxels that small_gicp thins a scan to, in those of its map: as in its own example."""
RECENT = {"horizon": 100, "clear_cycle": 10}
"""Scans after which its map forgets a voxel, and between two looks for such ones: as in that example."""


def main() -> None:
    """Read the command line; the scans of a sequence are in one file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "scans",
        help=".npz with arrays (n, 3) named scan0, scan1, ..., and times0, ... from 0 to 1, or 'versions'",
    )
    parser.add_argument("--voxel", type=float, default=RANGE / 100.0)
    parser.add_argument("--method", choices=list(METHODS), default="kiss-icp")
    arguments = parser.parse_args()
    if arguments.scans == "versions":
        print(
            json.dumps(
                {"KISS-ICP": metadata.version("kiss-icp"), "small_gicp": metadata.version("small_gicp")}
            )
        )
        return
    arrays = np.load(Path(arguments.scans))
    count = sum(name.startswith("scan") for name in arrays.files)
    scans = [arrays[f"scan{number}"].astype(np.float64) for number in range(count)]
    nothing = np.zeros(0)
    has_times = "times0" in arrays.files
    times = [arrays[f"times{k}"].astype(np.float64) if has_times else nothing for k in range(count)]
    follow = METHODS[arguments.method](arguments.voxel, has_times)
    poses = []
    start = time.process_time()
    for points, moments in zip(scans, times, strict=True):
        poses.append(follow(points, moments).tolist())
    print(json.dumps({"poses": poses, "seconds": time.process_time() - start}))


def by_kiss_icp(voxel: float, has_times: bool) -> Callable[[Array, Array], Array]:
    """Give what takes a scan and its times to its pose, by KISS-ICP."""
    from kiss_icp.config import KISSConfig  # type: ignore[import-not-found]
    from kiss_icp.kiss_icp import KissICP  # type: ignore[import-not-found]

    config = KISSConfig()
    config.data.max_range, config.data.min_range = RANGE, 0.0
    config.mapping.voxel_size = voxel
    config.data.deskew = has_times
    odometry = KissICP(config=config)

    def follow(points: Array, moments: Array) -> Array:
        odometry.register_frame(points, moments)
        return np.asarray(odometry.last_pose, np.float64)

    return follow


def by_small_gicp(voxel: float, has_times: bool) -> Callable[[Array, Array], Array]:
    """Give the same by small_gicp, which has no deskewing: GICP of each scan with a voxel map.

    It has parts for odometry and an example that joins them (kitti_odometry.py): the scan is thinned,
    expected where the last motion leads, aligned with the means and covariances of a map's voxels, and put
    into it.
    """
    import small_gicp

    voxels: Any = small_gicp.GaussianVoxelMap(voxel)
    voxels.set_lru(**RECENT)
    pose, motion = np.eye(4), np.eye(4)

    def follow(points: Array, _: Array) -> Array:
        nonlocal pose, motion
        scan, _tree = small_gicp.preprocess_points(points, DETAIL * voxel, num_threads=1)
        if voxels.size() > 0:
            found = small_gicp.align(voxels, scan, pose @ motion, num_threads=1).T_target_source
            motion, pose = np.linalg.inv(pose) @ found, found
        voxels.insert(scan, pose)
        return np.asarray(pose, np.float64)

    return follow


METHODS = {"kiss-icp": by_kiss_icp, "small_gicp": by_small_gicp}


if __name__ == "__main__":
    main()
