"""The C interface's models and instances: values are Python's, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_double, c_size_t, c_uint32, c_void_p

import numpy as np
import pytest
from c_interface import PROGRESS, CInterface, Failed, Instance, Scan, address
from finding_scene import FindingScene, finding_scene, whole
from numpy.typing import NDArray

import surfsig
from surfsig import PointCloud

INVALID, CANCELLED = 1, 5

Array = NDArray[np.float64]
Found = list[tuple[Instance, NDArray[np.uint32]]]


@pytest.fixture(scope="module")
def scene() -> FindingScene:
    """A half hidden copy of the model on a table, and what is near it, seen from 0."""
    whole_scene = finding_scene("figure", 2, copies=1, others=0)
    points = whole_scene.cloud.points
    near = np.linalg.norm(points - whole_scene.poses[0][:3, 3], axis=1) < 0.06
    cloud = PointCloud(np.ascontiguousarray(points[near]), viewpoint=np.zeros(3))
    return FindingScene(cloud, whole_scene.poses, whole_scene.hidden)


@contextmanager
def scan_of(
    c: CInterface,
    points: Array,
    viewpoint: Array | None = None,
    directions: NDArray[np.float32] | None = None,
) -> Iterator[Scan]:
    """Make a surfsig_scan."""
    with c.cloud_of(points) as cloud:
        yield Scan(cloud, *(None if array is None else address(array) for array in (viewpoint, directions)))


@contextmanager
def options(
    c: CInterface,
    *,
    score: float = 0.0,
    at_most: int = 0,
    threads: int = 1,
    stop: int = 0,
    steps: list[tuple[int, int]],
) -> Iterator[c_void_p]:
    """Make options whose progress goes into a list."""
    f = c.functions
    made = c_void_p(f.surfsig_find_options_new())

    def told(_: object, done: int, total: int) -> int:
        steps.append((done, total))
        return stop

    call = PROGRESS(told)
    try:
        c.check(f.surfsig_find_options_set_score(made, c_double(score)))
        c.check(f.surfsig_find_options_set_at_most(made, c_size_t(at_most)))
        c.check(f.surfsig_find_options_set_threads(made, c_uint32(threads)))
        c.check(f.surfsig_find_options_set_progress(made, call, c_void_p()))
        yield made
    finally:
        f.surfsig_find_options_free(made)


@contextmanager
def model_of(
    c: CInterface, points: Array, viewpoint: Array | None = None, stop: int = 0
) -> Iterator[c_void_p]:
    """Prepare a model."""
    made, steps = c_void_p(1), list[tuple[int, int]]()
    with scan_of(c, points, viewpoint) as scan, options(c, stop=stop, steps=steps) as how:
        code = c.functions.surfsig_model_new(byref(scan), how, byref(made))
        assert (code == 0) == bool(made)
        c.check(code)
    assert steps[-1] == (2, 2)
    try:
        assert c.functions.surfsig_model_size(made) == len(points)
        yield made
    finally:
        c.functions.surfsig_model_free(made)


def found_by_c(
    c: CInterface,
    models: list[c_void_p],
    scan: Scan,
    *,
    score: float = 0.0,
    at_most: int = 0,
    threads: int = 1,
    stop: int = 0,
) -> Found:
    """Find instances by the C interface."""
    f, made, found, steps = c.functions, c_void_p(1), [], list[tuple[int, int]]()
    pointers = (c_void_p * len(models))(*models)
    with options(c, score=score, at_most=at_most, threads=threads, stop=stop, steps=steps) as how:
        code = f.surfsig_find_instances(pointers, c_size_t(len(models)), byref(scan), how, byref(made))
        assert (code == 0) == bool(made)
        c.check(code)
    assert {total for _, total in steps} == {2 + 3 * len(models)}
    try:
        for number in range(f.surfsig_instances_size(made)):
            instance = Instance()
            c.check(f.surfsig_instances_get(made, c_size_t(number), byref(instance)))
            indices = f.surfsig_instances_indices(made, c_size_t(number))
            found.append((instance, np.array(indices[: instance.point_count], np.uint32)))
    finally:
        f.surfsig_instances_free(made)
    return found


def check(
    found: Found, expected: surfsig.Instances | list[surfsig.Instance], names: tuple[str, ...] = ("model",)
) -> None:
    """All numbers are the same."""
    assert len(found) == len(expected) > 0
    for (ours, indices), theirs in zip(found, expected, strict=True):
        assert names[ours.model] == theirs.name
        np.testing.assert_array_equal(ours.T_scene_model.array(), theirs.T_scene_model)
        np.testing.assert_array_equal(np.array(ours.covariance[:]).reshape(6, 6), theirs.covariance)
        np.testing.assert_array_equal(ours.center[:], theirs.center)
        for name in ("score", "visible", "overlap", "rms"):
            assert getattr(ours, name) == getattr(theirs, name)
        assert ours.free_direction_count == len(theirs.free_directions)
        for one, other in zip(ours.free_directions, theirs.free_directions, strict=False):
            np.testing.assert_array_equal(one.axis[:], other.axis)
            np.testing.assert_array_equal(one.point[:], other.point)
        np.testing.assert_array_equal(indices, theirs.indices)


def test_a_model_and_its_instance_are_those_of_python(c: CInterface, scene: FindingScene) -> None:
    points, model = scene.cloud.points, whole("figure", 6000).points
    expected = surfsig.find_instances(model, scene.cloud)
    assert np.linalg.norm(expected[0].T_scene_model[:3, 3] - scene.poses[0][:3, 3]) < 0.001
    with model_of(c, model) as prepared:
        library = surfsig.finding.model.model_of(model)
        assert c.functions.surfsig_model_radius(prepared) == library.radius
        assert c.functions.surfsig_model_spacing(prepared) == library.spacing
        for viewpoint in (np.zeros(3), None):
            # Without a viewpoint the origin is one, as all can have been seen from there.
            with scan_of(c, points, viewpoint) as scan:
                check(found_by_c(c, [prepared], scan, threads=2), expected)
        with scan_of(c, points) as scan:
            assert found_by_c(c, [prepared], scan, score=expected[0].score + 1e-6) == []


def test_a_scene_may_have_directions_and_a_viewpoint(c: CInterface, scene: FindingScene) -> None:
    points, model = scene.cloud.points, whole("figure", 6000).points
    normals = np.nan_to_num(surfsig.extract(scene.cloud, 0.004).normals.astype(np.float32))
    # As Python scales vectors of any length.
    normals /= np.maximum(np.abs(normals).max(axis=1, keepdims=True), np.float32(1e-6))
    far = np.array([10.0, -20.0, 5.0])
    cloud = PointCloud(points + far, viewpoint=far, fields={"normals": normals})
    expected = surfsig.find_instances(model, cloud)
    with model_of(c, model) as prepared, scan_of(c, cloud.points, far, normals) as scan:
        check(found_by_c(c, [prepared], scan), expected)


def test_one_view_is_a_model_and_several_are_told_apart(c: CInterface, scene: FindingScene) -> None:
    model = whole("figure", 6000).points
    front, above = np.ascontiguousarray(model[model[:, 2] > 0.0]), np.array([0.0, 0.0, 1.0])
    clouds = {"front": PointCloud(front, viewpoint=above), "bracket": whole("bracket with pin", 6000)}
    expected = surfsig.find_instances(clouds, scene.cloud)
    with (
        model_of(c, front, above) as first,
        model_of(c, clouds["bracket"].points) as second,
        scan_of(c, scene.cloud.points, np.zeros(3)) as scan,
    ):
        check(found_by_c(c, [first, second], scan), expected, tuple(clouds))
        check(found_by_c(c, [first, second], scan, at_most=1), [expected[0]], tuple(clouds))
        assert found_by_c(c, [], scan) == []


def test_what_is_no_model_is_told(c: CInterface) -> None:
    with pytest.raises(Failed, match=f"^{INVALID}: a model needs 50 finite points at least, not 9"):
        model_of(c, np.zeros((9, 3))).__enter__()
    with pytest.raises(Failed, match=f"^{INVALID}: .* one place"):
        model_of(c, np.ones((90, 3))).__enter__()


def test_a_search_is_stopped(c: CInterface) -> None:
    points = finding_scene("figure", 2, copies=1, others=0).cloud.points
    with (
        model_of(c, whole("figure", 6000).points) as prepared,
        scan_of(c, np.ascontiguousarray(points)) as scan,
        pytest.raises(Failed, match=f"^{CANCELLED}: "),
    ):
        found_by_c(c, [prepared], scan, stop=1)
    with pytest.raises(Failed, match=f"^{CANCELLED}: "):
        model_of(c, np.ascontiguousarray(points), stop=1).__enter__()
