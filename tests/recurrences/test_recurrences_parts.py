"""The parts of recurrences: equal surfaces, free directions, groups, what the sensor saw."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from recurrences import adjusted_rand_index

from surfsig.alignment.free_directions import free_directions, free_directions_of_surface
from surfsig.point_cloud import PointCloud
from surfsig.recurrences.equal_surfaces import equal_surfaces
from surfsig.recurrences.grouping import best_match_tree, groups_of
from surfsig.recurrences.main_surface import may_be_equal
from surfsig.recurrences.matching import common_shares
from surfsig.recurrences.pieces import pieces_of
from surfsig.recurrences.shadows import Region, direction_of_sensor, places_without_points, second_viewpoint
from surfsig.shapes.measured import measured_surface
from surfsig.shapes.surface import PARAMETERS, Kind
from surfsig.spacing import point_spacing
from surfsig.surfaces import Surface, Surfaces

Array = NDArray[np.float64]


def surface(kind: Kind, radius: float, std: float, *, axis: Array | None = None, **sizes: float) -> Surface:
    """Make a surface at a place that depends on its radius."""
    place = np.array([radius, 2.0, 3.0])
    entry = {
        "kind": kind,
        "point": place,
        "axis": np.array([0.0, 0.0, 1.0]) if axis is None else axis,
        "radius": radius,
        "major_radius": sizes.get("major_radius", np.nan),
        "half_angle": sizes.get("half_angle", np.nan),
        "deviation": 1e-4,
        "covariance": std**2 * np.eye(len(PARAMETERS[kind])),
    }
    points = np.random.default_rng(0).normal(size=(12, 3))
    made = measured_surface(entry, points, np.zeros(3), np.arange(12))
    return dataclasses.replace(made, center=place)


def found(*surfaces: Surface) -> Surfaces:
    """Put surfaces into a scan without points."""
    return Surfaces(PointCloud(np.zeros((0, 3))), np.zeros(0, np.int32), list(surfaces))


def test_equal_surfaces_are_pooled_and_others_kept_apart() -> None:
    scans = [
        found(surface("sphere", 0.020, 1e-5), surface("sphere", 0.015, 1e-5)),
        found(surface("sphere", 0.02002, 1e-5), surface("cylinder", 0.020, 1e-5)),
    ]
    (group,) = equal_surfaces(scans, 0.99)
    assert group.members == [(0, 0), (1, 0)]
    assert group.size == {"radius": pytest.approx(0.02001)}
    assert group.size_std["radius"] == pytest.approx(1e-5 / np.sqrt(2))
    np.testing.assert_allclose(group.poses[1] @ [0.020, 2, 3, 1], [0.02002, 2, 3, 1], atol=1e-12)
    assert "2 x sphere, radius=0.02001" in repr(group)


def test_a_chain_of_sizes_does_not_join_its_ends() -> None:
    # Neighbours differ by 2.1 standard errors of their difference, the ends by 12.7.
    sizes = 0.02 + 3e-5 * np.arange(7)
    groups = equal_surfaces([found(*(surface("sphere", size, 1e-5) for size in sizes))], 0.99)
    assert groups
    assert max(len(group) for group in groups) <= 3


def test_planes_and_surfaces_without_errors_have_no_size_to_compare() -> None:
    ball = surface("sphere", 0.02, np.nan)
    scan = found(*[dataclasses.replace(ball, kind="plane", radius=np.nan)] * 2, ball, ball)
    assert equal_surfaces([scan], 0.99) == []


def test_equal_cylinders_are_brought_axis_to_axis() -> None:
    tilted = np.array([0.6, 0.0, -0.8])
    scan = found(surface("cylinder", 0.02, 1e-5), surface("cylinder", 0.02001, 1e-5, axis=tilted))
    (group,) = equal_surfaces([scan], 0.99)
    assert abs(group.poses[1][:3, :3] @ [0, 0, 1] @ tilted) == pytest.approx(1.0)
    assert [direction.motion for direction in group.free_directions] == ["rotation", "translation"]


def test_cones_are_equal_by_their_angle_and_meet_at_their_apex() -> None:
    scan = found(surface("cone", 0.02, 1e-4, half_angle=0.5), surface("cone", 0.01, 1e-4, half_angle=0.5001))
    (group,) = equal_surfaces([scan], 0.99)
    apex = [(r, 2.0, 3.0 - r / np.tan(angle), 1.0) for r, angle in ((0.02, 0.5), (0.01, 0.5001))]
    np.testing.assert_allclose(group.poses[1] @ apex[0], apex[1], atol=1e-12)


def test_main_surfaces_that_cannot_be_equal() -> None:
    can, wide = surface("cylinder", 0.020, 1e-5), surface("cylinder", 0.0205, 1e-5)
    ball, narrow = surface("sphere", 0.020, 1e-5), surface("sphere", 0.016, 1e-5)
    frustum, nearly_a_can = (surface("cone", 0.02, 1e-4, half_angle=angle) for angle in (0.3, 0.02))
    for a, b, equal in (
        # 2.5 % are what a view of a part may make; 20 % are not.
        (can, wide, True),
        (ball, narrow, False),
        (can, frustum, False),
        (can, nearly_a_can, True),
        (frustum, nearly_a_can, False),
        # An egg may be a sphere on one side.
        (can, ball, True),
        (can, None, True),
    ):
        assert may_be_equal(a, b) is may_be_equal(b, a) is equal
    # Errors count where they are large.
    assert may_be_equal(surface("sphere", 0.020, 1e-3), surface("sphere", 0.016, 1e-3))


def directions_of(points: Array, normals: Array) -> list[str]:
    """Name the free directions of oriented points."""
    return [direction.motion for direction in free_directions(points, normals)]


def test_free_directions_of_points_on_simple_surfaces() -> None:
    rng = np.random.default_rng(3)
    directions = rng.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    center = np.array([0.3, -0.2, 0.5])
    (turn,) = free_directions(center + 0.02 * directions, directions)
    assert turn.motion == "rotation"
    np.testing.assert_allclose(turn.point, center, atol=1e-9)
    assert np.isnan(turn.axis).all()

    around = directions.copy()
    around[:, 2] = 0.0
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    heights = rng.uniform(-0.03, 0.03, 400)
    rod = center + 0.02 * around + np.outer(heights, [0, 0, 1])
    turn, slide = free_directions(rod, around)
    assert (turn.motion, slide.motion) == ("rotation", "translation")
    np.testing.assert_allclose(np.abs([turn.axis, slide.axis]), [[0, 0, 1]] * 2, atol=1e-6)
    np.testing.assert_allclose(turn.point[:2], center[:2], atol=1e-7)

    # A cone's normals lean towards its axis: it cannot slide.
    narrowing = center + (0.02 + heights)[:, None] * around + np.outer(heights, [0, 0, 1])
    leaning = (around - [0, 0, 1]) / np.sqrt(2.0)
    assert directions_of(narrowing, leaning) == ["rotation"]
    flat = np.column_stack([rng.uniform(-1, 1, (400, 2)), np.zeros(400)])
    assert directions_of(flat, np.tile([0.0, 0.0, 1.0], (400, 1))) == [
        "rotation",
        "translation",
        "translation",
    ]
    # Three faces of a box leave nothing free.
    faces = np.concatenate([np.roll(flat, k, axis=1) for k in range(3)])
    assert directions_of(faces, np.repeat(np.eye(3)[[2, 0, 1]], 400, axis=0)) == []


def test_free_directions_are_named() -> None:
    ball, rod = (
        free_directions_of_surface(kind, np.zeros(3), np.array([0.0, 0.0, 1.0]))
        for kind in ("sphere", "cylinder")
    )
    assert [str(direction) for direction in ball] == ["rotates about (0, 0, 0)"]
    assert [str(direction) for direction in rod] == [
        "rotates about the axis (0, 0, 1) through (0, 0, 0)",
        "slides along (0, 0, 1)",
    ]


def test_groups_hang_together_by_matches_that_their_members_agree_with() -> None:
    scores = np.zeros((6, 6))
    for i, j, score in ((0, 1, 0.8), (1, 2, 0.3), (3, 4, 0.8), (4, 5, 0.6), (0, 3, 0.5), (2, 5, 0.1)):
        scores[i, j] = scores[j, i] = score
    asked = []

    def agree(first: list[int], second: list[int], match: tuple[int, int]) -> bool:
        asked.append((first, second, match))
        return match != (0, 3)

    # 0 and 2 show nothing in common; 0 and 3 match, and others speak against it; 0.1 is no match.
    assert groups_of(scores, 0.2, agree) == [[0, 1, 2], [3, 4, 5]]
    assert asked[3] == ([0, 1], [3, 4, 5], (0, 3))
    assert groups_of(scores[:1, :1], 0.2, agree) == [[0]]


def test_poses_are_chained_over_the_best_matches() -> None:
    scores = np.array([[0, 0.2, 0.9], [0.2, 0, 0.8], [0.9, 0.8, 0]])
    assert best_match_tree([0, 1, 2], scores) == [(0, 2), (2, 1)]


def test_signatures_in_common_count_for_the_piece_that_has_fewer() -> None:
    rows = np.eye(243)[:4]
    # Their length does not count.
    sets = [rows, 3.0 * rows[:2], rows[1:3], rows[2:], rows[:0]]
    expected = [
        [1.0, 1.0, 1.0, 1.0, 1.0],
        [1.0, 1.0, 0.5, 0.0, 1.0],
        [1.0, 0.5, 1.0, 0.5, 1.0],
        [1.0, 0.0, 0.5, 1.0, 1.0],
        [1.0, 1.0, 1.0, 1.0, 1.0],
    ]
    np.testing.assert_array_equal(common_shares(sets), expected)
    assert common_shares([]).shape == (0, 0)


def test_adjusted_rand_index() -> None:
    kinds = np.array([0, 0, 1, 1])
    assert adjusted_rand_index(kinds, 1 - kinds) == 1.0
    # Hubert and Arabie: no pair in common, where a third of one is expected.
    assert adjusted_rand_index(kinds, np.array([0, 1, 0, 1])) == pytest.approx(-0.5)


def board(side: int = 60) -> Array:
    """Make a square of points, one apart, on z = 0."""
    steps = np.arange(side, dtype=np.float64)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(side * side)])


def test_pieces_are_what_a_support_carries() -> None:
    table = board()
    bricks = [board(6) + np.array([x, y, 2.5]) for x, y in ((5, 5), (40, 8), (20, 40))]
    points = np.concatenate([table, *bricks])
    plane = (np.arange(len(table)), np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.01)
    pieces, supports = pieces_of(points, [plane], point_spacing(points), 20)
    assert [len(piece) for piece in pieces] == [36, 36, 36]
    assert supports == [0]


def shadowed(*directions: Array) -> Region:
    """Make a board 20 above a table, lit along directions: the table lacks what is in a shadow."""
    table, lid = board(120), board(30) + np.array([50.0, 50.0, 20.0])
    lit = np.ones(len(table), np.bool_)
    for direction in directions:
        # Where the way to the light passes the lid's height.
        x, y, _ = (table + 20.0 / direction[2] * direction).T
        lit &= (np.abs(x - 64.5) > 15.0) | (np.abs(y - 64.5) > 15.0)
    empty = places_without_points(table[lit], 1.0)
    return Region(np.arange(len(lid)), np.concatenate([lid, table[lit]]), empty, np.array([0.0, 0.0, 1.0]))


def unit(*vector: float) -> Array:
    """Scale to length 1."""
    scaled = np.asarray(vector, np.float64)
    return scaled / float(np.linalg.norm(scaled))


def angle_between(a: Array, b: Array) -> float:
    """Give the angle of two vectors in degrees."""
    return float(np.degrees(np.arccos(np.clip(unit(*a) @ unit(*b), -1.0, 1.0))))


def test_shadows_tell_where_the_sensor_was() -> None:
    light = unit(0.5, -0.3, 1.0)
    found = direction_of_sensor([shadowed(light)], 1.0)
    assert found is not None
    assert angle_between(found, light) < 5.0
    assert direction_of_sensor([shadowed()], 1.0) is None


def test_shadows_tell_a_second_viewpoint() -> None:
    eye, camera = 1e4 * unit(0.1, 0.0, 1.0), 1e4 * unit(0.0, -0.6, 1.0)
    shift = second_viewpoint([shadowed(unit(*eye), unit(*camera))], [eye], 1.0)
    assert shift is not None
    assert angle_between(eye + shift, camera) < 5.0
    assert second_viewpoint([shadowed(unit(*eye))], [eye], 1.0) is None
