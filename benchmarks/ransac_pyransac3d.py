"""Find planes, spheres and cylinders with pyransac3d, print a line of JSON, write each point's index (int32).

pyransac3d fits one model of one kind at a time: of the three kinds the one with the most points within the
threshold is kept, its points are taken away, and so on until none has enough.
"""

from __future__ import annotations

import argparse
import json
import random
import time
import warnings
from importlib import metadata
from pathlib import Path

import numpy as np

THRESHOLD = 0.001  # of the diagonal
LEAST_POINTS = 0.01  # of all points
ROUNDS = 300


def main() -> None:
    """Read the command line, and one cloud."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cloud", type=Path, help="(n, 3) float64, or `versions`")
    parser.add_argument("labels", type=Path, nargs="?")
    parser.add_argument("seed", type=int, nargs="?")
    arguments = parser.parse_args()
    if str(arguments.cloud) == "versions":
        print(json.dumps({"pyransac3d": metadata.version("pyransac3d")}))
        return
    import pyransac3d  # type: ignore[import-not-found]

    # A sample whose points lie on a line divides by zero in pyransac3d; its model then has no points.
    warnings.simplefilter("ignore")
    random.seed(arguments.seed)
    points = np.fromfile(arguments.cloud).reshape(-1, 3)
    threshold = THRESHOLD * float(np.linalg.norm(np.ptp(points, axis=0)))
    start = time.process_time()
    labels = np.full(len(points), -1, dtype=np.int32)
    kinds: list[str] = []
    radii: list[float | None] = []
    least = max(10, LEAST_POINTS * len(points))
    rest = np.arange(len(points))
    while len(rest) >= least:
        fits = {"plane": pyransac3d.Plane(), "sphere": pyransac3d.Sphere(), "cylinder": pyransac3d.Cylinder()}
        for fit in fits.values():
            fit.fit(points[rest], thresh=threshold, maxIteration=ROUNDS)
        kind = max(fits, key=lambda name: len(fits[name].inliers))
        inliers = np.asarray(fits[kind].inliers, dtype=np.intp)
        if len(inliers) < least:
            break
        labels[rest[inliers]] = len(kinds)
        kinds.append(kind)
        radii.append(None if kind == "plane" else float(fits[kind].radius))
        rest = np.delete(rest, inliers)
    seconds = time.process_time() - start
    labels.tofile(arguments.labels)
    print(json.dumps({"seconds": seconds, "kinds": kinds, "radii": radii}))


if __name__ == "__main__":
    main()
