"""What the benchmarks of covariances and of many scans count."""

from __future__ import annotations

import covariance
import multiway
import numpy as np

from surfsig import MultiwayRegistration, PointCloud, geometry


def test_a_sixth_of_the_squared_error_is_1_in_the_mean_where_the_covariance_is_right() -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6)) * np.array([1e-3] * 3 + [0.05] * 3)[:, None]
    shares = [covariance.share_of_covariance(root @ rng.normal(size=6), root @ root.T) for _ in range(400)]
    assert 0.9 < np.mean(shares) < 1.1
    assert np.isnan(covariance.share_of_covariance(np.ones(6), np.diag([np.inf] * 6)))
    assert covariance.row("none", [(np.nan, np.nan, np.nan)])[1] == "0 of 1"


def _found(reference: int, poses: np.ndarray, belongs: np.ndarray) -> MultiwayRegistration:
    known = np.where(belongs[:, None, None], poses, np.nan)
    return MultiwayRegistration(["a", "b", "c", "d"], reference, known, np.zeros((4, 6, 6)), [])


def test_poses_are_right_beside_the_reference_and_strangers_must_be_left_out() -> None:
    rng = np.random.default_rng(2)
    poses = [geometry.exp_twist(rng.normal(size=6)) for _ in range(4)]
    nothing = PointCloud(np.zeros((0, 3)))
    belongs = np.array([True, True, True, False])
    views = multiway.Views([nothing] * 4, poses, belongs, 1.0, 0.05)
    exact = np.array([geometry.inverse(poses[1]) @ pose for pose in poses])
    assert multiway.scores(views, _found(1, exact, belongs)) == (3, 0, 1)
    assert multiway.scores(views, _found(1, exact, np.ones(4, bool))) == (3, 1, 0)
    shifted = exact.copy()
    shifted[2, 0, 3] += 0.06
    assert multiway.scores(views, _found(1, shifted, belongs)) == (2, 1, 1)
