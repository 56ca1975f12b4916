"""Standard errors: as large as the errors are."""

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig import Extraction, Status, extract

SEED, DRAWS, FAR = 17, 1000, 10.0
CURVATURES = {"plane": (0.0, 0.0), "sphere": (0.1, 0.1), "cylinder": (0.1, 0.0), "saddle": (0.1, -0.1)}


def draws(kind: str, noise: float, count: int, half: bool = False) -> Extraction:
    """Curvature at the middle of a thousand noisy patches of radius 1, far from each other."""
    rng = np.random.default_rng(SEED)
    radius = np.sqrt(rng.random((DRAWS, count)))
    angle = rng.random((DRAWS, count)) * (np.pi if half else 2 * np.pi)
    u, v = radius * np.cos(angle), radius * np.sin(angle)
    heights = {
        "plane": 0 * u,
        "sphere": np.sqrt(100 - u**2 - v**2) - 10,
        "cylinder": np.sqrt(100 - u**2) - 10,
        "saddle": (v**2 - u**2) / 20,
    }
    w = heights[kind] + rng.normal(0, noise, u.shape)
    places = np.zeros((DRAWS, 3))
    places[:, 0] = FAR * np.arange(DRAWS)
    points = np.stack([u, v, w], axis=2) + places[:, None]
    return extract(points.reshape(-1, 3), 1.2, at=places, viewpoint=[0, 0, 1e9])


def spread(values: NDArray[np.floating], truth: float, error: NDArray[np.floating]) -> float:
    return float(np.sqrt(np.mean(((values - truth) / error) ** 2)))


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize(("noise", "count"), [(0.01, 60), (0.01, 500), (0.03, 500)])
@pytest.mark.parametrize("kind", CURVATURES)
def test_h_and_where_they_differ_k1_and_k2(kind: str, noise: float, count: int, half: bool) -> None:
    k1, k2 = CURVATURES[kind]
    s = draws(kind, noise, count, half)
    assert 0.9 < spread(s.mean_curvature, (k1 + k2) / 2, s.mean_curvature_std) < 1.1
    difference = (s.k1 - s.k2) / np.hypot(s.k1_std, s.k2_std)
    if k1 != k2 and np.median(difference) > 6:
        assert 0.9 < spread(s.k1, k1, s.k1_std) < 1.12
        assert 0.9 < spread(s.k2, k2, s.k2_std) < 1.12
    assert np.median(s.noise) == pytest.approx(noise, rel=0.03)


def test_half_a_disc_is_one_sided_and_less_sure() -> None:
    whole, half = draws("plane", 0.01, 200), draws("plane", 0.01, 200, half=True)
    assert (whole.status == Status.OK).all()
    assert (half.status == Status.ONE_SIDED).mean() > 0.99
    assert np.median(half.mean_curvature_std) > 2 * np.median(whole.mean_curvature_std)


def test_a_full_disc_agrees_with_theory() -> None:
    """std(H) is about 6.9 s / (r^2 sqrt N), a normal curvature's about 8.5 s / (r^2 sqrt N)."""
    s = draws("plane", 0.01, 2000)
    assert np.median(s.mean_curvature_std) == pytest.approx(6.93 * 0.01 / np.sqrt(2000), rel=0.03)
    assert np.median(s.k1_std) == pytest.approx(8.49 * 0.01 / np.sqrt(2000), rel=0.03)


def test_six_points_leave_nothing_to_estimate_an_error_from() -> None:
    points = np.array([[0, 0, 0.01], [1, 0, 0.1], [-1, 0.1, 0], [0.2, 1, 0], [0, -1, 0.2], [0.7, 0.7, 0]])
    s = extract(points, 3.0)
    assert np.isfinite(s.k1).all()
    assert np.isnan(s.k1_std).all()
    assert np.isnan(s.noise).all()


def test_errors_turn_with_the_cloud_and_scale_with_its_unit() -> None:
    rng = np.random.default_rng(SEED)
    points = rng.uniform(-1, 1, (2000, 3)) * [1, 1, 0.02]
    s, large = extract(points, 0.4), extract(1000 * points, 400.0)
    for name in ("mean_curvature_std", "k1_std", "k2_std"):
        np.testing.assert_allclose(getattr(large, name) * 1000, getattr(s, name), rtol=1e-3)
    np.testing.assert_allclose(large.noise, s.noise * 1000, rtol=1e-4)


def test_the_sensors_axes_have_no_errors() -> None:
    points = np.random.default_rng(SEED).uniform(-1, 1, (500, 3)) * [1, 1, 0.02]
    assert np.isnan(extract(points, 0.4, axes="sensor").mean_curvature_std).all()
