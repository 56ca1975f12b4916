"""Telling a caller how far work has come."""

from __future__ import annotations

from collections.abc import Callable

ProgressCallback = Callable[[int, int], object]
"""Called with what is done and with all that there is to do; an exception that it raises stops the work."""


class Progress:
    """Counts what is done and passes it on as (done, total); does nothing without a callback.

    Parameters
    ----------
    callback
        Called with two whole numbers: bytes where a file is read, points where one is written.
    total
        The second of the two.
    """

    def __init__(self, callback: ProgressCallback | None, total: int) -> None:
        self._callback = callback
        self._total = total
        self._done = 0

    def advance(self, amount: int) -> None:
        """Add to what is done."""
        self._done = min(self._total, self._done + amount)
        if self._callback is not None:
            self._callback(self._done, self._total)
