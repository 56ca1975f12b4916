"""Follow a sensor by KISS-ICP, and print a line of JSON: poses and processor time.

Runs in the peers' own environment; `odometry_peers.py versions` prints what is installed there.
"""

from __future__ import annotations

import argparse
import json
import time
from importlib import metadata
from pathlib import Path

import numpy as np

RANGE = 100.0
"""Metres, KISS-ICP's default of the largest range; its voxel is a hundredth of it where none is given."""


def main() -> None:
    """Read the command line; the scans of a sequence are in one file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "scans",
        help=".npz with arrays (n, 3) named scan0, scan1, ..., and times0, ... from 0 to 1, or 'versions'",
    )
    parser.add_argument("--voxel", type=float, default=RANGE / 100.0)
    arguments = parser.parse_args()
    if arguments.scans == "versions":
        print(json.dumps({"KISS-ICP": metadata.version("kiss-icp")}))
        return
    from kiss_icp.config import KISSConfig  # type: ignore[import-not-found]
    from kiss_icp.kiss_icp import KissICP  # type: ignore[import-not-found]

    config = KISSConfig()
    config.data.max_range, config.data.min_range = RANGE, 0.0
    config.mapping.voxel_size = arguments.voxel
    arrays = np.load(Path(arguments.scans))
    count = sum(name.startswith("scan") for name in arrays.files)
    scans = [arrays[f"scan{number}"].astype(np.float64) for number in range(count)]
    config.data.deskew = "times0" in arrays.files
    nothing = np.zeros(0)
    times = [arrays[f"times{k}"].astype(np.float64) if config.data.deskew else nothing for k in range(count)]
    odometry = KissICP(config=config)
    poses = []
    start = time.process_time()
    for points, moments in zip(scans, times, strict=True):
        odometry.register_frame(points, moments)
        poses.append(odometry.last_pose.tolist())
    print(json.dumps({"poses": poses, "seconds": time.process_time() - start}))


if __name__ == "__main__":
    main()
