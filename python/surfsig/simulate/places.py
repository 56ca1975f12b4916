"""Places to scan whose truth is known: rooms, corridors, tunnels, halls, storeys, pipes, forests, a plane.

Each is drawn by a seed. Lengths are in metres, z is up, the floor is at z = 0, and the middle of a place is
at x = y = 0. Some deceive on purpose: a smooth corridor does not tell how far a sensor went, an empty room
looks the same after half a turn.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from .poses import Array, pose, turn
from .scene import Placed, Scene
from .surfaces import Box, Cylinder, Sphere

_THICK = 0.1
"""Of walls."""
_UP = (0.0, 0.0, 1.0)


def room(
    seed: int = 0, *, size: tuple[float, float, float] | None = None, furniture: int | None = None
) -> Scene:
    """Build a room with boxes, columns and balls that stand around.

    Parameters
    ----------
    seed
        Draws what is not given, and the furniture.
    size
        Along x, y and z; by default 5 to 9 by 4 to 7 by 2.5 to 3.2 metres.
    furniture
        How many things; 8 to 14 by default. Without any, a room looks the same after half a turn.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([1, seed])
    drawn = rng.uniform((5.0, 4.0, 2.5), (9.0, 7.0, 3.2))
    count = int(rng.integers(8, 15))
    x, y, z = drawn if size is None else size
    placed = _shell(x, y, z)
    for _ in range(count if furniture is None else furniture):
        placed.append(_thing(rng, (0.42 * x, 0.42 * y)))
    return Scene(placed)


def corridor(
    seed: int = 0, *, length: float = 60.0, width: float = 2.0, height: float = 2.5, niches: int = 0
) -> Scene:
    """Build a straight corridor along x.

    Parameters
    ----------
    seed
        Draws where niches are.
    length, width, height
        Of the corridor, whose ends are closed.
    niches
        Door frames and columns along the walls; without any, nothing tells how far along a sensor is.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([2, seed])
    placed = _shell(length, width, height)
    for x in rng.uniform(-0.5 * length, 0.5 * length, niches):
        depth, wide = rng.uniform((0.1, 0.4), (0.4, 1.2))
        side = rng.choice((-1.0, 1.0))
        placed.append(_box((x, side * (0.5 * width - 0.5 * depth), 0.5 * height), (wide, depth, height)))
    return Scene(placed)


def tunnel(seed: int = 0, *, length: float = 80.0, radius: float = 3.0) -> Scene:
    """Build a round tunnel along x with a flat floor and nothing in it; its ends are open.

    Parameters
    ----------
    seed
        Draws where the floor lies.
    length, radius
        Of the tunnel.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([3, seed])
    below = radius * rng.uniform(0.4, 0.7)
    across = turn((0.0, 1.0, 0.0), 0.5 * np.pi)
    tube = Placed(Cylinder(radius, length, capped=False), pose((0.0, 0.0, below), across))
    floor = _box((0.0, 0.0, -0.5 * _THICK), (length, 2.0 * radius, _THICK))
    return Scene([tube, floor])


def hall(seed: int = 0, *, size: tuple[float, float, float] = (40.0, 25.0, 8.0), columns: int = 6) -> Scene:
    """Build a hall with a row of equal columns at equal distances on either side, and some machines.

    Parameters
    ----------
    seed
        Draws the machines.
    size
        Along x, y and z.
    columns
        In each row.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([4, seed])
    x, y, z = size
    placed = _shell(x, y, z)
    for column in (np.arange(columns) + 0.5) / columns * x - 0.5 * x:
        for side in (-0.25 * y, 0.25 * y):
            placed.append(_box((column, side, 0.5 * z), (0.6, 0.6, z)))
    placed += [_thing(rng, (0.45 * x, 0.45 * y), 3.0) for _ in range(8)]
    return Scene(placed)


def pipes(seed: int = 0, *, count: int = 12, size: tuple[float, float, float] = (10.0, 8.0, 4.0)) -> Scene:
    """Build a plant room with straight pipes along its three axes, and vessels.

    Parameters
    ----------
    seed
        Draws where pipes run and how thick they are.
    count
        Of pipes.
    size
        Of the room, along x, y and z.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([5, seed])
    placed = _shell(*size)
    turns = (turn((0.0, 1.0, 0.0), 0.5 * np.pi), turn((1.0, 0.0, 0.0), 0.5 * np.pi), np.eye(3))
    for number in range(count):
        axis = number % 3
        middle = rng.uniform(-0.4, 0.4, 3) * size + (0.0, 0.0, 0.5 * size[2])
        middle[axis] = 0.5 * size[2] if axis == 2 else 0.0
        radius = rng.uniform(0.05, 0.25)
        placed.append(Placed(Cylinder(radius, size[axis]), pose(middle, turns[axis])))
    for _ in range(3):
        x, y = rng.uniform(-0.35, 0.35, 2) * size[:2]
        placed.append(Placed(Cylinder(rng.uniform(0.4, 0.8), 2.0), pose((x, y, 1.0))))
    return Scene(placed)


def forest(seed: int = 0, *, trees: int = 120, size: float = 60.0) -> Scene:
    """Build trunks on flat ground.

    Parameters
    ----------
    seed
        Draws where trees stand, how thick they are and how they lean.
    trees
        Their number.
    size
        Along x and y.

    Returns
    -------
    Scene
    """
    rng = np.random.default_rng([6, seed])
    placed = [_box((0.0, 0.0, -0.5 * _THICK), (size, size, _THICK))]
    while len(placed) <= trees:
        x, y = rng.uniform(-0.5 * size, 0.5 * size, 2)
        lean, about = rng.normal(0.0, 0.05), rng.uniform(0.0, 2.0 * np.pi)
        radius = rng.uniform(0.08, 0.35)
        if np.hypot(x, y) > 1.5:
            leaning = turn((np.cos(about), np.sin(about), 0.0), lean)
            placed.append(Placed(Cylinder(radius, 24.0), pose((x, y, 0.0), leaning)))
    return Scene(placed)


def plane(size: float = 60.0) -> Scene:
    """Build flat ground with nothing on it: three motions of a sensor are free.

    Parameters
    ----------
    size
        Along x and y.

    Returns
    -------
    Scene
    """
    return Scene([_box((0.0, 0.0, -0.5 * _THICK), (size, size, _THICK))])


def storey(
    seed: int = 0,
    *,
    rooms: tuple[int, int] = (4, 2),
    size: tuple[float, float, float] = (6.0, 5.0, 2.8),
    opening: float = 2.4,
    furniture: int = 6,
) -> Scene:
    """Build a storey of rooms in rows, each open to its neighbours.

    Parameters
    ----------
    seed
        Draws where the openings are, and the furniture.
    rooms
        Their number along x and y.
    size
        Of a room, along x, y and z.
    opening
        Width of the openings between rooms, from floor to ceiling: the wider, the more of a room is seen from
        the next.
    furniture
        Things in each room.

    Returns
    -------
    Scene
        The middle of room (i, j) is at ((i - (n - 1) / 2) * size x, (j - (m - 1) / 2) * size y); things stand
        at least 1.2 metres from it.
    """
    rng = np.random.default_rng([11, seed])
    (n, m), (x, y, z) = rooms, size
    placed = _shell(n * x, m * y, z)
    for i in range(n):
        for j in range(m):
            middle = np.array([(i - 0.5 * (n - 1)) * x, (j - 0.5 * (m - 1)) * y, 0.0])
            things = [_thing(rng, (0.42 * x, 0.42 * y)) for _ in range(furniture)]
            placed += [thing.moved(pose(middle)) for thing in things]
            for axis, is_last in ((0, i == n - 1), (1, j == m - 1)):
                if not is_last:
                    placed += _wall_with_opening(rng, middle, axis, size, opening)
    return Scene(placed)


def _wall_with_opening(
    rng: np.random.Generator, middle: Array, axis: int, size: tuple[float, float, float], opening: float
) -> list[Placed]:
    """Build the wall at the far side of a room along x or y, in two parts."""
    along = 1 - axis
    length = size[along]
    start = rng.uniform(0.1, 0.9) * (length - opening)
    placed = []
    for low, high in ((0.0, start), (start + opening, length)):
        wall, at = np.zeros(3), middle.copy()
        wall[axis], wall[along], wall[2] = _THICK, high - low, size[2]
        at[axis] += 0.5 * size[axis]
        at[along] += 0.5 * (low + high) - 0.5 * length
        at[2] = 0.5 * size[2]
        placed.append(_box(at.tolist(), wall.tolist()))
    return placed


def block(size: tuple[float, float, float] = (1.0, 0.7, 0.4)) -> Scene:
    """Build a box, which looks the same in four poses; in 24 if it is a cube.

    Parameters
    ----------
    size
        Along x, y and z; its middle is at 0.

    Returns
    -------
    Scene
    """
    return Scene([_box((0.0, 0.0, 0.0), size)])


def upright_pose(x: float, y: float, height: float, yaw: float, tilt: Sequence[float] = (0.0, 0.0)) -> Array:
    """Give the pose of a sensor that stands upright.

    Parameters
    ----------
    x, y, height
        Where it stands.
    yaw
        Angle about z, in radians.
    tilt
        Angles about its own y and x axes, in radians.

    Returns
    -------
    (4, 4), T_scene_sensor.
    """
    result = np.eye(4)
    result[:3, :3] = scipy.spatial.transform.Rotation.from_euler("ZYX", [yaw, *tilt]).as_matrix()
    result[:3, 3] = (x, y, height)
    return result


def _shell(x: float, y: float, z: float) -> list[Placed]:
    """Build floor, ceiling and four walls."""
    t = _THICK
    return [
        _box((0.0, 0.0, -0.5 * t), (x + 2 * t, y + 2 * t, t)),
        _box((0.0, 0.0, z + 0.5 * t), (x + 2 * t, y + 2 * t, t)),
        *(_box((side * 0.5 * (x + t), 0.0, 0.5 * z), (t, y + 2 * t, z)) for side in (-1.0, 1.0)),
        *(_box((0.0, side * 0.5 * (y + t), 0.5 * z), (x + 2 * t, t, z)) for side in (-1.0, 1.0)),
    ]


def _thing(rng: np.random.Generator, half: tuple[float, float], scale: float = 1.0) -> Placed:
    """Put a box, a column or a ball on the floor, not where a sensor stands."""
    while True:
        x, y = rng.uniform(-1.0, 1.0, 2) * half
        if np.hypot(x, y) > 1.2 * scale:
            break
    a, b, c = scale * rng.uniform((0.3, 0.3, 0.3), (1.2, 0.8, 1.8))
    kind, yaw = rng.integers(0, 4), rng.uniform(0.0, np.pi)
    if kind == 0:
        return Placed(Cylinder(0.25 * a, c), pose((x, y, 0.5 * c)))
    if kind == 1:
        return Placed(Sphere(0.4 * a), pose((x, y, 0.4 * a)))
    return Placed(Box((a, b, c)), pose((x, y, 0.5 * c), turn(_UP, yaw)))


def _box(middle: Sequence[float], size: Sequence[float]) -> Placed:
    x, y, z = size
    return Placed(Box((x, y, z)), pose(middle))
