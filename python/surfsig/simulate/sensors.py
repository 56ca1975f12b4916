"""Sensors that stand somewhere and look around: spinning lidars and depth cameras."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InvalidInputError
from ..geometry import pose_array
from ..point_cloud import PointCloud
from .poses import Array
from .scene import Scene


@dataclass(frozen=True)
class Lidar:
    """A spinning lidar, whose axis is its z axis. Angles are in degrees, lengths in metres.

    Parameters
    ----------
    lines
        Lasers, evenly spread in elevation.
    elevation
        Of the lowest and the highest laser.
    steps
        Directions in a turn.
    noise
        Standard deviation of a measured range.
    max_range
        Beyond, nothing is measured.
    dropout
        Share of the returns that are lost, by chance.
    """

    lines: int = 32
    elevation: tuple[float, float] = (-25.0, 25.0)
    steps: int = 480
    noise: float = 0.01
    max_range: float = 100.0
    dropout: float = 0.0

    def rays(self) -> Array:
        """Give unit vectors in the sensor's axes, (lines * steps, 3), one line after the other."""
        low, high = np.radians(self.elevation)
        elevation, azimuth = np.meshgrid(
            np.linspace(low, high, self.lines),
            np.arange(self.steps) / self.steps * 2.0 * np.pi - np.pi,
            indexing="ij",
        )
        flat = np.cos(elevation)
        return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], -1).reshape(
            -1, 3
        )


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
        focal = self.width / 2.0 / np.tan(np.radians(self.view) / 2.0)
        x, y = np.meshgrid(
            (np.arange(self.width) + 0.5 - self.width / 2.0) / focal,
            (np.arange(self.height) + 0.5 - self.height / 2.0) / focal,
        )
        rays = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def scan(
    scene: Scene, sensor: Lidar | DepthCamera, pose: ArrayLike | None = None, *, seed: int = 0
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
    rays = sensor.rays()
    hits = scene.cast(np.broadcast_to(T_scene_sensor[:3, 3], rays.shape), rays @ T_scene_sensor[:3, :3].T)
    rng = np.random.default_rng([seed, len(rays)])
    noise, luck = rng.normal(size=len(rays)), rng.random(len(rays))
    met = (hits.t < sensor.max_range) & (luck >= sensor.dropout)
    if not met.any():
        raise InvalidInputError("the sensor meets nothing of the scene")
    deviation = sensor.noise * (hits.t[met] ** 2 if isinstance(sensor, DepthCamera) else 1.0)
    ranges = hits.t[met] + deviation * noise[met]
    return PointCloud((ranges[:, None] * rays[met]).astype(np.float32), viewpoint=np.zeros(3))


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
