"""What the paper could not do: the same objects turned about every axis, the patch off the apex."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from .._surfsig import FLAT_ATOM_NOISES, GOOD, OPTIMAL, Frame
from ..flat_atom import mean_curvature_noise
from ..signature_similarity import similarity_matrix
from ..simulate import Scanner
from ..simulate.poses import Array
from .comparison import REPRODUCTION
from .printed import SIDE, TABLE_III
from .scans import OWN, OWN_HALF, PAPER, Fit, Fits

KINDS: Final = ("plane", "cylinder", "sphere")

#: Radii further apart than this belong to objects that must not be confused.
FAR_APART: Final = 1.5

#: Largest share of false matches that is still a success.
ALLOWED: Final = 0.01

#: Acquisitions that the twenty are recognised by: each object once, and one plane for all (they differ in
#: nothing that a patch shows). The repeats 16, 18 and 19 show the objects of 11, 15 and 14.
LIBRARY: Final = (1, 8, 9, 14, 10, 15, 13, 12, 11, 17, 20)
SHOWN_BY: Final = {2: 1, 3: 1, 4: 1, 5: 1, 6: 1, 7: 1, 16: 11, 18: 15, 19: 14}


def flat_atom(ball: float, scanner: Scanner | None = None) -> float:
    """Length of the flat atom for fits in balls of a radius, from the scanner's data sheet alone.

    Nothing measured enters, so it was fixed before any random pose was compared:

    - A height has the variance
      s^2 = noise^2 + (rounding step)^2 / 12 + outlier rate * (outlier height)^2 / 3.
    - A disc of radius r that faces the scanner holds N = pi r^2 / (spacing in x * spacing in y) points. On a
      tilted surface there are fewer by the cosine, but their errors along the normal are smaller by it.
    - The fit's H then has the standard deviation 6.9 s / (r^2 sqrt(N)) (a paraboloid's theory). On a plane
      the signature is H times that of unit H: to first order nothing else is left of noise.
    - The flat atom is so many times as long as that noise that 99 of 100 pairs of planes are at 0.9 or
      above (`FLAT_ATOM_NOISES`).

    Parameters
    ----------
    ball : float
        Radius of the ball, metres.
    scanner : Scanner, optional
        Its defaults otherwise, which the acquisitions are scanned with.

    Returns
    -------
    float
        For signatures of the default frame on patches of 40 mm.
    """
    scanner = scanner or Scanner()
    variance = scanner.noise**2 + (scanner.row_step * scanner.height_per_row) ** 2 / 12
    variance += scanner.outlier_rate * scanner.outlier_height**2 / 3
    count = np.pi * ball**2 / (scanner.column_step * scanner.pixel * scanner.sheet_step)
    k = np.array([mean_curvature_noise(np.sqrt(variance), ball, count)], np.float32)
    noise, _ = Frame.default().signatures_of_curvatures(k, k, side=SIDE)
    return float(np.linalg.norm(noise) * FLAT_ATOM_NOISES)


@dataclass(frozen=True, eq=False)
class Way:
    """One way of making signatures, and what came of it in d random draws.

    Attributes
    ----------
    fit : Fit
        Axes and ball.
    label : str
        For headings.
    flat_atom : float or None
        Its length.
    signatures : (d, 20, n) ndarray
        NaN where the vocabulary ends.
    library : (11, n) ndarray
        The objects of `LIBRARY`, in the stated poses.
    zeta : (d, 20, d, 20) ndarray
        Of all pairs of patches.
    """

    fit: Fit
    label: str
    flat_atom: float | None
    signatures: Array
    library: Array
    zeta: Array

    def pairs(self, one: int, other: int) -> Array:
        """Zeta of two acquisitions (1 to 20, or one twice), over all pairs of different draws."""
        zeta = self.zeta[:, one - 1, :, other - 1]
        return np.asarray(zeta[~np.eye(len(zeta), dtype=np.bool_)])

    def share_alike(self, one: int, other: int) -> float:
        """Share of these pairs at 0.9 or above; one without a signature is not."""
        return float((self.pairs(one, other) >= OPTIMAL).mean())

    def share_missing(self, number: int) -> float:
        """Share of an acquisition's draws without a signature."""
        return float(np.isnan(self.signatures[:, number - 1, 0]).mean())

    def recognised(self) -> npt.NDArray[np.int64]:
        """Which of the `LIBRARY` is most alike, (d, 20) positions in it; -1 where none is from 0.5 on."""
        rows = self.signatures.reshape(-1, self.signatures.shape[-1])
        zeta = np.nan_to_num(similarity_matrix(rows, self.library))
        best = np.where(zeta.max(axis=1) >= GOOD, zeta.argmax(axis=1), -1)
        return best.reshape(self.signatures.shape[:2])

    def confusion(self) -> Array:
        """Shares of draws, (11, 12): rows shown, columns recognised objects of `LIBRARY`, then none."""
        counts = np.zeros((len(LIBRARY), len(LIBRARY) + 1))
        for number, best in enumerate(self.recognised().T, start=1):
            counts[LIBRARY.index(SHOWN_BY.get(number, number))] += np.bincount(
                np.where(best < 0, len(LIBRARY), best), minlength=len(LIBRARY) + 1
            )
        return np.asarray(counts / counts.sum(axis=1, keepdims=True))


def ways(random: dict[Fit, Fits], stated: dict[Fit, Fits]) -> tuple[Way, ...]:
    """Make the signatures of random draws in the paper's way and in the surface's own axes.

    Parameters
    ----------
    random, stated
        Fits of `PAPER`, `OWN` and `OWN_HALF`, in random poses (d draws) and in the stated ones (of which the
        first draw is the library).
    """
    made = [
        _way(
            PAPER,
            "the paper's way: sensor's axes",
            None,
            REPRODUCTION.signatures(random[PAPER].surfaces),
            REPRODUCTION.signatures(stated[PAPER].surfaces[0]),
        )
    ]
    for fit, label in ((OWN, "surface's axes, 20 mm ball"), (OWN_HALF, "surface's axes, 10 mm ball")):
        length = flat_atom(fit.radius)
        rows, first = (own_signatures(fits, length) for fits in (random[fit], stated[fit]))
        made.append(_way(fit, label, length, rows, first[0]))
    return tuple(made)


def own_signatures(fits: Fits, flat: float) -> Array:
    """Signatures of the default frame, with a flat atom, from k1 and k2: (s, 20, 243), NaN beyond it."""
    k1, k2 = (np.ascontiguousarray(k, np.float32).ravel() for k in (fits.k1, fits.k2))
    # The frame's patch stays the paper's, whatever the ball that gave the curvatures.
    rows, _ = Frame.default().signatures_of_curvatures(k1, k2, side=SIDE)
    atom = np.where(np.isnan(rows[:, :1]), np.nan, flat)
    return np.hstack([rows.astype(np.float64), atom]).reshape(*fits.k1.shape, -1)


def _way(fit: Fit, label: str, flat: float | None, signatures: Array, stated: Array) -> Way:
    draws = len(signatures)
    rows = signatures.reshape(draws * len(TABLE_III), -1)
    zeta = similarity_matrix(rows, rows).reshape(draws, len(TABLE_III), draws, len(TABLE_III))
    library = stated[[number - 1 for number in LIBRARY]]
    return Way(fit, label, flat, signatures, library, zeta)


def must_differ(one: int, other: int) -> bool:
    """Tell whether table III has two planes, cylinders or spheres of different kind or far apart radii."""
    a, b = TABLE_III[one - 1], TABLE_III[other - 1]
    if a.kind not in KINDS or b.kind not in KINDS:
        return False
    if a.kind != b.kind:
        return True
    return a.kind != "plane" and max(a.radius, b.radius) / min(a.radius, b.radius) > FAR_APART


def false_matches(way: Way) -> dict[tuple[int, int], float]:
    """Share of pairs of draws at 0.9 or above, for each pair of acquisitions that `must_differ`."""
    numbers = range(1, len(TABLE_III) + 1)
    return {
        (one, other): way.share_alike(one, other)
        for one in numbers
        for other in numbers
        if one < other and must_differ(one, other)
    }


def self_similarity(way: Way) -> dict[str, float]:
    """Share of pairs of draws of the same acquisition at 0.9 or above, for each kind over its objects."""
    return {kind: float(np.mean([way.share_alike(n, n) for n in _numbers(kind)])) for kind in KINDS}


def _numbers(kind: str) -> list[int]:
    return [number for number, row in enumerate(TABLE_III, start=1) if row.kind == kind]
