"""A camera that finds depth by disparity: its errors are as large as it says."""

import numpy as np
import pytest

import surfsig
from surfsig import simulate
from surfsig.simulate.ellipsoid import Ellipsoid

SMALL = simulate.StereoCamera(
    width=160,
    height=120,
    focal=144.0,
    disparity_step=0.0,
    smoothing=0.0,
    bleeding=0.0,
    mixed=0.0,
    dropout=0.0,
)


def wall(depth: float) -> simulate.Scene:
    return simulate.Scene(
        [simulate.Placed(simulate.Plane(), simulate.pose((0.0, 0.0, depth), simulate.facing(simulate.UP)))]
    )


def ball_before_wall() -> simulate.Scene:
    ball = simulate.Placed(simulate.Sphere(0.1), simulate.pose((0.0, 0.0, 0.8)))
    return simulate.Scene([ball, *wall(1.2).objects])


@pytest.mark.parametrize("depth", [1.0, 2.0])
def test_range_noise_grows_with_the_square_of_the_distance(depth: float) -> None:
    z = SMALL.scan(wall(depth), seed=1).points[:, 2]
    expected = depth**2 * SMALL.disparity_noise / (SMALL.focal * SMALL.baseline)
    assert np.isclose(np.nanstd(z), expected, rtol=0.05)
    assert np.isclose(np.nanmedian(z), depth, atol=expected / 10)


def test_disparities_come_in_steps() -> None:
    camera = simulate.StereoCamera(width=80, height=60, focal=72.0, disparity_step=0.25)
    z = camera.scan(wall(1.5), seed=2).points[:, 2].astype(float)
    steps = camera.focal * camera.baseline / z[np.isfinite(z)] / 0.25
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-4)


def test_smoothing_makes_the_noise_of_neighbours_alike() -> None:
    camera = simulate.StereoCamera(width=160, height=120, focal=144.0, disparity_step=0.0, dropout=0.0)
    z = camera.scan(wall(1.0), seed=3).points[:, 2].reshape(120, 160)
    rough = SMALL.scan(wall(1.0), seed=3).points[:, 2].reshape(120, 160)

    def alike(depth: np.ndarray) -> float:
        pairs = np.stack([depth[:, 1:].ravel(), depth[:, :-1].ravel()])
        return float(np.corrcoef(pairs[:, np.isfinite(pairs).all(axis=0)])[0, 1])

    assert alike(z) > 0.5
    assert abs(alike(rough)) < 0.05


def test_what_the_second_camera_does_not_see_is_a_hole() -> None:
    cloud = SMALL.scan(ball_before_wall(), seed=1)
    surface, z = cloud.fields["surface"], cloud.points[:, 2]
    holes = np.isnan(z).reshape(120, 160)
    of_wall = (surface == 1).reshape(120, 160)
    # The second camera is to the right: it does not see what is hidden to the left of the ball.
    assert (holes & of_wall)[:, :80].sum() > 100
    assert (holes & of_wall)[:, 85:].sum() < 10
    assert np.isfinite(z[surface == 0]).mean() > 0.8


def test_steep_surfaces_and_dark_ones_have_holes() -> None:
    bright = SMALL.scan(ball_before_wall(), seed=4, reflectance=[1.0, 1.0])
    dark = SMALL.scan(ball_before_wall(), seed=4, reflectance=[0.2, 1.0])
    on_ball = bright.fields["surface"] == 0
    share = [np.isnan(cloud.points[on_ball, 2]).mean() for cloud in (bright, dark)]
    assert 0.02 < share[0] < 0.25
    assert share[1] > share[0] + 0.1


def test_outlines_bleed_and_mix_only_near_outlines() -> None:
    clean = SMALL.scan(ball_before_wall(), seed=5)
    camera = simulate.StereoCamera(
        width=160, height=120, focal=144.0, disparity_step=0.0, smoothing=0.0, dropout=0.0
    )
    worn = camera.scan(ball_before_wall(), seed=5)
    off = np.abs(worn.points[:, 2] - clean.points[:, 2]) > 0.1
    assert off.sum() > 20
    pixel = np.argwhere(off.reshape(120, 160))
    radius = np.linalg.norm(pixel - [59.5, 79.5], axis=1)
    # The ball's outline is at 18 pixels; the hole beside it reaches further.
    assert radius.min() > 10
    assert radius.max() < 40


def test_the_same_seed_gives_the_same_image_and_mistakes_are_told() -> None:
    one, same, other = (SMALL.scan(ball_before_wall(), seed=seed).points for seed in (6, 6, 7))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)
    with pytest.raises(surfsig.InvalidInputError, match="2 numbers between 0 and 1"):
        SMALL.scan(ball_before_wall(), reflectance=[1.0, 2.0])
    with pytest.raises(surfsig.InvalidInputError, match="2 numbers"):
        SMALL.scan(ball_before_wall(), reflectance=[1.0])


@pytest.mark.parametrize(
    "surface",
    [
        simulate.Sphere(0.3),
        simulate.Cylinder(0.1, 0.4),
        simulate.Cone(0.2, 0.3, 0.1),
        simulate.Box((0.1, 0.2, 0.3)),
        simulate.Rectangle((0.3, 0.2)),
        Ellipsoid((0.1, 0.2, 0.3)),
    ],
)
def test_rays_that_are_left_out_meet_nothing(surface: simulate.Surface) -> None:
    rng = np.random.default_rng(8)
    placed = simulate.Placed(surface, simulate.pose((0.3, -0.2, 5.0), simulate.turn((1, 2, 3), 0.7)))
    origins = rng.uniform(-1.0, 1.0, (4000, 3))
    directions = np.array([0.3, -0.2, 5.0]) + rng.uniform(-0.6, 0.6, (4000, 3)) - origins
    met = np.isfinite(placed.crossings(origins, directions)).any(axis=0)
    near = np.zeros(4000, np.bool_)
    near[placed.near(origins, directions)] = True
    assert 50 < met.sum() < near.sum() < 4000
    assert near[met].all()
