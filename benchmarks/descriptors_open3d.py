"""Compute Open3D's FPFH of clouds with normals, and print a line of JSON with the seconds of each.

Runs in the peers' own environment; `descriptors_open3d.py versions` prints what is installed there.
"""

from __future__ import annotations

import argparse
import json
from importlib import metadata
from pathlib import Path

import numpy as np
from timing import times_of


def main() -> None:
    """Read the command line, and the clouds one by one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "clouds", type=Path, nargs="+", help=".npz with points, normals and count, or `versions`"
    )
    parser.add_argument("--radius", type=float)
    arguments = parser.parse_args()
    if str(arguments.clouds[0]) == "versions":
        print(json.dumps({"Open3D": metadata.version("open3d-cpu")}))
        return
    import open3d  # type: ignore[import-not-found]

    seconds = []
    for path in arguments.clouds:
        arrays = np.load(path)
        vector = open3d.utility.Vector3dVector
        cloud = open3d.geometry.PointCloud(vector(arrays["points"]))
        cloud.normals = vector(arrays["normals"])
        search = open3d.geometry.KDTreeSearchParamRadius(arguments.radius)
        histograms = []
        compute = open3d.pipelines.registration.compute_fpfh_feature
        _, spent = times_of(lambda: histograms.append(compute(cloud, search).data))  # noqa: B023
        seconds.append(spent)
        # Those of the places, which come first.
        np.save(path.with_suffix(".npy"), histograms[0].T[: int(arrays["count"])].astype(np.float32))
    print(json.dumps({"processor_seconds": seconds}))


if __name__ == "__main__":
    main()
