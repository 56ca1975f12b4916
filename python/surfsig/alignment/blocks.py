"""Covariances of motions whose heights err alike near each other: cluster-robust, by blocks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BLOCKS = 8.0
"""Blocks along the overlap: what errs alike within one counts once."""
_FEWEST = 20
"""Blocks that tell whether errors are alike."""


def blocks(places: Array) -> NDArray[np.int64] | None:
    """Give the block's number of each place (n, 3), from 0; None where they are too few to tell."""
    size = float(np.ptp(places, axis=0).max()) / _BLOCKS
    _, block = np.unique(np.floor(places / size).astype(np.int64), axis=0, return_inverse=True)
    numbers = np.asarray(block.ravel(), np.int64)
    return numbers if int(numbers.max()) >= _FEWEST else None


def clustered_covariance(design: Array, heights: Array, block: NDArray[np.int64]) -> Array:
    """Give the covariance of a motion, (6, 6): only sums over whole blocks are independent.

    Parameters
    ----------
    design
        How each height changes with the motion, (n, 6).
    heights
        What is left of them, (n,).
    block
        The block of each, from 0, (n,).
    """
    gradients = np.zeros((int(block.max()) + 1, 6))
    np.add.at(gradients, block, design * heights[:, None])
    inverse = np.linalg.pinv(design.T @ design, rcond=1e-12, hermitian=True)
    spread = gradients.T @ gradients * (len(gradients) / (len(gradients) - 6))
    return np.asarray(inverse @ spread @ inverse)
