"""Field signatures: against a slow reference, under motions, and whether they find places again."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, PointCloud, _surfsig

Array = NDArray[np.float64]

RADIUS = 0.5
VIEW = np.array([1.0, 1.0, 6.0])
ORDERS, RINGS, HEIGHTS = 8, 5, 6


def height(x: Array, y: Array) -> Array:
    """Bumps and hollows in no order, by seeded waves."""
    rng = np.random.default_rng(3)
    total = np.zeros_like(x)
    for _ in range(14):
        p, q = rng.normal(size=2) * 6.0
        total += 0.05 * np.cos(p * x + q * y + rng.uniform(0.0, 2.0 * np.pi))
    return total


@functools.cache
def surface(seed: int = 0, count: int = 20_000) -> Array:
    """Points of a bumpy sheet, at random places."""
    xy = np.random.default_rng(seed).uniform(0.0, 2.0, (count, 2))
    return np.column_stack([xy, height(*xy.T)])


def places(count: int = 60) -> Array:
    """Places in the middle of the sheet, so that patches are whole."""
    xy = np.random.default_rng(7).uniform(0.5, 1.5, (count, 2))
    return np.column_stack([xy, height(*xy.T)])


def motion(seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    rotation, triangle = np.linalg.qr(rng.normal(size=(3, 3)))
    rotation = rotation * np.sign(np.diag(triangle))
    rotation[:, 0] *= np.linalg.det(rotation)
    return rotation, rng.normal(size=3)


def signatures(
    points: Array, at: Array, radius: float = RADIUS, viewpoint: Array = VIEW, **options: Any
) -> surfsig.FieldSignatures:
    return surfsig.extract_field_signatures(points, radius, at=at, viewpoint=viewpoint, **options)


def _shares(value: float, bins: int) -> list[tuple[int, float]]:
    place = min(max(value - 0.5, 0.0), bins - 1.0)
    low = int(place)
    return [(low, 1.0 - place + low), (min(low + 1, bins - 1), place - low)]


def reference_pool(points: Array, place: Array, axis: Array, tangent: Array) -> NDArray[np.complex128]:
    """What is pooled around a place, by the text of the documentation."""
    ball = RADIUS / 4
    support = surfsig.extract(points, ball, voxel=RADIUS / 10, viewpoint=VIEW)
    pool = np.zeros((RINGS, HEIGHTS, 7, ORDERS), np.complex128)
    across = np.cross(axis, tangent)
    for i in np.flatnonzero(np.isfinite(support.k1)):
        offset = (support.points[i] - place) / RADIUS
        if offset @ offset > 1.0:
            continue
        x, y, z = offset @ tangent, offset @ across, offset @ axis
        angle = np.arctan2(y, x)
        out = np.cos(angle) * tangent + np.sin(angle) * across
        around = np.cross(axis, out)
        normal, direction = support.normals[i].astype(float), support.directions[i].astype(float)
        bend = support.mean_curvature[i] * ball
        difference = (support.k1[i] - support.k2[i]) / 2 * ball
        bend, difference = (value / (abs(value) + 0.5) for value in (bend, difference))
        along, sideways = direction @ out, direction @ around
        values = [normal @ axis, normal @ out, normal @ around, bend, difference]
        values += [difference * (along**2 - sideways**2), difference * 2.0 * along * sideways]
        waves = np.exp(1j * angle * np.arange(ORDERS))
        for ring, first in _shares(np.hypot(x, y) * RINGS, RINGS):
            for level, second in _shares((z + 1.0) * HEIGHTS / 2, HEIGHTS):
                pool[ring, level] += first * second * np.outer(values, waves)
    return pool


def test_pools_are_those_of_a_slow_reference() -> None:
    points, at = surface(), places(5)
    found = _surfsig.field_signatures(
        points, origin=[0.0] * 3, radius=RADIUS, at=at, viewpoint=VIEW.tolist(), pools=True
    )
    waves = found["pools"].reshape(5, RINGS, HEIGHTS, 7, 2, ORDERS)
    for i, place in enumerate(at):
        axis, tangent = found["axes"][i].astype(float), found["tangents"][i].astype(float)
        expected = reference_pool(points, place, axis, tangent)
        size = np.abs(expected).max()
        np.testing.assert_allclose(waves[i, ..., 0, :], expected.real, atol=2e-5 * size)
        np.testing.assert_allclose(waves[i, ..., 1, :], expected.imag, atol=2e-5 * size)


def test_signatures_have_length_one_and_axes_point_to_the_sensor() -> None:
    found = signatures(surface(), places())
    assert found.ok.all()
    assert found.oriented
    assert found.vectors.shape == (60, 256)
    assert found.phases.shape == (60, 7, 8)
    np.testing.assert_allclose(np.linalg.norm(found.vectors, axis=1), 1.0, atol=1e-6)
    assert np.all(np.sum(found.axes * (VIEW - found.points), axis=1) > 0.0)
    np.testing.assert_allclose(np.sum(found.axes * found.tangents, axis=1), 0.0, atol=1e-6)


def test_the_same_bits_with_any_number_of_threads_and_in_any_order() -> None:
    points, at = surface(), places()
    found = signatures(points, at, threads=1)
    again = signatures(points, at[::-1].copy(), threads=3)
    for name in ("vectors", "phases", "axes", "count", "status"):
        np.testing.assert_array_equal(getattr(found, name), getattr(again, name)[::-1])
    # In another order of the points, voxels of two are represented by the other one.
    shuffled = np.random.default_rng(1).permutation(len(points))
    other = signatures(points[shuffled], at)
    assert np.sum(found.vectors * other.vectors, axis=1).min() > 0.99


def test_unit_and_far_origin_do_not_matter() -> None:
    points, at = surface(), places()
    found = signatures(points, at)
    scaled = signatures(points * 1024.0, at * 1024.0, radius=RADIUS * 1024.0, viewpoint=VIEW * 1024.0)
    np.testing.assert_allclose(found.vectors, scaled.vectors, atol=1e-5)
    # A whole number of voxels away, up to rounding at these coordinates.
    shift = np.array([500_000.0, 4_500_000.0, 100.0])
    far = PointCloud(points, origin=shift)
    moved = surfsig.extract_field_signatures(far, RADIUS, at=at + shift, viewpoint=VIEW + shift)
    assert np.sum(found.vectors * moved.vectors, axis=1).min() > 0.99


def test_turned_and_differently_sampled_surfaces_keep_their_signatures_and_matches_carry_the_pose() -> None:
    at = places()
    rotation, translation = motion(5)
    source = signatures(surface(0), at)
    target = signatures(
        surface(1) @ rotation.T + translation,
        at @ rotation.T + translation,
        viewpoint=rotation @ VIEW + translation,
    )
    alike = np.sum(source.vectors * target.vectors, axis=1)
    assert np.median(alike) > 0.98
    assert np.quantile(alike, 0.05) > 0.95
    matches = surfsig.match_fields(source, target)
    assert np.mean(matches.source == matches.target) > 0.95
    assert len(matches) > 0.9 * len(at)
    assert np.all(np.diff(matches.distances) >= 0.0)
    right = matches.source == matches.target
    for pose, place in zip(matches.poses[right], at[matches.source[right]], strict=True):
        np.testing.assert_allclose(pose[:3, :3] @ place + pose[:3, 3], rotation @ place + translation)
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-6)
    cosine = (np.einsum("nij,ij->n", matches.poses[right][:, :3, :3], rotation) - 1.0) / 2.0
    errors = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    assert np.median(errors) < 3.0
    assert np.mean(errors < 10.0) > 0.9


def test_without_mutual_check_every_place_has_a_match() -> None:
    source, target = signatures(surface(0), places()), signatures(surface(1), places(30))
    assert len(surfsig.match_fields(source, target, mutual=False)) == 60
    mutual = surfsig.match_fields(source, target)
    assert len(set(mutual.target.tolist())) == len(mutual) <= 30


def test_places_without_a_surface_have_no_value_and_say_why() -> None:
    line = np.column_stack([np.linspace(10.0, 11.0, 200), np.zeros(200), np.zeros(200)])
    at = np.array([[1.0, 1.0, 0.0], [np.nan, 0.0, 0.0], [50.0, 0.0, 0.0], [10.5, 0.0, 0.0]])
    found = signatures(np.concatenate([surface(), line]), at)
    assert found.status.tolist()[:3] == [
        surfsig.Status.OK,
        surfsig.Status.NOT_FINITE,
        surfsig.Status.TOO_FEW_POINTS,
    ]
    assert not found.ok[3]
    assert np.isnan(found.vectors[1:]).all()
    assert np.isnan(found.phases[1:]).all()
    assert found.count[2] == 0
    matches = surfsig.match_fields(found, found)
    assert matches.source.tolist() == matches.target.tolist() == [0]
    nothing = surfsig.match_fields(found.take([1, 2]), found)
    assert len(nothing) == 0
    assert nothing.poses.shape == (0, 4, 4)


def test_an_empty_cloud_and_no_places() -> None:
    assert len(signatures(np.zeros((0, 3)), np.zeros((0, 3)))) == 0
    assert len(signatures(surface(), np.zeros((0, 3)))) == 0
    assert not signatures(np.zeros((0, 3)), places()).ok.any()


def test_normals_of_the_cloud_take_the_viewpoints_place() -> None:
    points, at = surface(), places()
    normals = VIEW - points
    found = surfsig.extract_field_signatures(points, RADIUS, at=at, normals=normals)
    np.testing.assert_array_equal(found.vectors, signatures(points, at).vectors)
    assert not surfsig.extract_field_signatures(points, RADIUS, at=at).oriented


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"radius": 0.0}, "above 0"),
        ({"radius": "large"}, "radius must be"),
        ({"radius": 1.0, "at": [20_000]}, "outside"),
        ({"radius": 1.0, "voxel": 0.1, "at": [0]}, "exclude"),
        ({"radius": 1.0, "threads": 0}, "threads"),
    ],
)
def test_arguments_without_meaning_are_refused(options: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidInputError, match=text):
        surfsig.extract_field_signatures(surface(), **options)


def test_signatures_of_different_radii_are_not_matched() -> None:
    first, second = (signatures(surface(), places(), radius=radius) for radius in (0.4, 0.5))
    with pytest.raises(InvalidInputError, match="different radii"):
        surfsig.match_fields(first, second)


def test_progress_is_told_to_the_end() -> None:
    told: list[tuple[int, int]] = []
    signatures(surface(), places(), progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (60, 60)
