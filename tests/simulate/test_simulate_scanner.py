"""The scanner: geometry, shadows, noise, rounding, outliers, handedness, seeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from surfsig import simulate as sim
from surfsig.errors import InvalidInputError

EXACT = sim.Scanner(noise=0.0, row_step=0.0, outlier_rate=0.0)
TABLE = sim.Placed(sim.Rectangle((0.2, 0.2)), sim.pose((0, 0, 0), sim.facing(sim.UP)), "table")


def on_table(radius: float, x: float = 0.0, y: float = 0.0) -> sim.Placed:
    return sim.Placed(sim.Sphere(radius), sim.pose((x, y, -radius)), "ball")


def mixed_scene() -> sim.Scene:
    field = sim.HeightField.random(5, size=(0.04, 0.04), rms=0.002, wavelengths=(0.015, 0.04))
    return sim.Scene(
        [
            TABLE,
            on_table(0.02, -0.025, 0.02),
            sim.Placed(sim.Box((0.02, 0.03, 0.025)), sim.pose((0.03, 0.02, -0.0125), sim.turn(sim.UP, 0.4))),
            sim.Placed(
                sim.Cylinder(0.008, 0.05), sim.pose((-0.02, -0.03, -0.02), sim.facing((1.0, 0.3, -0.2)))
            ),
            sim.Placed(sim.Cone(0.015, 0.03), sim.pose((0.0, 0.045, 0.0), sim.facing(sim.UP))),
            sim.Placed(field, sim.pose((0.03, -0.03, -0.012), sim.facing((0.2, 0.1, -1.0)))),
        ]
    )


def test_triangle_of_laser_camera_and_reference_point() -> None:
    s = EXACT
    laser, camera = s.laser_at(np.zeros(1))[0], s.camera_at(np.zeros(1))[0]
    assert laser[1] - camera[1] == pytest.approx(s.baseline)
    assert np.arctan2(-camera[1], -camera[2]) == pytest.approx(s.triangulation_angle)
    # The laser's centre lies in the camera's principal plane: square to the camera's axis.
    assert (laser - camera) @ -camera == pytest.approx(0.0, abs=1e-15)
    # The row is that of a pinhole camera that looks at the reference point.
    axis = -camera / np.linalg.norm(camera)
    down = np.cross((1.0, 0.0, 0.0), axis)
    z = np.array([-0.1, -0.03, 0.0, 0.015])
    spots = np.column_stack([np.full(4, 0.02), np.zeros(4), z]) - camera
    expected = -(spots @ down) / (spots @ axis) * s.camera_distance / s.pixel
    np.testing.assert_allclose(np.abs(s.row_of(z)), np.abs(expected), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(s.z_of(s.row_of(z)), z, atol=1e-16)
    assert s.z_of(np.array([1.0]))[0] == pytest.approx(s.height_per_row, rel=1e-3)


def test_spacing_on_the_reference_plane() -> None:
    p = EXACT.scan(sim.Scene([TABLE]), 0).points
    assert len(p) == 241 * 241
    np.testing.assert_allclose(np.unique(p[:, 1].round(12)), np.arange(-120, 121) * 5e-4, atol=1e-12)
    np.testing.assert_allclose(np.unique(p[:, 0].round(12)), np.arange(-120, 121) * 5e-4, atol=1e-12)
    np.testing.assert_allclose(p[:, 2], 0.0, atol=1e-15)


def test_exact_scan_lies_on_the_surfaces_with_true_fields() -> None:
    scene = mixed_scene()
    cloud = EXACT.scan(scene, 0, truth=True)
    label = cloud.fields["surface"]
    assert set(np.unique(label)) == set(range(6))
    for index, placed in enumerate(scene.objects):
        own = cloud.points[label == index]
        assert np.abs(placed.implicit(own)).max() < 1e-12
    ball = label == 1
    np.testing.assert_allclose(cloud.fields["true_k1"][ball], 50.0)
    np.testing.assert_allclose(cloud.fields["true_k2"][ball], 50.0)
    normals = np.column_stack([cloud.fields[f"true_n{a}"] for a in "xyz"])
    radial = (cloud.points[ball] - scene.objects[1].pose[:3, 3]) / 0.02
    np.testing.assert_allclose(normals[ball], radial, atol=1e-12)
    np.testing.assert_allclose(
        normals[label == 0], np.tile((0.0, 0.0, -1.0), (np.sum(label == 0), 1)), atol=1e-15
    )


def test_every_point_is_lit_and_seen() -> None:
    """By brute force: nothing of any surface lies between a point and the laser, or the camera."""
    scene = mixed_scene()
    cloud = EXACT.scan(scene, 0)
    rng = np.random.default_rng(0)
    chosen = cloud.points[rng.choice(len(cloud), 400, replace=False)]
    field = scene.objects[5]
    for eyes in (EXACT.laser_at(chosen[:, 1]), EXACT.camera_at(chosen[:, 1])):
        side_before = np.zeros(len(chosen))
        for share in np.linspace(0.6, 0.998, 600):
            between = eyes + share * (chosen - eyes)
            for solid in scene.objects[1:5]:
                assert (solid.implicit(between) > 0.0).all()
            # The wavy sheet may be passed by, but not crossed: over it, a ray stays on one side.
            over = (np.abs(sim.transform_points(sim.inverse(field.pose), between)[:, :2]) < 0.02).all(axis=1)
            side = np.where(over, np.sign(field.implicit(between)), 0.0)
            assert (side * side_before >= 0.0).all()
            side_before = side
    # And enough was dropped for this to mean something: each hidden spot has something in its way.
    origins, directions = EXACT.laser_rays()
    hits = scene.cast(origins, directions)
    assert scene.hidden(EXACT.camera_at(origins[:, 1]), hits.points).sum() > 500


def test_shadow_of_a_sphere_has_the_predicted_width() -> None:
    """In the plane x = 0, laser and camera each cast a shadow bounded by a tangent to the circle."""
    radius = 0.02
    s = replace(EXACT, sheet_step=1e-4, field_width=0.002, scan_length=0.15)
    cloud = s.scan(sim.Scene([TABLE, on_table(radius)]), 0)
    table = cloud.points[(cloud.fields["surface"] == 0) & (np.abs(cloud.points[:, 0]) < 1e-9), 1]
    # The laser moves with the sheet and shines straight down there: its shadow is the silhouette, |y| <= r.
    assert table[table < 0.0].max() == pytest.approx(-radius, abs=1.01e-4)
    # The camera sees z = 0 along one fixed slope a: the tangent to the ball with that slope passes its
    # centre, r above the table, at the distance r, and so meets the table r tan a + r / cos a behind it.
    a = s.triangulation_angle
    far = radius * np.tan(a) + radius / np.cos(a)
    assert table[table > 0.0].min() == pytest.approx(far, abs=1.01e-4)


def test_incidence_and_depth_of_field_end_the_scan() -> None:
    s = replace(EXACT, depth_range=(-0.036, 0.001), max_incidence=np.radians(50.0))
    cloud = s.scan(sim.Scene([TABLE, on_table(0.02)]), 0, truth=True)
    ball = cloud.fields["surface"] == 1
    assert cloud.points[ball, 2].min() == pytest.approx(-0.036, abs=4e-4)
    normals = np.column_stack([cloud.fields[f"true_n{a}"] for a in "xyz"])
    steepest = 0.0
    for eyes in (s.laser_at(cloud.points[:, 1]), s.camera_at(cloud.points[:, 1])):
        sight = eyes - cloud.points
        cosine = np.einsum("ij,ij->i", sight, normals) / np.linalg.norm(sight, axis=1)
        steepest = max(steepest, float(np.degrees(np.arccos(cosine.min()))))
    assert 48.0 < steepest <= 50.0 + 1e-9


def test_noise_has_the_stated_deviation_and_stays_on_the_laser_ray() -> None:
    s = replace(EXACT, noise=1e-4)
    p = s.scan(sim.Scene([TABLE]), 5).points
    assert p[:, 2].std() == pytest.approx(1e-4, rel=0.01)
    assert abs(p[:, 2].mean()) < 4e-4 / np.sqrt(len(p)) + 1e-6
    z = p[:, 2] / 1e-4
    assert np.mean(z**4) / np.mean(z**2) ** 2 == pytest.approx(3.0, abs=0.1)
    tangent = p[:, 0] / (p[:, 2] + s.laser_height)
    columns = tangent * s.laser_height / 5e-4
    np.testing.assert_allclose(columns, columns.round(), atol=1e-9)
    # Gaussian in the row, so it follows the height of a row: compare a plate 60 mm up.
    high = sim.Placed(sim.Rectangle((0.2, 0.2)), sim.pose((0, 0, -0.06), sim.facing(sim.UP)))
    up = s.scan(sim.Scene([high]), 5).points[:, 2]
    per_row = np.diff(s.z_of(s.row_of(np.array([-0.06])) + np.array([-0.5, 0.5])))[0]
    assert up.std() == pytest.approx(1e-4 * per_row / s.height_per_row, rel=0.01)


@pytest.mark.parametrize("step", [1.0, 1 / 8])
def test_rows_are_rounded_to_the_stated_step(step: float) -> None:
    slope = sim.Placed(sim.Rectangle((0.1, 0.1)), sim.pose((0, 0, -0.03), sim.facing((0.3, 0.2, -1.0))))
    s = replace(EXACT, row_step=step)
    cloud, exact = s.scan(sim.Scene([slope]), 0), EXACT.scan(sim.Scene([slope]), 0)
    rows = s.row_of(cloud.points[:, 2])
    np.testing.assert_allclose(rows / step, np.round(rows / step), atol=1e-8)
    error = (rows - s.row_of(exact.points[:, 2])) / step
    assert np.abs(error).max() <= 0.5 + 1e-8
    assert error.std() == pytest.approx(1 / np.sqrt(12), rel=0.02)


def test_outliers_have_the_stated_rate_and_size() -> None:
    s = replace(EXACT, outlier_rate=0.02, outlier_height=0.004)
    cloud = s.scan(sim.Scene([TABLE]), 1)
    bad = cloud.fields["outlier"] == 1
    assert bad.mean() == pytest.approx(0.02, abs=4 * np.sqrt(0.02 * 0.98 / len(cloud)))
    assert np.abs(cloud.points[~bad, 2]).max() < 1e-15
    assert np.abs(cloud.points[bad, 2]).max() < 0.004 + 1e-12
    assert cloud.points[bad, 2].std() == pytest.approx(0.004 / np.sqrt(3), rel=0.05)


def test_seeds() -> None:
    scene, s = mixed_scene(), sim.Scanner()
    a, b, c = (s.scan(scene, seed, truth=True) for seed in (7, 7, 8))
    assert a.offsets.tobytes() == b.offsets.tobytes()
    for name in a.fields:
        assert a.fields[name].tobytes() == b.fields[name].tobytes()
    assert len(a) == len(c)
    assert (a.points[:, 2] != c.points[:, 2]).mean() > 0.7


@pytest.mark.parametrize("centre", [(0.0, 0.0), pytest.param((0.03, -0.02), marks=pytest.mark.slow)])
def test_a_bump_towards_the_sensor_has_positive_second_derivatives(centre: tuple[float, float]) -> None:
    radius = 0.03
    cloud = replace(EXACT, column_step=2, sheet_step=2e-4).scan(
        sim.Scene([TABLE, on_table(radius, *centre)]), 0
    )
    p = cloud.points - (*centre, -2 * radius)
    p = p[np.linalg.norm(p, axis=1) < 0.002]
    x, y, z = p.T
    a, b, c, d, e, f = np.linalg.lstsq(np.stack([x * x, y * y, x, y, x * y, x**0], axis=1), z, rcond=None)[0]
    assert a == pytest.approx(1 / (2 * radius), rel=0.01)
    assert b == pytest.approx(1 / (2 * radius), rel=0.01)
    np.testing.assert_allclose([c, d, e], 0.0, atol=0.02)
    assert f == pytest.approx(0.0, abs=1e-6)
    # The apex is the smallest z: heights grow along negative z, and the sensor stands beyond.
    assert cloud.points[:, 2].min() == pytest.approx(-2 * radius, abs=1e-6)
    assert cloud.viewpoint is not None
    assert cloud.viewpoint[2] == pytest.approx(-0.12 / np.sin(np.radians(25)) / np.cos(np.radians(25)))


@pytest.mark.slow
def test_part_has_its_surfaces_and_curvatures() -> None:
    scene = sim.part_scene()
    cloud = sim.part(3, truth=True)
    assert 150_000 < len(cloud) < 250_000
    label = cloud.fields["surface"]
    assert np.bincount(label, minlength=len(scene.names)).min() > 300
    mean = (cloud.fields["true_k1"] + cloud.fields["true_k2"]) / 2
    expected = {
        "plate": 0.0,
        "pipe, r 10 mm": 50.0,
        "dome, r 30 mm": 1000 / 30,
        "groove, r -12 mm": -1000 / 24,
        "dimple, r -25 mm": -40.0,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(mean[label == scene.names.index(name)], value, rtol=1e-12)
    clean = cloud.fields["outlier"] == 0
    for index, placed in enumerate(scene.objects):
        own = cloud.points[clean & (label == index)]
        assert np.abs(placed.implicit(own)).max() < 6 * sim.PART_SCANNER.noise
    dimple = scene.names.index("dimple, r -25 mm")
    assert cloud.points[clean & (label == dimple), 2].max() == pytest.approx(0.008, abs=2e-4)


@pytest.mark.parametrize(
    "bad",
    [
        {"baseline": 0.0},
        {"triangulation_angle": 2.0},
        {"noise": -1.0},
        {"noise": np.nan},
        {"outlier_rate": 1.5},
        {"depth_range": (0.1, 0.0)},
        {"depth_range": (-1.0, 0.0)},
    ],
)
def test_bad_scanner_is_one_line(bad: dict[str, object]) -> None:
    with pytest.raises(InvalidInputError) as caught:
        sim.Scanner(**bad)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
