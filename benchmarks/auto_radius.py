"""Compare radius="auto" with the best fixed radius, which needs to know the truth: a table for BENCHMARKS.md.

python benchmarks/auto_radius.py
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

import surfsig

Array = npt.NDArray[np.float64]
Surface = tuple[Array, Array, Array, npt.NDArray[Any]]
SEED, NOISES = 3, (0.02, 0.1, 0.3)
RADII = [2 ** (i / 2) for i in range(2, 11)]


def sphere(rng: np.random.Generator) -> Surface:
    """Make points of a half sphere of radius 30, normals, mean curvature, and which are not at the rim."""
    z, turn = rng.uniform(0, 1, 24_000), rng.uniform(0, 2 * np.pi, 24_000)
    normals = np.column_stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
    return 30 * normals, normals, np.full(len(z), 1 / 30), z > 0.4


def cylinder(rng: np.random.Generator) -> Surface:
    """Make the same of a part of a cylinder of radius 15 along y."""
    turn, y = rng.uniform(-1.2, 1.2, 20_000), rng.uniform(-50, 50, 20_000)
    normals = np.column_stack([np.sin(turn), np.zeros(len(turn)), np.cos(turn)])
    points = 15 * normals + np.column_stack([0 * y, y, 0 * y])
    return points, normals, np.full(len(turn), 1 / 30), np.maximum(abs(y) / 30, abs(turn) / 0.8) < 1


def plane(rng: np.random.Generator) -> Surface:
    """Make the same of a plane."""
    points = np.column_stack([rng.uniform(-50, 50, (20_000, 2)), np.zeros(20_000)])
    normals = np.tile([0.0, 0.0, 1.0], (20_000, 1))
    return points, normals, np.zeros(20_000), np.abs(points).max(axis=1) < 30


def waves(rng: np.random.Generator) -> Surface:
    """Make the same of z = 2 sin(wx) sin(wy) with waves of length 60, whose curvature changes everywhere."""
    x, y = rng.uniform(-60, 60, (2, 40_000))
    height, w = 2.0, 2 * np.pi / 60
    sx, cx, sy, cy = np.sin(w * x), np.cos(w * x), np.sin(w * y), np.cos(w * y)
    fx, fy, fxx, fxy = (
        height * w * cx * sy,
        height * w * sx * cy,
        -height * w * w * sx * sy,
        height * w * w * cx * cy,
    )
    length = np.sqrt(1 + fx**2 + fy**2)
    mean = -((1 + fy**2) * fxx - 2 * fx * fy * fxy + (1 + fx**2) * fxx) / (2 * length**3)
    normals = np.column_stack([-fx, -fy, np.ones(len(x))]) / length[:, None]
    inner = (abs(x) < 30) & (abs(y) < 30)
    return np.column_stack([x, y, height * sx * sy]), normals, mean, inner


def main() -> None:
    """Print the table."""
    print(f"Seed {SEED}; fixed radii: {', '.join(f'{radius:.3g}' for radius in RADII)}.\n")
    print("| surface | noise | best radius | its error of H | auto's | ratio | chosen radii (5, 50, 95 %) |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    surfaces: list[Callable[[np.random.Generator], Surface]] = [sphere, cylinder, plane, waves]
    for surface in surfaces:
        for noise in NOISES:
            _row(surface, noise)


def _row(surface: Callable[[np.random.Generator], Surface], noise: float) -> None:
    rng = np.random.default_rng(SEED)
    points, normals, truth, inner = surface(rng)
    points = points + normals * rng.normal(0, noise, (len(points), 1))
    at = np.flatnonzero(inner)[::5]

    def error(s: surfsig.Extraction) -> float:
        return float(np.sqrt(np.nanmean((s.mean_curvature - truth[at]) ** 2)))

    errors = [error(s) for s in surfsig.extract_radii(points, RADII, at=at, normals=normals)]
    chosen = surfsig.extract(points, "auto", at=at, normals=normals)
    best, mine = min(errors), error(chosen)
    quantiles = ", ".join(f"{r:.3g}" for r in np.quantile(chosen.radius, (0.05, 0.5, 0.95)))
    radius = RADII[int(np.argmin(errors))]
    name = surface.__name__
    print(f"| {name} | {noise} | {radius:.3g} | {best:.2g} | {mine:.2g} | {mine / best:.2f} | {quantiles} |")


if __name__ == "__main__":
    main()
