"""Nearest and hybrid neighbourhoods, and normals that say on which side the sensor was."""

import numpy as np
import pytest
from surface_points import Array, rough_surface

from surfsig import Extraction, PointCloud, Status, extract

RADIUS = 0.3


@pytest.fixture(scope="module")
def points() -> Array:
    return rough_surface(43, count=900).astype(np.float64)


def radii(s: Extraction) -> Array:
    return np.asarray(s.radius, np.float64)


def distances(points: Array, place: Array) -> Array:
    return np.sort(np.linalg.norm(points - place, axis=1))


@pytest.mark.parametrize("k", [6, 20, 150, 899])
def test_the_radius_is_the_distance_to_the_kth_point(points: Array, k: int) -> None:
    s = extract(points, neighbors=k)
    assert (s.count == k).all()
    expected = [distances(points, p)[k - 1] for p in points]
    np.testing.assert_allclose(s.radius, expected, rtol=5e-6)


def test_k_nearest_points_fit_as_the_ball_that_holds_them(points: Array) -> None:
    nearest = extract(points, neighbors=60)
    for i in range(0, 900, 90):
        d = distances(points, points[i])
        ball = extract(points, 0.5 * (d[59] + d[60]), at=[i])
        assert ball.count[0] == 60
        for name in ("k1", "k2", "residual"):
            a, b = getattr(nearest, name)[i], getattr(ball, name)[0]
            assert abs(a - b) <= 2e-5 * max(abs(b), 1 if name == "residual" else 1 / d[59])


def test_more_neighbors_than_points_are_all_points(points: Array) -> None:
    few = points[:40]
    s = extract(few, neighbors=1000)
    assert (s.count == 40).all()
    np.testing.assert_allclose(s.radius, [distances(few, p)[-1] for p in few], rtol=5e-6)


def test_fewer_than_six_are_too_few(points: Array) -> None:
    s = extract(points, neighbors=5)
    assert (s.status == Status.TOO_FEW_POINTS).all()
    assert np.isnan(s.k1).all()


def test_hybrid_takes_the_nearest_of_the_ball(points: Array) -> None:
    ball, hybrid = extract(points, RADIUS), extract(points, RADIUS, neighbors=40)
    nearest = extract(points, neighbors=40)
    full = ball.count > 40
    assert full.any()
    assert not full.all()
    assert (hybrid.count == np.minimum(ball.count, 40)).all()
    np.testing.assert_allclose(radii(hybrid)[full], radii(nearest)[full], rtol=5e-6)
    assert (radii(hybrid)[~full] == np.float32(RADIUS)).all()
    np.testing.assert_array_equal(hybrid.k1[~full], ball.k1[~full])
    np.testing.assert_allclose(hybrid.k1[full], nearest.k1[full], rtol=1e-3, atol=1e-3)


def test_clusters_of_very_different_density_each_get_their_own_radius() -> None:
    rng = np.random.default_rng(7)
    dense = rng.uniform(-1, 1, (3000, 3)) * [0.01, 0.01, 0]
    sparse = rng.uniform(-1, 1, (300, 3)) * [10, 10, 0] + [50, 0, 0]
    alone = np.array([[1e5, 0, 0]])
    cloud = np.vstack([dense, sparse, alone])
    s = extract(cloud, neighbors=12)
    assert (s.count == 12).all()
    for i in (0, 1500, 3000, 3200, 3300):
        assert radii(s)[i] == pytest.approx(distances(cloud, cloud[i])[11], rel=1e-5)
    # From a hundred kilometres away the others lie on a line.
    assert s.status[-1] == Status.DEGENERATE


def test_all_points_at_one_place() -> None:
    s = extract(np.full((30, 3), 2.5), neighbors=10)
    assert (s.status == Status.DEGENERATE).all()
    assert (np.asarray(s.radius) < 1e-6).all()
    assert np.isnan(s.k1).all()


def test_no_points_and_points_that_are_not_finite(points: Array) -> None:
    assert len(extract(np.empty((0, 3)), neighbors=10)) == 0
    with_gaps = points[:100].copy()
    with_gaps[[3, 50]] = np.nan
    s = extract(with_gaps, neighbors=10)
    assert (s.status[[3, 50]] == Status.NOT_FINITE).all()
    assert (np.delete(s.count, [3, 50]) == 10).all()
    assert np.isnan(radii(s)[3])


def test_nearest_has_the_same_bits_for_any_number_of_threads(points: Array) -> None:
    one, many = (extract(points, neighbors=50, threads=n) for n in (1, 5))
    for name in ("k1", "k2", "normals", "radius", "residual"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name))


def test_places_of_their_own(points: Array) -> None:
    places = points[:20] + 0.01
    s = extract(points, neighbors=30, at=places)
    np.testing.assert_allclose(s.radius, [distances(points, p)[29] for p in places], rtol=5e-6)


def test_signatures_are_of_each_places_own_patch(points: Array) -> None:
    s = extract(points, neighbors=60)
    i = int(np.flatnonzero(s.ok)[5])
    alone = extract(points, float(radii(s)[i]), at=[i])
    np.testing.assert_allclose(s.signatures([i]), alone.signatures(), atol=2e-4)


def test_normals_choose_the_side(points: Array) -> None:
    plain = extract(points, RADIUS, viewpoint=[0, 0, 100])
    known = plain.normals * np.float32(3)
    known[::2] *= -1
    s = extract(points, RADIUS, normals=np.nan_to_num(known))
    assert s.oriented
    sign = np.where(np.arange(len(points)) % 2 == 0, -1, 1).astype(np.float32)
    ok = plain.ok
    np.testing.assert_array_equal(s.normals[ok], (plain.normals * sign[:, None])[ok])
    np.testing.assert_array_equal(s.mean_curvature[ok], (plain.mean_curvature * sign)[ok])


def test_normals_of_the_cloud_come_before_its_viewpoint(points: Array) -> None:
    down = np.tile(np.array([0, 0, -1], np.float32), (len(points), 1))
    for fields in (dict(zip(("nx", "ny", "nz"), down.T, strict=True)), {"normals": down}):
        cloud = PointCloud(points, viewpoint=np.array([0, 0, 100.0]), fields=fields)
        s = extract(cloud, RADIUS)
        assert (s.normals[s.ok][:, 2] < 0).all()
        above = extract(cloud, RADIUS, viewpoint=[0, 0, 100])
        assert (above.normals[above.ok][:, 2] > 0).mean() > 0.99


def test_a_normal_that_says_nothing_leaves_the_convention(points: Array) -> None:
    unknown = np.zeros_like(points)
    unknown[::3], unknown[1::3] = np.nan, [np.inf, 0, 0]
    s, plain = extract(points, RADIUS, normals=unknown), extract(points, RADIUS)
    np.testing.assert_array_equal(s.normals, plain.normals)


def test_each_scan_of_a_joined_cloud_has_its_viewpoint(points: Array) -> None:
    scan = (np.arange(len(points)) % 2).astype(np.uint8)
    cloud = PointCloud(points, fields={"scan": scan}, viewpoints=np.array([[0, 0, 100.0], [0, 0, -100.0]]))
    s = extract(cloud, RADIUS)
    assert s.oriented
    assert (s.normals[s.ok & (scan == 0)][:, 2] > 0).all()
    assert (s.normals[s.ok & (scan == 1)][:, 2] < 0).all()
