"""Cutting space: each place belongs to one tile, and tiles have about equally many points."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from surfsig.tiles.cell_counts import MOST_CELLS, CellCounts
from surfsig.tiles.plan import Plan, planned


def counted(points: np.ndarray, blocks: int = 1) -> CellCounts:
    counts = CellCounts()
    for part in np.array_split(points, blocks):
        counts.add(part)
    return counts


def in_half_open_boxes(plan: Plan, points: np.ndarray) -> np.ndarray:
    """The slow reference: which boxes hold each point, (n, t)."""
    low, high = plan.boxes[:, 0], plan.boxes[:, 1]
    return np.asarray(((points[:, None] >= low) & (points[:, None] < high)).all(axis=2))


@settings(derandomize=True, max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), tiles=st.integers(1, 40))
def test_each_point_is_in_one_half_open_box(seed: int, tiles: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(800, 3)) * rng.uniform(0.1, 50, 3)
    plan = planned(counted(points), 10**9, tiles)
    # Points on faces, edges and corners of tiles, too.
    corners = plan.boxes[np.isfinite(plan.boxes).all(axis=(1, 2))].reshape(-1, 3)
    mixed = np.where(rng.random((400, 3)) < 0.5, rng.choice(plan.boxes.reshape(-1, 3), 400), 0.0)
    asked = np.concatenate([points, corners, np.where(np.isfinite(mixed), mixed, 1.0)])
    owners, inside = plan.owners(asked), in_half_open_boxes(plan, asked)
    np.testing.assert_array_equal(inside.sum(axis=1), 1)
    np.testing.assert_array_equal(owners, np.argmax(inside, axis=1))


def test_points_that_are_not_finite_have_one_tile() -> None:
    points = np.random.default_rng(1).normal(size=(500, 3))
    plan = planned(counted(points), 100)
    odd = np.array([[np.nan, 0, 0], [np.inf, 0, 0], [-np.inf, np.nan, 0], [1e300, -1e300, 0]])
    owners = plan.owners(odd)
    assert ((owners >= 0) & (owners < len(plan))).all()


@pytest.mark.parametrize("tiles", [1, 2, 3, 5, 16, 37])
def test_tiles_have_about_equally_many_points(tiles: int) -> None:
    rng = np.random.default_rng(tiles)
    # Ten times as dense at one end.
    points = np.column_stack([rng.uniform(0, 1, 60_000) ** 3 * 100, rng.uniform(0, 40, (60_000, 1))])
    points = np.column_stack([points, rng.normal(0, 0.1, 60_000)])
    plan = planned(counted(points, 4), -(-60_000 // tiles))
    sizes = np.bincount(plan.owners(points), minlength=len(plan))
    assert len(plan) == tiles
    assert sizes.max() <= 1.1 * 60_000 / tiles
    assert sizes.min() >= 0.9 * 60_000 / tiles


def test_what_a_box_touches() -> None:
    points = np.random.default_rng(3).uniform(0, 10, (5000, 3))
    plan = planned(counted(points), 300)
    for box in ([[2, 2, 2], [3, 3, 3]], [[-5, -5, -5], [20, 20, 20]], [[50, 50, 50], [60, 60, 60]]):
        corners = np.array(box, float)
        inside = ((points >= corners[0]) & (points <= corners[1])).all(axis=1)
        assert set(plan.owners(points[inside])) <= set(plan.touching(corners))
    assert len(plan.touching(np.array([[2, 2, 2], [2.1, 2.1, 2.1]]))) < len(plan)


def test_a_plan_is_kept_as_json() -> None:
    points = np.random.default_rng(4).normal(size=(2000, 3)) / 3
    plan = planned(counted(points), 100)
    again = Plan.from_json(json.loads(json.dumps(plan.to_json())))
    np.testing.assert_array_equal(again.boxes, plan.boxes)
    np.testing.assert_array_equal(again.owners(points), plan.owners(points))


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((1000, 3)),
        np.concatenate([np.zeros((1000, 3)), np.ones((1, 3))]),
        np.concatenate([np.random.default_rng(5).normal(size=(1000, 3)), [[1e12, 0, 0], [-1e15, 1e15, 0]]]),
        np.empty((0, 3)),
    ],
    ids=["one place", "two places", "outliers", "nothing"],
)
def test_odd_clouds_are_cut(points: np.ndarray) -> None:
    plan = planned(counted(points, 3), 100)
    owners = plan.owners(points)
    assert ((owners >= 0) & (owners < len(plan))).all()
    assert counted(points, 3).total == len(points)


def test_cells_stay_few_and_count_all() -> None:
    rng = np.random.default_rng(6)
    counts = CellCounts()
    for scale in (1, 10, 1000):
        counts.add(rng.uniform(0, scale, (400_000, 3)))
    assert counts.total == 1_200_000
    assert len(counts.counts) <= MOST_CELLS


def test_merged_counts_are_those_of_all() -> None:
    rng = np.random.default_rng(7)
    first, second = rng.normal(size=(900, 3)), rng.normal(size=(700, 3)) * 40
    merged = counted(first)
    merged.merge(counted(second))
    merged.merge(counted(np.full((5, 3), 2.0)))
    assert merged.total == 1605
    plan = planned(merged, 200)
    sizes = np.bincount(plan.owners(np.concatenate([first, second])), minlength=len(plan))
    assert sizes.max() < 260
