"""Extract a simulated scan of a machined part, and draw what surfsig finds: `make demo`.

python examples/demo.py [FOLDER]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import ArrayLike

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import surfsig
from surfsig import plot, simulate

SEED = 0
RADIUS = 0.005
"""Half a patch's side, in metres: small against the part's radii, large against its 0.1 mm of noise."""


def main(folder: Path) -> None:
    """Scan, extract, compare, draw."""
    folder.mkdir(parents=True, exist_ok=True)
    cloud = simulate.part(SEED)
    start = time.perf_counter()
    s = surfsig.extract(cloud, RADIUS)
    seconds = time.perf_counter() - start
    print(f"simulated part, seed {SEED}: {len(s):,} points, {s.count.mean():.0f} neighbours each")
    print(f"curvature of all of them in {seconds:.2f} s ({len(s) / seconds:,.0f} points per second)")
    for name, count in s.status_counts().items():
        print(f"  {name:20}{count:10,}")

    print(f"\n{'true surface':34}{'points':>8}{'1/k1 [mm]':>12}{'1/k2 [mm]':>12}   (medians)")
    surface = cloud.fields["surface"]
    for number, name in enumerate(simulate.part_scene().names):
        member = (surface == number) & s.ok
        k1, k2 = np.median(s.k1[member]), np.median(s.k2[member])
        print(f"{name:34}{member.sum():8,}{_radius(k1):>12}{_radius(k2):>12}")

    names = simulate.part_scene().names
    reference = _middle_of(cloud, surface == _first(names, "sphere", "dome"))
    zeta = s.similarity_to(s.signatures([reference], flat_atom="auto")[0])
    picture = folder / "part.png"
    _draw(s, zeta, reference, picture)
    cloud_file = folder / "part.ply"
    columns: dict[str, ArrayLike] = {"k1": s.k1, "k2": s.k2, "mean_curvature": s.mean_curvature}
    columns |= {"zeta": zeta, "normals": s.normals}
    surfsig.write(cloud_file, cloud, columns)
    print(f"\npicture:      {picture}\npoint cloud:  {cloud_file}   (CloudCompare offers its scalar fields)")


def _radius(curvature: float) -> str:
    """Return a radius in millimetres, or that it is flat to the eye."""
    return "flat" if abs(curvature) < 2.0 else f"{1000.0 / curvature:.1f}"


def _first(names: tuple[str, ...] | list[str], *words: str) -> int:
    return next(i for i, name in enumerate(names) if any(word in name for word in words))


def _middle_of(cloud: surfsig.PointCloud, member: np.ndarray) -> int:
    points = cloud.points
    distance = np.linalg.norm(points - np.median(points[member], axis=0), axis=1)
    return int(np.argmin(np.where(member, distance, np.inf)))


def _draw(s: surfsig.Extraction, zeta: np.ndarray, reference: int, path: Path) -> None:
    # Heights run along negative z: seen from the scanner's side, a little from the front.
    view = plot.view_axes(-62.0, -48.0) * np.array([[-1.0], [-1.0], [1.0]])
    figure, axes = plt.subplots(1, 2, figsize=(15, 6.2), layout="constrained")
    size = 0.5
    shown = plot.draw_points(
        axes[0], s.points, s.mean_curvature, normals=s.normals, view=view, size=size, limits=(-150, 150)
    )
    axes[0].set_title("Mean curvature: bumps red, hollows blue, flat grey")
    figure.colorbar(shown, ax=axes[0], shrink=0.7, label="H [1/m]")
    shown = plot.draw_points(
        axes[1], s.points, zeta, normals=s.normals, view=view, size=size, limits=(0, 1), colormap="viridis"
    )
    place = (s.points[reference] - s.points[np.isfinite(s.points).all(axis=1)].mean(axis=0)) @ view.T
    axes[1].plot(*place[:2], "+", color="white", markersize=14, markeredgewidth=2)
    axes[1].set_title("Points with the signature of the one marked +")
    figure.colorbar(shown, ax=axes[1], shrink=0.7, label="zeta, eq. (12)")
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "demo"))
