"""Surfaces of sensors whose neighbouring points err alike, measure in steps, or see a point many times."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

import surfsig
from surfsig import Surfaces

SEED = 21
WALL, PIPE, BALL = 0, 1, 2
RADIUS = {PIPE: 0.12, BALL: 0.15}
Depths = NDArray[np.float64]


def camera() -> tuple[Depths, Depths, NDArray[np.intp]]:
    """Give rays (h, w, 3), depths (h, w) and the object of each pixel, seen by a camera at 0 along z.

    A wall that leans, an upright pipe and a ball before it.
    """
    v, u = np.mgrid[-0.4:0.4:200j, -0.53:0.53:265j]
    rays = np.stack([u, v, np.ones_like(u)], axis=-1)
    wall = 1.3 / (1 - 0.2 * u - 0.3 * v)
    # Nearest root of |p + t d|^2 = r^2: across the pipe's axis in x and z, of the ball in all.
    depths = [wall]
    for center, radius, across in (
        ([-0.25, 0, 1.0], RADIUS[PIPE], [0, 2]),
        ([0.25, 0.05, 1.0], RADIUS[BALL], [0, 1, 2]),
    ):
        d, c = rays[..., across], np.array(center)[across]
        a, b = (d * d).sum(axis=-1), d @ c
        root = b**2 - a * (c @ c - radius**2)
        with np.errstate(invalid="ignore"):
            near = (b - np.sqrt(root)) / a
        # The pipe is short, so that the wall hangs together above and below.
        depths.append(np.where((root > 0) & (np.abs(near * v) < 0.25), near, np.inf))
    return rays, np.min(depths, axis=0), np.argmin(depths, axis=0)


def check(found: Surfaces, owner: NDArray[np.intp], share: float, precision: float) -> None:
    """Each object is one surface, with most of its points and none of the others', of the right size."""
    kinds = {WALL: "plane", PIPE: "cylinder", BALL: "sphere"}
    for number, kind in kinds.items():
        labels = found.labels[owner == number]
        best = np.bincount(labels[labels >= 0]).argmax()
        surface = found.surfaces[best]
        assert surface.kind == kind
        assert (labels == best).mean() > share
        assert (owner[found.labels == best] == number).mean() > 0.98
        if number in RADIUS:
            assert surface.radius == pytest.approx(RADIUS[number], rel=precision)


def test_neighbours_err_alike() -> None:
    """As a stereo camera's do: what they have in common is four times what they differ by."""
    rng = np.random.default_rng(SEED)
    rays, depth, owner = camera()
    common = gaussian_filter(rng.normal(size=depth.shape), 4)
    noisy = depth + 0.002 * common / common.std() + 0.0005 * rng.normal(size=depth.shape)
    found = surfsig.find_surfaces((rays * noisy[..., None]).reshape(-1, 3))
    check(found, owner.ravel(), share=0.9, precision=0.05)
    assert len(found) <= 6


@pytest.mark.parametrize(("step", "jitter"), [(0.003, 0.3), (0.001, 0.3), (0.0009, 0.0), (0.0014, 0.0)])
def test_a_sensor_that_measures_in_steps(step: float, jitter: float) -> None:
    """As the first Kinect's depths do, in steps of 3 mm at one metre: no step is a surface."""
    rng = np.random.default_rng(SEED)
    rays, depth, owner = camera()
    stepped = 1 / (np.round(1 / depth / step + jitter * rng.normal(size=depth.shape)) * step)
    found = surfsig.find_surfaces((rays * stepped[..., None]).reshape(-1, 3))
    check(found, owner.ravel(), share=0.9, precision=0.03)
    assert len(found) <= 6


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.0008, 0.001, 0.0012, 0.0017])
def test_no_step_is_a_surface(step: float) -> None:
    """Nor where there is no noise but steps: two of them are a quadric, so that it looked like a model.

    The wall and the ball are found; the pipe, along whose columns depth is the same, may be in pieces.
    """
    rays, depth, owner = camera()
    stepped = 1 / (np.round(1 / depth / step) * step)
    found = surfsig.find_surfaces((rays * stepped[..., None]).reshape(-1, 3))
    assert len(found) <= 12
    for number, kind in ((WALL, "plane"), (BALL, "sphere")):
        labels = found.labels[owner.ravel() == number]
        best = np.bincount(labels[labels >= 0]).argmax()
        assert found.surfaces[best].kind == kind
        assert (labels == best).mean() > 0.9


def test_points_that_were_seen_many_times() -> None:
    """As a tablet's features are: short clumps along the line of sight."""
    rng = np.random.default_rng(SEED)
    rays, depth, owner = camera()
    seen = rng.permutation(depth.size)[:6000]
    times = 6
    depths = depth.ravel()[seen, None] + 0.004 * rng.normal(size=(len(seen), 1))
    depths = depths + 0.0003 * rng.normal(size=(len(seen), times))
    points = rays.reshape(-1, 3)[seen, None] * depths[..., None]
    found = surfsig.find_surfaces(points.reshape(-1, 3))
    check(found, np.repeat(owner.ravel()[seen], times), share=0.9, precision=0.05)


def test_errors_that_are_independent_stay_so() -> None:
    """Nothing is made coarser where neighbours do not err alike: a step of five deviations is seen."""
    rng = np.random.default_rng(SEED)
    x, y = rng.uniform(0, 1, (2, 20_000))
    upper = x > 0.5
    points = np.column_stack([x, y, 0.005 * upper + 0.001 * rng.normal(size=x.size)])
    found = surfsig.find_surfaces(points)
    assert [surface.kind for surface in found] == ["plane", "plane"]
    assert (found.labels[upper] == found.labels[upper][0]).mean() > 0.97
    assert found.labels[upper][0] != found.labels[~upper][0]
