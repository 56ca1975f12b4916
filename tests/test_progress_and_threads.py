"""What takes long says how far it has come, can be stopped, and gives the same for any number of threads."""

import dataclasses
import inspect
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import surface_scenes
from drawn_shapes import sphere

import surfsig
from surfsig.threads import map_in_threads

RNG = np.random.default_rng(51)
POINTS = surface_scenes.box().points[::4]
BALL = np.concatenate([sphere(RNG, 0.0, 0.005, 800), sphere(RNG, -1.0, 0.005, 300) + np.array([4, 0, 0])])
EGG = sphere(RNG, -1.0, 0.0, 3000)
BENT_EGG = EGG * (1.0, 0.7, 1.6) + np.column_stack(
    [0.4 * EGG[:, 2] ** 2, 0.3 * EGG[:, 0] * EGG[:, 2], 0 * EGG[:, 0]]
)
FIELDS = surfsig.extract_field_signatures(POINTS, 0.4, voxel=0.2)
SIGNATURES = RNG.normal(size=(2500, 242))
TWO_BALLS = surfsig.PointCloud(
    np.concatenate([BALL, BALL + np.array([0, 8, 0])]), viewpoint=np.array([2.0, 4.0, 30.0])
)

CALLS: dict[str, Callable[..., Any]] = {
    "extract": lambda **how: surfsig.extract(POINTS, 0.2, **how),
    "extract_radii": lambda **how: surfsig.extract_radii(POINTS, [0.1, 0.2], **how),
    "extract_field_signatures": lambda **how: surfsig.extract_field_signatures(POINTS, 0.4, voxel=0.2, **how),
    "find_keypoints": lambda **how: surfsig.find_keypoints(POINTS, 0.4, count=20, **how),
    "match_fields": lambda **how: surfsig.match_fields(FIELDS, FIELDS, **how),
    "find_surfaces": lambda **how: surfsig.find_surfaces(POINTS, **how),
    "find_recurrences": lambda **how: surfsig.find_recurrences(
        surfsig.find_surfaces(TWO_BALLS, kinds=["sphere"]), **how
    ),
    "fit_sphere": lambda **how: surfsig.fit_sphere(BALL, near=[0, 0, 1], **how),
    "fit_cylinder": lambda **how: surfsig.fit_cylinder(BALL, robust=True, **how),
    "fit_plane": lambda **how: surfsig.fit_plane(POINTS, near=[0, 0, 0.25], **how),
    "fit_cone": lambda **how: surfsig.fit_cone(BALL, **how),
    "fit_torus": lambda **how: surfsig.fit_torus(BALL[:400], **how),
    "fit_circle": lambda **how: surfsig.fit_circle(BALL, **how),
    "fit_line": lambda **how: surfsig.fit_line(BALL, robust=True, **how),
    "remove_outliers": lambda **how: surfsig.remove_outliers(POINTS, **how),
    "downsample": lambda **how: surfsig.downsample(
        surfsig.PointCloud(POINTS, fields={"intensity": POINTS[:, 0].astype(np.float32)}), 0.1, **how
    ),
    "fuse_scans": lambda **how: surfsig.fuse_scans([POINTS], [np.eye(4)], voxel=0.1, **how),
    "register": lambda **how: surfsig.register(POINTS, POINTS, init=np.eye(4), **how),
    "find_instances": lambda **how: surfsig.find_instances(BENT_EGG, BENT_EGG, **how).instances,
    "similarity_matrix": lambda **how: surfsig.similarity_matrix(
        SIGNATURES, SIGNATURES[:50], either_side=True, **how
    ),
}
OTHERS = {
    "estimate_odometry": "it tells nothing yet",
    "extract_tiles": "it tells what it does, too",
    "find_surfaces_tiles": "it tells what it does, too",
    "register_multiway": "each pair is registered as by `register`",
    "read": "one thread reads",
    "write": "one thread writes",
}
"""Functions that have one of both arguments, and are not called here."""


def arrays_of(result: Any) -> list[Any]:
    """Give the arrays and numbers that a result consists of."""
    if isinstance(result, list):
        return [array for part in result for array in arrays_of(part)]
    if isinstance(result, surfsig.Surfaces):
        return [result.labels, *arrays_of(result.surfaces)]
    if isinstance(result, surfsig.PointCloud):
        return [result.points, *result.fields.values()]
    if dataclasses.is_dataclass(result) and not isinstance(result, type):
        values = [getattr(result, field.name) for field in dataclasses.fields(result)]
        return [array for value in values for array in arrays_of(value)]
    return [] if result is None else [result]


def test_what_has_one_of_both_arguments_has_the_other() -> None:
    for name in surfsig.__all__:
        function = getattr(surfsig, name)
        if inspect.isfunction(function) and name not in OTHERS:
            parameters = inspect.signature(function).parameters
            assert ("threads" in parameters) == ("progress" in parameters) == (name in CALLS), name


@pytest.mark.parametrize("name", CALLS)
def test_progress_goes_from_little_to_all(name: str) -> None:
    told: list[tuple[int, int]] = []
    CALLS[name](progress=lambda done, total: told.append((done, total)))
    assert told
    done, totals = np.array(told).T
    assert (np.diff(done) >= 0).all()
    assert done[0] >= 0
    # Points that no surface explains stay over.
    assert done[-1] == totals[-1] or name == "find_surfaces"
    # How many candidates there are is known when they have been chosen.
    assert len(set(totals)) == 1 or name == "find_keypoints"


@pytest.mark.parametrize("name", CALLS)
def test_what_progress_raises_stops_the_work(name: str) -> None:

    def enough(done: int, total: int) -> None:
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        CALLS[name](progress=enough)


@pytest.mark.parametrize("name", CALLS)
def test_the_number_of_threads_does_not_matter(name: str) -> None:
    one, several = (arrays_of(CALLS[name](threads=threads)) for threads in (1, 3))
    assert len(one) == len(several) > 0
    for ours, theirs in zip(one, several, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"threads": 0}, "threads must be 1 to 1024"),
        ({"threads": 1.5}, "threads must be a whole number"),
        ({"progress": 3}, "progress must be a function"),
    ],
)
def test_arguments_without_a_meaning_are_refused(name: str, how: dict[str, Any], message: str) -> None:
    with pytest.raises(surfsig.InvalidInputError, match=message):
        CALLS[name](**how)


@pytest.mark.parametrize("threads", [None, 1, 3])
def test_results_are_in_the_order_of_the_items(threads: int | None) -> None:
    told: list[tuple[int, int]] = []
    found = map_in_threads(lambda x: x * x, range(20), threads, lambda *counts: told.append(counts))
    assert found == [x * x for x in range(20)]
    assert told == [(done, 20) for done in range(1, 21)]
    assert map_in_threads(lambda x: x, [], threads) == []


def test_what_has_not_begun_is_not_begun_where_the_work_stops() -> None:
    begun = []

    def work(item: int) -> None:
        begun.append(item)
        if item == 0:
            raise KeyError("the first")

    with pytest.raises(KeyError, match="the first"):
        map_in_threads(work, range(10_000), 2)
    assert len(begun) < 10_000


@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="no fork here")
def test_no_call_leaves_threads_that_a_forked_child_waits_for() -> None:
    script = """
import os, signal, sys
import numpy as np, surfsig
from surfsig import simulate, spacing
sys.path.insert(0, sys.argv[1])
from test_progress_and_threads import CALLS, POINTS
lidar = simulate.Lidar(lines=32, steps=480)
scan = simulate.scan(simulate.room(1), lidar, simulate.upright_pose(0, 0, 1.2, 0))
others = {
    "deskew": lambda: surfsig.deskew(scan, np.full(6, 0.1), spin_rate=10.0),
    "estimate_odometry": lambda: surfsig.estimate_odometry([scan, scan]),
    "estimate_viewpoint": lambda: surfsig.estimate_viewpoint(scan),
    "point_spacing": lambda: spacing.point_spacing(scan.points),
    "join_surface_pieces": lambda: surfsig._surfsig.join_surface_pieces([], []),
    "signatures": lambda: surfsig.extract(POINTS, 0.2).signatures(),
}
for name, call in (CALLS | others).items():
    call()
    child = os.fork()
    if child == 0:
        signal.alarm(20)
        call()
        os._exit(0)
    print(name, os.waitpid(child, 0)[1])
"""
    command = [sys.executable, "-W", "ignore", "-c", script, str(Path(__file__).parent)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    ended = dict(line.split() for line in done.stdout.splitlines())
    assert ended.keys() > CALLS.keys()
    assert {name for name, code in ended.items() if code != "0"} == set()
