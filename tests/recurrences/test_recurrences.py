"""What recurs in simulated scenes: groups, poses, and what they are called."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn_shapes import sphere
from placed_objects import near_objects
from recurrence_scene import RecurrenceScene, recurrence_scene
from recurrences import scored
from surface_points import Array

import surfsig

BESIDE = np.array([2.0, 0.0, 0.0])
KINDS = ("large ball", "small ball", "bracket", "egg")


@pytest.fixture(scope="module")
def scene() -> RecurrenceScene:
    """Scan twelve objects of four kinds, and the table near them."""
    scene = recurrence_scene(7, columns=4, rows=3, kinds=KINDS)
    near = near_objects(scene.cloud, 4, 3)
    return replace(scene, cloud=scene.cloud.at(near), object_of_point=scene.object_of_point[near])


@pytest.fixture(scope="module")
def found(scene: RecurrenceScene) -> surfsig.Recurrences:
    """Find what recurs in it."""
    return surfsig.find_recurrences(surfsig.find_surfaces(scene.cloud))


def objects_of(scene: RecurrenceScene, found: surfsig.Recurrences, group: int) -> list[int]:
    """Give the true object of each member of a group."""
    points = [found.pieces[piece].points for piece in found[group].pieces]
    return [int(np.bincount(scene.object_of_point[part]).argmax()) for part in points]


@pytest.mark.slow
def test_groups_are_the_kinds(scene: RecurrenceScene, found: surfsig.Recurrences) -> None:
    score = scored(scene, found)
    # One bracket shows a side that no other shows: it stays alone.
    assert score.rand_index > 0.85
    assert not score.merged
    assert len(found) == len(KINDS)


@pytest.mark.slow
def test_poses_of_an_object_without_symmetry(scene: RecurrenceScene, found: surfsig.Recurrences) -> None:
    for number, group in enumerate(found.groups):
        objects = objects_of(scene, found, number)
        if KINDS[scene.kind_of_object[objects[0]]] != "bracket":
            continue
        for pose, member in zip(group.poses, objects, strict=True):
            true = scene.poses[member] @ np.linalg.inv(scene.poses[objects[0]])
            turn = pose[:3, :3] @ true[:3, :3].T
            assert np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))) < 3.0
            # Where the first one's middle comes to lie: 0.8 mm are between points.
            middle = scene.poses[objects[0]][:, 3]
            assert np.linalg.norm((pose - true) @ middle) < 1.5e-3
        return
    pytest.fail("no group of brackets")


@pytest.mark.slow
def test_a_ball_has_no_orientation(scene: RecurrenceScene, found: surfsig.Recurrences) -> None:
    balls = 0
    for number, group in enumerate(found.groups):
        objects = objects_of(scene, found, number)
        if "ball" not in KINDS[scene.kind_of_object[objects[0]]]:
            assert group.free_directions == []
            continue
        balls += 1
        (turn,) = group.free_directions
        assert str(turn).startswith("rotates about (")
        np.testing.assert_allclose(turn.point, scene.poses[objects[0]][:3, 3], atol=1e-3)
        for pose, member in zip(group.poses, objects, strict=True):
            center = pose @ scene.poses[objects[0]][:, 3]
            np.testing.assert_allclose(center[:3], scene.poses[member][:3, 3], atol=5e-4)
    assert balls == 2


@pytest.mark.slow
def test_labels_table_and_words(scene: RecurrenceScene, found: surfsig.Recurrences) -> None:
    (labels,), (groups,) = found.labels, found.group_labels
    assert labels.shape == groups.shape == (len(scene.cloud),)
    for number, piece in enumerate(found.pieces):
        np.testing.assert_array_equal(np.flatnonzero(labels == number), piece.points)
        np.testing.assert_allclose(piece.center, scene.cloud.offsets[piece.points].mean(axis=0))
    assert (groups[labels < 0] == -1).all()
    table = found.to_pandas()
    assert len(table) == sum(len(group) for group in found.groups)
    assert table.loc[found[0].pieces, "group"].eq(0).all()
    first = table.loc[found[0].pieces[0]]
    assert (first["qw"], first["tx"], first["score"]) == (1.0, 0.0, 1.0)
    assert repr(found).startswith(f"Recurrences({len(table)} of {len(found.pieces)} pieces in 4 groups")


@pytest.mark.slow
def test_the_same_scan_twice_and_shifted(scene: RecurrenceScene) -> None:
    """Between scans, poses are in true coordinates: here the shift between two copies of a scan."""
    one = scene.cloud.at(np.flatnonzero(np.isin(scene.object_of_point, range(4))))
    shift = np.array([500.0, -20.0, 3.0])
    other = surfsig.PointCloud(
        one.offsets, origin=shift, fields=one.fields, viewpoints=one.viewpoints + shift
    )
    found = surfsig.find_recurrences([surfsig.find_surfaces(one), surfsig.find_surfaces(other)])
    half = len(found.pieces) // 2
    of_scan = [[piece.scan for piece in found.pieces].count(scan) for scan in (0, 1)]
    assert of_scan == [half, half]
    for group in found.groups:
        for member, pose in zip(group.pieces, group.poses, strict=True):
            if member == group.pieces[0] + half:
                center = found.pieces[group.pieces[0]].center
                np.testing.assert_allclose(pose[:3, :3] @ center + pose[:3, 3], center + shift, atol=2e-3)
                break
        else:
            pytest.fail(f"{group} does not find its copy")


@pytest.mark.slow
def test_the_same_result_every_time(scene: RecurrenceScene) -> None:
    few = scene.cloud.at(np.flatnonzero(np.isin(scene.object_of_point, range(4))))
    one, other = (surfsig.find_recurrences(surfsig.find_surfaces(few)) for _ in range(2))
    np.testing.assert_array_equal(one.scores, other.scores)


def test_a_scan_without_pieces() -> None:
    found = surfsig.find_recurrences(surfsig.find_surfaces(np.zeros((0, 3))))
    assert (len(found), found.pieces, found.equal_surfaces) == (0, [], [])
    assert len(found.to_pandas()) == 0


def two_balls(origin: Array, viewpoint: Array | None) -> surfsig.Surfaces:
    """Find the surfaces of halves of two balls of radius 0.5 at 0 and (2, 0, 0) from an origin."""
    rng = np.random.default_rng(53)
    points = np.concatenate([0.5 * sphere(rng, 0.0, 0.002, 600), 0.5 * sphere(rng, 0.0, 0.002, 600) + BESIDE])
    cloud = surfsig.PointCloud(points, origin=origin, viewpoint=viewpoint)
    return surfsig.find_surfaces(cloud, kinds=["sphere"])


def test_two_balls_in_two_scans_are_four_of_a_kind() -> None:
    """Poses are in true coordinates, between scans, too, and known but for rotations about the center."""
    far = np.array([500_000.0, 4_500_000.0, 3.0])
    scans = [two_balls(origin, origin + np.array([1.0, 0.0, 30.0])) for origin in (np.zeros(3), far)]
    found = surfsig.find_recurrences(scans)
    assert [piece.scan for piece in found.pieces] == [0, 0, 1, 1]
    (group,) = found.groups
    assert sorted(group.pieces) == [0, 1, 2, 3]
    for member, pose in zip(group.pieces, group.poses, strict=True):
        first, other = (
            scans[found.pieces[number].scan][found.pieces[number].surfaces[0]]
            for number in (group.pieces[0], member)
        )
        np.testing.assert_allclose(pose[:3, :3] @ first.center + pose[:3, 3], other.center, atol=5e-3)
    (turn,) = group.free_directions
    assert str(turn).startswith("rotates about (")
    (equal,) = found.equal_surfaces
    assert len(equal) == 4
    assert equal.size["radius"] == pytest.approx(0.5, abs=1e-3)


def test_unknown_viewpoints_and_other_input() -> None:
    known = two_balls(np.zeros(3), np.array([1.0, 0, 30]))
    with pytest.raises(surfsig.InvalidInputError, match="set the cloud's viewpoint"):
        surfsig.find_recurrences(two_balls(np.zeros(3), None))
    with pytest.raises(surfsig.InvalidInputError, match=r"what surfsig\.find_surfaces returns"):
        surfsig.find_recurrences([known.cloud])  # type: ignore[list-item]
    with pytest.raises(surfsig.InvalidInputError, match="min_points"):
        surfsig.find_recurrences(known, min_points=0)


@pytest.mark.slow
def test_without_a_viewpoint_shadows_tell(scene: RecurrenceScene) -> None:
    blind = surfsig.PointCloud(scene.cloud.offsets)
    with pytest.warns(UserWarning, match="where shadows point to"):
        found = surfsig.find_recurrences(surfsig.find_surfaces(blind))
    score = scored(scene, found)
    assert score.rand_index > 0.7
    assert not score.merged
