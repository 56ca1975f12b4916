"""The implicit quadric: exact on quadrics of any size, and used where it is the better answer."""

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_points import Array, rotation

import surfsig
from surfsig import FitUsed, InvalidInputError, extract

SEED, BALL = 37, 1.0


def patch(kind: str, radius: float, rng: np.random.Generator, count: int, noise: float) -> Array:
    """Points of a sphere or a cylinder within the ball about the origin, which is on it; it bulges to +z."""
    kept: list[Array] = []
    while sum(map(len, kept)) < count:
        turn = rng.normal(size=(4 * count, 3))
        if radius > BALL:
            # Only a cap is within the ball.
            turn = np.column_stack([rng.uniform(-BALL, BALL, (4 * count, 2)), np.zeros(4 * count)])
            turn[:, 2] = np.sqrt(radius**2 - turn[:, 0] ** 2 - (kind == "sphere") * turn[:, 1] ** 2)
        if kind == "cylinder":
            turn[:, 1] = 0
        normals = turn / np.linalg.norm(turn, axis=1)[:, None]
        points = radius * normals - [0, 0, radius]
        if kind == "cylinder":
            points[:, 1] = rng.uniform(-BALL, BALL, len(points))
        points += normals * rng.normal(0, noise, (len(points), 1))
        kept.append(points[np.linalg.norm(points, axis=1) < BALL])
    return np.concatenate(kept)[:count]


@pytest.mark.parametrize("radius", [0.6, 1.0, 2.5, 10.0])
@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_exact_at_any_size_and_in_any_pose(kind: str, radius: float) -> None:
    rng = np.random.default_rng(SEED)
    turn, shift = rotation(rng), rng.uniform(-3, 3, 3)
    points = patch(kind, radius, rng, 600, 0.0) @ turn.T + shift
    sensor = turn @ [0, 0, 50] + shift
    s = extract(points, 1.01 * BALL, at=[shift], viewpoint=sensor, fit="quadric")
    assert s.fit_used is not None
    assert s.fit_used[0] == FitUsed.QUADRIC
    assert s.k1[0] == pytest.approx(1 / radius, rel=2e-5)
    assert s.k2[0] == pytest.approx(0 if kind == "cylinder" else 1 / radius, abs=2e-5 / radius)
    assert s.normals[0] @ turn[:, 2] == pytest.approx(1, abs=1e-6)
    if kind == "cylinder":
        assert abs(s.directions[0] @ turn[:, 1]) < 1e-4


def draws(kind: str, radius: float, noise: float, fit: str) -> surfsig.Extraction:
    rng = np.random.default_rng(SEED)
    places = np.zeros((300, 3))
    places[:, 0] = 5 * np.arange(300)
    points = np.concatenate([patch(kind, radius, rng, 500, noise) + place for place in places])
    return extract(points, 1.05 * BALL, at=places, viewpoint=[0, 0, 1e9], fit=fit)  # type: ignore[arg-type]


@pytest.mark.parametrize("radius", [0.7, 1.45, 2.5])
@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_unbiased_in_noise_and_as_sure_as_it_says(kind: str, radius: float) -> None:
    s = draws(kind, radius, 0.005, "quadric")
    found, said = (s.mean_curvature, s.mean_curvature_std) if kind == "sphere" else (s.k1, s.k1_std)
    assert np.all(s.fit_used == FitUsed.QUADRIC)
    assert abs(found.mean() * radius - 1) < 0.005
    assert 0.85 < found.std() / np.median(said) < 1.15
    assert np.median(s.noise) == pytest.approx(0.005, rel=0.03)


def test_auto_takes_what_errs_less() -> None:
    bent, flat = draws("sphere", 1.45, 0.005, "auto"), draws("sphere", 20.0, 0.005, "auto")
    assert np.all(bent.fit_used == FitUsed.QUADRIC)
    assert np.all(flat.fit_used == FitUsed.PARABOLOID)
    plain = draws("sphere", 20.0, 0.005, "paraboloid")
    np.testing.assert_allclose(flat.k1, plain.k1, atol=1e-5)
    assert plain.fit_used is None


def test_a_plane_is_left_to_the_paraboloid() -> None:
    rng = np.random.default_rng(SEED)
    for noise in (0.0, 0.01):
        plane = np.column_stack([rng.uniform(-3, 3, (4000, 2)), rng.normal(0, noise, 4000)])
        s, plain = extract(plane, 0.8, fit="quadric"), extract(plane, 0.8)
        assert s.fit_used is not None
        assert (s.fit_used == FitUsed.QUADRIC).mean() < 0.01
        same = s.fit_used == FitUsed.PARABOLOID
        np.testing.assert_allclose(s.k1[same], plain.k1[same], atol=2e-5)


def test_the_same_bits_for_any_number_of_threads_and_where_points_are_dense() -> None:
    rng = np.random.default_rng(SEED)
    points: NDArray[np.float32] = patch("sphere", 2.0, rng, 20_000, 0.01).astype(np.float32)
    one, many = (extract(points, 0.5, fit="quadric", threads=n) for n in (1, 4))
    for name in ("k1", "k2", "normals", "k1_std", "fit_used"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))
    assert np.median(one.k1) == pytest.approx(0.5, rel=0.15)


def test_what_cannot_be_asked_for() -> None:
    points = np.zeros((10, 3))
    with pytest.raises(InvalidInputError, match="only fit='paraboloid'"):
        extract(points, 1.0, fit="quadric", axes="sensor")
    with pytest.raises(InvalidInputError, match="fit must be"):
        extract(points, 1.0, fit="cubic")  # type: ignore[arg-type]
