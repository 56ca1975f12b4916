"""Which pairs the poses of many scans rest on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from surfsig import PointCloud, geometry
from surfsig.registration.pair_selection import PairSelection
from surfsig.registration.registration import Registration

Array = np.ndarray
Found = tuple[int, int, Registration]


def truth(count: int) -> Array:
    rng = np.random.default_rng(7)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[1:, :3, :3] = Rotation.random(count - 1, rng=rng).as_matrix()
    poses[1:, :3, 3] = rng.uniform(-5.0, 5.0, (count - 1, 3))
    return poses


def found(T_target_source: Array, doubts: tuple[str, ...] = (), explained: float = 0.5) -> Registration:
    return Registration(
        T_target_source=T_target_source,
        covariance=1e-6 * np.eye(6),
        information=1e6 * np.eye(6),
        center=np.zeros(3),
        free_directions=[],
        matches=100,
        inliers=0,
        overlap=0.3,
        rms=0.01,
        radius=1.0,
        trusted=not doubts,
        doubts=list(doubts),
        reasons=list(doubts),
        alternatives=[],
        explained=explained,
        free_space=0.0,
        scale=1.0,
        scale_standard_error=0.001,
    )


def pair(poses: Array, target: int, source: int, *doubts: str, shift: float = 0.0) -> Found:
    exact = geometry.inverse(poses[target]) @ poses[source]
    off = geometry.from_translation(np.array([shift, 0.0, 0.0]))
    return source, target, found(off @ exact, doubts, 0.5 - 0.1 * (shift != 0.0))


def selected(
    count: int, pairs: list[Found], free_space: Callable[[int, int, Array], float] = lambda *_: 0.0
) -> tuple[Array, set[tuple[int, int]]]:
    rng = np.random.default_rng(8)
    scans = [PointCloud(rng.uniform(-2.0, 2.0, (300, 3))) for _ in range(count)]
    solution, _, used = PairSelection(scans, pairs, 0.25, free_space, 0.02).solved()
    numbers = {tuple(sorted(pairs[number][:2])) for number in used}
    return solution.T_world_scan, {(a, b) for a, b in numbers}


def test_doubtful_pairs_around_a_loop_confirm_each_other() -> None:
    for count in (3, 4):
        poses = truth(count)
        around = [pair(poses, k, (k + 1) % count, "few_matches") for k in range(count)]
        result, used = selected(count, around)
        assert len(used) == count
        assert (
            np.abs(geometry.inverse(result[1]) @ result[2] - geometry.inverse(poses[1]) @ poses[2]).max()
            < 1e-6
        )
        # One of them is wrong, or something speaks against it.
        wrong = pair(poses, 1, 2, "few_matches", shift=1.0)
        assert selected(count, [around[0], wrong, *around[2:]])[1] == set()
        refuted = pair(poses, 1, 2, "few_matches", "free_space")
        assert selected(count, [around[0], refuted, *around[2:]])[1] == set()


def test_two_doubtful_pairs_that_agree_join_a_scan_to_a_group() -> None:
    poses = truth(4)
    group = [pair(poses, 0, 1), pair(poses, 1, 2)]
    first, second = pair(poses, 0, 3, "little_overlap"), pair(poses, 2, 3, "few_matches")
    result, used = selected(4, [*group, first, second])
    assert used == {(0, 1), (1, 2), (0, 3), (2, 3)}
    assert np.isfinite(result).all()
    assert selected(4, [*group, first])[1] == {(0, 1), (1, 2)}
    assert selected(4, [*group, first, pair(poses, 2, 3, "few_matches", shift=1.0)])[1] == {(0, 1), (1, 2)}


def test_a_trusted_pair_by_which_a_sensor_looked_through_other_scans_is_left_out() -> None:
    poses = truth(4)
    # Scan 3 belongs to another place, and lies where the sensors of 0 and 1 looked through.
    pairs = [pair(poses, 0, 1), pair(poses, 1, 2), pair(poses, 0, 2), pair(poses, 2, 3)]
    asked = []

    def free_space(source: int, target: int, pose: Array) -> float:
        asked.append((source, target))
        np.testing.assert_allclose(pose, geometry.inverse(poses[target]) @ poses[source], atol=1e-6)
        return 0.1 if 3 in (source, target) else np.nan

    result, used = selected(4, pairs, free_space)
    assert used == {(0, 1), (1, 2), (0, 2)}
    assert np.isnan(result[3]).all()
    assert sorted(asked) == [(3, 0), (3, 1)]
