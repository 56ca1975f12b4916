"""The C interface's surfaces, fits, transforms: values are Python's, bit for bit, or those of a formula."""

from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import byref, c_double, c_int32, c_size_t, c_uint8, c_uint32, c_void_p
from typing import Any

import numpy as np
import pytest
from c_interface import MOMENTS, PROGRESS, CInterface, Cylinder, Failed, Sphere, Transform, address
from numpy.typing import NDArray
from surface_points import UTM, rotation
from surface_scenes import cone, on_a_plane, torus

from surfsig import _surfsig, geometry
from surfsig.shapes import CURVE_KINDS, KINDS

UNDETERMINED, CANCELLED = 4, 5


@contextmanager
def found(c: CInterface, points: NDArray[Any], *, origin: Any = None, **how: Any) -> Iterator[c_void_p]:
    """Find surfaces."""
    f = c.functions
    options, made = c_void_p(f.surfsig_surface_options_new()), c_void_p(1)
    kinds = np.array(how.get("kinds", []), np.uint8)
    c.check(f.surfsig_surface_options_set_kinds(options, address(kinds), c_size_t(len(kinds))))
    c.check(f.surfsig_surface_options_set_min_points(options, c_uint32(how.get("min_points", 0))))
    c.check(f.surfsig_surface_options_set_noise(options, c_double(how.get("noise", 0.0))))
    c.check(f.surfsig_surface_options_set_threads(options, c_uint32(how.get("threads", 0))))
    call = PROGRESS(lambda *_: how.get("stop", 0))
    c.check(f.surfsig_surface_options_set_progress(options, call, c_void_p()))
    try:
        with c.cloud_of(points, origin=origin) as cloud:
            code = f.surfsig_find_surfaces(cloud, options, byref(made))
        assert (code == 0) == bool(made)
        c.check(code)
        yield made
    finally:
        f.surfsig_surface_options_free(options)
        f.surfsig_surfaces_free(made)


@pytest.fixture(scope="module")
def scene() -> NDArray[np.float64]:
    """Half a sphere and a pipe on the floor, a torus and a cone beside."""
    offsets = np.array([[4.0, 0.0, 0.5], [0.0, 4.0, 0.0]])
    points = np.concatenate([on_a_plane().points, torus(0.5, 0.15) + offsets[0], cone(0.4) + offsets[1]])
    points[11] = np.nan
    return np.ascontiguousarray(points)


@pytest.mark.parametrize(
    ("dtype", "origin", "how"),
    [
        (np.float64, None, {}),
        (np.float32, UTM, {"threads": 1}),
        (np.float64, None, {"kinds": [2, 0], "min_points": 300, "noise": 0.002}),
    ],
    ids=["default", "float32-utm", "chosen"],
)
def test_surfaces(
    c: CInterface, scene: NDArray[np.float64], dtype: Any, origin: Any, how: dict[str, Any]
) -> None:
    points = scene.astype(dtype)
    labels, entries, _, _ = _surfsig.find_surfaces(
        points,
        origin=[0.0, 0.0, 0.0] if origin is None else origin.tolist(),
        kinds=[KINDS[kind] for kind in how.get("kinds", range(5))],
        min_points=how.get("min_points"),
        noise=how.get("noise"),
    )
    f = c.functions
    with found(c, points, origin=origin, **how) as made:
        columns = c.columns("surfaces", made)
        assert f.surfsig_surfaces_size(made) == len(entries)
        assert f.surfsig_surfaces_label_count(made) == len(points)
        pointer = f.surfsig_surfaces_labels(made)
        own_labels = np.ctypeslib.as_array(pointer, (len(points),)).copy()
        covariances = []
        for index, entry in enumerate(entries):
            parameters = f.surfsig_surface_kind_parameters(c_uint8(KINDS.index(entry["kind"])))
            first = f.surfsig_surfaces_covariance(made, c_size_t(index))
            covariances.append(np.ctypeslib.as_array(first, (parameters, parameters)).copy())
        assert not f.surfsig_surfaces_covariance(made, c_size_t(len(entries)))
    assert {entry["kind"] for entry in entries} >= {KINDS[kind] for kind in how.get("kinds", range(5))}
    np.testing.assert_array_equal(own_labels, labels)
    assert own_labels.dtype == np.dtype(c_int32)
    for entry, covariance in zip(entries, covariances, strict=True):
        np.testing.assert_array_equal(covariance, entry["covariance"])
    for name, column in columns.items():
        assert column is not None
        if name == "kind":
            assert [KINDS[kind] for kind in column] == [entry["kind"] for entry in entries]
        else:
            expected = np.array([np.ravel(entry[name]) for entry in entries]).reshape(column.shape)
            np.testing.assert_array_equal(column, expected, err_msg=name)


def test_a_search_that_is_stopped(c: CInterface, scene: NDArray[np.float64]) -> None:
    with pytest.raises(Failed, match=f"{CANCELLED}: stopped by the caller"), found(c, scene, stop=1):
        pass


@contextmanager
def fitted(
    c: CInterface, points: NDArray[Any], kind: str, start: Any = None, **how: Any
) -> Iterator[c_void_p]:
    """Fit one surface."""
    made = c_void_p(1)
    with c.cloud_of(points, **how) as cloud:
        code = c.functions.surfsig_fit_primitive(cloud, c_uint8(KINDS.index(kind)), start, byref(made))
    assert (code == 0) == bool(made)
    c.check(code)
    try:
        yield made
    finally:
        c.functions.surfsig_primitive_free(made)


def points_of(kind: str) -> NDArray[np.float64]:
    """Noisy points of a surface of a kind, (n, 3)."""
    known = on_a_plane()
    part = {"sphere": 0, "cylinder": 1, "plane": 2}
    if kind in part:
        return np.ascontiguousarray(known.points[known.owners == part[kind]])
    return torus(0.5, 0.15) if kind == "torus" else cone(0.4)


@pytest.mark.parametrize("kind", KINDS)
def test_fits(c: CInterface, kind: str) -> None:
    points, f = points_of(kind), c.functions
    half = points[::2].copy()
    expected = _surfsig.fit_primitive(points, kind)
    assert expected is not None
    with fitted(c, points, kind) as made, fitted(c, half, kind, made) as again:
        values = [
            np.ctypeslib.as_array(f.surfsig_primitive_point(made), (3,)).copy(),
            np.ctypeslib.as_array(f.surfsig_primitive_axis(made), (3,)).copy(),
            f.surfsig_primitive_radius(made),
        ]
        for value, name in zip(values, ("point", "axis", "radius"), strict=True):
            np.testing.assert_array_equal(value, getattr(expected, name), err_msg=name)
        assert f.surfsig_primitive_kind(made) == KINDS.index(kind)
        assert np.isnan(f.surfsig_primitive_major_radius(made)) == (kind != "torus")
        assert np.isnan(f.surfsig_primitive_half_angle(made)) == (kind != "cone")
        from_start = _surfsig.fit_primitive(half, kind, expected)
        assert from_start is not None
        np.testing.assert_array_equal(f.surfsig_primitive_radius(again), from_start.radius)
        # Python does not give a torus's and a cone's other sizes: the distances tell them.
        distances = np.full(len(points), 7.0)
        parameters = f.surfsig_surface_kind_parameters(c_uint8(KINDS.index(kind)))
        covariance, across, freedom = np.full((parameters, parameters), 7.0), np.full((2, 3), 7.0), c_double()
        with c.cloud_of(points) as cloud:
            c.check(f.surfsig_primitive_distances(made, cloud, address(distances)))
            c.check(
                f.surfsig_primitive_uncertainty(
                    made, cloud, address(covariance), address(across), byref(freedom)
                )
            )
            assert f.surfsig_primitive_independent_error(made, cloud) == expected.independent_error(points)
    np.testing.assert_array_equal(distances, expected.distances(points))
    for own, other in zip((covariance, across, freedom.value), expected.uncertainty(points), strict=True):
        np.testing.assert_array_equal(own, other)


@contextmanager
def known(c: CInterface, **values: Any) -> Iterator[c_void_p]:
    """Make options of a fit."""
    f = c.functions
    options = c_void_p(f.surfsig_primitive_options_new())
    try:
        if "weights" in values:
            weights = values["weights"]
            c.check(
                f.surfsig_primitive_options_set_weights(options, address(weights), c_size_t(len(weights)))
            )
        if "radius" in values:
            c.check(f.surfsig_primitive_options_set_radius(options, c_double(values["radius"])))
        if "axis" in values:
            c.check(f.surfsig_primitive_options_set_axis(options, (c_double * 3)(*values["axis"])))
        yield options
    finally:
        f.surfsig_primitive_options_free(options)


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("sphere", {"radius": 0.31}),
        ("cylinder", {"radius": 0.2, "axis": [0.0, 0.0, 1.0]}),
        ("cone", {"axis": [0.0, 0.0, 2.0], "weighted": True}),
        ("plane", {"weighted": True}),
    ],
)
def test_fits_where_something_is_known(c: CInterface, kind: str, values: dict[str, Any]) -> None:
    points, f = points_of(kind), c.functions
    given = {name: value for name, value in values.items() if name != "weighted"}
    if "weighted" in values:
        given["weights"] = np.random.default_rng(9).integers(0, 3, len(points)).astype(np.float64)
    arguments = (given.get("weights"), given.get("radius"), given.get("axis"))
    expected = _surfsig.fit_primitive(points, kind, None, *arguments)
    assert expected is not None
    made, number = c_void_p(1), c_uint8(KINDS.index(kind))
    parameters = f.surfsig_surface_kind_parameters(number)
    covariance = np.full((parameters, parameters), 7.0)
    with known(c, **given) as options, c.cloud_of(points) as cloud:
        c.check(f.surfsig_fit_primitive_with(cloud, number, options, byref(made)))
        c.check(
            f.surfsig_primitive_uncertainty_with(
                made, cloud, options, address(covariance), c_void_p(), c_void_p()
            )
        )
        point = np.ctypeslib.as_array(f.surfsig_primitive_point(made), (3,)).copy()
        radius = f.surfsig_primitive_radius(made)
        f.surfsig_primitive_free(made)
    np.testing.assert_array_equal(point, expected.point)
    np.testing.assert_array_equal(radius, expected.radius)
    np.testing.assert_array_equal(covariance, expected.uncertainty(points, *arguments)[0])


def test_what_is_known_must_suit_the_kind_and_the_points(c: CInterface) -> None:
    points, made = points_of("cone"), c_void_p(1)
    wrong: dict[str, dict[str, Any]] = {
        "a cone keeps no radius": {"radius": 1.0},
        "weights must be one of each of the 6000 points, not 2": {"weights": np.ones(2)},
    }
    for message, values in wrong.items():
        with known(c, **values) as options, c.cloud_of(points) as cloud:
            code = c.functions.surfsig_fit_primitive_with(
                cloud, c_uint8(KINDS.index("cone")), options, byref(made)
            )
            with pytest.raises(Failed, match=message):
                c.check(code)
            assert not made


def test_a_fit_of_points_with_an_origin_is_elsewhere(c: CInterface) -> None:
    points = points_of("sphere")
    with fitted(c, points, "sphere") as here, fitted(c, points, "sphere", origin=UTM) as there:
        point = [
            np.ctypeslib.as_array(c.functions.surfsig_primitive_point(made), (3,)) for made in (here, there)
        ]
        np.testing.assert_allclose(point[1] - UTM, point[0], atol=1e-8)


def test_points_that_determine_nothing(c: CInterface) -> None:
    circle = np.column_stack([np.cos(np.arange(9.0)), np.sin(np.arange(9.0)), np.zeros(9)])
    message = f"{UNDETERMINED}: the points determine no sphere"
    with pytest.raises(Failed, match=message), fitted(c, circle, "sphere"):
        pass


def test_fits_off_moments(c: CInterface) -> None:
    f = c.functions
    turned = rotation(np.random.default_rng(8))
    # Noiseless points, on which Taubin's fits are exact.
    t, h = np.random.default_rng(9).uniform(0, 2, (2, 300))
    ball = 0.5 * np.column_stack([np.cos(t) * np.cos(h), np.sin(t) * np.cos(h), np.sin(h)]) + UTM
    pipe = np.column_stack([0.25 * np.cos(t), 0.25 * np.sin(t), h]) @ turned.T + UTM
    sums = {}
    for name, points in (("ball", ball), ("pipe", pipe)):
        # Two halves, whose moments add; a point that is not finite is left out.
        halves = np.zeros((2, MOMENTS))
        centre = (c_double * 3)(*UTM)
        for half, part in zip(halves, (points[:100], points[100:]), strict=True):
            rows = np.vstack([part, [[np.nan, 0.0, 0.0]]])
            with c.cloud_of(rows) as cloud:
                c.check(f.surfsig_moments(cloud, centre, address(half)))
        sums[name] = halves.sum(axis=0)
        x, y, z = (points - UTM).T
        expected = [len(x), x.sum(), y.sum(), z.sum(), (x * x).sum(), (x * y).sum(), (x * z).sum()]
        np.testing.assert_allclose(sums[name][:7], expected, rtol=1e-12)
        assert sums[name][-1] == pytest.approx((z**4).sum(), rel=1e-12)
    sphere, cylinder, quadric, at = Sphere(), Cylinder(), np.zeros(13), np.zeros(11)
    c.check(f.surfsig_fit_sphere(address(sums["ball"]), byref(sphere)))
    assert sphere.radius == pytest.approx(0.5, abs=1e-7)
    np.testing.assert_allclose(sphere.centre[:], 0, atol=1e-7)
    c.check(f.surfsig_fit_cylinder(address(sums["pipe"]), byref(cylinder)))
    assert cylinder.radius == pytest.approx(0.25, abs=1e-7)
    assert abs(np.dot(cylinder.axis[:], turned[:, 2])) == pytest.approx(1, abs=1e-9)
    c.check(f.surfsig_fit_quadric(address(sums["ball"]), address(quadric)))
    # Towards the middle of the points, where the surface is one nearest point.
    place = np.array([0.3, 0.3, 0.4])
    c.check(f.surfsig_quadric_nearest(address(quadric), address(place), address(at)))
    np.testing.assert_allclose(at[:3], 0.5 * place / np.linalg.norm(place), atol=1e-5)
    np.testing.assert_allclose(np.abs(at[6:8]), 2, atol=1e-4)


def test_transforms(c: CInterface) -> None:
    f, rng = c.functions, np.random.default_rng(12)
    twists = rng.normal(size=(2, 6))
    poses = [geometry.exp_twist(twist) for twist in twists]
    a_b, b_c = (Transform.of(pose) for pose in poses)
    result, numbers, adjoint = Transform(), np.zeros(6), np.zeros((6, 6))
    c.check(f.surfsig_transform_exp(address(twists[0].copy()), byref(result)))
    np.testing.assert_allclose(result.array(), poses[0], atol=1e-15)
    c.check(f.surfsig_transform_compose(byref(a_b), byref(b_c), byref(result)))
    np.testing.assert_allclose(result.array(), poses[0] @ poses[1], atol=1e-14)
    c.check(f.surfsig_transform_inverse(byref(a_b), byref(result)))
    np.testing.assert_allclose(result.array(), np.linalg.inv(poses[0]), atol=1e-14)
    c.check(f.surfsig_transform_log(byref(a_b), address(numbers)))
    np.testing.assert_allclose(numbers, twists[0], atol=1e-13)
    c.check(f.surfsig_transform_adjoint(byref(a_b), address(adjoint)))
    np.testing.assert_allclose(adjoint, geometry.adjoint(poses[0]), atol=1e-14)
    vector, translation = twists[0, :3].copy(), twists[0, 3:].copy()
    c.check(f.surfsig_transform_from_rotation_vector(address(vector), address(translation), byref(result)))
    np.testing.assert_allclose(result.array(), geometry.from_rotation_vector(vector, translation), atol=1e-15)
    np.testing.assert_array_equal(f.surfsig_transform_identity().array(), np.eye(4))


def test_transforms_of_points_may_be_in_their_place(c: CInterface) -> None:
    f, rng = c.functions, np.random.default_rng(13)
    pose = geometry.exp_twist(rng.normal(size=6))
    # Four doubles a point, and packed.
    wide = np.full((50, 4), np.nan)
    wide[:, :3] = rng.normal(size=(50, 3))
    moved = np.zeros((50, 3))
    transform = byref(Transform.of(pose))
    count = c_size_t(50)
    c.check(f.surfsig_transform_points(transform, address(wide), count, c_size_t(32), address(moved)))
    np.testing.assert_allclose(moved, wide[:, :3] @ pose[:3, :3].T + pose[:3, 3], atol=1e-14)
    packed = np.ascontiguousarray(wide[:, :3])
    c.check(f.surfsig_transform_points(transform, address(packed), count, c_size_t(24), address(packed)))
    np.testing.assert_array_equal(packed, moved)
    c.check(f.surfsig_transform_vectors(transform, address(wide), count, c_size_t(32), address(moved)))
    np.testing.assert_allclose(moved, wide[:, :3] @ pose[:3, :3].T, atol=1e-14)


def test_a_printed_matrix_is_the_rotation_next_to_it(c: CInterface) -> None:
    f = c.functions
    pose = geometry.exp_twist(np.array([0.3, -0.2, 0.1, 1.0, 2.0, 3.0]))
    result = Transform()
    printed = np.round(pose, 4)
    c.check(f.surfsig_transform_from_matrix(address(printed), byref(result)))
    found_rotation = result.array()[:3, :3]
    np.testing.assert_allclose(found_rotation, pose[:3, :3], atol=1e-4)
    np.testing.assert_allclose(found_rotation.T @ found_rotation, np.eye(3), atol=1e-14)
    c.check(f.surfsig_transform_from_matrix(address(pose), byref(result)))
    np.testing.assert_array_equal(result.array(), pose)
    for wrong, message in (
        (np.diag([1.0, 1, -1, 1]), "not mirror"),
        (2 * pose, "0, 0, 0, 1 in its last row"),
    ):
        with pytest.raises(Failed, match=message):
            c.check(f.surfsig_transform_from_matrix(address(wrong.copy()), byref(result)))


def test_kinds(c: CInterface) -> None:
    kinds = (*KINDS, *CURVE_KINDS)
    names = [c.functions.surfsig_surface_kind_name(c_uint8(kind)) for kind in range(len(kinds))]
    assert names == [kind.encode() for kind in kinds]
    parameters = [c.functions.surfsig_surface_kind_parameters(c_uint8(kind)) for kind in range(len(kinds))]
    assert dict(zip(kinds, parameters, strict=True)) == _surfsig.KIND_PARAMETERS
