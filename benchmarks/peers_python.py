"""Time one method of Open3D, jakteristics or small_gicp on one cloud and print one JSON line.

Runs in the peers' own environment. `peers_python.py versions` prints what is installed there. Trees that a
library takes ready-made, conversions into its own cloud and normals that a method asks for are made before
the clock starts; each method warms up on a few points first.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from importlib import metadata

import numpy as np
import numpy.typing as npt
from clouds import evenly_spaced, mean_neighbours
from timing import add_job_arguments, finite_share, report, times_of

DISTRIBUTIONS = ("open3d-cpu", "jakteristics", "small_gicp", "numpy")
WARM_UP_POINTS = 2000
# Without the normal: version 0.6 tells eigenvectors apart by an absolute 1e-5 in their eigenvalues, so at
# radii of a few centimetres many of its normals are not numbers. The time is the same.
JAKTERISTICS_FEATURES = ["planarity", "linearity", "sphericity", "surface_variation"]

Cloud = npt.NDArray[np.float64]
Timed = tuple[tuple[float, float], float]
"""What `times_of` gives, and the share of the answers that are finite."""


def open3d_normals(cloud: Cloud, radius: float, threads: int) -> Timed:
    """Time Open3D's normals; its tree cannot be handed over, so the time includes it."""
    import open3d  # type: ignore[import-not-found]

    points = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(cloud))
    search = open3d.geometry.KDTreeSearchParamRadius(radius)
    times = times_of(lambda: points.estimate_normals(search))
    return times, finite_share(points.normals)


def open3d_fpfh(cloud: Cloud, radius: float, threads: int) -> Timed:
    """Time Open3D's FPFH, normals given."""
    import open3d

    points = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(cloud))
    search = open3d.geometry.KDTreeSearchParamRadius(radius)
    points.estimate_normals(search)
    histograms = []
    compute = open3d.pipelines.registration.compute_fpfh_feature
    times = times_of(lambda: histograms.append(compute(points, search).data))
    return times, finite_share(histograms[0].T)


def jakteristics_features(cloud: Cloud, radius: float, threads: int) -> Timed:
    """Time four of jakteristics' shape features."""
    import jakteristics  # type: ignore[import-not-found, import-untyped, unused-ignore]

    tree = jakteristics.cKDTree(cloud)
    features = []
    times = times_of(
        lambda: features.append(
            jakteristics.compute_features(
                cloud, radius, kdtree=tree, num_threads=threads, feature_names=JAKTERISTICS_FEATURES
            )
        )
    )
    return times, finite_share(features[0])


def small_gicp_covariances(cloud: Cloud, radius: float, threads: int) -> Timed:
    """Time small_gicp's normals and covariances from as many nearest points as a ball holds on average."""
    import small_gicp

    points = small_gicp.PointCloud(cloud)
    tree = small_gicp.KdTree(points, num_threads=threads)
    neighbours = neighbours_to_ask_for(cloud, radius)
    times = times_of(
        lambda: small_gicp.estimate_normals_covariances(
            points, tree, num_neighbors=neighbours, num_threads=threads
        )
    )
    return times, finite_share(points.normals())


def neighbours_to_ask_for(cloud: Cloud, radius: float) -> int:
    """Return the mean number of neighbours in a ball as the k of a search for the nearest."""
    return max(5, round(mean_neighbours(cloud.astype(np.float32), radius)))


METHODS: dict[str, Callable[[Cloud, float, int], Timed]] = {
    "open3d_normals": open3d_normals,
    "open3d_fpfh": open3d_fpfh,
    "jakteristics": jakteristics_features,
    "small_gicp": small_gicp_covariances,
}


def installed_versions() -> dict[str, str]:
    """Return the versions of the peers that this environment has."""
    versions = {}
    for name in DISTRIBUTIONS:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def time_method(method: str, path: str, radius: float, threads: int) -> None:
    """Time one method on the cloud at `path` and print the measurement."""
    single = np.load(path)
    cloud = np.ascontiguousarray(single, dtype=np.float64)
    METHODS[method](np.ascontiguousarray(cloud[evenly_spaced(WARM_UP_POINTS, len(cloud))]), radius, threads)
    times, valid = METHODS[method](cloud, radius, threads)
    report(method, len(cloud), times, mean_neighbours(single, radius), threads, valid=valid)


def main() -> None:
    """Read the command line and time one method."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="method", required=True)
    commands.add_parser("versions")
    for method in METHODS:
        add_job_arguments(commands.add_parser(method))
    arguments = parser.parse_args()
    if arguments.method == "versions":
        print(json.dumps(installed_versions()))
        return
    try:
        time_method(arguments.method, str(arguments.cloud), arguments.radius, arguments.threads)
    except ImportError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
