"""Look for models in a scene by OpenCV or Open3D, and print a line of JSON: poses and processor time.

Runs in the peers' own environment; `clutter_peers.py versions` prints what is installed there. Neither says
whether the model is there: each gives its best pose.
"""

from __future__ import annotations

import argparse
import json
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from registration_peers import open3d_alignment

PPF_STEP = 0.05
"""Of the model's diameter: distance between its sampled points, and the step of its table of distances, as
in Drost et al., Model globally, match locally (2010)."""
PPF_SCENE_STEP = 1.0 / 5.0
"""Share of the scene's points that are reference points, as there."""
PPF_POSES = 5
"""Poses that its ICP refines; the one with the least residual is given."""
FPFH_VOXEL = 0.025
"""Of the model's diameter: of 100 to 260 mm, 2.5 to 6.5 mm."""


def by_opencv(model: Any, normals: Any, scene: Any, diameter: float) -> Any:
    """Vote by point pair features and refine by ICP: `ppf_match_3d` as OpenCV's `ppf_load_match` calls it."""
    import cv2  # type: ignore[import-not-found]
    import open3d  # type: ignore[import-not-found]

    step = PPF_STEP * diameter
    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(scene)).voxel_down_sample(step)
    seen = np.asarray(cloud.points, np.float32)
    _, seen = cv2.ppf_match_3d.computeNormalsPC3d(seen, 12, True, (0.0, 0.0, 0.0))
    whole = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(model))
    whole.normals = open3d.utility.Vector3dVector(normals)
    whole = whole.voxel_down_sample(step).normalize_normals()
    known = np.hstack([whole.points, whole.normals]).astype(np.float32)
    detector = cv2.ppf_match_3d.PPF3DDetector(PPF_STEP, PPF_STEP)
    detector.trainModel(known)
    # Its sampling of the scene is relative to the scene's size: as far apart as the model's points.
    of_scene = step / float(np.ptp(seen[:, :3], axis=0).max())
    poses = detector.match(np.asarray(seen, np.float32), PPF_SCENE_STEP, of_scene)[:PPF_POSES]
    if not poses:
        return np.eye(4)
    _, poses = cv2.ppf_match_3d.ICP(100).registerModelToScene(known, np.asarray(seen, np.float32), poses)
    return np.array(min(poses, key=lambda pose: pose.residual).pose)


def by_open3d(model: Any, normals: Any, scene: Any, diameter: float) -> Any:
    """Align the model with the scene by FPFH, RANSAC and ICP."""
    import open3d

    voxel = FPFH_VOXEL * diameter
    known = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(model))
    known.normals = open3d.utility.Vector3dVector(normals)
    seen = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(scene)).voxel_down_sample(voxel)
    seen.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(2 * voxel, 30))
    seen.orient_normals_towards_camera_location(np.zeros(3))
    return open3d_alignment([known.voxel_down_sample(voxel), seen], voxel).transformation


METHODS = {"opencv": by_opencv, "open3d": by_open3d}


def main() -> None:
    """Read the command line; a file has the scene's points, and each model's points, normals and diameter."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("method", choices=[*METHODS, "versions"])
    parser.add_argument("file", type=Path, nargs="?", help=".npz with scene, models, normals and diameters")
    arguments = parser.parse_args()
    if arguments.method == "versions":
        names = {"OpenCV": "opencv-contrib-python-headless", "Open3D": "open3d-cpu"}
        print(json.dumps({name: metadata.version(package) for name, package in names.items()}))
        return
    arrays = np.load(arguments.file)
    poses, processor = [], []
    for model, normals, diameter in zip(
        arrays["models"], arrays["normals"], arrays["diameters"], strict=True
    ):
        begin = time.process_time()
        pose = METHODS[arguments.method](model, normals, arrays["scene"], float(diameter))
        processor.append(time.process_time() - begin)
        poses.append(np.asarray(pose).tolist())
    print(json.dumps({"poses": poses, "processor": processor}))


if __name__ == "__main__":
    main()
