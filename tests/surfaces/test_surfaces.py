"""What is found in scenes of known surfaces: kinds, sizes, errors, and whose each point is."""

import math

import numpy as np
import pytest
import surface_scenes
from numpy.typing import NDArray
from surface_points import UTM, rotation

import surfsig
from surfsig import InvalidInputError, PointCloud, Surfaces
from surfsig.shapes.measured import measured_surface


def agreement(found: Surfaces, owners: NDArray[np.intp]) -> float:
    """Give the share of points that are with the most of their part's, each surface being one part's."""
    parts = {}
    for owner in np.unique(owners):
        labels = found.labels[owners == owner]
        parts[owner] = np.bincount(labels[labels >= 0]).argmax()
    assert len(set(parts.values())) == len(parts)
    return float((found.labels == np.vectorize(parts.get)(owners)).mean())


@pytest.fixture(scope="module")
def scene() -> surface_scenes.Known:
    return surface_scenes.on_a_plane()


@pytest.fixture(scope="module")
def found(scene: surface_scenes.Known) -> Surfaces:
    return surfsig.find_surfaces(scene.points)


def test_a_sphere_and_a_pipe_on_a_floor(scene: surface_scenes.Known, found: Surfaces) -> None:
    assert [surface.kind for surface in found] == ["plane", "cylinder", "sphere"]
    floor, pipe, ball = found
    assert agreement(found, scene.owners) > 0.99
    assert [pipe.radius, ball.radius] == pytest.approx([0.2, 0.3], rel=1e-3)
    np.testing.assert_allclose(ball.center, [0.6, 0, 0], atol=2e-4)
    np.testing.assert_array_equal(ball.center, ball.point)
    np.testing.assert_allclose(pipe.center, [-0.6, 0, 0.4], atol=5e-3)
    np.testing.assert_allclose(abs(pipe.axis), [0, 0, 1], atol=1e-3)
    np.testing.assert_allclose(abs(floor.axis), [0, 0, 1], atol=1e-4)
    assert abs(floor.center @ floor.axis) < 1e-3
    for surface in found:
        assert surface.rms == pytest.approx(0.001, rel=0.05)
        assert surface.deviation == pytest.approx(surface.rms, rel=1e-2)


def test_sizes(found: Surfaces) -> None:
    floor, pipe, ball = found
    assert [floor.length, floor.width] == pytest.approx([3, 3], rel=0.01)
    assert [pipe.length, pipe.arc] == pytest.approx([0.8, 2 * np.pi], rel=0.01)
    assert ball.arc == pytest.approx(np.pi, rel=0.05)
    assert floor.area == pytest.approx(9 - np.pi * (0.3**2 + 0.2**2), rel=0.03)
    assert pipe.area == pytest.approx(2 * np.pi * 0.2 * 0.8, rel=0.04)
    assert ball.area == pytest.approx(2 * np.pi * 0.3**2, rel=0.04)
    # What a kind has not is NaN, never 0.
    assert all(
        math.isnan(value) for value in (floor.radius, floor.arc, ball.length, pipe.width, pipe.half_angle)
    )
    assert np.isnan(ball.axis).all()


def test_a_radius_has_its_interval(found: Surfaces) -> None:
    for surface, radius in zip(found, (math.nan, 0.2, 0.3), strict=True):
        low, high = surface.interval
        if surface.kind == "plane":
            assert math.isnan(low)
            assert math.isnan(high)
        else:
            assert low < radius < high
        assert len(surface.covariance) == {"plane": 3, "cylinder": 5, "sphere": 4}[surface.kind]


def test_distances_are_those_of_the_members(scene: surface_scenes.Known, found: Surfaces) -> None:
    ball = found[2]
    expected = np.linalg.norm(scene.points - ball.center, axis=1) - ball.radius
    np.testing.assert_allclose(ball.distances(scene.points), expected, atol=1e-12)
    own = ball.distances(scene.points[found[2].members])
    assert np.sqrt((own**2).mean()) == pytest.approx(ball.rms)
    assert len(own) == ball.count


def test_a_box_has_six_planes() -> None:
    known = surface_scenes.box()
    found = surfsig.find_surfaces(known.points)
    assert [surface.kind for surface in found] == ["plane"] * 6
    assert agreement(found, known.owners) > 0.97
    for owner, (axis, sides) in enumerate(
        [(0, (1, 0.5)), (0, (1, 0.5)), (1, (2, 0.5)), (1, (2, 0.5)), (2, (2, 1)), (2, (2, 1))]
    ):
        labels = found.labels[known.owners == owner]
        side = found[int(np.bincount(labels[labels >= 0]).argmax())]
        np.testing.assert_allclose(abs(side.axis), np.eye(3)[axis], atol=2e-3)
        assert [side.length, side.width] == pytest.approx([sides[0], sides[1]], rel=0.03)


@pytest.mark.parametrize("half_angle", [0.3, 0.8])
def test_a_cone(half_angle: float) -> None:
    found = surfsig.find_surfaces(surface_scenes.cone(half_angle))
    assert [surface.kind for surface in found] == ["cone"]
    (cone,) = found
    assert cone.half_angle == pytest.approx(half_angle, rel=0.005)
    # It widens along its axis.
    np.testing.assert_allclose(cone.axis, [0, 0, 1], atol=3e-3)
    assert cone.radius == pytest.approx(cone.point[2] * np.tan(half_angle), rel=0.01)
    assert [cone.length, cone.arc] == pytest.approx([1, 2 * np.pi], rel=0.02)
    # The side of a frustum with the heights 0.5 and 1.5.
    assert cone.area == pytest.approx(np.pi * np.tan(half_angle) * 2 / np.cos(half_angle), rel=0.05)


def test_a_torus() -> None:
    found = surfsig.find_surfaces(surface_scenes.torus(1.0, 0.3))
    assert [surface.kind for surface in found] == ["torus"]
    (torus,) = found
    assert [torus.major_radius, torus.radius] == pytest.approx([1, 0.3], rel=2e-3)
    np.testing.assert_allclose(torus.center, [0, 0, 0], atol=1e-3)
    np.testing.assert_allclose(abs(torus.axis), [0, 0, 1], atol=2e-3)
    assert torus.length == pytest.approx(0.6, rel=0.02)
    assert torus.area == pytest.approx(4 * np.pi**2 * 0.3, rel=0.05)


def test_points_have_the_class_of_their_surface(scene: surface_scenes.Known, found: Surfaces) -> None:
    kinds = np.array([surfsig.PointClass[surface.kind.upper()] for surface in found])
    inside = found.labels >= 0
    np.testing.assert_array_equal(found.classes[inside], kinds[found.labels[inside]])
    distances = abs(found[2].distances(scene.points[found[2].members])) / found[2].deviation
    expected = 1 / (1 + np.exp((distances**2 - 9) / 2))
    np.testing.assert_allclose(found.confidence[found[2].members], expected, atol=1e-6)
    assert (found.confidence >= 0).all()
    assert (found.confidence <= 1).all()


def test_a_saddle_and_a_free_form() -> None:
    x, y = (np.mgrid[0:80, 0:80].reshape(2, -1) - 39.5) / 40
    noise = 1e-4 * np.random.default_rng(8).normal(size=x.shape)
    for sign, kind in ((-1, "SADDLE"), (1, "FREE_FORM")):
        bowl = np.column_stack([x, y, 0.3 * (x**2 + sign * 1.7 * y**2 + 0.3 * x**3) + noise])
        found = surfsig.find_surfaces(bowl, kinds=["plane"], min_points=2000)
        assert len(found) == 0
        share = (found.classes == surfsig.PointClass[kind]).mean()
        assert share > 0.9, kind


def test_edges_are_edges() -> None:
    """Of a box without large enough sides, the points at its edges, and few others."""
    known = surface_scenes.box(noise=1e-4)
    found = surfsig.find_surfaces(known.points, min_points=100_000, noise=1e-4)
    assert len(found) == 0
    to_side = np.sort(np.array([1, 0.5, 0.25]) - abs(known.points), axis=1)
    edge = found.classes == surfsig.PointClass.EDGE
    assert edge[to_side[:, 1] < 0.01].mean() > 0.95
    assert edge[to_side[:, 1] > 0.08].mean() < 0.02


def test_threads_and_repetition_do_not_matter(scene: surface_scenes.Known, found: Surfaces) -> None:
    for threads in (1, 2):
        again = surfsig.find_surfaces(scene.points, threads=threads)
        np.testing.assert_array_equal(again.labels, found.labels)
        assert [surface.radius for surface in again][1:] == [surface.radius for surface in found][1:]
        np.testing.assert_array_equal(again.confidence, found.confidence)


def test_the_order_of_points_hardly_matters(scene: surface_scenes.Known, found: Surfaces) -> None:
    order = np.random.default_rng(9).permutation(len(scene.points))
    shuffled = surfsig.find_surfaces(scene.points[order])
    assert [surface.kind for surface in shuffled] == [surface.kind for surface in found]
    assert (shuffled.labels == found.labels[order]).mean() > 0.995


def test_a_scan_at_utm_coordinates(scene: surface_scenes.Known, found: Surfaces) -> None:
    turn = rotation(np.random.default_rng(10))
    far = surfsig.find_surfaces(PointCloud(scene.points @ turn.T, UTM))
    assert [surface.kind for surface in far] == [surface.kind for surface in found]
    assert (far.labels == found.labels).mean() > 0.995
    assert far[2].radius == pytest.approx(found[2].radius, rel=1e-4)
    np.testing.assert_allclose(far[2].center, turn @ found[2].center + UTM, atol=1e-4)
    assert far[1].length == pytest.approx(found[1].length, rel=0.01)


def test_fields_for_files_and_tables(found: Surfaces) -> None:
    columns = found.columns()
    assert list(columns) == ["surface", "surface_kind", "point_class", "confidence", "deviation"]
    np.testing.assert_array_equal(columns["surface"], found.labels)
    np.testing.assert_array_equal(columns["surface_kind"] > 0, found.labels >= 0)
    colors = np.unique(found.colors, axis=0)
    assert len(colors) == len(found) + 1
    assert len(np.unique(found.colors[found[0].members], axis=0)) == 1
    frame = pytest.importorskip("pandas") and found.to_pandas()
    assert list(frame.kind) == ["plane", "cylinder", "sphere"]
    assert frame.radius[2] == found[2].radius
    assert math.isnan(frame.radius[0])
    assert list(frame.loc[2, ["center_x", "center_y", "center_z"]]) == list(found[2].center)


def test_only_some_kinds(scene: surface_scenes.Known) -> None:
    assert {surface.kind for surface in surfsig.find_surfaces(scene.points, kinds=["sphere", "plane"])} <= {
        "sphere",
        "plane",
    }
    for wrong in ("ball", [], ["plane", 3]):
        with pytest.raises(InvalidInputError, match="kinds must be"):
            surfsig.find_surfaces(scene.points, kinds=wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "wrong", [{"min_points": 0}, {"noise": 0}, {"noise": math.nan}, {"threads": 0}, {"min_points": 2.5}]
)
def test_arguments_without_a_meaning(scene: surface_scenes.Known, wrong: dict[str, float]) -> None:
    with pytest.raises(InvalidInputError, match=next(iter(wrong))):
        surfsig.find_surfaces(scene.points, **wrong)  # type: ignore[arg-type]


def test_the_errors_of_the_core_are_given_on() -> None:
    """A sphere as the core may describe it: the interval is Student's."""
    rng = np.random.default_rng(14)
    towards = rng.normal(size=(500, 3))
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    nothing = {"axis": np.full(3, np.nan), "major_radius": np.nan, "half_angle": np.nan}
    core = {"kind": "sphere", "point": UTM, "radius": 2.0, "deviation": 0.1, **nothing}
    errors = {"freedom": 10.0, "covariance": np.diag([1e-4, 1e-4, 1e-4, 1e-4])}
    members = np.arange(500)
    sphere = measured_surface({**core, **errors}, 2.1 * towards, UTM, members)
    assert sphere.radius_std == 0.01
    # t of 10 degrees of freedom at 0.975.
    assert sphere.interval == pytest.approx((2 - 0.0222814, 2 + 0.0222814), abs=1e-6)
    assert sphere.rms == pytest.approx(0.1)
    assert sphere.area == pytest.approx(4 * np.pi * 2**2, rel=0.08)
    np.testing.assert_array_equal(sphere.covariance, errors["covariance"])
    (row,) = Surfaces(PointCloud(2.1 * towards, UTM), np.zeros(500, np.int32), [sphere]).table()[1]
    assert row[2:4] == ("2.000", "1.978 to 2.022")
    assert sphere.to_dict()["interval"] == sphere.interval
    assert "major_radius" not in sphere.to_dict()
    without = measured_surface(core, 2.1 * towards, UTM, members)
    assert math.isnan(without.radius_std)
    assert without.covariance.shape == (4, 4)
    assert np.isnan(without.covariance).all()


def test_kinds_are_tried_the_simplest_first_in_whatever_order_they_are_asked_for() -> None:
    points = surface_scenes.box().points
    one = surfsig.find_surfaces(points, kinds=["torus", "plane"])
    other = surfsig.find_surfaces(points, kinds=["plane", "torus"])
    assert {surface.kind for surface in one} == {"plane"}
    np.testing.assert_array_equal(one.labels, other.labels)


def test_no_surface_has_fewer_points_than_asked_for() -> None:
    found = surfsig.find_surfaces(surface_scenes.box().points, min_points=200)
    assert all(surface.count >= 200 for surface in found)
    assert (np.bincount(found.labels[found.labels >= 0]) >= 200).all()
