"""Poses of many scans from poses of pairs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from surfsig import geometry
from surfsig.alignment.pose_graph import Edge, PoseGraph, solve

NOISE = np.array([2e-3, 1e-3, 3e-3, 0.01, 0.02, 0.015])


def truth(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[1:, :3, :3] = Rotation.random(count - 1, rng=rng).as_matrix()
    poses[1:, :3, 3] = rng.uniform(-20.0, 20.0, (count - 1, 3))
    return poses


def edge(poses: np.ndarray, source: int, target: int, seed: int, noise: float = 1.0) -> Edge:
    """A measured pose: T_true = T(c) exp(twist) T(-c) T_measured, as a registration's covariance says."""
    rng = np.random.default_rng([source, target, seed])
    exact = np.linalg.inv(poses[target]) @ poses[source]
    center = rng.uniform(-5.0, 5.0, 3)
    about = geometry.from_translation(center)
    twist = noise * rng.normal(0.0, NOISE)
    measured = about @ geometry.exp_twist(-twist) @ geometry.inverse(about) @ exact
    return Edge(source, target, measured, np.diag(NOISE**-2.0), center, 1.0)


PAIRS = [(1, 0), (2, 1), (3, 2), (4, 3), (0, 4), (2, 0), (3, 1)]


def test_exact_pairs_give_the_exact_poses() -> None:
    poses = truth(5, 1)
    found = solve(5, 0, [edge(poses, a, b, 2, noise=0.0) for a, b in PAIRS])
    assert np.abs(found.T_world_scan - poses).max() < 1e-9
    assert np.nanmax(found.residuals) < 1e-6


def test_errors_are_as_large_as_the_covariance_says() -> None:
    poses = truth(5, 3)
    squares = []
    for seed in range(16):
        found = solve(5, 0, [edge(poses, a, b, seed) for a, b in PAIRS])
        for scan in range(1, 5):
            twist = geometry.log_pose(geometry.inverse(found.T_world_scan[scan]) @ poses[scan])
            squares.append(twist @ np.linalg.solve(found.covariance[scan], twist) / 6.0)
    # The residuals may enlarge a covariance, and never make it smaller.
    assert 0.6 < np.mean(squares) < 1.2


def test_one_wrong_pair_hardly_moves_the_others() -> None:
    poses = truth(5, 4)
    edges = [edge(poses, a, b, 5) for a, b in PAIRS]
    wrong = edge(poses, 3, 0, 6)
    shifted = wrong.T_target_source.copy()
    shifted[:3, 3] += 8.0
    lighter = Edge(3, 0, shifted, wrong.information, wrong.center, 0.1)
    found = solve(5, 0, [*edges, lighter])
    assert np.linalg.norm(found.T_world_scan[:, :3, 3] - poses[:, :3, 3], axis=1).max() < 0.5
    assert found.residuals[-1] > 20.0 * found.residuals[:-1].max()


def test_scans_without_a_pair_have_no_pose() -> None:
    poses = truth(4, 7)
    found = solve(4, 0, [edge(poses, 1, 0, 1), edge(poses, 3, 2, 1)])
    assert np.isfinite(found.T_world_scan[:2]).all()
    assert np.isnan(found.T_world_scan[2:]).all()
    assert np.isnan(found.residuals[1])
    alone = solve(2, 1, [])
    assert np.array_equal(alone.T_world_scan[1], np.eye(4))
    assert np.isnan(alone.covariance[0]).all()


@pytest.mark.parametrize("first", [0, 2])
def test_the_reference_changes_nothing_but_the_axes(first: int) -> None:
    poses = truth(5, 8)
    edges = [edge(poses, a, b, 9) for a, b in PAIRS]
    found = solve(5, first, edges).T_world_scan
    other = solve(5, 4, edges).T_world_scan
    relative = [np.linalg.inv(each[1]) @ each[3] for each in (found, other)]
    assert np.abs(relative[0] - relative[1]).max() < 1e-5


def test_a_motion_that_no_edge_determines_has_an_infinite_variance() -> None:
    poses = truth(3, 8)
    known = edge(poses, 1, 0, 9)
    # Of the second edge the translation along z of the target is not known.
    measured = edge(poses, 2, 1, 9)
    open_along = measured.information.copy()
    open_along[5, :] = open_along[:, 5] = 0.0
    slides = Edge(2, 1, measured.T_target_source, open_along, measured.center, 1.0)
    found = solve(3, 0, [known, slides])
    assert np.isfinite(found.covariance[1]).all()
    assert np.isinf(found.covariance[2][3:, 3:]).any()
    along = geometry.inverse(poses[2])[:3, :3] @ poses[1][:3, 2]
    open_part = np.isinf(np.diag(found.covariance[2])[3:])
    np.testing.assert_array_equal(open_part, along**2 > 0.0025)
    assert np.isfinite(found.covariance[2][:3, :3]).all()
    # With another edge that knows it, nothing is open.
    whole = solve(3, 0, [known, slides, edge(poses, 2, 0, 9)])
    assert np.isfinite(whole.covariance).all()


@pytest.mark.parametrize("robust", [None, 3.0])
def test_poses_and_covariances_are_those_of_dense_least_squares(robust: float | None) -> None:
    """With derivatives by differences, and SciPy's least squares with its own robust loss."""
    true = truth(5, 11)
    edges = [edge(true, a, b, 12, noise=2.0) for a, b in PAIRS]
    graph = PoseGraph(
        np.array([one.source for one in edges]),
        np.array([one.target for one in edges]),
        np.array([one.T_target_source for one in edges]),
        np.array([one.information for one in edges]),
        np.array([one.center for one in edges]),
        first=2,
        robust=robust,
    )

    def moved(unknowns: np.ndarray) -> np.ndarray:
        twists = np.zeros((5, 6))
        twists[[0, 1, 3, 4]] = unknowns.reshape(4, 6)
        return np.asarray(found @ geometry.exp_twist(twists))

    found = graph.fit(true)
    slow = least_squares(
        lambda unknowns: graph.residuals(moved(unknowns)).ravel(),
        np.zeros(24),
        jac="3-point",
        x_scale="jac",
        loss="linear" if robust is None else "soft_l1",
        f_scale=3.0,
    )
    # In units of the noise: differences leave some thousandths of it.
    assert np.abs(slow.x.reshape(4, 6) / NOISE).max() < 0.02
    expected = np.linalg.inv(slow.jac.T @ slow.jac)
    covariances = graph.covariances(found, np.arange(5))
    assert not covariances[2].any()
    for place, scan in enumerate([0, 1, 3, 4]):
        own = slice(6 * place, 6 * place + 6)
        scale = np.sqrt(np.outer(np.diag(expected)[own], np.diag(expected)[own]))
        assert np.abs((covariances[scan] - expected[own, own]) / scale).max() < 0.01
