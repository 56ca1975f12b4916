"""Covariance of a fit whose residuals are neither independent nor of one size.

A scanner errs along its ray, and neighbouring points err alike: the number of points alone promises too
much. The points are cut into blocks of neighbours, and only whole blocks count as independent: the
cluster-robust covariance J+ (sum of r r^T over blocks) J+^T, with the residuals of each block corrected for
what the fit took away from them (Bell and McCaffrey 2002, "CR2"). It is unbiased for independent noise of any
size per point, and holds for a correlation that is short against the blocks. An interval takes Student's t
with the degrees of freedom that the blocks leave.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig.shapes.surface import Array, Surface

_BLOCKS = (8, 16, 32)
"""Blocks that the points may be cut into; of 32 the standard error is itself known to some 15 %."""

_PIECES = 6
"""Independent pieces that a block should hold at least, so that few of them lie across its border."""


def covariance_of(surface: Surface, points: Array) -> tuple[Array, float]:
    """Give the covariance of a fitted surface's unknowns, and the degrees of freedom of the last one's.

    Parameters
    ----------
    surface
        Fitted to the points.
    points
        (n, 3).

    Returns
    -------
    As `block_covariance`, with as many blocks as the residuals' correlation allows.
    """
    residuals = surface.distances(points)
    jacobian = surface.jacobian(points, np.zeros(surface.unknowns))
    return block_covariance(jacobian, residuals, spatial_blocks(points, block_count(points, residuals)))


def block_count(points: Array, residuals: Array) -> int:
    """Choose how many blocks to cut points into: fewer, the more neighbours err alike.

    The sum of a block's independent residuals has as many times the mean square of one as there are points in
    the block; by what factor it is larger (the design effect), fewer pieces are independent than points.

    Parameters
    ----------
    points
        (n, 3).
    residuals
        Their distances from the surface, (n,).

    Returns
    -------
    Blocks, 8 to 32.
    """
    squares = float(residuals @ residuals)
    if squares == 0:
        return _BLOCKS[-1]
    effects = [
        float((np.bincount(spatial_blocks(points, count), residuals) ** 2).sum()) / squares
        for count in _BLOCKS
    ]
    pieces = len(points) / max(1.0, *effects)
    return int(np.clip(pieces / _PIECES, _BLOCKS[0], _BLOCKS[-1]))


def spatial_blocks(points: Array, count: int) -> NDArray[np.intp]:
    """Cut points into blocks of neighbours of nearly equal number, each across its longest extent.

    Parameters
    ----------
    points
        (n, 3).
    count
        Blocks to make; no more than there are points.

    Returns
    -------
    numpy.ndarray
        The number of each point's block, (n,).
    """
    labels = np.zeros(len(points), np.intp)
    parts = [(np.arange(len(points)), 0, min(count, len(points)))]
    while parts:
        members, first, share = parts.pop()
        if share == 1:
            labels[members] = first
            continue
        axis = np.ptp(points[members], axis=0).argmax()
        order = members[np.argsort(points[members, axis], kind="stable")]
        left = share // 2
        cut = len(members) * left // share
        parts += [(order[:cut], first, left), (order[cut:], first + left, share - left)]
    return labels


def block_covariance(jacobian: Array, residuals: Array, labels: NDArray[np.intp]) -> tuple[Array, float]:
    """Give the covariance of a least-squares fit from what its residuals have in common within blocks.

    Parameters
    ----------
    jacobian
        Derivatives of the residuals by the unknowns, (n, p).
    residuals
        At the solution, (n,).
    labels
        The number of each point's block, (n,).

    Returns
    -------
    The covariance of the unknowns, (p, p), and the degrees of freedom of the last one's variance
    (Satterthwaite's, as for independent noise); NaN where a block's points are all that determines some
    unknown.
    """
    unknowns = jacobian.shape[1]
    # In the basis q of the Jacobian's columns the normal matrix is the identity.
    basis, triangle = np.linalg.qr(jacobian)
    inverse = np.linalg.inv(triangle)
    count = int(labels.max()) + 1
    order = np.argsort(labels, kind="stable")
    bounds = np.searchsorted(labels[order], np.arange(count + 1))
    scores, last, lengths = np.empty((count, unknowns)), np.empty((count, unknowns)), np.empty(count)
    for block in range(count):
        rows = order[bounds[block] : bounds[block + 1]]
        q = basis[rows]
        taken, turn = np.linalg.eigh(q.T @ q)
        if taken[-1] > 1 - 1e-9:
            return np.full((unknowns, unknowns), np.nan), np.nan
        correction = turn / np.sqrt(1 - taken) @ turn.T
        scores[block] = correction @ (q.T @ residuals[rows])
        # What the last unknown's error is to this block's residuals: q (1 - q^T q)^-1/2 c.
        weights = correction @ inverse[-1]
        last[block] = q.T @ (q @ weights)
        lengths[block] = weights @ last[block]
    covariance = inverse @ (scores.T @ scores) @ inverse.T
    gram = np.diag(lengths) - last @ last.T
    freedom = float(np.trace(gram) ** 2 / (gram**2).sum())
    return covariance, freedom
