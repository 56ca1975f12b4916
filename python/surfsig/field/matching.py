"""Matches between two scans, each with a whole pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.arguments import progress_callback, thread_count
from surfsig.errors import InvalidInputError
from surfsig.field.signatures import FieldSignatures
from surfsig.progress import Progress, ProgressCallback

_Float32 = NDArray[np.float32]
_Places = tuple[NDArray[np.float64], _Float32, _Float32, _Float32, _Float32]
"""Points, vectors, axes, tangents and phases."""


@dataclass(frozen=True, eq=False, repr=False)
class FieldMatches:
    """Places of a source and of a target that look alike, the most alike first."""

    source: NDArray[np.int64]
    """Numbers of places of the source, (k,)."""
    target: NDArray[np.int64]
    """Numbers of places of the target, (k,)."""
    distances: NDArray[np.float32]
    """Between the two signatures, (k,): 0 to 2."""
    poses: NDArray[np.float64]
    """T_target_source by each match alone, (k, 4, 4): place on place, axis on axis, and turned about it by
    what the phases say."""

    def __len__(self) -> int:
        """Return the number of matches."""
        return len(self.source)

    def __repr__(self) -> str:
        """Say how many there are."""
        return f"FieldMatches({len(self)})"


def match_fields(
    source: FieldSignatures,
    target: FieldSignatures,
    *,
    mutual: bool = True,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> FieldMatches:
    """Find for each place of the source the most similar one of the target.

    Parameters
    ----------
    source, target
        From `extract_field_signatures` or `find_keypoints`, of the same radius. Places without a value take
        no part.
    mutual
        Whether only matches stay of which each place is the other's most similar.
    threads
        Number of threads; all cores by default. The result is the same, bit for bit.
    progress
        Called before and after the search, with the number of places of the source that are matched, and of
        all.

    Returns
    -------
    FieldMatches
        Each with a pose; the most similar first.

    Raises
    ------
    InvalidInputError
        If the radii differ.
    """
    workers, tell = thread_count(threads), progress_callback(progress)
    if source.radius != target.radius:
        raise InvalidInputError(
            f"signatures of different radii cannot be matched: {source.radius:g} and {target.radius:g}"
        )
    ours, theirs = np.flatnonzero(source.ok), np.flatnonzero(target.ok)
    done = Progress(tell, len(ours))
    done.advance(0)
    found = _surfsig.match_fields(
        _places(source.take(ours)), _places(target.take(theirs)), mutual=mutual, threads=workers
    )
    done.advance(len(ours))
    return FieldMatches(ours[found["source"]], theirs[found["target"]], found["distances"], found["poses"])


def _places(fields: FieldSignatures) -> _Places:
    """Give places as the core takes them."""
    parts = fields.vectors, fields.axes, fields.tangents, _as_floats(fields.phases)
    vectors, axes, tangents, phases = (np.ascontiguousarray(part, np.float32) for part in parts)
    return np.ascontiguousarray(fields.points, np.float64), vectors, axes, tangents, phases


def _as_floats(phases: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Give real and imaginary parts in turn, (n, 112)."""
    flat = np.ascontiguousarray(phases, np.complex64).view(np.float32)
    return flat.reshape(len(phases), 2 * phases.shape[1] * phases.shape[2])
