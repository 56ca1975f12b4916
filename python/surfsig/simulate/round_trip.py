"""A corridor around a block of a building: where a sensor that goes round comes back to where it began."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .places import upright_pose
from .poses import pose
from .scene import Placed, Scene
from .surfaces import Box

Array = NDArray[np.float64]

_THICK = 0.2
_THINGS_PER_METRE = 0.4
"""Of the outer walls: one each 2.5 m, as doors and cupboards are."""
_TURN_RADIUS = 1.5
"""Of the path at the corners."""


def circuit(seed: int = 0, *, side: float = 100.0, width: float = 4.0, height: float = 3.0) -> Scene:
    """Build a corridor around a square block, with things along its walls.

    Parameters
    ----------
    seed
        Draws the things.
    side
        Of the outer walls: a round is some 4 (side - width) long.
    width, height
        Of the corridor.

    Returns
    -------
    Scene
        About (0, 0), the floor at z = 0.
    """
    rng = np.random.default_rng([12, seed])
    outer, inner, t = 0.5 * side, 0.5 * side - width, _THICK
    placed = [_box((0.0, 0.0, z), (side + 2.0, side + 2.0, t)) for z in (-0.5 * t, height + 0.5 * t)]
    for sign in (-1.0, 1.0):
        placed += [
            _box((sign * (outer + 0.5 * t), 0.0, 0.5 * height), (t, side + 2.0 * t, height)),
            _box((0.0, sign * (outer + 0.5 * t), 0.5 * height), (side + 2.0 * t, t, height)),
            _box((sign * (inner - 0.5 * t), 0.0, 0.5 * height), (t, 2.0 * inner, height)),
            _box((0.0, sign * (inner - 0.5 * t), 0.5 * height), (2.0 * inner, t, height)),
        ]
    for _ in range(round(4.0 * side * _THINGS_PER_METRE)):
        along = rng.uniform(0.5 - outer, outer - 0.5)
        long, deep, high = rng.uniform((0.2, 0.2, 0.4), (1.0, 1.0, 2.0))
        is_inner = rng.random() < 0.5 and abs(along) < inner
        across = inner + 0.5 * deep if is_inner else outer - 0.5 * deep
        # Onto one of the four sides.
        quarter = int(rng.integers(4))
        x, y = ((along, across), (-across, along), (-along, -across), (across, -along))[quarter]
        size = (deep, long, high) if quarter % 2 else (long, deep, high)
        placed.append(_box((x, y, 0.5 * high), size))
    return Scene(placed)


def circuit_poses(
    *, side: float = 100.0, width: float = 4.0, step: float = 1.0, beyond: float = 5.0, sway: float = 0.03
) -> Array:
    """Go round in the middle of the corridor.

    Parameters
    ----------
    side, width
        As of the circuit.
    step
        Distance between two poses.
    beyond
        By how much the path goes on after a whole round.
    sway
        By how much the sensor yaws, pitches and rolls, in radians.

    Returns
    -------
    (n, 4, 4), T_scene_sensor.
    """
    half = 0.5 * (side - width)
    straight, quarter = 2.0 * (half - _TURN_RADIUS), 0.5 * np.pi * _TURN_RADIUS
    length = 4.0 * (straight + quarter)
    poses = []
    for travelled in np.arange(0.0, length + beyond, step):
        corner, along = divmod(travelled % length, straight + quarter)
        angle = max(0.0, along - straight) / _TURN_RADIUS
        x = -0.5 * straight + min(along, straight) + _TURN_RADIUS * np.sin(angle)
        y = -half + _TURN_RADIUS * (1.0 - np.cos(angle))
        heading = 0.5 * np.pi * corner
        cos, sin = np.cos(heading), np.sin(heading)
        yaw = heading + angle + sway * np.sin(0.9 * travelled)
        tilt = (sway * np.sin(0.7 * travelled), sway * np.cos(1.1 * travelled))
        poses.append(upright_pose(cos * x - sin * y, sin * x + cos * y, 1.2, yaw, tilt))
    return np.array(poses)


def _box(middle: tuple[float, float, float], size: tuple[float, float, float]) -> Placed:
    return Placed(Box(size), pose(middle))
