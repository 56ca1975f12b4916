"""What the benchmark of trust calls right, named and equal."""

import numpy as np
import pytest
import trust
from scipy.spatial import KDTree

from surfsig import FreeDirection, geometry, simulate


def test_a_pose_is_right_near_one_of_those_that_are() -> None:
    truth = geometry.from_rotation_vector(np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0]))
    turned, shifted = truth.copy(), truth.copy()
    turned[:3, :3] = simulate.turn((0.0, 0.0, 1.0), np.radians(2.5)) @ truth[:3, :3]
    shifted[:3, 3] += 0.05
    assert trust.is_right(shifted, [turned, truth], 10.0) == [False, True]
    assert trust.is_right(turned, [truth], 10.0) == [False]
    assert trust.is_right(shifted, [truth], 1.0) == [False]
    assert trust.is_right(np.full((4, 4), np.nan), [truth], 10.0) == [False]


def test_a_free_translation_may_be_any_in_the_span_of_those_named() -> None:
    nowhere = np.full(3, np.nan)
    x, y = (FreeDirection("translation", np.array(axis), nowhere) for axis in ([1.0, 0, 0], [0, 1.0, 0]))
    about = FreeDirection("rotation", np.array([0.0, 0.0, 1.0]), np.zeros(3))
    diagonal = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    assert trust._is_named([x, y, about], diagonal)
    assert not trust._is_named([x], diagonal)
    assert not trust._is_named([about], np.array([0.0, 0.0, 1.0]))
    assert not trust._is_named([], diagonal)


@pytest.mark.parametrize(("case", "count"), [("box", 4), ("empty room", 2), ("empty square room", 4)])
def test_all_equal_poses_bring_the_source_onto_the_target(case: str, count: int) -> None:
    pair = trust.CASES[case](3)
    assert len(pair.right) == count
    tree = KDTree(pair.target.points)
    near = [
        np.median(tree.query(geometry.transform_points(pose, pair.source.points.astype(float)))[0])
        for pose in pair.right
    ]
    wrong = pair.right[0] @ geometry.from_rotation_vector(np.array([0.0, 0.0, 0.5]), np.zeros(3))
    elsewhere = np.median(tree.query(geometry.transform_points(wrong, pair.source.points.astype(float)))[0])
    assert max(near) < 0.7 * elsewhere
