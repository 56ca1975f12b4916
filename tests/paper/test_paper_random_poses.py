"""The flat atom's length, what may not be confused, and the counts over pairs of draws."""

import numpy as np
import pytest

from surfsig import Frame
from surfsig.paper.printed import SIDE, TABLE_III
from surfsig.paper.random_poses import LIBRARY, Way, false_matches, flat_atom, must_differ, self_similarity
from surfsig.paper.scans import OWN, OWN_HALF, PAPER, scan_and_fit
from surfsig.signature_similarity import similarity_matrix
from surfsig.simulate import Scanner


def made_up(signatures: np.ndarray) -> Way:
    draws = len(signatures)
    rows = signatures.reshape(draws * 20, -1)
    zeta = similarity_matrix(rows, rows).reshape(draws, 20, draws, 20)
    return Way(OWN, "made up", None, signatures, signatures[0, [n - 1 for n in LIBRARY]], zeta)


def one_hot(draws: int) -> np.ndarray:
    """Signatures that are the same for the same object, and have nothing in common for others."""
    objects = {row: place for place, row in enumerate(dict.fromkeys((r.kind, r.radius) for r in TABLE_III))}
    signatures = np.zeros((draws, 20, 242))
    for i, row in enumerate(TABLE_III):
        signatures[:, i, objects[row.kind, row.radius]] = 1.0
    return signatures


def test_length_of_the_flat_atom() -> None:
    quiet = Scanner(row_step=0.0, outlier_rate=0.0, noise=1e-4)
    count = np.pi * 0.02**2 / 5e-4**2
    noise = np.array([6.9 * 1e-4 / (0.02**2 * np.sqrt(count))], np.float32)
    length = np.linalg.norm(Frame.default().signatures_of_curvatures(noise, noise, side=SIDE)[0])
    assert flat_atom(0.02, quiet) == pytest.approx(8.077 * float(length), rel=1e-3)
    # Error of H: with the cube of the ball's radius; outliers of 5 mm, 0.2 %, weigh more than the noise.
    assert flat_atom(0.01) == pytest.approx(8 * flat_atom(0.02), rel=1e-3)
    assert flat_atom(0.02) / flat_atom(0.02, quiet) == pytest.approx(1.635, abs=1e-3)


def test_the_flat_atom_keeps_99_of_100_planes_together() -> None:
    rng = np.random.default_rng(0)
    length = 2.576 * np.sqrt(2) / np.arccos(0.9)
    angles = np.arctan(rng.normal(size=(2, 200_000)) / length)
    assert (np.abs(np.cos(angles[0] - angles[1])) >= 0.9).mean() == pytest.approx(0.99, abs=0.004)


def test_what_must_differ() -> None:
    assert must_differ(1, 8)
    assert must_differ(8, 9)  # radii apart by 1.58
    assert must_differ(9, 11)
    assert must_differ(14, 13)
    assert not must_differ(1, 4)
    assert not must_differ(14, 15)  # by 1.45
    assert not must_differ(11, 16)
    assert not must_differ(1, 20)


def test_counts_of_a_perfect_way() -> None:
    way = made_up(one_hot(3))
    assert self_similarity(way) == {"plane": 1.0, "cylinder": 1.0, "sphere": 1.0}
    shares = false_matches(way)
    assert len(shares) == 125
    assert set(shares.values()) == {0.0}
    np.testing.assert_array_equal(way.confusion(), np.eye(11, 12))


def test_counts_of_a_spoilt_way() -> None:
    signatures = one_hot(4)
    signatures[1, 8 - 1] = signatures[0, 1 - 1]  # a cylinder taken for a plane, once
    signatures[2, 10 - 1] = np.nan  # a sphere beyond the vocabulary, once
    way = made_up(signatures)
    # Of twelve ordered pairs of draws three have draw 1 of the cylinder, with any other draw of plane 1.
    assert false_matches(way)[1, 8] == pytest.approx(0.25)
    assert way.share_alike(8, 8) == pytest.approx(0.5)
    assert way.share_missing(10) == 0.25
    assert way.share_alike(10, 10) == pytest.approx(0.5)
    confusion = way.confusion()
    assert confusion[LIBRARY.index(8), LIBRARY.index(1)] == 0.25
    assert confusion[LIBRARY.index(10), len(LIBRARY)] == 0.25
    np.testing.assert_allclose(confusion.sum(axis=1), 1.0)


def test_scans_are_the_same_for_the_same_seeds() -> None:
    ways = (PAPER, OWN, OWN_HALF)
    first, again = (scan_and_fit(ways, seeds, poses="random") for seeds in ([3], [4, 3]))
    for fit in ways:
        np.testing.assert_array_equal(first[fit].surfaces[0], again[fit].surfaces[1])
        assert not np.array_equal(again[fit].surfaces[0], again[fit].surfaces[1])
    # Cylinders in random poses have one curvature of about 1/r in their own axes, and none along.
    own = again[OWN_HALF]
    np.testing.assert_allclose(own.k1[:, 7:9], [[1 / 0.02427, 1 / 0.03827]] * 2, rtol=0.06)
    assert np.abs(own.k2[:, 7:9]).max() < 1.5
    assert own.surfaces[0, 8].tolist() == [own.k1[0, 8] / 2, own.k2[0, 8] / 2, 0, 0, 0, 0]
    assert (again[OWN].count > own.count).all()
