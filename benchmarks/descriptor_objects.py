"""Objects with known motions: models with scenes that hold them, simulated ones from neighbouring views."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from descriptor_pairs import PLACES, Array, Scan, ScanPairs
from finding_scene import OBJECTS

import surfsig
from surfsig import simulate

SCENE_PLACES = 10_000
"""Random points of a scene: a few millimetres apart."""

CUT = 2.0
"""Of a scene stays what is within so many of the model's radii of its middle."""

WIDTH, HEIGHT, FOCAL, DISTANCE = 240, 240, 900.0, 0.3
"""Of the simulated depth images: pixels of 0.3 mm on the object, in metres."""

NOISE = 1e-4
VIEWS = 8


def read_objects(data: Path) -> list[ScanPairs]:
    """Read the models and scenes that the folder has."""
    found = []
    for name, title, truth, radius in (
        ("chef", "chef in a scene, model and viewpoint known", "T_rs1_from_chef_DERIVED.txt", 0.035),
        ("milk", "milk carton cut out of a scene, viewpoints known", "T_scene_from_milk_DERIVED.txt", 0.03),
    ):
        folder = data / "objects" / name
        if folder.is_dir():
            found.append(_model_and_scene(folder, name, title, np.loadtxt(folder / truth), radius))
    return found


def _model_and_scene(folder: Path, name: str, title: str, motion: Array, radius: float) -> ScanPairs:
    """Read a model and the part of a scene around it; both sensors stand at the scene's origin."""
    model = surfsig.read(folder / f"{name}.pcd")
    points = model.points.astype(np.float64)
    if "normal_x" in model.fields:
        sides = np.column_stack([model.fields[f"normal_{axis}"] for axis in "xyz"]).astype(np.float64)
    else:
        sides = np.linalg.inv(motion)[:3, 3] - points
    scene = surfsig.read(folder / "scene.pcd").points.astype(np.float64)
    middle = points.mean(axis=0)
    reach = CUT * np.linalg.norm(points - middle, axis=1).max()
    near = np.linalg.norm(scene - (motion[:3, :3] @ middle + motion[:3, 3]), axis=1) < reach
    scans = {
        "model": _scan(points, sides, PLACES, 0),
        "scene": _scan(scene[near], -scene[near], SCENE_PLACES, 1),
    }
    return ScanPairs(title, scans, {("model", "scene"): motion}, radius=radius, tolerance=0.005)


def simulated_objects() -> ScanPairs:
    """Depth images of single objects, and pairs of views 45 degrees apart."""
    ways = _ways()
    scans, motions, poses = {}, {}, {}
    for name, parts in OBJECTS.items():
        for view in range(VIEWS):
            # Seen from 30 degrees above, all around.
            around = simulate.turn((0.0, 0.0, 1.0), 2.0 * np.pi * view / VIEWS)
            pose = simulate.pose(
                (0.0, 0.0, DISTANCE), simulate.turn((1.0, 0.0, 0.0), np.radians(-120.0)) @ around
            )
            scene = simulate.Scene([simulate.Placed(surface, pose @ own) for surface, own in parts])
            hits = scene.cast(np.zeros_like(ways), ways).points
            noise = np.random.default_rng(view).normal(0.0, NOISE, (len(ways), 1))
            seen = (hits + noise * ways)[np.isfinite(hits[:, 0])]
            scans[f"{name} {view}"] = _scan(seen, -seen, PLACES, view)
            poses[name, view] = pose
        for view in range(VIEWS):
            after = (view + 1) % VIEWS
            motions[f"{name} {view}", f"{name} {after}"] = poses[name, after] @ simulate.inverse(
                poses[name, view]
            )
    title = "three simulated objects, neighbouring views, viewpoints known"
    return ScanPairs(title, scans, motions, radius=0.012, tolerance=0.0012)


def _ways() -> Array:
    """Give the directions of the pixels, with z component 1."""
    x, y = np.meshgrid(np.arange(WIDTH) - WIDTH / 2 + 0.5, np.arange(HEIGHT) - HEIGHT / 2 + 0.5)
    return np.column_stack([x.ravel() / FOCAL, y.ravel() / FOCAL, np.ones(x.size)])


def _scan(points: Array, sides: Array, places: int, seed: int) -> Scan:
    """Choose places at random: so many, or all."""
    count = min(places, len(points))
    chosen = np.random.default_rng(seed).choice(len(points), count, replace=False)
    return Scan(points, sides, np.sort(chosen))
