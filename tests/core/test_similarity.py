"""Equation (12) against loops, the paper's classes, and what cannot be compared."""

import math

import numpy as np
import pytest
from surface_points import Array

from surfsig import InvalidInputError, flip_signatures, similarity, similarity_class, similarity_matrix


@pytest.fixture(scope="module")
def rows() -> Array:
    return np.random.default_rng(81).normal(size=(7, 242))


def by_hand(a: Array, b: Array) -> float:
    """Return zeta by a loop: eqs. (11) and (12)."""
    dot = sum(float(x) * float(y) for x, y in zip(a, b, strict=True))
    return abs(dot) / math.sqrt(sum(float(x) ** 2 for x in a)) / math.sqrt(sum(float(y) ** 2 for y in b))


def test_zeta_is_eq_12(rows: Array) -> None:
    for i in range(7):
        for j in range(7):
            assert similarity(rows[i], rows[j]) == pytest.approx(by_hand(rows[i], rows[j]), abs=1e-12)
    one = similarity(rows[0], rows[1])
    assert type(one) is float
    assert similarity(rows[0], rows[0]) == pytest.approx(1)
    assert similarity(rows[0], -3 * rows[0]) == pytest.approx(1)
    orthogonal = rows[1] - (rows[1] @ rows[0]) / (rows[0] @ rows[0]) * rows[0]
    assert similarity(rows[0], orthogonal) == pytest.approx(0, abs=1e-12)


def test_zeta_never_exceeds_1() -> None:
    many = np.random.default_rng(82).normal(size=(2000, 242)).astype(np.float32)
    assert np.max(similarity(many, 7 * many)) <= 1
    assert np.max(similarity_matrix(many[:50], many[:50])) <= 1


def test_leading_axes_broadcast(rows: Array) -> None:
    expected = np.array([[by_hand(a, b) for b in rows[:3]] for a in rows])
    np.testing.assert_allclose(similarity(rows[:, None], rows[None, :3]), expected, atol=1e-12)
    np.testing.assert_allclose(similarity(rows, rows[2]), expected[:, 2], atol=1e-12)
    np.testing.assert_allclose(similarity(rows[2].tolist(), rows), expected[:, 2], atol=1e-12)
    pairs = [by_hand(rows[i], rows[4 + i]) for i in range(3)]
    np.testing.assert_allclose(similarity(rows[:3], rows[4:]), pairs)
    assert np.asarray(similarity(np.zeros((0, 242)), rows[0])).shape == (0,)


def test_matrix_is_every_pair(rows: Array) -> None:
    expected = np.array([[by_hand(a, b) for b in rows[:3]] for a in rows])
    np.testing.assert_allclose(similarity_matrix(rows, rows[:3]), expected, atol=1e-12)
    np.testing.assert_allclose(similarity_matrix(rows.astype(np.float32), rows[:3]), expected, atol=1e-6)
    assert similarity_matrix(rows[0], rows[1]).shape == (1, 1)
    assert similarity_matrix(np.zeros((0, 242)), rows).shape == (0, 7)


def test_a_flat_atom_takes_part(rows: Array) -> None:
    a, b = (np.append(row, 20.0) for row in rows[:2])
    assert similarity(a, b) == pytest.approx(by_hand(a, b))
    assert similarity(a, b) > similarity(rows[0], rows[1]) + 0.1


def test_either_side_takes_the_larger_zeta(rows: Array) -> None:
    other = flip_signatures(rows)
    sides = list(zip(rows, other, strict=True))
    expected = np.array([[max(by_hand(a, b), by_hand(a, c)) for b, c in sides] for a in rows])
    np.testing.assert_allclose(similarity_matrix(rows, rows, either_side=True), expected, atol=1e-12)
    np.testing.assert_allclose(similarity(rows, rows[3], either_side=True), expected[:, 3], atol=1e-12)
    assert similarity(rows[0], other[0], either_side=True) == pytest.approx(1)
    assert type(similarity(rows[0], other[0], either_side=True)) is float
    assert (expected > similarity_matrix(rows, rows) + 0.01).any()


def test_flipped_transposes_the_fields_and_inverts_h(rows: Array) -> None:
    for row, other in zip(rows, flip_signatures(rows), strict=True):
        for i in range(11):
            for j in range(11):
                assert other[11 * i + j] == row[11 * j + i]
                assert other[121 + 11 * i + j] == -row[121 + 11 * j + i]


def test_what_is_missing_or_zero_has_no_zeta(rows: Array) -> None:
    nan, zero = np.full(242, np.nan), np.zeros(242)
    for missing in (nan, zero):
        assert math.isnan(similarity(missing, rows[0]))
        assert math.isnan(similarity(rows[0], missing, either_side=True))
        found = similarity_matrix([missing, rows[0]], rows)
        assert np.isnan(found[0]).all()
        np.testing.assert_allclose(found[1], similarity(rows[0], rows))


@pytest.mark.parametrize(
    ("zeta", "expected"),
    [
        (1.0, "optimal"),
        (0.9, "optimal"),
        (np.nextafter(0.9, 0), "good"),
        (0.5, "good"),
        (np.nextafter(0.5, 0), "dissimilar"),
        (0.0, "dissimilar"),
        (1, "optimal"),
    ],
)
def test_classes_at_their_borders(zeta: float, expected: str) -> None:
    assert similarity_class(zeta) == expected


@pytest.mark.parametrize("zeta", [np.nan, -1e-12, 1 + 1e-12, np.inf])
def test_what_is_no_zeta_has_no_class(zeta: float) -> None:
    with pytest.raises(InvalidInputError, match="zeta must be a number from 0 to 1"):
        similarity_class(zeta)


def test_signatures_of_the_wrong_length(rows: Array) -> None:
    for bad in (rows[:, :241], 5, np.zeros((3, 0)), np.zeros(244), "abc"):
        with pytest.raises(InvalidInputError, match="signatures must"):
            similarity(bad, rows)
        with pytest.raises(InvalidInputError, match="signatures must"):
            similarity_matrix(rows, bad)
    for compare in (similarity, similarity_matrix):
        with pytest.raises(InvalidInputError, match="signatures of 242 and 243 numbers cannot be compared"):
            compare(rows, np.ones((7, 243)))


def test_shapes_that_do_not_broadcast(rows: Array) -> None:
    with pytest.raises(InvalidInputError):
        similarity(rows[:3], rows[:2])


def test_a_matrix_of_stacks(rows: Array) -> None:
    with pytest.raises(InvalidInputError):
        similarity_matrix(rows[None], rows[None])
