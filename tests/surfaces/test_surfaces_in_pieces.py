"""Pieces of one surface are one; those of two that are nearly alike stay two."""

import numpy as np
import pytest
from surface_points import Array

import surfsig

NOISE = 0.002
TURN = 2 * np.pi


def pipe(
    rng: np.random.Generator,
    low: float,
    high: float,
    count: int = 1500,
    *,
    radius: float = 0.1,
    angles: tuple[float, float] = (0.0, TURN),
    offset: float = 0.0,
    noise: float = NOISE,
) -> Array:
    """Give points of a pipe about x = offset, y = 0 between two heights."""
    angle, distance = rng.uniform(*angles, count), radius + noise * rng.normal(size=count)
    beside = np.column_stack([offset + distance * np.cos(angle), distance * np.sin(angle)])
    return np.column_stack([beside, rng.uniform(low, high, count)])


def floor(
    rng: np.random.Generator,
    low: float,
    high: float,
    count: int,
    *,
    height: float = 0.0,
    noise: float = NOISE,
) -> Array:
    """Give points of a plane between two values of x, 2 wide."""
    off = height + noise * rng.normal(size=count)
    return np.column_stack([rng.uniform(low, high, count), rng.uniform(-1, 1, count), off])


@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_a_floor_that_a_shadow_cuts(noise: float) -> None:
    rng = np.random.default_rng(31)
    pieces = floor(rng, -2, 0, 6000, noise=noise), floor(rng, 0.3, 1.5, 4000, noise=noise)
    (found,) = surfsig.find_surfaces(np.concatenate(pieces))
    assert found.kind == "plane"
    assert found.count > 9900


def test_a_pole_behind_a_box() -> None:
    rng = np.random.default_rng(32)
    (found,) = surfsig.find_surfaces(np.concatenate([pipe(rng, 0, 1), pipe(rng, 1.4, 2.4)]))
    assert found.kind == "cylinder"
    assert found.radius == pytest.approx(0.1, abs=2e-4)
    assert found.length == pytest.approx(2.4, rel=0.01)


def test_a_pole_that_two_bands_are_seen_of() -> None:
    rng = np.random.default_rng(33)
    (found,) = surfsig.find_surfaces(np.concatenate([pipe(rng, 0, 0.1, 800), pipe(rng, 0.4, 0.5, 800)]))
    assert found.kind == "cylinder"
    assert found.radius == pytest.approx(0.1, abs=4e-4)
    assert abs(found.axis[2]) > 0.9999


def test_a_tank_with_seams() -> None:
    rng = np.random.default_rng(34)
    halves = [pipe(rng, 0, 1, radius=0.3, angles=angles) for angles in ((0.15, 3.0), (3.3, 6.1))]
    (found,) = surfsig.find_surfaces(np.concatenate(halves))
    assert found.kind == "cylinder"
    assert found.radius == pytest.approx(0.3, abs=3e-4)


def test_a_step_between_floors_stays() -> None:
    """Of a fifth of the noise it is significant, of so many points."""
    rng = np.random.default_rng(35)
    levels = floor(rng, -2, 0, 4000), floor(rng, 0.3, 1.5, 4000, height=0.002)
    assert len(surfsig.find_surfaces(np.concatenate(levels))) == 2


def test_pipes_whose_axes_are_apart_stay_two() -> None:
    rng = np.random.default_rng(36)
    assert (
        len(surfsig.find_surfaces(np.concatenate([pipe(rng, 0, 1), pipe(rng, 1.4, 2.4, offset=0.004)]))) == 2
    )


def test_pieces_far_apart_stay_two() -> None:
    rng = np.random.default_rng(37)
    assert len(surfsig.find_surfaces(np.concatenate([pipe(rng, 0, 0.4), pipe(rng, 2, 2.4)]))) == 2


def test_an_edge_between_pieces_is_another_surfaces() -> None:
    """Two teeth of one height with a groove as wide as they are between them: two faces, as made."""
    rng = np.random.default_rng(38)
    teeth = floor(rng, -0.5, 0, 2000), floor(rng, 0.5, 1, 2000)
    bottom = floor(rng, 0, 0.5, 2000, height=-0.5)
    sides = [floor(rng, -0.5, 0, 2000)[:, [2, 1, 0]] + [x, 0, 0] for x in (0, 0.5)]
    found = surfsig.find_surfaces(np.concatenate([*teeth, bottom, *sides]))
    assert [surface.kind for surface in found] == ["plane"] * 5
