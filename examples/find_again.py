"""Register two scans, and find an object in a scene, from the shell; draw both before and after.

    python examples/find_again.py FOLDER_OF_SCANS [PICTURE.png]

The scans are not part of the project; their sources are named in BENCHMARKS.md.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from PIL import Image

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import surfsig

CAMERA = np.diag([1.0, -1.0, -1.0])
"""Seen from where the camera stood: its x to the right, its y down, its z away."""
BLUE, ORANGE, DARK, GREY = (0.12, 0.47, 0.71), (1.0, 0.5, 0.05), (0.6, 0.2, 0.0), (0.7, 0.7, 0.7)
DRAWN = 60_000
"""Points of each panel."""


def run(*arguments: object) -> None:
    """Run a command as a user would, and show what it says."""
    command = [sys.executable, "-m", "surfsig.cli", *map(str, arguments)]
    print(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main(folder: Path, picture: Path) -> None:
    """Draw two views of a kitchen, and the chef on a table of things."""
    figure, axes = plt.subplots(1, 4, figsize=(16.8, 4.4), layout="constrained")
    rooms = folder / "registration" / "redkitchen"
    source, target = rooms / "cloud_bin_5.ply", rooms / "cloud_bin_0.ply"
    objects = folder / "objects" / "chef"
    with tempfile.TemporaryDirectory() as scratch:
        aligned, found, labelled = (
            Path(scratch) / name for name in ("aligned.ply", "found.json", "labelled.ply")
        )
        run("register", source, target, "-o", aligned)
        room = surfsig.read(target).points
        for ax, file, word in zip(axes, (source, aligned), ("before", "after"), strict=False):
            draw(ax, [(room, BLUE), (surfsig.read(file).points, ORANGE)], f"register: two scans {word}")
        run("find", objects / "chef.pcd", objects / "scene.pcd", "--json", found, "-o", labelled)
        instances = json.loads(found.read_text())["instances"]
        scene = surfsig.read(labelled)
    with warnings.catch_warnings():
        # A model of a whole object has no viewpoint; its file says the default one.
        warnings.filterwarnings("ignore", ".*its viewpoint is")
        model = surfsig.read(objects / "chef.pcd").points
    draw(axes[2], [(scene.points, GREY)], "find: a scene")
    own = scene.fields["instance"] >= 0
    parts = [(scene.points[~own], GREY), (scene.points[own], ORANGE)]
    for instance in instances:
        pose = np.array(instance["T_scene_model"])
        parts.append((model @ pose[:3, :3].T + pose[:3, 3], DARK))
    draw(axes[3], parts, "the chef in it")
    figure.savefig(picture, dpi=80)
    # Few colours: a small file.
    with Image.open(picture) as drawn:
        drawn.convert("RGB").quantize(64, dither=Image.Dither.NONE).save(picture, optimize=True)


def draw(ax: Axes, parts: Sequence[tuple[NDArray[np.float64], tuple[float, ...]]], title: str) -> None:
    """Draw clouds in colours as the camera saw them, far points darker, the nearest in front."""
    step = max(1, sum(len(points) for points, _ in parts) // DRAWN)
    thinned = [points[:: step if len(points) > DRAWN else 1] for points, _ in parts]
    seen = np.concatenate(thinned) @ CAMERA
    colors = np.concatenate(
        [np.tile(color, (len(points), 1)) for points, (_, color) in zip(thinned, parts, strict=True)]
    )
    near, far = np.quantile(seen[:, 2], [0.99, 0.01])
    shade = np.clip((seen[:, 2] - far) / (near - far), 0.0, 1.0)
    colors *= 0.55 + 0.45 * shade[:, None]
    order = np.argsort(seen[:, 2])
    ax.scatter(seen[order, 0], seen[order, 1], s=2, c=colors[order], linewidths=0, rasterized=True)
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.set_title(title, fontsize=11)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(f"usage: {sys.argv[0]} FOLDER_OF_SCANS [PICTURE.png]")
    main(Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else "find_again.png"))
