"""How coarse coordinates may be: the error of mean curvature where they are rounded to a part of the radius.

    python scripts/coarse_coordinates.py

Spheres of 8,000 and 60,000 points are rounded to steps of 1/32 to 1/2 of the ball's radius; the
table says how many standard errors the curvature is off. `COARSEST_STEP` of
crates/surfsig/src/resolution.rs is chosen by it: up to a sixth of the radius errors are what
standard errors say, from a quarter on they are not. A rotation hides the lattice, which the library
itself would recognise.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import surfsig

SEED = 0
RADIUS, BALL = 0.5, 0.15
STEPS = (1 / 32, 1 / 16, 1 / 8, 1 / 6, 1 / 5, 1 / 4, 1 / 3, 1 / 2)


def main() -> None:
    """Print the table."""
    rng = np.random.default_rng(SEED)
    print(f"seed {SEED}\n{'points':>8} {'step / radius':>14} {'median errors':>14} {'share above 4':>14}")
    for count in (8000, 60_000):
        directions = rng.normal(size=(count, 3))
        sphere = RADIUS * directions / np.linalg.norm(directions, axis=1, keepdims=True) + rng.uniform(size=3)
        for part in STEPS:
            step = part * BALL
            rounded = Rotation.random(random_state=SEED).apply(step * np.round(sphere / step))
            found = surfsig.extract(rounded, BALL)
            known = found.ok & (found.mean_curvature_std > 0)
            off = np.abs(np.abs(found.mean_curvature[known]) - 1 / RADIUS) / found.mean_curvature_std[known]
            print(f"{count:>8} {part:>14.3f} {np.median(off):>14.1f} {(off > 4).mean():>14.2f}")


if __name__ == "__main__":
    main()
