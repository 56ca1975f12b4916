"""How long the flat atom should be: what separates "flat within its error" from "slightly curved".

On a plane the curvature fields tend to 0, and the direction of their signature to that of noise: a plane is
then as similar to a large cylinder as to another plane. One more coordinate, the same for every surface, is
as good as nothing beside a signature that noise cannot explain, and outweighs one that it can.
"""

from __future__ import annotations

import math

import numpy as np

from surfsig._surfsig import Frame
from surfsig.defaults import FLAT_ATOM_NOISES
from surfsig.errors import InvalidInputError


def mean_curvature_noise(noise: float, radius: float, count: float) -> float:
    """Return the standard deviation of H that noise alone gives: 6.9 s / (r^2 sqrt N).

    Parameters
    ----------
    noise
        Standard deviation s of a point's distance to the surface.
    radius
        Radius r of the ball, in the same unit.
    count
        Points N in the ball, spread over a disc.

    Returns
    -------
    Per unit of length.

    Raises
    ------
    InvalidInputError
        If one of them is not a finite number above 0.
    """
    for name, value in (("noise", noise), ("radius", radius), ("count", count)):
        if not (math.isfinite(value) and value > 0):
            raise InvalidInputError(f"{name} must be a finite number above 0, not {value}")
    return 6.9 * noise / (radius**2 * math.sqrt(count))


def flat_atom_length(noise: float, radius: float, count: float, *, frame: Frame | None = None) -> float:
    """Return the flat atom's length for scans of this noise: a few signatures of pure noise.

    Surfaces can only be compared with flat atoms of one length. For an extraction `s`, a typical one is
    ``flat_atom_length(np.nanmedian(s.residual), s.radius, np.median(s.count))``.

    Parameters
    ----------
    noise, radius, count
        As in `mean_curvature_noise`.
    frame
        The vocabulary; `Frame.default()` by default.

    Returns
    -------
    The length, for `Extraction.signatures(flat_atom=...)`.

    Raises
    ------
    InvalidInputError
        As `mean_curvature_noise`; or if the noise alone is beyond the vocabulary's end.
    """
    frame = Frame.default() if frame is None else frame
    k = np.array([mean_curvature_noise(noise, radius, count)], np.float32)
    # A paraboloid that is bent by noise: its signature is linear in H, and does not notice K.
    rows, _ = frame.signatures_of_curvatures(k, k, side=2.0 * radius)
    length = FLAT_ATOM_NOISES * float(np.linalg.norm(rows[0]))
    if not math.isfinite(length):
        raise InvalidInputError(
            f"noise of {noise} is beyond the vocabulary at radius {radius}: take a larger radius"
        )
    return length
