"""The extraction against a slow, independent one: all distances, and numpy.linalg.lstsq of eq. (5)."""

import numpy as np
import pytest
from surface_points import UTM, Array, rotation, rough_surface

from surfsig import Extraction, extract

RADIUS = 0.3
SEEDS = [11, 12, 13]
TOLERANCE = 1e-4


def ball(points: Array, place: Array) -> Array:
    """Return the points of a ball, about its centre."""
    offsets = points - place
    members: Array = offsets[(offsets**2).sum(axis=1) <= RADIUS**2 * (1 + 1e-5)]
    return members


def fitted(local: Array) -> tuple[Array, float]:
    """Fit eq. (5) to points in their patch's axes: a, b, c, d, e, f, and the rms of the heights."""
    x, y, z = local.T
    terms = np.column_stack([x * x, y * y, x, y, x * y, np.ones_like(x)])
    coefficients: Array = np.linalg.lstsq(terms, z, rcond=None)[0]
    return coefficients, float(np.sqrt(np.mean((terms @ coefficients - z) ** 2)))


def curvatures(coefficients: Array) -> tuple[float, float]:
    """Return K and H at the patch's centre: eqs. (3), (4) with the power 3/2, and (6)-(10)."""
    a, b, c, d, e, _ = coefficients
    metric = 1 + c * c + d * d
    k = (4 * a * b - e * e) / metric**2
    h = ((1 + c * c) * 2 * b - 2 * c * d * e + (1 + d * d) * 2 * a) / (2 * metric**1.5)
    return float(k), float(h)


def principal(k: float, h: float) -> tuple[float, float]:
    root = np.sqrt(max(h * h - k, 0.0))
    return h + root, h - root


def turned_until_flat(local: Array) -> tuple[Array, Array, float] | None:
    """Return the axes in which the slope at the centre is zero (rows u, v, w), the fit, and its rms."""
    axes = np.linalg.eigh(np.cov(local.T))[1].T[::-1]
    for _ in range(400):
        coefficients, rms = fitted(local @ axes.T)
        c, d = coefficients[2:4]
        if np.hypot(c, d) < 1e-11:
            return axes, coefficients, rms
        w = axes[2] - 0.4 * (c * axes[0] + d * axes[1])
        w /= np.linalg.norm(w)
        u = axes[0] - (axes[0] @ w) * w
        u /= np.linalg.norm(u)
        axes = np.array([u, np.cross(w, u), w])
    return None


def check_curvature(found: Extraction, i: int, k1: float, k2: float) -> None:
    scale = max(abs(k1), abs(k2), 1 / RADIUS)
    assert found.k1[i] == pytest.approx(k1, abs=TOLERANCE * scale)
    assert found.k2[i] == pytest.approx(k2, abs=TOLERANCE * scale)


@pytest.mark.parametrize("seed", SEEDS)
def test_fit_in_the_sensors_axes(seed: int) -> None:
    points = rough_surface(seed)
    at = np.arange(0, len(points), 12)
    found = extract(points, RADIUS, at=at, axes="sensor")
    assert found.coefficients is not None
    assert found.ok.all()
    for i, place in enumerate(points[at]):
        local = ball(points, place)
        coefficients, rms = fitted(local)
        assert found.count[i] == len(local)
        np.testing.assert_allclose(found.coefficients[i], coefficients, rtol=TOLERANCE, atol=TOLERANCE)
        assert found.residual[i] == pytest.approx(rms, rel=TOLERANCE)
        check_curvature(found, i, *principal(*curvatures(coefficients)))
        c, d = coefficients[2:4]
        # z runs away from the sensor, the normal towards it.
        np.testing.assert_allclose(
            found.normals[i], np.array([c, d, -1]) / np.hypot(1, np.hypot(c, d)), atol=1e-4
        )


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("origin", [np.zeros(3), UTM], ids=["at 0", "at UTM"])
def test_fit_in_the_surfaces_own_axes(seed: int, origin: Array) -> None:
    turned = rotation(np.random.default_rng(seed))
    points = rough_surface(seed) @ turned.T + origin
    above = origin + 50 * turned[:, 2]
    at = np.arange(0, len(points), 18)
    found = extract(points, RADIUS, at=at, viewpoint=above)
    compared = 0
    for i, place in enumerate(points[at]):
        local = ball(points, place)
        reference = turned_until_flat(local)
        if reference is None or not found.ok[i]:
            continue
        compared += 1
        axes, coefficients, rms = reference
        sign = -1.0 if axes[2] @ (above - place) > 0 else 1.0
        k1, k2 = principal(*curvatures(sign * coefficients))
        check_curvature(found, i, k1, k2)
        assert found.count[i] == len(local)
        assert found.residual[i] == pytest.approx(rms, rel=TOLERANCE)
        np.testing.assert_allclose(found.normals[i], -sign * axes[2], atol=1e-5)
        if k1 - k2 > 0.3:
            a, b, _, _, e, _ = sign * coefficients
            values, vectors = np.linalg.eigh([[2 * a, e], [e, 2 * b]])
            assert values[1] == pytest.approx(k1, abs=1e-6)
            along = vectors[0, 1] * axes[0] + vectors[1, 1] * axes[1]
            assert abs(found.directions[i] @ along) == pytest.approx(1, abs=1e-5)
    assert compared >= 0.95 * len(at)


@pytest.mark.parametrize("axes", ["surface", "sensor"])
def test_linearity_planarity_and_scattering(axes: str) -> None:
    rng = np.random.default_rng(14)
    # A thick ribbon, so that none of the three is near 0 or 1 everywhere.
    points = rng.uniform(-1, 1, (1500, 3)) * [1, 0.2, 0.1] @ rotation(rng).T
    at = np.arange(0, len(points), 15)
    found = extract(points, RADIUS, at=at, axes=axes)  # type: ignore[arg-type]
    for i, place in enumerate(points[at]):
        l3, l2, l1 = np.linalg.eigvalsh(np.cov(ball(points, place).T))
        assert found.linearity[i] == pytest.approx((l1 - l2) / l1, abs=1e-5)
        assert found.planarity[i] == pytest.approx((l2 - l3) / l1, abs=1e-5)
        assert found.scattering[i] == pytest.approx(l3 / l1, abs=1e-5)


def test_noise_comes_back_as_residual_and_as_the_spread_of_curvature() -> None:
    """Section 5 of the theory: noise s, N points in a disc: std(H) about 6.9 s / (r^2 sqrt(N))."""
    rng = np.random.default_rng(15)
    x, y = rng.uniform(-6, 6, (2, 60_000))
    noise = 0.02
    points = np.column_stack([x, y, rng.normal(0, noise, len(x))])
    inner = np.flatnonzero((abs(x) < 5) & (abs(y) < 5))[::20]
    found = extract(points, RADIUS, at=inner)
    count = found.count.mean()
    assert count == pytest.approx(60_000 / 144 * np.pi * RADIUS**2, rel=0.05)
    assert np.sqrt(np.mean(found.residual**2)) == pytest.approx(noise * np.sqrt(1 - 6 / count), rel=0.01)
    assert found.mean_curvature.std() == pytest.approx(6.9 * noise / RADIUS**2 / np.sqrt(count), rel=0.08)
    assert (found.condition > 1.2).all()
    assert np.median(found.condition) < 2


def test_a_place_beside_the_surface_has_the_curvature_of_the_surface() -> None:
    points = rough_surface(16)
    place = np.array([0.1, -0.2, 0.15])
    found = extract(points, RADIUS, at=[place.tolist()], axes="sensor")
    local = ball(points, place)
    assert found.count[0] == len(local)
    check_curvature(found, 0, *principal(*curvatures(fitted(local)[0])))
