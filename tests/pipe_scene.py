"""A simulated pipe: straight pieces and elbows, with what is known of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from surface_points import Array

from surfsig.geometry import axes_across


@dataclass(frozen=True)
class Pipe:
    """Points of a pipe, and the ends of its straight pieces."""

    points: Array
    ends: Array
    """(pieces, 2, 3)."""


def pipe(
    corners: Array,
    radius: float,
    bend_radius: float,
    *,
    noise: float,
    density: float,
    seed: int,
    elbows: bool = True,
) -> Pipe:
    """Give a pipe along corners, each rounded by an elbow of a bend radius.

    Without `elbows` the points at these are missing, as where flanges or insulation hide them.
    """
    rng = np.random.default_rng(seed)
    along = np.diff(corners, axis=0)
    directions = along / np.linalg.norm(along, axis=1, keepdims=True)
    turns = np.arccos(np.sum(directions[:-1] * directions[1:], axis=1))
    setbacks = [0.0, *(bend_radius * np.tan(0.5 * turns)), 0.0]
    parts, ends = [], []
    for number, direction in enumerate(directions):
        start = corners[number] + setbacks[number] * direction
        end = corners[number + 1] - setbacks[number + 1] * direction
        ends.append((start, end))
        length = float(np.linalg.norm(end - start))
        count = round(density * 2 * math.pi * radius * length)
        heights, angles = rng.uniform(0, length, count), rng.uniform(0, 2 * math.pi, count)
        distance = radius + noise * rng.normal(size=count)
        parts.append(start + np.outer(heights, direction) + around(direction, angles, distance))
    for number, turn in enumerate(turns) if elbows else ():
        parts.append(
            elbow(
                rng,
                ends[number][1],
                directions[number : number + 2],
                turn,
                radius,
                bend_radius,
                noise,
                density,
            )
        )
    return Pipe(np.concatenate(parts), np.array(ends))


def around(direction: Array, angles: Array, distance: Array) -> Array:
    """Give vectors across a direction."""
    first, second = axes_across(direction)
    return np.outer(distance * np.cos(angles), first) + np.outer(distance * np.sin(angles), second)


def elbow(
    rng: np.random.Generator,
    start: Array,
    directions: Sequence[Array] | Array,
    turn: float,
    radius: float,
    bend_radius: float,
    noise: float,
    density: float,
) -> Array:
    """Give points of a part of a torus that begins at a point and turns from one direction to another."""
    before, after = directions
    inward = after - (after @ before) * before
    inward /= np.linalg.norm(inward)
    axis = np.cross(before, inward)
    count = round(2 * density * 2 * math.pi * radius * turn * bend_radius)
    angle, tube = rng.uniform(0, turn, count), rng.uniform(0, 2 * math.pi, count)
    # Outside there is more of it.
    kept = rng.uniform(0, bend_radius + radius, count) < bend_radius + radius * np.cos(tube)
    angle, tube = angle[kept], tube[kept]
    distance = radius + noise * rng.normal(size=len(tube))
    outward = np.outer(np.sin(angle), before) - np.outer(np.cos(angle), inward)
    away = bend_radius + distance * np.cos(tube)
    center = start + bend_radius * inward
    points: Array = center + away[:, None] * outward + np.outer(distance * np.sin(tube), axis)
    return points
