"""Find the surfaces of real scans from the shell, and draw each in a colour of its own.

    python examples/surfaces.py FOLDER_OF_SCANS [PICTURE.png]

The scans are not part of the project; their sources are named in BENCHMARKS.md.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from PIL import Image

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import surfsig
from surfsig import PointCloud, plot

CAMERA = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""Seen from where the camera stood: its x to the right, its y down, its z away."""

PARTS = ("PC101", "PC44")
"""Clouds of the benchmark Fit4CAD."""


def read_part(path: Path) -> PointCloud:
    """Read a cloud of Fit4CAD: a list of points in Maple's words."""
    numbers = path.read_text().partition(":=")[2].translate(str.maketrans("[],;:", "     "))
    return PointCloud(np.array(numbers.split(), np.float64).reshape(-1, 3))


def labelled(file: Path) -> PointCloud:
    """Run `surfsig surfaces` as a user would, and read what it wrote."""
    with tempfile.TemporaryDirectory() as scratch:
        output = Path(scratch) / "labelled.ply"
        command = [sys.executable, "-m", "surfsig.cli", "surfaces", str(file), "-o", str(output)]
        table = subprocess.run(command, check=True, capture_output=True, text=True)
        print(table.stdout)
        return surfsig.read(output)


def main(folder: Path, picture: Path) -> None:
    """Draw the mug on its table, and some parts."""
    figure, axes = plt.subplots(
        1, 1 + len(PARTS), figsize=(4.2 * (1 + len(PARTS)), 4.4), layout="constrained"
    )
    table = labelled(folder / "surfaces" / "table_scene_mug.pcd")
    near = (np.abs(table.points - [0.05, 0.05, 0.9]) < [0.4, 0.3, 0.4]).all(axis=1)
    draw(axes[0], table.at(near), np.array(CAMERA), "Mug on a table (stereo)")
    for ax, name in zip(axes[1:], PARTS, strict=True):
        with tempfile.TemporaryDirectory() as scratch:
            file = Path(scratch) / f"{name}.ply"
            surfsig.write(file, read_part(folder / "primitives" / "fit4cad" / f"{name}.txt"))
            draw(ax, labelled(file), plot.view_axes(-60.0, 30.0), f"{name} (Fit4CAD)")
    figure.savefig(picture, dpi=80)
    # Few colours: a small file.
    with Image.open(picture) as drawn:
        drawn.convert("RGB").quantize(64, dither=Image.Dither.NONE).save(picture, optimize=True)


def draw(ax: Axes, cloud: PointCloud, view: NDArray[np.float64], title: str) -> None:
    """Draw a labelled cloud in its surfaces' colours, the nearest points in front."""
    colors = np.column_stack([cloud.fields[name] for name in ("red", "green", "blue")]) / 255
    seen = cloud.points @ view.T
    order = np.argsort(seen[:, 2])
    ax.scatter(seen[order, 0], seen[order, 1], s=4, c=colors[order], linewidths=0, rasterized=True)
    ax.set_aspect("equal")
    ax.set_axis_off()
    found = len(np.unique(cloud.fields["surface"][cloud.fields["surface"] >= 0]))
    ax.set_title(f"{title}\n{len(cloud):,} points, {found} surfaces", fontsize=11)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(f"usage: {sys.argv[0]} FOLDER_OF_SCANS [PICTURE.png]")
    main(Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else "surfaces.png"))
