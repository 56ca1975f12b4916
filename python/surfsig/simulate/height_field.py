"""An irregular smooth surface: a seeded sum of waves, with exact curvatures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InvalidInputError
from .poses import Array
from .ray_crossings import slab_entry_exit
from .surfaces import Surface

_MAX_STEPS = 200
_ON_SURFACE = 1e-13  # metres


@dataclass(frozen=True)
class HeightField(Surface):
    """The sheet z = sum_i a_i cos(p_i x + q_i y + phase_i) over a rectangle about the origin.

    Parameters
    ----------
    size : (float, float)
        Sides of the rectangle along x and y, in metres.
    waves : tuple of (a, p, q, phase)
        Amplitude in metres, wave numbers along x and y in radians per metre, phase in radians.
    """

    size: tuple[float, float]
    waves: tuple[tuple[float, float, float, float], ...]

    def __post_init__(self) -> None:
        table = np.array(self.waves, dtype=np.float64)
        if table.ndim != 2 or table.shape[1] != 4 or not np.isfinite(table).all() or min(self.size) <= 0.0:
            raise InvalidInputError("HeightField: size must be positive, waves rows of four finite numbers")

    @classmethod
    def random(
        cls,
        seed: int,
        *,
        size: tuple[float, float],
        rms: float,
        wavelengths: tuple[float, float],
        count: int = 12,
    ) -> HeightField:
        """Sum of waves in random directions.

        Parameters
        ----------
        seed : int
            The same seed gives the same surface.
        size : (float, float)
            Sides of the rectangle, in metres.
        rms : float
            Root mean square height, in metres, over an unlimited field: all waves have the amplitude
            rms * sqrt(2 / count).
        wavelengths : (float, float)
            Shortest and longest wave, in metres; their logarithms are drawn uniformly.
        count : int
            Number of waves.

        Raises
        ------
        InvalidInputError
            If a length or the count is not positive.
        """
        shortest, longest = wavelengths
        if not (rms > 0.0 and 0.0 < shortest <= longest < np.inf and count > 0):
            raise InvalidInputError(
                "HeightField.random: rms, wavelengths (short, long) and count must be positive"
            )
        rng = np.random.default_rng(seed)
        number = 2 * np.pi / np.exp(rng.uniform(np.log(shortest), np.log(longest), count))
        heading = rng.uniform(0.0, 2 * np.pi, count)
        phase = rng.uniform(0.0, 2 * np.pi, count)
        amplitude = np.full(count, rms * np.sqrt(2.0 / count))
        table = np.stack([amplitude, number * np.cos(heading), number * np.sin(heading), phase], axis=1)
        return cls(size, tuple((float(a), float(p), float(q), float(s)) for a, p, q, s in table))

    @property
    def _columns(self) -> tuple[Array, Array, Array]:
        """Amplitudes (m,), wave numbers (2, m) and phases (m,)."""
        table = np.array(self.waves, dtype=np.float64)
        return table[:, 0], table[:, 1:3].T, table[:, 3]

    def heights(self, xy: Array) -> Array:
        """Height z, (n,), above points of the plane, (n, 2); the rectangle does not limit it."""
        amplitude, number, phase = self._columns
        return np.asarray(np.cos(xy @ number + phase) @ amplitude)

    def crossings(self, origins: Array, directions: Array) -> Array:
        """Find the first crossing in front of the origin; see :meth:`Surface.crossings`; k = 1.

        Newton's step on the height above the sheet, shortened by a bound on its second derivative along the
        ray: it never runs past the first root, and converges quadratically. A ray that grazes the sheet
        within 1e-13 m counts as a hit.
        """
        amplitude, number, phase = self._columns
        half = np.array([self.size[0] / 2, self.size[1] / 2, float(np.abs(amplitude).sum())])
        enter, leave = slab_entry_exit(origins, directions, half)
        result = np.full(len(origins), np.inf)
        start = np.maximum(enter, 0.0)
        ray = np.flatnonzero(np.isfinite(enter) & (leave > 0.0))
        # A function of the parameter alone along each ray: angles grow linearly.
        phases = origins[ray, :2] @ number + phase
        rates = directions[ray, :2] @ number
        bound = rates**2 @ np.abs(amplitude)
        z0, dz, t, last = origins[ray, 2], directions[ray, 2], start[ray], leave[ray]
        side = np.zeros(len(ray))
        for _ in range(_MAX_STEPS):
            if not len(ray):
                break
            angles = phases + t[:, None] * rates
            above = z0 + t * dz - np.cos(angles) @ amplitude
            side = np.where(side == 0.0, np.where(above < 0.0, -1.0, 1.0), side)
            gap = side * above
            slope = side * (dz + (np.sin(angles) * rates) @ amplitude)
            hit = gap <= _ON_SURFACE
            result[ray[hit]] = t[hit]
            with np.errstate(divide="ignore", invalid="ignore"):
                t = t + 2.0 * gap / (np.sqrt(slope**2 + 2.0 * bound * np.maximum(gap, 0.0)) - slope)
            going = ~hit & (t <= last)
            ray, phases, rates, bound = ray[going], phases[going], rates[going], bound[going]
            z0, dz, t, last, side = z0[going], dz[going], t[going], last[going], side[going]
        return result[None]

    def implicit(self, points: Array) -> Array:
        """Height above the sheet, not a distance; the rectangle does not limit it."""
        return np.asarray(points[:, 2] - self.heights(points[:, :2]))

    def _derivatives(self, points: Array) -> tuple[Array, Array, Array, Array, Array]:
        """First (x, y) and second (xx, xy, yy) derivatives of the height, each (n,)."""
        amplitude, number, phase = self._columns
        angles = points[:, :2] @ number + phase
        sines, cosines = -np.sin(angles) * amplitude, -np.cos(angles) * amplitude
        p, q = number
        return sines @ p, sines @ q, cosines @ p**2, cosines @ (p * q), cosines @ q**2

    def normals(self, points: Array) -> Array:
        """Upwards, square to the sheet."""
        hx, hy, *_ = self._derivatives(points)
        normals = np.stack([-hx, -hy, np.ones_like(hx)], axis=1)
        return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))

    def curvatures(self, points: Array) -> Array:
        """Principal curvatures of the graph; a hill is positive."""
        hx, hy, hxx, hxy, hyy = self._derivatives(points)
        square = 1.0 + hx**2 + hy**2
        mean = -((1.0 + hx**2) * hyy - 2.0 * hx * hy * hxy + (1.0 + hy**2) * hxx) / (2.0 * square**1.5)
        gaussian = (hxx * hyy - hxy**2) / square**2
        half_difference = np.sqrt(np.maximum(mean**2 - gaussian, 0.0))
        return np.stack([mean + half_difference, mean - half_difference], axis=1)
