"""How alike signatures are: eqs. (11) and (12), and the paper's three classes."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig._surfsig import GOOD, OPTIMAL
from surfsig.arguments import progress_callback, thread_count
from surfsig.errors import InvalidInputError
from surfsig.progress import ProgressCallback
from surfsig.threads import map_in_threads

FIELD = 121
"""Numbers of one curvature field, on a grid of 11 x 11."""

SIGNATURE = 2 * FIELD
"""Numbers of a signature: K's field, then H's."""

_BLOCK = 1024
"""Rows of a matrix of similarities that are made at a time."""


def similarity(a: ArrayLike, b: ArrayLike, *, either_side: bool = False) -> NDArray[np.float64] | float:
    """Return zeta of eq. (12): |a . b| / (|a| |b|), between 0 and 1.

    Parameters
    ----------
    a, b
        Signatures, (..., 242) or (..., 243) with a flat atom; the leading axes broadcast.
    either_side
        Whether the side from which each surface was seen is unknown: zeta is then the larger one of
        both. For signatures in the surface's own axes.

    Returns
    -------
    zeta, of the leading axes' shape; a float for two single signatures. NaN where a signature is
    missing or zero (a perfect plane without noise has no direction to compare, unless a flat atom
    gives it one).

    Raises
    ------
    InvalidInputError
        If the signatures are not of one length.
    """
    v1, v2 = _rows(a), _rows(b)
    _same_length(v1, v2)
    try:
        dot = np.einsum("...i,...i->...", v1, v2)
    except ValueError:
        raise InvalidInputError(f"shapes {v1.shape} and {v2.shape} do not broadcast") from None
    zeta = _zeta(dot, _lengths(v1), _lengths(v2))
    if either_side:
        zeta = np.fmax(zeta, similarity(v1, flip_signatures(v2)))
    return zeta if np.ndim(zeta) else float(zeta)


def similarity_matrix(
    a: ArrayLike,
    b: ArrayLike,
    *,
    either_side: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> NDArray[np.float64]:
    """Return zeta of every row of `a` with every row of `b`, by products of matrices.

    Parameters
    ----------
    a, b
        Signatures, (m, 242) and (k, 242), or both with a flat atom.
    either_side
        As in `similarity`.
    threads
        Number of threads; all cores by default. Within each, NumPy's matrix product may use threads of its
        own. The result is the same.
    progress
        Called with the number of rows of `a` that are done, and of all.

    Returns
    -------
    (m, k) float64.

    Raises
    ------
    InvalidInputError
        If the signatures are not of one length.
    """
    workers, tell = thread_count(threads), progress_callback(progress)
    v1, v2 = np.atleast_2d(_rows(a)), np.atleast_2d(_rows(b))
    _same_length(v1, v2)
    if v1.ndim != 2 or v2.ndim != 2:
        raise InvalidInputError(f"expected rows of signatures, not the shapes {v1.shape} and {v2.shape}")
    sides = [v2, flip_signatures(v2)] if either_side else [v2]
    lengths = [_lengths(side)[None, :] for side in sides]
    zeta = np.empty((len(v1), len(v2)))

    def fill(start: int) -> None:
        rows = v1[start : start + _BLOCK]
        own = _lengths(rows)[:, None]
        found = [_zeta(rows @ side.T, own, length) for side, length in zip(sides, lengths, strict=True)]
        zeta[start : start + _BLOCK] = np.fmax(*found) if either_side else found[0]

    def rows_done(number: int, _: int) -> None:
        if tell is not None:
            tell(min(number * _BLOCK, len(v1)), len(v1))

    map_in_threads(fill, range(0, len(v1), _BLOCK), workers, rows_done)
    return zeta


def similarity_class(zeta: float) -> Literal["optimal", "good", "dissimilar"]:
    """Return the paper's class: optimal from 0.9 on, good from 0.5 on, else dissimilar.

    Parameters
    ----------
    zeta
        As `similarity` gives it.

    Returns
    -------
    The class, in lower case.

    Raises
    ------
    InvalidInputError
        If zeta is not a number from 0 to 1.
    """
    if not 0.0 <= zeta <= 1.0:
        raise InvalidInputError(f"zeta must be a number from 0 to 1, not {zeta}")
    if zeta >= OPTIMAL:
        return "optimal"
    return "good" if zeta >= GOOD else "dissimilar"


def flip_signatures(signatures: ArrayLike) -> NDArray[np.float64]:
    """Return the signatures of the same surfaces seen from their other side.

    From there k1 and k2 change places and signs: K stays, H is inverted, and the grid's axes change
    places. The frame holds with an atom its mirror images, so w changes as the fields do.

    Parameters
    ----------
    signatures
        In the surface's own axes, (..., 242) or (..., 243).

    Returns
    -------
    Of the same shape, float64; a flat atom stays as it is.

    Raises
    ------
    InvalidInputError
        If they are not numbers of that shape.
    """
    rows = _rows(signatures)
    other = rows.copy()
    for start, sign in ((0, 1.0), (FIELD, -1.0)):
        grid = rows[..., start : start + FIELD].reshape(*rows.shape[:-1], 11, 11)
        other[..., start : start + FIELD] = sign * grid.swapaxes(-1, -2).reshape(*rows.shape[:-1], FIELD)
    return other


def _rows(signatures: ArrayLike) -> NDArray[np.float64]:
    try:
        rows = np.asarray(signatures, np.float64)
    except (TypeError, ValueError):
        raise InvalidInputError("signatures must be numbers") from None
    if rows.ndim == 0 or rows.shape[-1] not in (SIGNATURE, SIGNATURE + 1):
        raise InvalidInputError(f"signatures must have 242 or 243 columns, not the shape {rows.shape}")
    return rows


def _same_length(a: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    if a.shape[-1] != b.shape[-1]:
        raise InvalidInputError(f"signatures of {a.shape[-1]} and {b.shape[-1]} numbers cannot be compared")


def _lengths(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", rows, rows)))


def _zeta(dot: Any, length1: NDArray[np.float64], length2: NDArray[np.float64]) -> NDArray[np.float64]:
    with np.errstate(invalid="ignore", divide="ignore"):
        # Equation (12); rounding must not lift it above 1.
        return np.asarray(np.minimum(np.abs(dot) / (length1 * length2), 1.0), np.float64)
