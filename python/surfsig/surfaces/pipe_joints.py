"""Which cylinders' ends are joined: by a torus as an elbow, where their axes meet, or along one line."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from surfsig.shapes.geometry import Array
from surfsig.shapes.relation import PARALLEL_LIMIT, angle_of_axes, nearest_of_axes
from surfsig.shapes.surface import Surface

JointKind = Literal["elbow", "corner", "straight"]
"""How two straight pieces of a pipe are joined."""

_SIGNIFICANT = 2.576
"""Standard errors at which a difference is one: in 99 of 100 cases that is not by chance."""

_SAME_RADIUS = 0.03
"""Share of the radius up to which pipes count as equal, whatever their errors: a scanner's own errors make
radii some 0.3 % wrong, tori of short elbows 1 %; the sizes in which pipes are made differ by 10 % or more."""

_NEAR_AXIS = 0.25
"""Of the radius, up to which axes count as meeting, and an elbow's circle as touching them: of simulated
pipes (tests/surfaces/test_pipe_runs.py) the circles are up to 0.12 of it beside."""

_REACH = 8.0
"""Radii from the end of a cylinder's points to the joint, at most, and between the ends of pieces in line: an
elbow of a bend radius of three diameters is set back by 6 at a right angle, and flanges hide some more."""

_BEYOND = 2.0
"""Radii by which a cylinder may reach over its joint: the outside of an elbow is taken for it at first. What
goes on farther, as at a tee, is not joined there."""

_ACROSS_ELBOW = math.radians(75.0)
"""Smallest angle between an elbow's axis and its pipes' axes, which is a right one but for errors."""


@dataclass(frozen=True)
class End:
    """One end of a cylinder."""

    cylinder: int
    """Its surface's number."""
    side: int
    """1 where the axis points, else -1."""


@dataclass(frozen=True)
class Joint:
    """Two ends that are joined."""

    kind: JointKind
    ends: tuple[End, End]
    torus: int
    """The elbow's surface; -1 for none."""
    distance: float
    """Between the ends' points; the nearest are joined first."""


def find_joints(surfaces: Sequence[Surface]) -> list[Joint]:
    """Find the joints of cylinders of equal radius; each end and each torus is in one joint at most."""
    cylinders = [number for number, surface in enumerate(surfaces) if surface.kind == "cylinder"]
    tori = [number for number, surface in enumerate(surfaces) if surface.kind == "torus"]
    candidates = [
        joint
        for pair in itertools.combinations(cylinders, 2)
        if _equal_radii(surfaces[pair[0]], surfaces[pair[1]])
        for joint in _joints_of(surfaces, pair, tori)
    ]
    # An elbow that was found explains more than axes that meet.
    candidates.sort(key=lambda joint: (joint.kind != "elbow", joint.distance, joint.ends[0].cylinder))
    taken_ends: set[End] = set()
    taken_tori: set[int] = set()
    joints = []
    for joint in candidates:
        if taken_ends.isdisjoint(joint.ends) and joint.torus not in taken_tori:
            taken_ends.update(joint.ends)
            taken_tori.update({joint.torus} - {-1})
            joints.append(joint)
    return joints


def end_point(surface: Surface, side: int) -> Array:
    """Give the position on a cylinder's axis at which its points end."""
    return np.asarray(surface.center + 0.5 * side * surface.length * surface.axis)


def _equal_radii(first: Surface, second: Surface) -> bool:
    difference = abs(first.radius - second.radius)
    error = math.hypot(first.radius_std, second.radius_std)
    significant = 0.0 if math.isnan(error) else _SIGNIFICANT * error
    return difference <= max(_SAME_RADIUS * first.radius, significant)


def _joints_of(surfaces: Sequence[Surface], pair: tuple[int, int], tori: Sequence[int]) -> list[Joint]:
    """Give the possible joints of two cylinders of equal radius."""
    first, second = surfaces[pair[0]], surfaces[pair[1]]
    if angle_of_axes(first.axis, second.axis) < PARALLEL_LIMIT:
        return _straight(first, second, pair)
    found = []
    for torus in tori:
        if _equal_radii(first, surfaces[torus]) and _equal_radii(second, surfaces[torus]):
            feet = [_touching(surface, surfaces[torus]) for surface in (first, second)]
            found += _at_feet("elbow", surfaces, pair, feet, torus)
    return found or _corner(surfaces, pair)


def _corner(surfaces: Sequence[Surface], pair: tuple[int, int]) -> list[Joint]:
    """Join two cylinders whose axes meet."""
    first, second = surfaces[pair[0]], surfaces[pair[1]]
    feet = nearest_of_axes(first.point, first.axis, second.point, second.axis)
    apart = float(np.linalg.norm(feet[1] - feet[0]))
    radius = first.radius
    if apart > _NEAR_AXIS * radius:
        error = first.distance_to(second).std if apart < radius else 0.0
        if not apart <= _SIGNIFICANT * error:
            return []
    return _at_feet("corner", surfaces, pair, list(feet), -1)


def _touching(cylinder: Surface, torus: Surface) -> Array | None:
    """Give where a torus's middle circle touches a cylinder's axis; None where it does not."""
    if angle_of_axes(cylinder.axis, torus.axis) < _ACROSS_ELBOW:
        return None
    on_torus_axis, foot = nearest_of_axes(torus.center, torus.axis, cylinder.point, cylinder.axis)
    above = float(np.linalg.norm(on_torus_axis - torus.center))
    beside = abs(float(np.linalg.norm(foot - on_torus_axis)) - torus.major_radius)
    return np.asarray(foot) if max(above, beside) <= _NEAR_AXIS * cylinder.radius else None


def _at_feet(
    kind: JointKind,
    surfaces: Sequence[Surface],
    pair: tuple[int, int],
    feet: Sequence[Array | None],
    torus: int,
) -> list[Joint]:
    """Join two cylinders at points of their axes, if these are at their ends."""
    # The outside of an elbow may be taken for the pipe, up to a bend radius beyond where it begins.
    bend = 0.0 if torus < 0 else surfaces[torus].major_radius
    ends, positions = [], []
    for number, foot in zip(pair, feet, strict=True):
        if foot is None:
            return []
        surface = surfaces[number]
        from_center = float((foot - surface.center) @ surface.axis)
        side = 1 if from_center >= 0.0 else -1
        missing = abs(from_center) - 0.5 * surface.length
        if not -_BEYOND * surface.radius - bend <= missing <= _REACH * surface.radius + bend:
            return []
        ends.append(End(number, side))
        positions.append(end_point(surface, side))
    distance = float(np.linalg.norm(positions[1] - positions[0]))
    return [Joint(kind, (ends[0], ends[1]), torus, distance)]


def _straight(first: Surface, second: Surface, pair: tuple[int, int]) -> list[Joint]:
    """Join two cylinders one behind the other."""
    between = second.center - first.center
    sides = (1 if between @ first.axis >= 0.0 else -1, 1 if between @ second.axis < 0.0 else -1)
    positions = [end_point(surface, side) for surface, side in zip((first, second), sides, strict=True)]
    gap = positions[1] - positions[0]
    along = sides[0] * float(gap @ first.axis)
    beside = float(np.linalg.norm(gap - (gap @ first.axis) * first.axis))
    is_near = -_BEYOND * first.radius <= along <= _REACH * first.radius
    if not is_near or beside > _NEAR_AXIS * first.radius:
        return []
    ends = (End(pair[0], sides[0]), End(pair[1], sides[1]))
    return [Joint("straight", ends, -1, float(np.linalg.norm(gap)))]
