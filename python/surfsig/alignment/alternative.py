"""Another transform that explains as much as the best one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.digits import finite_or_none


@dataclass(frozen=True, eq=False)
class Alternative:
    """A transform that explains as much of the source as the best one."""

    T_target_source: NDArray[np.float64]
    """(4, 4): a point p of the source is at R p + t of the target."""
    explained: float
    """Share of the source that lies on the target's surface, near points counting more, 0 to 1; of pieces
    that recur, mean share of both pieces."""
    free_space: float
    """The larger share of one scan's points in the free space of the other's sensor; NaN where no viewpoint
    is known."""

    def values(self) -> dict[str, Any]:
        """Give everything as plain numbers, for JSON.

        Returns
        -------
        By the names of the attributes; None for what is not known.
        """
        return {
            "T_target_source": self.T_target_source.tolist(),
            "explained": self.explained,
            "free_space": finite_or_none(self.free_space),
        }
