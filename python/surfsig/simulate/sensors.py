"""Sensors that stand somewhere and look around: spinning lidars and depth cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InvalidInputError
from ..geometry import pose_array
from ..point_cloud import PointCloud
from .poses import Array
from .scene import Scene

_EDGE = 0.05
"""Share of the range by which two neighbouring returns differ at an edge."""


@dataclass(frozen=True)
class Lidar:
    """A lidar that turns about its z axis. Angles are in degrees, lengths in metres.

    Parameters
    ----------
    lines
        Lasers, evenly spread in elevation.
    elevation
        Of the lowest and the highest laser.
    steps
        Directions from the first to the last.
    noise
        Standard deviation of a measured range.
    max_range
        Beyond, nothing is measured.
    dropout
        Share of the returns that are lost, by chance.
    view
        Angle of all its directions, half of it to either side of its x axis; a whole turn by default.
    """

    lines: int = 32
    elevation: tuple[float, float] = (-25.0, 25.0)
    steps: int = 480
    noise: float = 0.01
    max_range: float = 100.0
    dropout: float = 0.0
    view: float = 360.0

    def rays(self, line_errors: ArrayLike = 0.0) -> Array:
        """Give unit vectors in the sensor's axes, (lines * steps, 3), one line after the other.

        Parameters
        ----------
        line_errors
            Radians by which each laser looks higher than the even spread says, (lines,).
        """
        low, high = np.radians(self.elevation)
        view = np.radians(self.view)
        elevation, azimuth = np.meshgrid(
            np.linspace(low, high, self.lines) + np.asarray(line_errors, np.float64),
            np.arange(self.steps) / self.steps * view - view / 2.0,
            indexing="ij",
        )
        flat = np.cos(elevation)
        return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], -1).reshape(
            -1, 3
        )


def pixel_rays(width: int, height: int, focal: float) -> Array:
    """Give the directions of a camera's pixels, row by row, (width * height, 3), with z component 1."""
    x, y = np.meshgrid(
        (np.arange(width) + 0.5 - width / 2.0) / focal, (np.arange(height) + 0.5 - height / 2.0) / focal
    )
    return np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)


@dataclass(frozen=True)
class DepthCamera:
    """A depth camera that looks along its z axis, x to the right. Angles are in degrees, lengths in metres.

    Parameters
    ----------
    width, height
        Pixels.
    view
        Angle from the left to the right edge of the image.
    noise
        Standard deviation of the depth at one metre; it grows with the square of the depth.
    max_range
        Beyond, nothing is measured.
    dropout
        Share of the pixels that are lost, by chance.
    """

    width: int = 160
    height: int = 120
    view: float = 70.0
    noise: float = 0.002
    max_range: float = 6.0
    dropout: float = 0.0

    def rays(self) -> Array:
        """Give unit vectors in the camera's axes, (width * height, 3), row by row."""
        rays = pixel_rays(self.width, self.height, self.width / 2.0 / np.tan(np.radians(self.view) / 2.0))
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


@dataclass(frozen=True)
class Calibration:
    """What is wrong with a sensor in all of its scans, as it is with real ones.

    Errors of this kind act alike over large parts of a scan and over many scans, so that the spread of
    residuals does not show them.

    Parameters
    ----------
    range_scale
        Share by which all ranges are too long.
    incidence
        By how much a range is too long where the surface is seen at a grazing angle, in metres; it grows as
        1 - cos of the angle between ray and normal.
    line_angle
        Standard deviation of the elevation of a lidar's lasers, in degrees: points are written along the
        directions that the lasers should have.
    mixed
        Share of the returns next to an edge that lie somewhere between both surfaces.
    seed
        Draws the lasers' elevations: the same seed is the same sensor.
    """

    range_scale: float = 0.0
    incidence: float = 0.0
    line_angle: float = 0.0
    mixed: float = 0.0
    seed: int = 0

    def line_errors(self, lines: int) -> Array:
        """Give the errors of the elevation of each laser, (lines,), in radians."""
        drawn = np.random.default_rng([41, self.seed]).normal(size=lines)
        return np.asarray(np.radians(self.line_angle) * drawn)


def bent_calibration(seed: int = 0) -> Calibration:
    """Give a calibration as bad as those of real lidars.

    Parameters
    ----------
    seed
        Of the sensor.

    Returns
    -------
    Calibration
        Ranges too long by a thousandth, and by up to 1 cm at grazing incidence; lasers off by 0.05 degrees;
        half of the returns at edges mixed.
    """
    return Calibration(range_scale=0.001, incidence=0.01, line_angle=0.05, mixed=0.5, seed=seed)


def scan(
    scene: Scene,
    sensor: Lidar | DepthCamera,
    pose: ArrayLike | None = None,
    *,
    seed: int = 0,
    calibration: Calibration | None = None,
) -> PointCloud:
    """Scan a scene from one place.

    Parameters
    ----------
    scene
        What there is.
    sensor
        A `Lidar` or a `DepthCamera`.
    pose
        (4, 4), T_scene_sensor; the identity by default.
    seed
        Of noise and dropouts; the same seed gives the same scan.
    calibration
        What is wrong with the sensor; nothing by default.

    Returns
    -------
    PointCloud
        In the sensor's own axes, float32, with the viewpoint at (0, 0, 0).

    Raises
    ------
    InvalidInputError
        If the pose is none, or nothing is met.
    """
    T_scene_sensor = np.eye(4) if pose is None else pose_array(pose, "pose")
    wrong = Calibration() if calibration is None else calibration
    rays = sensor.rays()
    is_lidar = isinstance(sensor, Lidar)
    true_rays = sensor.rays(wrong.line_errors(sensor.lines)) if isinstance(sensor, Lidar) else rays
    directions = true_rays @ T_scene_sensor[:3, :3].T
    hits = scene.cast(np.broadcast_to(T_scene_sensor[:3, 3], rays.shape), directions)
    rng = np.random.default_rng([seed, len(rays)])
    noise, met = _drawn(rng, hits.t, sensor)
    ranges = hits.t
    if calibration is not None:
        width = sensor.steps if isinstance(sensor, Lidar) else sensor.width
        is_turn = isinstance(sensor, Lidar) and sensor.view == 360.0
        ranges = _mixed(ranges, hits.surface, width, is_turn, wrong.mixed, rng)
        cosine = np.abs(np.einsum("ni,ni->n", directions, hits.normals))
        ranges = ranges * (1.0 + wrong.range_scale) + wrong.incidence * (1.0 - cosine)
    deviation = sensor.noise * (1.0 if is_lidar else hits.t[met] ** 2)
    ranges = ranges[met] + deviation * noise[met]
    return PointCloud((ranges[:, None] * rays[met]).astype(np.float32), viewpoint=np.zeros(3))


def scan_moving(
    scene: Scene, sensor: Lidar, poses: ArrayLike, *, seed: int = 0, period: float = 0.1
) -> PointCloud:
    """Scan a scene by a lidar that moves while it spins: its scan is bent by the motion.

    Parameters
    ----------
    scene
        What there is.
    sensor
        The lidar; all its lasers fire at once.
    poses
        (steps, 4, 4), T_scene_sensor at each direction, counter-clockwise: a whole turn begins behind.
    seed
        Of noise and dropouts; the same seed gives the same scan.
    period
        Seconds that the scan takes.

    Returns
    -------
    PointCloud
        Each point in the sensor's axes at its own time, float32, with the viewpoint at (0, 0, 0) and the
        field ``time``: seconds from the middle of the scan on, float32.

    Raises
    ------
    InvalidInputError
        If there is not one pose for each step, or nothing is met.
    """
    T_scene_sensor = np.asarray(poses, np.float64)
    if T_scene_sensor.shape != (sensor.steps, 4, 4):
        raise InvalidInputError(f"poses must be ({sensor.steps}, 4, 4), not {T_scene_sensor.shape}")
    rays = sensor.rays()
    step = np.tile(np.arange(sensor.steps), sensor.lines)
    at = T_scene_sensor[step]
    hits = scene.cast(at[:, :3, 3], np.einsum("nij,nj->ni", at[:, :3, :3], rays))
    rng = np.random.default_rng([seed, len(rays)])
    noise, met = _drawn(rng, hits.t, sensor)
    ranges = hits.t[met] + sensor.noise * noise[met]
    times = period * (step / sensor.steps - 0.5)
    return PointCloud(
        (ranges[:, None] * rays[met]).astype(np.float32),
        viewpoint=np.zeros(3),
        fields={"time": times[met].astype(np.float32)},
    )


def _drawn(
    rng: np.random.Generator, ranges: Array, sensor: Lidar | DepthCamera
) -> tuple[Array, NDArray[np.bool_]]:
    """Draw a normal number for each ray, and which rays have a return."""
    noise, luck = rng.normal(size=len(ranges)), rng.random(len(ranges))
    met = (ranges < sensor.max_range) & (luck >= sensor.dropout)
    if not met.any():
        raise InvalidInputError("the sensor meets nothing of the scene")
    return noise, met


def _mixed(
    ranges: Array,
    surface: NDArray[np.int32],
    width: int,
    is_turn: bool,
    share: float,
    rng: np.random.Generator,
) -> Array:
    """Mix a share of the returns with those of the next ray of the line, where another surface lies apart.

    After the last ray of a line the first one comes if the line is a whole turn, and none otherwise.
    """
    rows, surfaces = ranges.reshape(-1, width), surface.reshape(-1, width)
    following = np.roll(rows, -1, axis=1)
    drawn, part = rng.random(rows.shape), rng.random(rows.shape)
    with np.errstate(invalid="ignore"):
        is_other = surfaces != np.roll(surfaces, -1, axis=1)
        apart = is_other & (np.abs(following - rows) > _EDGE * np.minimum(rows, following))
        is_mixed = apart & np.isfinite(rows) & np.isfinite(following) & (drawn < share)
        is_mixed[:, -1] &= is_turn
        mixed = np.where(is_mixed, rows + part * (following - rows), rows)
    return np.asarray(mixed.reshape(-1))


def distorted(cloud: PointCloud, *, scale: float = 1.0, mirrored: bool = False) -> PointCloud:
    """Give a scan another unit or another hand, as a wrong export does.

    Parameters
    ----------
    cloud
        A scan, about its sensor.
    scale
        By which all coordinates are multiplied.
    mirrored
        Whether y changes its sign: the axes become left-handed.

    Returns
    -------
    PointCloud
        The points and the viewpoint alone, without other fields.
    """
    factors = np.array([scale, -scale if mirrored else scale, scale])
    viewpoint = None if cloud.viewpoint is None else cloud.viewpoint * factors
    return PointCloud((cloud.points * factors).astype(cloud.points.dtype), viewpoint=viewpoint)
