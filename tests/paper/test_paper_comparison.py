"""Signatures beyond the vocabulary, zeta matrices, and the count of the 57 decisions."""

import numpy as np
import pytest

from surfsig.paper.comparison import (
    OF_NEGATIVES,
    OF_POSITIVES,
    REPRODUCTION,
    VOCABULARIES,
    Vocabulary,
    decide,
    differences,
    zeta_matrices,
    zeta_of,
)
from surfsig.paper.printed import SIDE, SIMILARITIES
from surfsig.paper.report import zeta_with_plane

# A plane's noise, a tilted cylinder, and two spheres as the paper's fit finds them, the last beyond 4/D.
SURFACES = np.array(
    [
        [0.02, -0.01, 0.6, 0.1, 0.01, 0.0],
        [23.4, 0.0, 0.1, 0.2, 3.0, 1e-4],
        [35.0, 34.5, 0.0, 0.05, 0.1, 0.0],
        [55.0, 51.0, 0.1, 0.0, 0.0, 0.0],
    ]
)


def printed_matrix() -> np.ndarray:
    """A matrix that holds the printed values."""
    zeta = np.eye(20)
    for table in SIMILARITIES:
        for number, value in zip(table.others, table.zeta, strict=True):
            zeta[table.reference - 1, number - 1] = value
    return zeta


@pytest.mark.parametrize(
    "vocabulary",
    [
        pytest.param(one, marks=() if number >= 2 else pytest.mark.slow)
        for number, one in enumerate(VOCABULARIES)
    ],
)
def test_signatures_have_the_zeta_of_equation_two(vocabulary: Vocabulary) -> None:
    units = SURFACES * np.array([SIDE, SIDE, 1, 1, SIDE, 1 / SIDE])
    c = np.array([vocabulary.frame.coefficients(surface) for surface in units])
    assert c.shape == (4, 3109 if vocabulary.offset_levels == 3 else 9159)
    w = vocabulary.signatures(SURFACES)
    np.testing.assert_allclose(w @ w.T, c @ c.T, rtol=1e-6, atol=1e-8 * np.abs(c @ c.T).max())
    lengths = np.linalg.norm(c, axis=1)
    zeta = np.abs(c @ c.T) / np.outer(lengths, lengths)
    np.testing.assert_allclose(zeta_matrices(w[None])[0], zeta, atol=1e-7)


def test_the_reproductions_frame() -> None:
    assert REPRODUCTION.frame.as_printed
    assert len(REPRODUCTION.frame) == 3109
    assert REPRODUCTION.frame.smallest_eigenvalue(SIDE) == pytest.approx(2.37e-4, abs=1e-6)
    assert VOCABULARIES[3].frame.hash == type(REPRODUCTION.frame).default().hash


def test_printed_values_repeat_all_decisions() -> None:
    assert (OF_POSITIVES, OF_NEGATIVES) == (8, 49)
    decisions = decide(printed_matrix()[None])
    assert (decisions.positives.tolist(), decisions.negatives.tolist()) == ([8], [49])
    assert differences(printed_matrix()[None]) == []


def test_always_and_never_alike() -> None:
    decisions = decide(np.stack([np.ones((20, 20)), np.zeros((20, 20)), np.full((20, 20), np.nan)]))
    assert decisions.positives.tolist() == [8, 0, 0]
    assert decisions.negatives.tolist() == [0, 49, 49]


def test_one_changed_value_is_one_changed_decision() -> None:
    changed = np.repeat(printed_matrix()[None], 4, axis=0)
    changed[0, 5 - 1, 9 - 1] = 0.5
    changed[1:3, 14 - 1, 19 - 1] = 0.4999
    decisions = decide(changed)
    assert decisions.positives.tolist() == [8, 7, 7, 8]
    assert decisions.negatives.tolist() == [48, 49, 49, 49]
    found = {(d.table.name, d.other): (d.share, d.printed) for d in differences(changed)}
    assert found == {("IV", 9): (0.25, 0.1036), ("VI", 19): (0.5, 0.6935)}


def test_the_median_draw_is_the_one_in_the_middle() -> None:
    zeta = np.repeat(printed_matrix()[None], 5, axis=0)
    for draw, wrong in enumerate((0, 6, 2, 1, 4)):
        zeta[draw, 5 - 1, 9 : 9 + wrong] = 0.9
    assert decide(zeta).negatives.tolist() == [49, 43, 47, 48, 45]
    assert decide(zeta).median_draw == 2
    assert decide(zeta[:4]).median_draw == 2


def test_tables_are_rows_without_the_reference() -> None:
    zeta = np.arange(400.0).reshape(1, 20, 20)
    for table in SIMILARITIES:
        expected = [20 * (table.reference - 1) + n - 1 for n in range(1, 21) if n != table.reference]
        assert zeta_of(table, zeta)[0].tolist() == expected


def test_what_is_nearly_flat_is_similar_to_a_plane() -> None:
    curvatures = np.array([2.0, 27.5, 46.8])
    cylinders = zeta_with_plane(curvatures, sphere=False)
    np.testing.assert_allclose(cylinders, [0.9998, 0.599, 0.143], atol=1e-3)
    assert zeta_with_plane(curvatures, sphere=True)[1] == pytest.approx(0.524, abs=1e-3)
