"""Tables IV to VI and their 57 decisions: the paper's signatures, compared as the paper does."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from .._surfsig import GOOD, Frame
from ..signature_similarity import similarity_matrix
from ..simulate.poses import Array
from .printed import SIDE, SIMILARITIES, SimilarityTable

#: Levels of f, table II's last parameter. The paper does not give the number of samples per parameter: with
#: 3 and eq. (4) as printed the smallest eigenvalue is 2.37e-4, with 9 (the default) and the power 3/2
#: 2.55e-4; the paper says about 2.5e-4.
OffsetLevels = Literal[3, 9]


@dataclass(frozen=True)
class Vocabulary:
    """One of the four frames of the reproduction.

    Attributes
    ----------
    as_printed : bool
        Eq. (4) with the power 2, as printed, or 3/2, the mean curvature.
    offset_levels : int
        3: the reproduction's frame. 9: the default frame.
    """

    as_printed: bool
    offset_levels: OffsetLevels

    @property
    def label(self) -> str:
        """For headings."""
        frame = "the reproduction's frame" if self.offset_levels == 3 else "the default frame"
        return f"{frame}, eq. (4) {'as printed' if self.as_printed else 'with the power 3/2'}"

    @property
    def frame(self) -> Frame:
        """Made once."""
        return _frame(self)

    def signatures(self, surfaces: Array) -> Array:
        """Signatures of surfaces in metres, also where the vocabulary ends.

        The library gives none to a surface that is more curved than any atom. The paper did (its sphere 5 is
        there), so the reproduction must: with F^T = Q R, the rows are R^-T alpha. They have the lengths and
        dot products, hence the zeta, of c = pinv(F) alpha, because F F^T = R^T R.

        Parameters
        ----------
        surfaces : (..., 6) ndarray
            a, b, c, d, e, f of eq. (5).

        Returns
        -------
        (..., 242) ndarray
        """
        patch_units = surfaces * np.array([SIDE, SIDE, 1.0, 1.0, SIDE, 1.0 / SIDE])
        rows = patch_units.reshape(-1, 6)
        alpha = np.array([self.frame.curvature_fields(row) for row in rows])
        return np.asarray(np.linalg.solve(_triangle(self).T, alpha.T).T).reshape(*surfaces.shape[:-1], -1)


#: The paper's frame, as nearly as it can be known; and the other three.
REPRODUCTION: Final = Vocabulary(as_printed=True, offset_levels=3)
VOCABULARIES: Final = (
    REPRODUCTION,
    Vocabulary(as_printed=False, offset_levels=3),
    Vocabulary(as_printed=True, offset_levels=9),
    Vocabulary(as_printed=False, offset_levels=9),
)


@cache
def _frame(vocabulary: Vocabulary) -> Frame:
    return Frame(as_printed=vocabulary.as_printed, offset=(0.5, vocabulary.offset_levels))


@cache
def _triangle(vocabulary: Vocabulary) -> Array:
    frame = vocabulary.frame
    atoms = np.array([frame.curvature_fields(atom) for atom in frame.atoms])
    return np.asarray(np.linalg.qr(atoms, mode="r"))


def zeta_matrices(signatures: Array) -> Array:
    """Zeta of all pairs of acquisitions, eq. (12), draw by draw: (s, 20, 242) to (s, 20, 20)."""
    return np.array([similarity_matrix(rows, rows) for rows in signatures])


def zeta_of(table: SimilarityTable, zeta: Array) -> Array:
    """One table's nineteen values, (s, 19), from matrices (s, 20, 20)."""
    return np.asarray(zeta[:, table.reference - 1, [n - 1 for n in table.others]])


@dataclass(frozen=True, eq=False)
class Decisions:
    """How many of the paper's 57 decisions (zeta >= 0.5) each draw repeats.

    "Always no" agrees with 49 of the 57, so the two kinds are counted apart.

    Attributes
    ----------
    positives, negatives : (s,) ndarray of int
        Repeated decisions, of `OF_POSITIVES` and `OF_NEGATIVES`.
    """

    positives: npt.NDArray[np.int64]
    negatives: npt.NDArray[np.int64]

    @property
    def median_draw(self) -> int:
        """The draw in the middle by the number of repeated decisions; the lower of two middles."""
        order = np.lexsort((self.positives, self.positives + self.negatives))
        return int(order[(len(order) - 1) // 2])


OF_POSITIVES: Final = sum(int((table.zeta >= GOOD).sum()) for table in SIMILARITIES)
OF_NEGATIVES: Final = sum(int((table.zeta < GOOD).sum()) for table in SIMILARITIES)


def decide(zeta: Array) -> Decisions:
    """Count the decisions in matrices (s, 20, 20); a zeta that is not a number decides "no"."""
    positives = np.zeros(len(zeta), np.int64)
    negatives = np.zeros(len(zeta), np.int64)
    for table in SIMILARITIES:
        alike, printed = zeta_of(table, zeta) >= GOOD, table.zeta >= GOOD
        positives += (alike & printed).sum(axis=1)
        negatives += (~alike & ~printed).sum(axis=1)
    return Decisions(positives, negatives)


@dataclass(frozen=True)
class Difference:
    """A decision that is not the paper's in at least one draw.

    Attributes
    ----------
    table : SimilarityTable
        Where it is printed.
    other : int
        With which acquisition the table's reference is compared.
    printed, median : float
        Zeta, printed and ours.
    share : float
        Share of draws in which the decision differs.
    """

    table: SimilarityTable
    other: int
    printed: float
    median: float
    share: float


def differences(zeta: Array) -> list[Difference]:
    """List the decisions that differ in any draw of matrices (s, 20, 20), table by table."""
    found = []
    for table in SIMILARITIES:
        ours = zeta_of(table, zeta)
        shares = ((ours >= GOOD) != (table.zeta >= GOOD)).mean(axis=0)
        for i, other in enumerate(table.others):
            if shares[i] > 0:
                median = float(np.median(ours[:, i]))
                found.append(Difference(table, other, float(table.zeta[i]), median, float(shares[i])))
    return found
