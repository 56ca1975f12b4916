"""Points drawn from a unit sphere, a unit cylinder and a square, with noise across the surface."""

import numpy as np
from surface_points import Array


def sphere(rng: np.random.Generator, lowest: float, noise: float = 0.0, count: int = 400) -> Array:
    """Give points of a unit sphere about 0, as far down as the lowest z."""
    z, turn = rng.uniform(lowest, 1, count), rng.uniform(0, 2 * np.pi, count)
    width = np.sqrt(1 - z * z)
    points = np.column_stack([width * np.cos(turn), width * np.sin(turn), z])
    return points * (1 + noise * rng.normal(size=(count, 1)))


def cylinder(rng: np.random.Generator, arc: float, noise: float = 0.0, count: int = 400) -> Array:
    """Give points of a unit cylinder along z, of length 2, over an arc."""
    turn = rng.uniform(-arc / 2, arc / 2, count)
    radius = 1 + noise * rng.normal(size=count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), rng.uniform(-1, 1, count)])


def plane(rng: np.random.Generator, noise: float = 0.0, count: int = 400) -> Array:
    """Give points of the plane z = 0, in a square of side 2."""
    return np.column_stack([rng.uniform(-1, 1, (count, 2)), noise * rng.normal(size=count)])


def revolved(
    rng: np.random.Generator,
    kind: str,
    sizes: tuple[float, ...],
    count: int,
    *,
    arc: float,
    noise: float = 0.0,
    rings: bool = False,
    thickness: bool = False,
) -> Array:
    """Give points of a shape about 0 along z, over an arc, with noise across it (or in all directions).

    Parameters
    ----------
    sizes
        The radius, and a cone's half angle or a torus's major radius.
    rings
        Whether the points are on two rings instead of all over the shape.
    thickness
        Whether the noise has all directions.
    """
    turn = rng.uniform(0, arc, count)
    along = np.arange(count) % 2.0 if rings else rng.uniform(0, 1, count)
    first, second = rng.normal(scale=noise, size=(2, count))
    zero = np.zeros(count)
    if kind == "plane":
        away, height = np.sqrt(along), first
    elif kind == "sphere":
        away, height = ((sizes[0] + first) * part for part in (np.sqrt(1 - along**2), along))
    elif kind == "cylinder":
        away, height = sizes[0] + first, 2 * along - 1
    elif kind == "cone":
        sine, cosine = np.sin(sizes[1]), np.cos(sizes[1])
        away, height = sizes[0] + along * sine + first * cosine, along * cosine - first * sine
    elif kind == "torus":
        tube = sizes[0] + first
        away = sizes[1] + tube * np.cos(2 * np.pi * along)
        height = tube * np.sin(2 * np.pi * along)
    elif kind == "circle":
        away, height = sizes[0] + first, second
    else:
        return np.column_stack([first, second, along])
    points = np.column_stack([away * np.cos(turn), away * np.sin(turn), height + zero])
    return points + noise * rng.normal(size=points.shape) if thickness else points
