"""Extract real scans from the shell, and draw each by its mean curvature.

    python examples/real_scans.py FOLDER_OF_SCANS [PICTURE.png]

The scans are not part of the project; their sources are named in BENCHMARKS.md.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import ArrayLike

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import surfsig
from surfsig import plot

CAMERA = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
"""Seen from where the camera stood: its x to the right, its y down, its z away."""


@dataclass(frozen=True)
class Scan:
    """A file, how to extract it, and from where to look at it."""

    file: str
    title: str
    radius: float
    limit: float
    """Mean curvature at the ends of the colour map, per metre."""
    view: ArrayLike = CAMERA
    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    """Only what lies between these corners is drawn."""


SCANS = (
    Scan("surfaces/table_scene_mug.pcd", "Mug on a table (stereo)", 0.02, 40.0,
         box=((-0.35, -0.4, 0.6), (0.45, 0.3, 1.6))),
    Scan("registration/redkitchen/cloud_bin_0.ply", "Kitchen (depth camera, fused)", 0.06, 15.0),
    Scan("registration/bunny/bun000.ply", "Bunny (laser range scan)", 0.003, 150.0, np.eye(3)),
    Scan("surfaces/lidar_sphere_1.xyz", "Sphere of radius 0.3 m (lidar)", 0.2, 7.0,
         plot.view_axes(-125.0, 12.0), ((1.0, 1.7, -0.6), (2.5, 3.3, 0.6))),
    Scan("surfaces/gym_ball.xyz", "Gym ball, radius 0.34 m (tablet)", 0.1, 7.0,
         plot.view_axes(-75.0, 20.0), ((-0.5, -1.5, 0.1), (0.7, -0.3, 1.4))),
)  # fmt: skip


def extract(scan: Scan, folder: Path) -> surfsig.PointCloud:
    """Run `surfsig extract` as a user would, and read what it wrote."""
    with tempfile.TemporaryDirectory() as scratch:
        output = Path(scratch) / "out.ply"
        command = [sys.executable, "-m", "surfsig.cli", "extract", str(folder / scan.file)]
        command += ["--radius", str(scan.radius), "--viewpoint", "0,0,0"]
        if "bunny" in scan.file:
            command[-1] = "0,0,1"
        subprocess.run([*command, "-o", str(output)], check=True)
        return surfsig.read(output)


def main(folder: Path, picture: Path) -> None:
    """Draw one panel a scan."""
    figure, axes = plt.subplots(1, len(SCANS), figsize=(4.2 * len(SCANS), 4.6), layout="constrained")
    for ax, scan in zip(axes, SCANS, strict=True):
        cloud = extract(scan, folder)
        low, high = scan.box or ((-np.inf,) * 3, (np.inf,) * 3)
        points = cloud.points
        shown = cloud.finite & (points >= low).all(axis=1) & (points <= high).all(axis=1)
        normals = np.stack([cloud.fields[name] for name in ("nx", "ny", "nz")], axis=1)
        mapping = plot.draw_points(
            ax,
            points[shown],
            cloud.fields["mean_curvature"][shown],
            normals=normals[shown],
            limits=(-scan.limit, scan.limit),
            view=scan.view,
            size=max(0.6, 2e4 / max(int(shown.sum()), 1)),
        )
        count = f"{int(shown.sum()):,} points, radius {scan.radius:g} m"
        ax.set_title(f"{scan.title}\n{count}", fontsize=11)
        figure.colorbar(mapping, ax=ax, orientation="horizontal", shrink=0.6, label="H [1/m]")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(f"usage: {sys.argv[0]} FOLDER_OF_SCANS [PICTURE.png]")
    main(Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else "real_scans.png"))
