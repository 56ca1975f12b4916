"""From points to signatures: both axes, units, sides, the flat atom, missing ones."""

from typing import Any

import numpy as np
import pytest
from surface_points import Array, cylinder, paraboloid, plane, rotation, rough_surface, sphere, turn

from surfsig import Extraction, Frame, InvalidInputError, Status, extract, flip_signatures, similarity

RADIUS = 0.02
ABOVE = np.array([0.0, 0.0, 1.0])
TOP = np.zeros((1, 3))


def on(points: Array, axes: str = "surface", viewpoint: Array = ABOVE) -> Extraction:
    return extract(points, RADIUS, at=TOP, axes=axes, viewpoint=viewpoint)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def rough() -> Extraction:
    points = rough_surface(71, count=400)
    points[3] = np.nan
    points[7, :2] = 90
    return extract(points, 0.3, viewpoint=[0, 0, 50])


def test_a_signature_is_that_of_its_curvatures_in_the_surfaces_axes(rough: Extraction) -> None:
    at = np.flatnonzero(rough.status == Status.OK)[:50]
    rows, status = Frame.default().signatures_of_curvatures(rough.k1[at], rough.k2[at], side=0.6)
    found, found_status = rough.signatures(at, return_status=True)
    np.testing.assert_array_equal(found, rows)
    np.testing.assert_array_equal(found_status, status)
    assert found.dtype == np.float32
    # Symmetric about both axes of the grid, x along k1.
    grids = found.reshape(-1, 2, 11, 11)
    np.testing.assert_array_equal(grids, grids[:, :, ::-1])
    np.testing.assert_array_equal(grids, grids[:, :, :, ::-1])


def test_a_known_paraboloid_in_the_sensors_axes_has_the_signature_of_its_coefficients() -> None:
    rng = np.random.default_rng(72)
    x, y = 1.2 * RADIUS * rng.uniform(-1, 1, (2, 1500))
    surface = np.array([12.0, -7.0, 0.3, -0.2, 9.0, 0.001])
    a, b, c, d, e, f = surface
    points = np.column_stack([x, y, 0.5 + a * x * x + b * y * y + c * x + d * y + e * x * y + f])
    # z runs away from the sensor, which is at the origin.
    found = extract(points, RADIUS, at=[[0, 0, 0.5]], axes="sensor", viewpoint=[0, 0, 0])
    w = found.signatures()[0].astype(np.float64)
    row = surface[None].astype(np.float32)
    expected, status = Frame.default().signatures_of_surfaces(row, side=2 * RADIUS)
    assert status[0] == Status.OK
    assert np.linalg.norm(w - expected[0]) < 1e-3 * np.linalg.norm(expected[0])
    # The frame of the caller's choice.
    printed = found.signatures(frame=Frame.reproduction())[0]
    expected, _ = Frame.reproduction().signatures_of_surfaces(row, side=2 * RADIUS)
    assert np.linalg.norm(printed - expected[0]) < 1e-3 * np.linalg.norm(expected[0])
    assert np.linalg.norm(printed - w) > 0.05 * np.linalg.norm(w)


def test_a_turned_cylinder_is_itself_in_the_surfaces_axes_and_another_in_the_sensors() -> None:
    rng = np.random.default_rng(73)
    points = cylinder(0.02427).points(rng, 0.7 * RADIUS)
    for degrees, limit in ((15, 0.6), (30, 0.4)):
        turned = points @ turn(2, degrees).T
        own = similarity(on(points).signatures()[0], on(turned).signatures()[0])
        sensor = similarity(on(points, "sensor").signatures()[0], on(turned, "sensor").signatures()[0])
        assert own > 0.999
        assert sensor < limit


def test_the_same_surface_anywhere_has_the_same_signature_and_another_has_not() -> None:
    rng = np.random.default_rng(74)
    shapes = [sphere(0.1), sphere(0.05), cylinder(0.05), paraboloid(20, -20)]
    first = np.array([on(shape.points(rng, RADIUS)).signatures()[0] for shape in shapes])
    again = []
    for shape in shapes:
        turned, moved = rotation(rng), rng.uniform(-5, 5, 3)
        points = shape.points(rng, RADIUS) @ turned.T + moved
        found = extract(points, RADIUS, at=moved[None], viewpoint=turned @ ABOVE + moved)
        again.append(found.signatures()[0])
    zeta = np.array([[similarity(a, b) for b in again] for a in first])
    assert (np.diag(zeta) > 0.999).all()
    assert (zeta[~np.eye(4, dtype=bool)] < 0.99).all()


@pytest.mark.parametrize("axes", ["surface", "sensor"])
def test_the_unit_of_length_does_not_matter(axes: str) -> None:
    points = rough_surface(75, count=300)
    metres = extract(points, 0.3, axes=axes, viewpoint=[0, 0, 50])  # type: ignore[arg-type]
    millimetres = extract(points * 1000, 300, axes=axes, viewpoint=[0, 0, 5e4])  # type: ignore[arg-type]
    w1, w2 = metres.signatures(), millimetres.signatures()
    there = metres.ok & millimetres.ok & ~np.isnan(w1[:, 0]) & ~np.isnan(w2[:, 0])
    assert there.mean() > 0.9
    lengths = np.linalg.norm(w1, axis=1)[there]
    error = np.linalg.norm(w1 - w2, axis=1)[there]
    assert np.median(error / lengths) < 1e-5
    # Beyond the atoms' curvature w grows steeply, and with it what is left of the last bits.
    assert (error < 1e-2 * lengths + 1e-6).all()


def test_flipped_is_the_signature_seen_from_the_other_side() -> None:
    rng = np.random.default_rng(76)
    for shape in (sphere(0.08), cylinder(0.06), paraboloid(15, -25), paraboloid(30, 5)):
        points = shape.points(rng, RADIUS)
        above, below = on(points).signatures()[0], on(points, viewpoint=-ABOVE).signatures()[0]
        length = float(np.linalg.norm(above))
        np.testing.assert_allclose(flip_signatures(above), below, atol=2e-4 * length)
        np.testing.assert_allclose(flip_signatures(flip_signatures(above)), above, atol=0)
        assert similarity(above, below, either_side=True) > 0.9999
        assert np.linalg.norm(above - below) > 0.1 * length


def test_flat_atom_is_one_more_column_and_tells_flat_from_slightly_curved(rough: Extraction) -> None:
    plain, with_flat = rough.signatures(), rough.signatures(flat_atom=0.25)
    np.testing.assert_array_equal(with_flat[:, :242], plain)
    missing = np.isnan(plain[:, 0])
    assert missing.any()
    np.testing.assert_array_equal(np.isnan(with_flat[:, 242]), missing)
    assert (with_flat[~missing, 242] == np.float32(0.25)).all()
    np.testing.assert_array_equal(flip_signatures(with_flat)[:, 242], with_flat[:, 242].astype(np.float64))

    rng = np.random.default_rng(77)
    flat1, flat2 = (plane().points(rng, RADIUS) + rng.normal(0, 1e-5, (1500, 3)) for _ in range(2))
    round_one = cylinder(0.038).points(rng, RADIUS)
    noise = float(np.linalg.norm(on(flat1).signatures()[0]))
    a, b, c = (on(p).signatures(flat_atom=4 * noise)[0] for p in (flat1, flat2, round_one))
    assert similarity(a, b) > 0.9
    assert similarity(a, c) < 0.5


def test_a_perfect_plane_has_no_direction_to_compare_but_for_a_flat_atom() -> None:
    z0 = plane().points(np.random.default_rng(78), RADIUS)
    found = on(z0)
    assert found.status[0] == Status.OK
    assert np.abs(found.signatures()).max() < 1e-6
    w = found.signatures(flat_atom=0.01)[0]
    assert similarity(w, w) == pytest.approx(1)


@pytest.mark.parametrize("flat_atom", [0, -0.1, np.nan, np.inf, "long"])
def test_flat_atom_of_no_length(rough: Extraction, flat_atom: Any) -> None:
    with pytest.raises(InvalidInputError, match="flat_atom must be a finite number above 0"):
        rough.signatures([0], flat_atom=flat_atom)


def test_rows_are_nan_and_statuses_say_why(rough: Extraction) -> None:
    w, status = rough.signatures(return_status=True)
    assert status[3] == Status.NOT_FINITE
    assert status[7] == Status.TOO_FEW_POINTS
    assert np.isnan(w[[3, 7]]).all()
    fitted = rough.status == Status.OK
    beyond = fitted & np.isnan(w[:, 0])
    np.testing.assert_array_equal(status == Status.OUTSIDE_VOCABULARY, beyond | (status == 5))
    np.testing.assert_array_equal(status[~fitted], rough.status[~fitted])
    # All or nothing, and no longer than 1.
    np.testing.assert_array_equal(np.isnan(w).any(axis=1), np.isnan(w).all(axis=1))
    assert np.nanmax(np.linalg.norm(w, axis=1)) <= 1.001


def test_beyond_the_vocabulary() -> None:
    rng = np.random.default_rng(79)
    points = sphere(0.0075).points(rng, 0.003)
    found = extract(points, 0.003, at=TOP, viewpoint=ABOVE)
    wide = Extraction(**{**found.__dict__, "radius": 0.02})
    w, status = wide.signatures(return_status=True)
    assert found.k1[0] == pytest.approx(133, rel=0.06)
    assert found.signatures(return_status=True)[1].tolist() == [Status.OK]
    assert status.tolist() == [Status.OUTSIDE_VOCABULARY]
    assert np.isnan(w).all()
    # The fit itself is in order.
    assert wide.status.tolist() == [Status.OK]


def test_iter_signatures_equals_signatures(rough: Extraction) -> None:
    reproduction = Frame.reproduction()
    for block in (1, 7, 399, 400, 10_000):
        for frame, flat_atom in ((None, None), (reproduction, 0.2)):
            whole, status = rough.signatures(frame=frame, flat_atom=flat_atom, return_status=True)
            parts = list(rough.iter_signatures(frame=frame, flat_atom=flat_atom, block=block))
            assert [part.start for part, _, _ in parts] == list(range(0, 400, block))
            assert parts[-1][0].stop == 400
            for places, rows, statuses in parts:
                np.testing.assert_array_equal(rows, whole[places])
                np.testing.assert_array_equal(statuses, status[places])


def test_similarity_to_compares_every_place_with_one_signature(rough: Extraction) -> None:
    reference = int(np.flatnonzero(rough.ok)[10])
    for flat_atom in (None, 0.1):
        w = rough.signatures(flat_atom=flat_atom)
        zeta = rough.similarity_to(w[reference])
        np.testing.assert_allclose(zeta, similarity(w, w[reference]), atol=1e-6)
        assert zeta[reference] == pytest.approx(1)
        np.testing.assert_array_equal(np.isnan(zeta), np.isnan(w[:, 0]))


def test_similarity_to_takes_either_side_where_no_sensor_is_known() -> None:
    points = rough_surface(80, count=300)
    up, down = extract(points, 0.3), extract(points * [1, 1, -1], 0.3)
    w = up.signatures()
    there = np.flatnonzero(up.ok & down.ok & ~np.isnan(w[:, 0]))[::10]
    for i in there:
        np.testing.assert_allclose(up.similarity_to(w[i]), similarity(w, w[i], either_side=True), atol=1e-6)
        assert down.similarity_to(w[i])[i] > 0.999


@pytest.mark.parametrize("signature", [np.zeros(241), np.zeros((1, 242)), 5, "abc"], ids=repr)
def test_similarity_to_what_is_no_signature(rough: Extraction, signature: Any) -> None:
    with pytest.raises(InvalidInputError, match="signature"):
        rough.similarity_to(signature)


@pytest.mark.parametrize("block", [0, -5])
def test_iter_signatures_of_blocks_without_a_row(rough: Extraction, block: int) -> None:
    with pytest.raises(InvalidInputError, match="block"):
        list(rough.iter_signatures(block=block))


def test_signatures_at_some_places(rough: Extraction) -> None:
    whole = rough.signatures()
    mask = np.zeros(len(rough), bool)
    mask[[5, 3, 399]] = True
    for at in ([5, 3, -1, 5], np.array([0], np.uint8), mask, []):
        rows = np.asarray(at, bool if at is mask else np.int64)
        np.testing.assert_array_equal(rough.signatures(at), whole[rows])
    for bad in ([400], [-401], [1.0], np.ones(3, bool), "all"):
        with pytest.raises(InvalidInputError, match="at"):
            rough.signatures(bad)
