"""The whole reproduction: scan, fit, compare. Its result is numbers; files are made of them elsewhere."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from ..defaults import PAPER_SEEDS
from ..errors import InvalidInputError
from ..simulate import Jitter
from ..simulate.poses import Array
from .comparison import REPRODUCTION, VOCABULARIES, Decisions, Vocabulary, decide, zeta_matrices
from .random_poses import Way, ways
from .scans import OWN, OWN_HALF, PAPER, Fit, Fits, scan_and_fit

#: Random poses are cheap to scan, and rare events are to be counted: this many draws per seed.
DRAWS_PER_SEED: Final = 5

#: The sweep: how far poses miss the stated ones, in multiples of `Jitter`'s bounds. 0 and 1 are the stated
#: and the jittered poses themselves.
SWEEP: Final = (0.5, 2.0)


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What was measured.

    Attributes
    ----------
    seeds, draws : int
        Draws of stated and jittered poses, each; draws of random poses.
    stated : dict of Fit to Fits
        In the stated poses: the draws differ by noise.
    jittered : Fits
        The paper's fits in poses that miss the stated ones by `Jitter`'s defaults.
    sweep : dict of float to Fits
        The same, with the bounds scaled; from 0 (stated) up.
    random : dict of Fit to Fits
        In random poses.
    ways : tuple of Way
        Random poses, in the paper's way and in the surface's own axes.
    """

    seeds: int
    draws: int
    stated: Mapping[Fit, Fits]
    jittered: Fits
    sweep: Mapping[float, Fits]
    random: Mapping[Fit, Fits]
    ways: tuple[Way, ...]

    @cached_property
    def zeta(self) -> dict[Vocabulary, dict[str, Array]]:
        """Zeta matrices (s, 20, 20) by frame, in "stated" and in "jittered" poses."""
        poses = {"stated": self.stated[PAPER], "jittered": self.jittered}
        return {
            vocabulary: {
                name: zeta_matrices(vocabulary.signatures(fits.surfaces)) for name, fits in poses.items()
            }
            for vocabulary in VOCABULARIES
        }

    @cached_property
    def sweep_decisions(self) -> dict[float, Decisions]:
        """Decisions of the reproduction's frame, by how far poses miss the stated ones."""
        return {
            scale: decide(zeta_matrices(REPRODUCTION.signatures(fits.surfaces)))
            for scale, fits in self.sweep.items()
        }


def reproduce(
    seeds: int = PAPER_SEEDS,
    *,
    draws: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Reproduction:
    """Run the paper's experiments on simulated scans; the same numbers for the same arguments.

    Parameters
    ----------
    seeds
        Draws in the stated and in the jittered poses (and half of it at each further scale of the sweep).
    draws
        Draws in random poses, at least 2; five for each of `seeds` by default.
    progress
        Called with the number of scans done and their total.

    Raises
    ------
    InvalidInputError
        If `seeds` is below 1 or `draws` below 2.
    """
    draws = DRAWS_PER_SEED * seeds if draws is None else draws
    if seeds < 1:
        raise InvalidInputError(f"seeds must be at least 1, not {seeds}")
    if draws < 2:
        raise InvalidInputError(f"draws must be at least 2, to compare different ones, not {draws}")
    few = range((seeds + 1) // 2)
    done = _Counter(20 * (2 * seeds + len(SWEEP) * len(few) + draws), progress)
    all_fits = (PAPER, OWN, OWN_HALF)
    stated = scan_and_fit(all_fits, range(seeds), poses="stated", done=done)
    jittered = scan_and_fit([PAPER], range(seeds), poses="jittered", done=done)[PAPER]
    sweep = {0.0: stated[PAPER], 1.0: jittered}
    standard = Jitter()
    for scale in SWEEP:
        bounds = Jitter(turn=scale * standard.turn, shift=scale * standard.shift, pick=scale * standard.pick)
        sweep[scale] = scan_and_fit([PAPER], few, poses="jittered", jitter=bounds, done=done)[PAPER]
    random = scan_and_fit(all_fits, range(draws), poses="random", done=done)
    return Reproduction(
        seeds, draws, stated, jittered, dict(sorted(sweep.items())), random, ways(random, stated)
    )


class _Counter:
    """Counts scans that several threads finish."""

    def __init__(self, total: int, progress: Callable[[int, int], object] | None) -> None:
        self.total, self.progress = total, progress
        self.count = 0
        self.lock = threading.Lock()

    def __call__(self) -> None:
        with self.lock:
            self.count += 1
            if self.progress is not None:
                self.progress(self.count, self.total)
