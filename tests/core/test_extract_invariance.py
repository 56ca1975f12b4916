"""What must not change a result: where a cloud is, how it is turned, ordered, tiled, and worked on."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from surface_points import UTM, Array, rotation, rough_surface

from surfsig import Extraction, PointCloud, Status, extract

RADIUS = 0.3
COLUMNS = (
    "k1",
    "k2",
    "normals",
    "directions",
    "residual",
    "condition",
    "count",
    "status",
    "linearity",
    "planarity",
    "scattering",
)
ABOVE = np.array([0.0, 0.0, 50.0])


@pytest.fixture(scope="module")
def points() -> Array:
    return rough_surface(21, count=2500)


@pytest.fixture(scope="module")
def whole(points: Array) -> Extraction:
    return extract(points, RADIUS, viewpoint=ABOVE)


def check_bits(found: Extraction, reference: Extraction, rows: Any = slice(None)) -> None:
    for column in COLUMNS:
        ours, theirs = getattr(found, column), np.ascontiguousarray(getattr(reference, column)[rows])
        assert ours.tobytes() == theirs.tobytes(), column


def check_values(
    found: Extraction, reference: Extraction, *, scale: float = 1.0, tolerance: float = 1e-5
) -> None:
    """Compare curvature to `tolerance` of the larger of |k| and 1 / r, times the condition."""
    np.testing.assert_array_equal(found.count, reference.count)
    both: NDArray[np.bool_] = found.ok & reference.ok
    assert both.mean() > 0.99
    largest = np.maximum(np.maximum(abs(reference.k1), abs(reference.k2)), 1 / RADIUS)
    limit = tolerance * largest * reference.condition
    for name in ("k1", "k2"):
        difference = abs(getattr(found, name).astype(np.float64) * scale - getattr(reference, name))
        assert (difference <= limit)[both].all(), (name, (difference / limit)[both].max())
    np.testing.assert_allclose(found.residual[both] / scale, reference.residual[both], rtol=1e-3, atol=1e-6)


@settings(derandomize=True, max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_turned_and_moved(seed: int) -> None:
    points = rough_surface(22)
    rng = np.random.default_rng(seed)
    turned, moved = rotation(rng), rng.uniform(-20, 20, 3)
    still = extract(points, RADIUS, viewpoint=ABOVE)
    found = extract(points @ turned.T + moved, RADIUS, viewpoint=turned @ ABOVE + moved)
    same = found.count == still.count
    assert same.mean() > 0.999
    both = found.ok & still.ok & same
    assert both.mean() > 0.99
    limit = 1e-5 * np.maximum(np.maximum(abs(still.k1), abs(still.k2)), 1 / RADIUS) * still.condition
    assert (abs(found.k1 - still.k1) <= limit)[both].all()
    assert (abs(found.k2 - still.k2) <= limit)[both].all()
    np.testing.assert_allclose(found.normals[both], (still.normals @ turned.T)[both], atol=1e-5)
    uneven = both & (still.k1 - still.k2 > 0.5)
    along = np.einsum("ij,ij->i", found.directions, still.directions @ turned.T)[uneven]
    np.testing.assert_allclose(abs(along), 1, atol=1e-5)


@pytest.mark.parametrize("axes", ["surface", "sensor"])
@pytest.mark.parametrize("moved", [UTM, [0.1234, -7.77, 1e4], [1e6, 1e6, 1e6]], ids=str)
def test_moved(points: Array, moved: Any, axes: Any) -> None:
    still = extract(points, RADIUS, axes=axes, viewpoint=ABOVE)
    check_values(extract(points + moved, RADIUS, axes=axes, viewpoint=ABOVE + moved), still)
    # The origin of a cloud is nothing but an addition.
    cloud = PointCloud(points, origin=moved, viewpoint=ABOVE + moved)
    added = extract(points + moved, RADIUS, axes=axes, viewpoint=ABOVE + moved)
    check_bits(extract(cloud, RADIUS, axes=axes), added)


def test_order_of_points(points: Array, whole: Extraction) -> None:
    order = np.random.default_rng(23).permutation(len(points))
    found = extract(points[order], RADIUS, viewpoint=ABOVE)
    back = np.argsort(order)
    unshuffled = extract(points[order], RADIUS, viewpoint=ABOVE, at=back)
    check_bits(unshuffled, found, back)
    check_values(unshuffled, whole)


def test_number_of_threads(points: Array, whole: Extraction) -> None:
    for threads in (1, 2, 3, 8):
        check_bits(extract(points, RADIUS, viewpoint=ABOVE, threads=threads), whole)


def test_points_that_are_there_twice(points: Array, whole: Extraction) -> None:
    at = np.arange(0, 2 * len(points), 2)
    found = extract(np.repeat(points, 2, axis=0), RADIUS, viewpoint=ABOVE, at=at)
    np.testing.assert_array_equal(found.count, 2 * whole.count)
    both = found.ok & whole.ok
    assert both.mean() > 0.99
    limit = 1e-5 * np.maximum(np.maximum(abs(whole.k1), abs(whole.k2)), 1 / RADIUS) * whole.condition
    assert (abs(found.k1 - whole.k1) <= limit)[both].all()
    assert (abs(found.k2 - whole.k2) <= limit)[both].all()
    np.testing.assert_allclose(found.residual[both], whole.residual[both], rtol=1e-4)


@pytest.mark.parametrize("scale", [1e-9, 1e-3, 1000.0, 1e6, 0.0254])
@pytest.mark.parametrize("axes", ["surface", "sensor"])
def test_unit_of_length(points: Array, scale: float, axes: Any) -> None:
    still = extract(points, RADIUS, axes=axes, viewpoint=ABOVE)
    found = extract(points * scale, RADIUS * scale, axes=axes, viewpoint=ABOVE * scale)
    check_values(found, still, scale=scale)
    np.testing.assert_allclose(found.linearity, still.linearity, atol=1e-5)


@pytest.mark.parametrize("scale", [1e-17, 1e-12, 1e-6, 1e6, 1e12, 1e17])
def test_a_radius_that_is_accepted_finds_its_points(points: Array, whole: Extraction, scale: float) -> None:
    found = extract(points * scale, RADIUS * scale, viewpoint=ABOVE * scale)
    np.testing.assert_array_equal(found.count, whole.count)


def test_mirrored(points: Array, whole: Extraction) -> None:
    mirror = np.array([-1.0, 1.0, 1.0])
    found = extract(points * mirror, RADIUS, viewpoint=ABOVE * mirror)
    check_values(found, whole)
    np.testing.assert_allclose(found.normals[found.ok], (whole.normals * mirror)[found.ok], atol=1e-5)


@pytest.mark.parametrize("axes", ["surface", "sensor"])
def test_chosen_points_have_the_bits_of_all_points(points: Array, axes: Any) -> None:
    whole = extract(points, RADIUS, axes=axes, viewpoint=ABOVE)
    rng = np.random.default_rng(24)
    some = rng.random(len(points)) < 0.2
    nothing = np.array([], np.int64)
    choices: list[Any] = [rng.permutation(len(points)), [7], [5, 5, 5, -1], some, nothing]
    for at in choices:
        rows = np.asarray(at)
        found = extract(points, RADIUS, axes=axes, viewpoint=ABOVE, at=at)
        check_bits(found, whole, rows)
        np.testing.assert_array_equal(found.points, points[rows])
        numbers = np.arange(len(points))[rows]
        np.testing.assert_array_equal(found.indices, numbers)
        if axes == "sensor":
            assert found.coefficients is not None
            assert whole.coefficients is not None
            assert found.coefficients.tobytes() == whole.coefficients[rows].tobytes()
        places = extract(points, RADIUS, axes=axes, viewpoint=ABOVE, at=points[rows].reshape(-1, 3))
        check_bits(places, whole, rows)
        assert places.indices is None
        np.testing.assert_array_equal(places.points, points[rows])


def test_positions_at_an_origin_have_the_bits_of_the_points() -> None:
    offsets = rough_surface(25).astype(np.float32)
    cloud = PointCloud(offsets, origin=UTM, viewpoint=UTM + ABOVE)
    check_bits(extract(cloud, RADIUS, at=cloud.points), extract(cloud, RADIUS))


@pytest.mark.parametrize(
    "make", [lambda p: p[:, [2, 0, 1]], lambda p: -p, lambda p: p], ids=["x up", "-z up", "z up"]
)
def test_exact_zeros_beside_noise_have_the_same_bits_in_any_company(make: Callable[[Array], Array]) -> None:
    """Fits run side by side in batches: what the neighbours need must leave no trace, be it a sign of 0."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    z = np.where(x > 20, np.random.default_rng(26).normal(size=x.size), 0)
    points = make(np.column_stack([x, y, z]))
    whole = extract(points, 4.1)
    for at in (np.arange(0, len(points), 7), np.arange(len(points))[::-1]):
        check_bits(extract(points, 4.1, at=at), whole, at)


@pytest.mark.parametrize("size", [0.1, 0.35, 5.0])
@pytest.mark.parametrize("origin", [np.zeros(3), UTM], ids=["at 0", "at UTM"])
def test_voxels_are_stood_for_by_the_point_nearest_to_their_mean(
    points: Array, size: float, origin: Array
) -> None:
    cloud = PointCloud(points, origin=origin, viewpoint=origin + ABOVE)
    found = extract(cloud, RADIUS, voxel=size)
    true = cloud.points
    voxels = np.floor(true / size).astype(np.int64)
    assert found.indices is not None
    assert len(found) == len(np.unique(voxels, axis=0))
    assert (np.diff(found.indices) > 0).all()
    for number in found.indices:
        members = true[(voxels == voxels[number]).all(axis=1)]
        nearest = np.linalg.norm(members - members.mean(axis=0), axis=1).min()
        assert np.linalg.norm(true[number] - members.mean(axis=0)) == pytest.approx(nearest, abs=1e-8)
    check_bits(found, extract(cloud, RADIUS), found.indices)


@pytest.mark.parametrize("origin", [np.zeros(3), UTM], ids=["at 0", "at UTM"])
@pytest.mark.parametrize("axes", ["surface", "sensor"])
def test_a_tile_with_a_halo_has_the_bits_of_the_whole(origin: Array, axes: Any) -> None:
    points = rough_surface(27, count=6000) + origin
    radius = 0.11
    whole = extract(points, radius, axes=axes)
    x, y, _ = (points - origin).T

    def within(box: tuple[float, float, float, float], halo: float = 0.0) -> NDArray[np.bool_]:
        west, east, south, north = box
        in_x: NDArray[np.bool_] = (x > west - halo) & (x < east + halo)
        in_y: NDArray[np.bool_] = (y > south - halo) & (y < north + halo)
        return in_x & in_y

    for box in ((-0.3, 0.2, -0.3, 0.25), (0.1, 2.0, -2.0, 0.0)):
        inside, halo = within(box), within(box, 1.01 * radius)
        tile = extract(points[halo], radius, axes=axes, at=inside[halo])
        assert len(tile) > 300
        check_bits(tile, whole, inside)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_far_outlier_changes_no_bit(points: Array, dtype: Any) -> None:
    cloud = points.astype(dtype)
    alone = extract(cloud, RADIUS, viewpoint=ABOVE)
    for far in ([1e6, 1e6, 1e6], [0, -1e6, 0], [1e9, 0, 0]):
        found = extract(np.vstack([np.array([far], dtype), cloud]), RADIUS, viewpoint=ABOVE)
        check_bits(extract(cloud, RADIUS, viewpoint=ABOVE), found, slice(1, None))
        assert found.status[0] == Status.TOO_FEW_POINTS
        assert found.count[0] == 1
        assert np.isnan(found.k1[0])
    assert len(alone) == len(cloud)


def test_a_far_outlier_costs_no_memory() -> None:
    script = """
import resource
import numpy as np
import surfsig
points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3))
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
surfsig.extract(points, 0.02, threads=2)
before = peak()
points[7] = 1e6
surfsig.extract(points, 0.02, threads=2)
surfsig.extract(points, 0.02, threads=2, voxel=0.02)
print((peak() - before) / 1024)
"""
    pytest.importorskip("resource")
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 30


def test_points_of_a_regular_grid_on_the_very_sphere_belong_to_the_ball_anywhere() -> None:
    i, j = (g.ravel() for g in np.meshgrid(np.arange(-8, 9), np.arange(-8, 9)))
    expected = int((i**2 + j**2 <= 25).sum())
    for origin in (np.zeros(3), UTM, np.array([0.0013, -0.0007, 1e6]), np.array([-1e5, 1e5, 0.3])):
        points = np.column_stack([0.004 * i, 0.004 * j, 0 * i]) + origin
        assert extract(points, 0.02, at=[8 * 17 + 8]).count[0] == expected == 81
