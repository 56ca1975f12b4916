"""Register pairs of clouds by Open3D or KISS-Matcher, and print a line of JSON: poses, times, confidence.

Runs in the peers' own environment; `registration_peers.py versions` prints what is installed there.
"""

from __future__ import annotations

import argparse
import json
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

KISS_VOXEL = 0.3
"""KISS-Matcher's default."""
LEAST_FITNESS = 0.3
"""Share of the source with a neighbour after ICP, from which on a pose is believed; Open3D says nothing."""
FEWEST_INLIERS = 5
"""Of KISS-Matcher's solution; its examples call one with fewer a failure."""


def by_open3d(source: Any, target: Any, eyes: Any, voxel: float) -> tuple[Any, bool]:
    """Align by Open3D; whether normals know their sides is said by the sensors' places."""
    import open3d  # type: ignore[import-not-found]

    clouds = []
    for points, eye in ((source, eyes[0]), (target, eyes[1])):
        cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points)).voxel_down_sample(voxel)
        cloud.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(2 * voxel, 30))
        if eye is not None:
            cloud.orient_normals_towards_camera_location(eye)
        clouds.append(cloud)
    found = open3d_alignment(clouds, voxel)
    return found.transformation, bool(found.fitness >= LEAST_FITNESS)


def open3d_alignment(clouds: list[Any], voxel: float) -> Any:
    """FPFH, RANSAC and point-to-plane ICP of two thinned clouds, as in Open3D's tutorial."""
    import open3d

    registration, search = open3d.pipelines.registration, open3d.geometry.KDTreeSearchParamHybrid
    features = [registration.compute_fpfh_feature(cloud, search(5 * voxel, 100)) for cloud in clouds]
    open3d.utility.random.seed(0)
    rough = registration.registration_ransac_based_on_feature_matching(
        *clouds, *features, True, 1.5 * voxel,
        registration.TransformationEstimationPointToPoint(False), 3,
        [
            registration.CorrespondenceCheckerBasedOnEdgeLength(0.9),
            registration.CorrespondenceCheckerBasedOnDistance(1.5 * voxel),
        ],
        registration.RANSACConvergenceCriteria(100_000, 0.999),
    )  # fmt: skip
    plane = registration.TransformationEstimationPointToPlane()
    return registration.registration_icp(*clouds, voxel, rough.transformation, plane)


def by_kiss(source: Any, target: Any, eyes: Any, voxel: float) -> tuple[Any, bool]:
    """KISS-Matcher of centred clouds, and GICP by small_gicp."""
    import kiss_matcher  # type: ignore[import-not-found]
    import small_gicp

    middles = source.mean(axis=0), target.mean(axis=0)
    # It refuses small voxels, whatever the unit.
    scale = KISS_VOXEL / voxel
    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(KISS_VOXEL))
    centred = [
        (scale * (points - middle)).astype(np.float32)
        for points, middle in zip((source, target), middles, strict=True)
    ]
    found = matcher.estimate(*centred)
    rough = np.eye(4)
    rough[:3, :3] = found.rotation
    rough[:3, 3] = np.asarray(found.translation).ravel() / scale
    fine = small_gicp.align(
        target - middles[1], source - middles[0], rough, registration_type="GICP",
        downsampling_resolution=voxel / 2, max_correspondence_distance=2 * voxel, num_threads=2,
    ).T_target_source  # fmt: skip
    pose = np.array(fine)
    pose[:3, 3] += middles[1] - pose[:3, :3] @ middles[0]
    return pose, bool(matcher.get_num_final_inliers() >= FEWEST_INLIERS)


METHODS = {"open3d": by_open3d, "kiss": by_kiss}


def main() -> None:
    """Read the command line; each cloud pair is in a file with its starts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("method", choices=[*METHODS, "versions"])
    parser.add_argument("pairs", type=Path, nargs="*", help=".npz with source, target, starts and known")
    parser.add_argument("--voxel", type=float)
    arguments = parser.parse_args()
    if arguments.method == "versions":
        names = {"Open3D": "open3d-cpu", "KISS-Matcher": "kiss-matcher"}
        print(json.dumps({name: metadata.version(package) for name, package in names.items()}))
        return
    poses, seconds, processor, confident = [], [], [], []
    for path in arguments.pairs:
        arrays = np.load(path)
        source, target = arrays["source"], arrays["target"]
        for start in arrays["starts"]:
            moved = np.einsum("ij,nj->ni", start[:3, :3], source) + start[:3, 3]
            eyes = (start[:3, 3], np.zeros(3)) if arrays["known"] else (None, None)
            begin = time.perf_counter(), time.process_time()
            pose, sure = METHODS[arguments.method](moved, target, eyes, arguments.voxel)
            seconds.append(time.perf_counter() - begin[0])
            processor.append(time.process_time() - begin[1])
            poses.append(np.asarray(pose).tolist())
            confident.append(sure)
    print(json.dumps({"poses": poses, "seconds": seconds, "processor": processor, "confident": confident}))


if __name__ == "__main__":
    main()
