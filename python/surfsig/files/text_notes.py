"""What is said about a whole cloud in comments of its text file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

_BEGIN = "surfsig"
_VIEWPOINT = "viewpoint"


def note_lines(viewpoint: NDArray[np.float64] | None, notes: Mapping[str, str]) -> list[str]:
    """Write a viewpoint and notes as comments."""
    told = {} if viewpoint is None else {_VIEWPOINT: " ".join(map(repr, viewpoint.tolist()))}
    told.update(notes)
    return [f"// {_BEGIN} {' '.join(f'{name} {text}'.split())}" for name, text in told.items()]


def viewpoint_of(comments: Iterable[str]) -> NDArray[np.float64] | None:
    """Read the viewpoint from comments above the points; None if none gives one."""
    for comment in comments:
        words = comment.strip().lstrip("#/% \t").split()
        if words[:2] == [_BEGIN, _VIEWPOINT] and len(words) == 5:
            try:
                place = np.array([float(word) for word in words[2:]])
            except ValueError:
                continue
            if np.isfinite(place).all():
                return place
    return None
