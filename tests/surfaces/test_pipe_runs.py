"""Pipes joined to runs: simulated ones with elbows, without them, and what must not be joined."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import Finished
from made_surfaces import made, moved
from numpy.typing import ArrayLike
from pipe_scene import pipe
from surface_points import UTM, rotation

import surfsig
from surfsig import PipeRun, PointCloud, Surface, Surfaces
from surfsig.surfaces.pipe_runs import find_pipe_runs

Shell = Callable[..., Finished]

RADIUS, BEND = 0.05, 0.15
CORNERS = np.array([[0, 0, 0], [1.2, 0, 0], [1.2, 1, 0], [1.2, 1.4, 0.5]])
TURNS = [0.5 * math.pi, math.atan2(0.5, 0.4)]


def straight(number: int, start: ArrayLike, end: ArrayLike, radius: float = RADIUS) -> Surface:
    """Give a cylinder between two points, with errors of 0.001 in each parameter."""
    along = np.asarray(end, float) - np.asarray(start, float)
    length = float(np.linalg.norm(along))
    middle = np.asarray(start, float) + 0.5 * along
    return made("cylinder", middle, (-1) ** number * along, radius, length=length)


@pytest.fixture(scope="module")
def found() -> Surfaces:
    scene = pipe(CORNERS, RADIUS, BEND, noise=0.0005, density=20_000, seed=1)
    return surfsig.find_surfaces(PointCloud(scene.points @ rotation(np.random.default_rng(2)).T, UTM))


def test_a_pipe_with_two_elbows(found: Surfaces) -> None:
    (run,) = found.pipe_runs()
    scene = pipe(CORNERS, RADIUS, BEND, noise=0.0005, density=20_000, seed=1)
    turn = rotation(np.random.default_rng(2))
    ends = scene.ends @ turn.T + UTM
    places = np.array([[segment.start, segment.end] for segment in run.segments])
    if np.linalg.norm(places[0, 0] - ends[0, 0]) > 0.1:
        ends = ends[::-1, ::-1]
        turns = TURNS[::-1]
    else:
        turns = TURNS
    np.testing.assert_allclose(places, ends, atol=0.1 * RADIUS)
    assert [joint.kind for joint in run.joints] == ["elbow", "elbow"]
    assert [found[joint.surface].kind for joint in run.joints] == ["torus", "torus"]
    assert [joint.angle for joint in run.joints] == pytest.approx(turns, abs=1e-3)
    assert [joint.bend_radius for joint in run.joints] == pytest.approx([BEND, BEND], rel=0.08)
    straight_pieces = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    # At both free ends the points end a little before the pipe does.
    assert run.length == pytest.approx(straight_pieces.sum() + BEND * sum(TURNS), abs=0.002)
    assert 0.0 < run.length_std < 0.002
    assert run.radius == pytest.approx(RADIUS, rel=1e-3)
    parts = [part.length for part in run.segments] + [joint.length for joint in run.joints]
    assert run.length == pytest.approx(sum(parts))
    assert repr(run).startswith("PipeRun(3 segments, 2 joints, length=2.76")


def test_hidden_elbows_are_corners() -> None:
    scene = pipe(CORNERS, RADIUS, BEND, noise=0.0005, density=20_000, seed=3, elbows=False)
    (run,) = surfsig.find_surfaces(scene.points).pipe_runs()
    assert [joint.kind for joint in run.joints] == ["corner", "corner"]
    assert sorted(joint.angle for joint in run.joints) == pytest.approx(sorted(TURNS), abs=1e-3)
    corners = np.array([segment.end for segment in run.segments[:-1]])
    distances = np.linalg.norm(corners[:, None] - CORNERS[None, 1:3], axis=2)
    assert distances.min(axis=1).max() < 0.02 * RADIUS
    assert run.length == pytest.approx(np.linalg.norm(np.diff(CORNERS, axis=0), axis=1).sum(), abs=0.002)
    assert math.isnan(run.joints[0].bend_radius)


def test_pieces_in_line_are_joined_over_a_gap() -> None:
    pieces = [
        straight(0, [0, 0, 0], [1, 0, 0]),
        straight(1, [1.2, 0, 0], [2, 0, 0]),
        straight(2, [3, 0, 0], [4, 0, 0]),
    ]
    (run,) = find_pipe_runs(pieces)
    assert [segment.surface for segment in run.segments] == [0, 1]
    assert [joint.kind for joint in run.joints] == ["straight"]
    assert (run.length, run.joints[0].length) == pytest.approx((2.0, 0.2))


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(straight(1, [1, 0.1, 0], [1, 1, 0], 0.06), id="another radius"),
        pytest.param(straight(1, [1, 0.1, 0.04], [1, 1, 0.04]), id="axes that pass each other"),
        pytest.param(straight(1, [0.5, 0.1, 0], [0.5, 1, 0]), id="a tee"),
        pytest.param(straight(1, [1, 0.7, 0], [1, 1, 0]), id="too far"),
        pytest.param(straight(1, [1.1, 0.04, 0], [2, 0.04, 0]), id="beside the line"),
        pytest.param(straight(1, [0, 0.3, 0], [1, 0.3, 0]), id="side by side"),
    ],
)
def test_what_is_no_joint(other: Surface) -> None:
    exact = [Surface(**{**vars(part), "covariance": 1e-12 * np.eye(5)}) for part in (PIECE, other)]
    assert find_pipe_runs(exact) == []


PIECE = straight(0, [0, 0, 0], [1, 0, 0])


def test_axes_that_may_meet_by_their_errors_do() -> None:
    past = straight(1, [1, 0.1, 0.0125 + 0.002], [1, 1, 0.0125 + 0.002])
    for std, count in ((0.01, 1), (0.001, 0)):
        pieces = [Surface(**{**vars(part), "covariance": std**2 * np.eye(5)}) for part in (PIECE, past)]
        assert len(find_pipe_runs(pieces)) == count


def test_a_closed_run_has_as_many_joints_as_segments() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    pieces = [straight(i, corners[i], corners[(i + 1) % 4]) for i in (0, 2, 1, 3)]
    (run,) = find_pipe_runs(pieces)
    assert (len(run.segments), len(run.joints)) == (4, 4)
    assert run.length == pytest.approx(4.0)
    ends = np.array([[segment.start, segment.end] for segment in run.segments])
    np.testing.assert_allclose(ends[:, 1], np.roll(ends[:, 0], -1, axis=0), atol=1e-12)


def test_the_standard_error_of_a_length_is_that_of_many_draws() -> None:
    rng = np.random.default_rng(9)
    pieces = [straight(0, [0, 0, 0], [1, 0, 0]), straight(1, [1, 0.1, 0], [1, 1, 0])]
    told = find_pipe_runs(pieces)[0]

    def drawn(surface: Surface) -> Surface:
        shift, tilt = 0.001 * rng.normal(size=(2, 2)) @ surface.across
        point = surface.point + shift
        axis = (surface.axis + tilt) / np.linalg.norm(surface.axis + tilt)
        return Surface(**{**vars(surface), "point": point, "center": point, "axis": axis})

    lengths = [find_pipe_runs([drawn(piece) for piece in pieces])[0].length for _ in range(400)]
    assert np.std(lengths) == pytest.approx(told.length_std, rel=0.12)


def test_a_run_does_not_depend_on_the_coordinates() -> None:
    turn = rotation(np.random.default_rng(10))
    pieces = [straight(0, [0, 0, 0], [1, 0, 0]), straight(1, [1, 0.1, 0], [1, 1, 0])]
    (here,), (there,) = find_pipe_runs(pieces), find_pipe_runs([moved(piece, turn, UTM) for piece in pieces])
    assert (there.length, there.length_std) == pytest.approx((here.length, here.length_std), rel=1e-6)
    for ours, theirs in zip(here.segments, there.segments, strict=True):
        np.testing.assert_allclose(turn @ ours.end + UTM, theirs.end, atol=1e-8)


def test_the_shell_and_the_report_tell_runs(shell: Shell, found: Surfaces, tmp_path: Path) -> None:
    scan = tmp_path / "scan.npz"
    surfsig.write(scan, found.cloud)
    finished = shell("surfaces", scan, "--json", tmp_path / "out.json")
    assert finished.code == 0
    (run,) = json.loads((tmp_path / "out.json").read_text())["pipe_runs"]
    expected: PipeRun = found.pipe_runs()[0]
    assert run["length"] == pytest.approx(expected.length, rel=1e-6)
    assert run["segments"][0]["start"] == pytest.approx(expected.segments[0].start, rel=1e-9)
    assert run["joints"][0]["bend_radius"] == pytest.approx(expected.joints[0].bend_radius, rel=1e-4)
    assert "pipe 0-1-2  0.0" in finished.out.splitlines()[-1]
    assert "long, 2 elbows" in finished.out.splitlines()[-1]
    found.write_report(tmp_path / "report.html")
    assert "long, 2 elbows" in (tmp_path / "report.html").read_text(encoding="utf-8")
