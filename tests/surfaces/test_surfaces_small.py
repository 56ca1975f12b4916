"""Surfaces of few points count where they end at edges, and not where a free form goes on."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plant_scene import f1, plant
from surface_points import Array, rotation

import surfsig

SMALLEST = 40
"""A five-hundredth of the points of the free forms, of which a surface counts whatever its border is."""


@pytest.mark.parametrize(("noise", "least"), [(0.0, 0.98), (0.002, 0.95)])
def test_a_plant_of_many_small_pipes(noise: float, least: float) -> None:
    """A five-hundredth of its points are more than most of its pipes have."""
    known = plant(100, 30_000, noise=noise, seed=3)
    counts = np.bincount(known.owners)
    assert np.median(counts[3:]) < 2 * len(known.points) / 500
    found = surfsig.find_surfaces(known.points)
    assert f1(known.owners, found.labels) > least
    pipes = [surface for surface in found if surface.kind == "cylinder"]
    assert min(pipe.count for pipe in pipes) < len(known.points) / 500
    assert all(0.045 < pipe.radius < 0.21 for pipe in pipes)


def bumpy_ball(noise: float, count: int = 20_000) -> Array:
    rng = np.random.default_rng(2)
    towards = rng.normal(size=(count, 3))
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    waves = [0.03 * np.sin(towards @ rng.normal(0, 4, 3) + rng.uniform(0, 6)) for _ in range(12)]
    return np.asarray(towards * (1 + np.sum(waves, axis=0))[:, None] + noise * rng.normal(size=(count, 3)))


def bumpy_field(noise: float, count: int = 20_000) -> Array:
    rng = np.random.default_rng(1)
    plane = rng.uniform(0, 1, (count, 2))
    waves = [0.012 * np.sin(plane @ rng.normal(0, 9, 2) + rng.uniform(0, 6)) for _ in range(12)]
    return np.column_stack([plane, np.sum(waves, axis=0)]) + noise * rng.normal(size=(count, 3))


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-4, 1e-3, 3e-3])
@pytest.mark.parametrize("free_form", [bumpy_ball, bumpy_field])
def test_a_free_form_has_no_small_surfaces(free_form: Callable[[float], Array], noise: float) -> None:
    found = surfsig.find_surfaces(free_form(noise))
    assert all(surface.count >= SMALLEST for surface in found)


def test_a_small_free_form_has_no_small_surfaces() -> None:
    found = surfsig.find_surfaces(bumpy_field(1e-3))
    assert all(surface.count >= SMALLEST for surface in found)


def test_few_points_of_a_face_are_enough_where_there_is_no_noise() -> None:
    """Of boxes of 14 points a face no point has its 24 nearest neighbours on its own face."""
    rng = np.random.default_rng(7)
    parts = [np.column_stack([rng.uniform(-3, 3, (1500, 2)), np.zeros(1500)])]
    for number in range(4):
        turn = rotation(rng)
        for axis in range(3):
            for side in (0.0, 1.0):
                face = rng.uniform(0, 1, (14, 3))
                face[:, axis] = side
                parts.append(face @ turn.T + [3 * number - 4.5, 0, 4])
    owners = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    found = surfsig.find_surfaces(np.concatenate(parts))
    assert f1(owners, found.labels) > 0.75
    assert {surface.kind for surface in found} == {"plane"}


def test_three_times_as_dense_along_as_across() -> None:
    """As a line scanner's points are that moves fast: a ball, two pipes, and two planes that meet."""
    known, owners = lines(3.0, noise=5e-4)
    found = surfsig.find_surfaces(known)
    assert sorted(surface.kind for surface in found) == ["cylinder", "cylinder", "plane", "plane", "sphere"]
    for number, surface in enumerate(found):
        owner = np.bincount(owners[found.labels == number]).argmax()
        # At the edge between the planes points are near both.
        assert (owners[found.labels == number] == owner).mean() > 0.95
        assert (found.labels[owners == owner] == number).mean() > 0.95
        if surface.kind != "plane":
            assert surface.radius == pytest.approx(0.4 if surface.kind == "sphere" else 0.3, rel=2e-3)


def lines(ratio: float, noise: float, step: float = 0.02) -> tuple[Array, NDArray[np.integer[Any]]]:
    """Give points on lines `ratio` times as far apart as the points along them, and whose they are."""
    wide = ratio * step

    def grid(length: float, width: float) -> Array:
        along, across = np.arange(0, length, step), np.arange(0, width, wide)
        return np.stack(np.meshgrid(along, across, indexing="ij"), axis=-1).reshape(-1, 2)

    flat = grid(1, 1)
    floor = np.column_stack([flat, np.zeros(len(flat))])
    wall = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1] + 0.5 * wide])
    around, up = grid(0.6 * np.pi, 1).T
    ring = np.column_stack([3 + 0.3 * np.cos(around / 0.3), 0.3 * np.sin(around / 0.3), up])
    up, around = grid(1, 0.6 * np.pi).T
    pipe = np.column_stack([5 + 0.3 * np.cos(around / 0.3), 0.3 * np.sin(around / 0.3), up])
    ball = []
    for latitude in np.arange(0.2, np.pi - 0.2, wide / 0.4):
        radius = 0.4 * np.sin(latitude)
        turn = np.arange(0, 2 * np.pi, step / radius)
        level = np.full(len(turn), 0.4 * np.cos(latitude))
        ball.append(np.column_stack([7 + radius * np.cos(turn), radius * np.sin(turn), level]))
    parts = [floor, wall, ring, pipe, np.concatenate(ball)]
    points = np.concatenate(parts)
    owners = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    return points + noise * np.random.default_rng(1).normal(size=points.shape), owners
