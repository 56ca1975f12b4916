"""What is free, equal, of another size or hand: poses of pieces that recur are trusted or not, and why."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from placed_objects import BOSSED, MIRRORED, Solids, enlarged, scanned
from recurrence_scene import KINDS, TABLE_TILT
from surface_points import Array

import surfsig
from surfsig._surfsig import align_pieces, examine_poses
from surfsig.recurrences.scan import ScanPieces

UP = np.array([0.0, np.sin(TABLE_TILT), -np.cos(TABLE_TILT)])
"""Away from the table."""
CANS, BALLS, BOXES, BRACKETS = ([0, 1, 2], [3, 4], [5, 6, 7, 8], [9, 10, 11])
"""Numbers of the objects of `found`."""


def objects_of(cloud: surfsig.PointCloud, found: surfsig.Recurrences) -> list[int]:
    """Give the number of the object that most of each piece's points are on."""
    own = cloud.fields["object"]
    return [int(np.bincount(own[piece.points]).argmax()) for piece in found.pieces]


Seen = tuple[surfsig.PointCloud, surfsig.Recurrences, list[Array]]


@pytest.fixture(scope="module")
def seen() -> Seen:
    """Scan cans, balls, boxes and brackets, and find what recurs."""
    angles = (0.4, 0.6 + np.pi / 2, 0.5 + np.pi, 0.3 - np.pi / 2)
    objects = [
        *[(KINDS["thick can"], 0.023, 0.0)] * 3,
        *[(KINDS["large ball"], 0.021, 0.0)] * 2,
        *[(KINDS["box"], 0.011, angle) for angle in angles],
        *[(KINDS["bracket"], 0.018, angle) for angle in (-0.7, -0.9, -0.6)],
    ]
    cloud, poses = scanned(objects, columns=4, seed=5)
    return cloud, surfsig.find_recurrences(surfsig.find_surfaces(cloud)), poses


Followers = Callable[[list[int]], list[surfsig.Occurrence]]


@pytest.fixture(scope="module")
def followers(seen: Seen) -> Followers:
    """Give the members of the group that shows some objects, but for the first one."""
    cloud, found, _ = seen
    objects = objects_of(cloud, found)

    def of(expected: list[int]) -> list[surfsig.Occurrence]:
        (group,) = [
            group for group in found.groups if sorted(objects[piece] for piece in group.pieces) == expected
        ]
        first = group.members[0]
        assert first.trusted
        np.testing.assert_array_equal(first.T_member_first, np.eye(4))
        return group.members[1:]

    return of


@pytest.mark.slow
def test_a_can_rotates_about_its_axis(seen: Seen, followers: Followers) -> None:
    for can in followers(CANS):
        (turn,) = can.free_directions
        assert turn.motion == "rotation"
        # The table is tilted by 30 degrees, and the can stands on it.
        assert abs(turn.axis @ UP) == pytest.approx(1.0, abs=1e-3)
        assert not can.trusted
        assert can.doubts[0] == "free_directions"
        assert can.scale == pytest.approx(1.0, abs=0.01)
        assert can.scale_standard_error < 0.01


@pytest.mark.slow
def test_a_ball_rotates_about_its_centre(seen: Seen, followers: Followers) -> None:
    poses = seen[2]
    (ball,) = followers(BALLS)
    (turn,) = ball.free_directions
    assert np.isnan(turn.axis).all()
    # In the scan of the second ball, or of the first one: which comes first is the scan's matter.
    centers = [poses[number][:3, 3] for number in BALLS]
    assert min(float(np.linalg.norm(turn.point - center)) for center in centers) < 1e-3
    assert (ball.doubts, ball.alternatives) == (["free_directions"], [])
    assert ball.reasons == ["the overlap does not determine 1 motion"]


@pytest.mark.slow
def test_equal_poses_of_a_box_are_listed(seen: Seen, followers: Followers) -> None:
    cloud, found, poses = seen
    objects = objects_of(cloud, found)
    for box in followers(BOXES):
        assert not box.trusted
        assert "ambiguous" in box.doubts
        first = next(group.pieces[0] for group in found.groups if box.piece in group.pieces)
        true = [
            poses[objects[box.piece]] @ np.diag([*signs, 1.0]) @ np.linalg.inv(poses[objects[first]])
            for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
        ]
        # All stand on the same side: that the box looks the same upside down was not seen.
        assert box.alternatives
        others = [box.T_member_first, *(other.T_target_source for other in box.alternatives)]
        angles = np.array([[angle_between(pose, one) for one in true] for pose in others])
        assert angles.min(axis=1).max() < np.radians(3.0)
        assert len(set(angles.argmin(axis=1).tolist())) == len(others)


@pytest.mark.slow
def test_poses_of_brackets_that_are_trusted_are_right(seen: Seen, followers: Followers) -> None:
    cloud, found, poses = seen
    objects = objects_of(cloud, found)
    for bracket in followers(BRACKETS):
        # Where few of the narrow sides are in sight, it slides along its edge.
        assert bracket.trusted or bracket.doubts == ["free_directions"]
        first = next(group.pieces[0] for group in found.groups if bracket.piece in group.pieces)
        true = poses[objects[bracket.piece]] @ np.linalg.inv(poses[objects[first]])
        middle = poses[objects[first]][:, 3]
        assert np.linalg.norm((bracket.T_member_first - true) @ middle) < 1e-3


@pytest.mark.slow
def test_what_is_said_of_poses_is_in_tables_and_json(seen: Seen) -> None:
    _, found, _ = seen
    values = json.loads(json.dumps(found.values()))["groups"]
    table = found.to_pandas()
    for group, told in zip(found.groups, values, strict=True):
        for member, plain in zip(group.members, told["members"], strict=True):
            assert plain == json.loads(json.dumps(member.values()))
            assert len(plain["alternatives"]) == len(member.alternatives)
            row = table.loc[member.piece]
            assert (row["trusted"], row["reasons"]) == (member.trusted, "; ".join(member.reasons))
            assert row["alternatives"] == len(member.alternatives)
            assert ("not trusted" in repr(member)) == (not member.trusted)
    header, rows = found.table()
    assert header[-1] == "trusted"
    assert rows[0][-1].endswith(f" of {len(found[0]) - 1}")


def angle_between(a: Array, b: Array) -> float:
    """Give the angle of the rotation between two poses, in radians."""
    return float(np.arccos(np.clip((np.trace(a[:3, :3] @ b[:3, :3].T) - 1.0) / 2.0, -1.0, 1.0)))


def examined(
    one: Solids,
    other: Solids,
    scale: float = 1.0,
    *,
    search: bool = True,
    angles: tuple[float, float] = (-0.7, -0.9),
) -> dict[str, Any]:
    """Scan two objects beside two balls, and examine the pose of the first on the second.

    The pose is searched, or the true one as if both were equal.
    """
    balls = [(KINDS["large ball"], 0.021, 0.0)] * 2
    cloud, poses = scanned(
        [(one, 0.018, angles[0]), (other, 0.018 * scale, angles[1]), *balls], columns=2, seed=3
    )
    scan = ScanPieces(0, surfsig.find_surfaces(cloud), 100, None)
    own = cloud.fields["object"]
    objects = [int(np.bincount(own[piece]).argmax()) for piece in scan.pieces]
    source, target = (
        max((k for k in range(len(objects)) if objects[k] == number), key=lambda k: len(scan.pieces[k]))
        for number in (0, 1)
    )
    views = scan.views(0.1 * float(np.median(scan.extents())), None)
    pose = poses[1] @ np.linalg.inv(poses[0])
    from_source, to_target = np.eye(4), np.eye(4)
    from_source[:3, 3], to_target[:3, 3] = views[source].center, -np.array(views[target].center)
    pose = to_target @ pose @ from_source
    if search:
        (found,) = align_pieces(views, [(source, target)])
        assert found is not None
        pose = found[0]
    return examine_poses(views, [((source, target), np.ascontiguousarray(pose))])[0]


@pytest.mark.slow
@pytest.mark.parametrize("bracket", [KINDS["bracket"], BOSSED], ids=["plain", "with a block"])
def test_a_bracket_is_trusted(bracket: Solids) -> None:
    found = examined(bracket, bracket)
    assert (found["doubts"], found["reasons"]) == ([], [])
    assert (found["free_directions"], found["alternatives"]) == ([], [])
    assert found["scale"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_a_mirrored_bracket_is_not_trusted() -> None:
    found = examined(MIRRORED, BOSSED, angles=(-1.2, -1.5))
    assert "mirrored" in found["doubts"]
    assert any(str(reason).startswith("the source's mirror image fits better") for reason in found["reasons"])


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.04, 1.1])
def test_a_larger_bracket_is_not_trusted(scale: float) -> None:
    found = examined(BOSSED, enlarged(BOSSED, scale), scale, search=False)
    assert "scale" in found["doubts"]
    assert found["scale"] == pytest.approx(1.0 / scale, abs=0.005)
    assert any("times as large as the target" in str(reason) for reason in found["reasons"])


@pytest.mark.slow
def test_mirrored_and_larger_copies_are_in_no_group_or_not_trusted() -> None:
    objects = [(BOSSED, 0.018, -0.7), (BOSSED, 0.018, -0.9), (MIRRORED, 0.018, -0.8)]
    cloud, _ = scanned([*objects, (enlarged(BOSSED, 1.1), 0.0198, -0.8)], columns=2, seed=5)
    found = surfsig.find_recurrences(surfsig.find_surfaces(cloud))
    own = objects_of(cloud, found)
    kinds = [min(1, number // 2) + (number == 3) for number in own]
    for group in found.groups:
        first = kinds[group.pieces[0]]
        for member in group.members[1:]:
            # They may look equal where little of them is seen.
            assert kinds[member.piece] == first or not member.trusted
