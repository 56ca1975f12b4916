"""Learn the frame of field signatures from simulated scans, and write the table that the core has.

python scripts/learn_field_frame.py            # some minutes; then build anew

For each angular order, what is pooled around a place is a complex vector. Two scans of the same place tell
how much of it changes with noise, viewpoint and sampling (W), all places how much it differs at all (T). The
frame's atoms are the generalised eigenvectors of T and W with the largest ratios, scaled so that what changes
between scans has unit variance in each, and weighted by the share of its variance that tells places apart
(Wiener's). Patches of three sizes are used, in units of which all is alike.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from field_scenes import UNIT, TwoScans, two_scans
from numpy.typing import NDArray
from scipy.linalg import eigh

import surfsig
from surfsig import _surfsig

TABLE = Path(__file__).parents[1] / "crates/surfsig/src/field/frame.bin"
SCENES = 36
PLACES = 600
RADII = (0.7 * UNIT, UNIT, 1.5 * UNIT)
ORDERS = 8
ATOMS = 256
RIDGE = 0.1
"""Of the mean variance within places, added to all: simulated scans do not know every error."""

Complex = NDArray[np.complex128]


def pools(scans: TwoScans, radius: float) -> tuple[Complex, Complex]:
    """Pool around the places of both scans, (n, features, orders); the second is turned as the first."""
    found = [
        _surfsig.field_signatures(
            cloud.offsets,
            origin=cloud.origin.tolist(),
            radius=radius,
            at=places,
            viewpoint=None if cloud.viewpoint is None else cloud.viewpoint.tolist(),
            pools=True,
        )
        for cloud, places in zip(scans.clouds, scans.places, strict=True)
    ]
    (axes, other_axes), (tangents, other_tangents) = (
        [f[name].astype(np.float64) for f in found] for name in ("axes", "tangents")
    )
    carried_axes, carried = (vectors @ scans.motion[:3, :3].T for vectors in (axes, tangents))
    along = np.sum(carried * other_tangents, axis=1)
    angle = np.arctan2(np.sum(carried * np.cross(other_axes, other_tangents), axis=1), along)
    # Where even the axes disagree, nothing else can be compared.
    same = np.sum(carried_axes * other_axes, axis=1) > 0.9
    for f in found:
        same &= f["status"] == surfsig.Status.OK
    first, second = (_complex(f["pools"])[same] for f in found)
    return first, second * np.exp(-1j * angle[same, None, None] * np.arange(ORDERS))


def _complex(sums: NDArray[np.float32]) -> Complex:
    waves = sums.reshape(len(sums), -1, 2, ORDERS).astype(np.float64)
    values = waves[:, :, 0] + 1j * waves[:, :, 1]
    size = np.sqrt((np.abs(values) ** 2).sum(axis=(1, 2), keepdims=True))
    return np.asarray(values / size)


def atoms(first: Complex, second: Complex) -> tuple[NDArray[np.float64], Complex, Complex]:
    """Return ratios of variance, the largest first, the atoms, (features, features), and the mean."""
    mean = (first.mean(axis=0) + second.mean(axis=0)) / 2
    between = sum((x - mean).T.conj() @ (x - mean) for x in (first, second)) / (2 * len(first))
    change = first - second
    within = change.T.conj() @ change / (2 * len(first))
    within += RIDGE * np.trace(within).real / len(within) * np.eye(len(within))
    ratios, vectors = eigh(between, within)
    return ratios[::-1], vectors[:, ::-1], mean


def main() -> None:
    """Scan, learn, write."""
    pairs = []
    for seed in range(SCENES):
        pairs.append(pools(two_scans(seed, PLACES), RADII[seed % len(RADII)]))
        print(f"scene {seed + 1} of {SCENES}", file=sys.stderr, flush=True)
    first, second = (np.concatenate(side) for side in zip(*pairs, strict=True))
    # Order 0 is real, and alone has a mean: the others' phases are of any angle.
    orders = [atoms(first[..., 0].real, second[..., 0].real)]
    angles = np.exp(2j * np.pi * np.random.default_rng(0).random((len(first), 1)))
    orders += [atoms(first[..., m] * angles, second[..., m] * angles) for m in range(1, ORDERS)]
    least = np.sort(np.concatenate([ratios for ratios, _, _ in orders]))[-ATOMS]
    counts = [int((ratios >= least).sum()) for ratios, _, _ in orders]
    numbers: list[NDArray[np.float64]] = []
    for order, (count, (ratios, vectors, mean)) in enumerate(zip(counts, orders, strict=True)):
        kept = vectors[:, :count] * np.sqrt(1.0 - 1.0 / ratios[:count])
        if order == 0:
            numbers += [(mean @ kept).real, kept.real.ravel()]
        else:
            numbers.append(np.stack([kept.real, kept.imag], axis=1).ravel())
    # Rounded to the upper half of float32.
    bits = np.concatenate(numbers).astype("<f4").view("<u4")
    halves = ((bits + 0x7FFF + ((bits >> 16) & 1)) >> 16).astype("<u2")
    TABLE.write_bytes(np.array(counts, "<u2").tobytes() + halves.tobytes())
    print(f"{len(first)} pairs; atoms of orders 0 to {ORDERS - 1}: {counts}; least ratio {least:.2f}")


if __name__ == "__main__":
    main()
