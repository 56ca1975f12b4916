"""A depth camera that finds depth by disparity, with the errors that such cameras have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..errors import InvalidInputError
from ..geometry import pose_array, rotate, transform_points
from ..point_cloud import PointCloud
from .poses import Array
from .scene import Scene
from .sensors import pixel_rays

_FEWEST_SMOOTHED = 0.5
"""Weight of the measured pixels in the smoothing window, below which a pixel is not smoothed."""
_OUTLINE = 1.0
"""Difference of two neighbours' disparities, in pixels, from which on an outline is between them."""
_LIGHT_OF_HOLES = 0.25
"""Reflectance times cosine at which 16 in 100 pixels are holes: those whose noise is a deviation low."""


@dataclass(frozen=True)
class StereoCamera:
    """Finds depth by disparity (stereo or structured light); it looks along its z axis, x to the right.

    The disparity of a point at depth z is ``focal * baseline / z``. Its errors are in pixels, so those of the
    depth grow with the square of the depth.

    Parameters
    ----------
    width, height
        Pixels.
    focal
        Focal length in pixels.
    baseline
        From the camera to the second camera or projector, along x, in metres.
    disparity_noise
        Standard deviation of a disparity, in pixels: 0.065 gives 1.5 mm at 1 m, as of common cameras.
    disparity_step
        Step in which disparities come, in pixels; 0 for none.
    smoothing
        Standard deviation in pixels of the window over which a disparity is found: it smooths the surface,
        rounds edges and makes neighbours' noise alike.
    bleeding
        Standard deviation in pixels by which the outline of what is nearer is moved, alike for neighbours.
    mixed
        Share of the pixels along an outline whose depth lies between both surfaces.
    steepest
        Cosine between normal and line of sight below which nothing is measured.
    max_range
        Depth in metres beyond which nothing is measured.
    dropout
        Share of the pixels that are lost in patches, by chance.
    """

    width: int = 640
    height: int = 480
    focal: float = 575.0
    baseline: float = 0.075
    disparity_noise: float = 0.065
    disparity_step: float = 0.125
    smoothing: float = 1.5
    bleeding: float = 1.0
    mixed: float = 0.3
    steepest: float = 0.2
    max_range: float = 6.0
    dropout: float = 0.01

    def rays(self) -> Array:
        """Give the directions of the pixels, row by row, (width * height, 3), with z component 1."""
        return pixel_rays(self.width, self.height, self.focal)

    def scan(
        self,
        scene: Scene,
        pose: ArrayLike | None = None,
        *,
        seed: int = 0,
        reflectance: ArrayLike | None = None,
    ) -> PointCloud:
        """Take a depth image of a scene.

        Parameters
        ----------
        scene
            What there is.
        pose
            (4, 4), T_scene_camera; the identity by default.
        seed
            Of all errors; the same seed gives the same image.
        reflectance
            Of each surface of the scene, 0 to 1: the darker, the more holes; 1 by default.

        Returns
        -------
        PointCloud
            In the camera's axes, float32, with the viewpoint at (0, 0, 0) and a grid; NaN in holes. The field
            ``surface`` is the number of the surface that the pixel's ray meets, -1 for none.

        Raises
        ------
        InvalidInputError
            If the pose is none, or reflectances are not one for each surface, between 0 and 1.
        """
        T_scene_camera = np.eye(4) if pose is None else pose_array(pose, "pose")
        albedo = np.ones(len(scene.objects)) if reflectance is None else np.asarray(reflectance, np.float64)
        if albedo.shape != (len(scene.objects),) or not ((albedo >= 0.0) & (albedo <= 1.0)).all():
            raise InvalidInputError(
                f"reflectance must be {len(scene.objects)} numbers between 0 and 1, one for each surface"
            )
        rng = np.random.default_rng([seed, self.width, self.height])
        rays = self.rays()
        directions = rotate(T_scene_camera, rays)
        hits = scene.cast(np.broadcast_to(T_scene_camera[:3, 3], rays.shape), directions)
        length = np.linalg.norm(rays, axis=1)
        cosine = np.abs(np.einsum("ni,ni->n", hits.normals, directions)) / length
        second = transform_points(T_scene_camera, np.array([[self.baseline, 0.0, 0.0]]))[0]
        met = np.flatnonzero(np.isfinite(hits.t) & (hits.t < self.max_range))
        lost = np.ones(len(rays), np.bool_)
        lost[met] = scene.hidden(second, hits.points[met])
        lost |= np.isnan(cosine) | (cosine < self.steepest)
        # Dark surfaces and oblique ones return little light: the chance of a hole grows as it falls.
        light = np.where(hits.surface >= 0, albedo[hits.surface], 0.0) * np.nan_to_num(cosine)
        blobs = self._smooth_noise(rng, 2.0 * self.smoothing + 1.0).ravel()
        threshold = np.quantile(blobs, self.dropout) if self.dropout > 0.0 else -np.inf
        lost |= (blobs < threshold) | (blobs < -light / _LIGHT_OF_HOLES)
        disparity = self.focal * self.baseline / hits.t
        disparity = np.where(lost, np.nan, disparity).reshape(self.height, self.width)
        disparity = self._bled(disparity, rng)
        disparity = self._smoothed(disparity)
        disparity = self._mixed(disparity, rng)
        disparity = disparity + self.disparity_noise * self._smooth_noise(rng, 0.5 * self.smoothing)
        if self.disparity_step > 0.0:
            disparity = np.round(disparity / self.disparity_step) * self.disparity_step
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = self.focal * self.baseline / disparity
        points = depth.reshape(-1, 1) * rays
        points[~(points[:, 2] > 0.0)] = np.nan
        return PointCloud(
            points.astype(np.float32),
            viewpoint=np.zeros(3),
            grid=(self.height, self.width),
            fields={"surface": hits.surface},
        )

    def _smooth_noise(self, rng: np.random.Generator, width: float) -> Array:
        """Give noise of standard deviation 1 that is alike over some pixels, (height, width)."""
        noise = rng.normal(size=(self.height, self.width))
        if width > 0.0:
            noise = scipy.ndimage.gaussian_filter(noise, width, mode="wrap")
            noise /= noise.std()
        return np.asarray(noise)

    def _bled(self, disparity: Array, rng: np.random.Generator) -> Array:
        """Take each disparity from a pixel near by, so that outlines are ragged."""
        if self.bleeding == 0.0:
            return disparity
        moved = [
            np.clip(
                index + np.round(self.bleeding * self._smooth_noise(rng, self.smoothing)).astype(np.int64),
                0,
                size - 1,
            )
            for index, size in zip(np.indices(disparity.shape), disparity.shape, strict=True)
        ]
        outline = self._is_outline(disparity, 3.0 * self.bleeding)
        return np.where(outline, disparity[moved[0], moved[1]], disparity)

    def _smoothed(self, disparity: Array) -> Array:
        """Average over the window; not over what is apart by more than the window bridges."""
        if self.smoothing == 0.0:
            return disparity
        known = np.isfinite(disparity)
        weight = scipy.ndimage.gaussian_filter(known.astype(np.float64), self.smoothing)
        total = scipy.ndimage.gaussian_filter(np.where(known, disparity, 0.0), self.smoothing)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = total / weight
        apart = self._is_outline(disparity, 2.0 * self.smoothing)
        keep = apart | ~known | (weight < _FEWEST_SMOOTHED)
        return np.where(keep, disparity, mean)

    def _mixed(self, disparity: Array, rng: np.random.Generator) -> Array:
        """Mix a share of the pixels along outlines with what is beside them."""
        following = np.roll(disparity, -1, axis=1)
        drawn, part = rng.random(disparity.shape), rng.random(disparity.shape)
        with np.errstate(invalid="ignore"):
            apart = np.abs(following - disparity) > _OUTLINE
        is_mixed = apart & (drawn < self.mixed)
        return np.where(is_mixed, disparity + part * (following - disparity), disparity)

    def _is_outline(self, disparity: Array, reach: float) -> NDArray[np.bool_]:
        """Tell which pixels are near an outline."""
        filled = np.where(np.isfinite(disparity), disparity, 0.0)
        step = np.zeros(disparity.shape)
        for axis in (0, 1):
            difference = np.abs(np.diff(filled, axis=axis)) > _OUTLINE
            pad = [(0, 1) if k == axis else (0, 0) for k in (0, 1)]
            step += np.pad(difference, pad)
        return np.asarray(scipy.ndimage.gaussian_filter(np.minimum(step, 1.0), max(0.5 * reach, 0.5)) > 0.05)
