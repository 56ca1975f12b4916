"""Pipes: cylinders and elbows joined to runs, with their lengths."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from surfsig.digits import with_error
from surfsig.shapes.geometry import Array
from surfsig.shapes.propagation import Located, propagated
from surfsig.shapes.relation import nearest_of_axes
from surfsig.shapes.surface import Surface
from surfsig.surfaces.pipe_joints import End, Joint, JointKind, end_point, find_joints


@dataclass(frozen=True, eq=False)
class PipeSegment:
    """A straight piece of a pipe, a cylinder; lengths in the scan's unit."""

    surface: int
    """The number of its surface."""
    start: Array
    """(3,), on the axis, where the piece begins: at the joint, or, at the run's own ends, where the points
    end."""
    end: Array
    """(3,), where it ends."""
    radius: float
    """Of the cylinder."""
    radius_std: float
    """Its standard error."""
    length: float
    """From start to end."""
    length_std: float
    """Its standard error, as `PipeRun.length_std` says."""


@dataclass(frozen=True, eq=False)
class PipeJoint:
    """What joins two straight pieces of a pipe."""

    kind: JointKind
    """"elbow": a torus that was found; "corner": no torus was found, but the axes meet; "straight": the
    pieces lie in line."""
    surface: int
    """The number of the elbow's surface; -1 for others."""
    angle: float
    """By which the run turns, in radians."""
    angle_std: float
    """Its standard error; NaN for a straight one."""
    bend_radius: float
    """Of an elbow, the torus's major radius: from its axis to the middle of the pipe; NaN for others."""
    bend_radius_std: float
    """Its standard error; where the pipes took some of the elbow's points, the bend radius errs more, by 4 %
    of a simulated one."""
    length: float
    """Along the middle of the pipe: of an elbow the bend radius times the angle; of a corner 0, for its
    pieces reach to where the axes meet; of a straight one the gap."""


@dataclass(frozen=True, eq=False, repr=False)
class PipeRun:
    """Pipes that are joined end to end: `Surfaces.pipe_runs`."""

    segments: list[PipeSegment]
    """The straight pieces, two or more, in order."""
    joints: list[PipeJoint]
    """Between a segment and the next; of a closed run the last one joins the last segment to the first."""
    radius: float
    """Mean of the segments' radii, by their standard errors."""
    radius_std: float
    """Its standard error."""
    length: float
    """Along the middle of the pipe, from end to end."""
    length_std: float
    """Its standard error by the covariances of all its surfaces, that is of joints and directions; where the
    points end at the run's own ends is taken as it is."""

    def to_dict(self) -> dict[str, Any]:
        """Name all values, as JSON calls them.

        Returns
        -------
        dict
            radius, radius_std, length, length_std; segments and joints, each a list of dicts with the names
            of `PipeSegment` and `PipeJoint`; arrays as lists.
        """
        return {
            "radius": self.radius,
            "radius_std": self.radius_std,
            "length": self.length,
            "length_std": self.length_std,
            "segments": [_plain(segment) for segment in self.segments],
            "joints": [_plain(joint) for joint in self.joints],
        }

    def __repr__(self) -> str:
        pieces = f"{len(self.segments)} segments, {len(self.joints)} joints"
        return f"PipeRun({pieces}, length={with_error(self.length, self.length_std)})"


def find_pipe_runs(surfaces: Sequence[Surface]) -> list[PipeRun]:
    """Join pipes to runs, as `Surfaces.pipe_runs` says; the longest first."""
    runs = [_run(surfaces, ends, joints) for ends, joints in _chains(find_joints(surfaces))]
    return sorted(runs, key=lambda run: -run.length)


def _chains(joints: Sequence[Joint]) -> list[tuple[list[End], list[Joint]]]:
    """Follow the joints: of each run the ends at which its cylinders are entered, and its joints in order."""
    joint_at = {end: joint for joint in joints for end in joint.ends}
    numbers = sorted({end.cylinder for end in joint_at})
    free = [End(n, side) for n in numbers for side in (-1, 1) if End(n, side) not in joint_at]
    seen: set[int] = set()
    chains = []
    # Runs with ends are followed from one of these; what is left then is closed.
    for start in [*free, *(End(number, -1) for number in numbers)]:
        if start.cylinder in seen:
            continue
        entries, passed, entry = [start], [], start
        seen.add(start.cylinder)
        while (joint := joint_at.get(End(entry.cylinder, -entry.side))) is not None:
            passed.append(joint)
            entry = joint.ends[joint.ends[0].cylinder == entry.cylinder]
            if entry.cylinder in seen:
                break
            seen.add(entry.cylinder)
            entries.append(entry)
        chains.append((entries, passed))
    return chains


def _run(surfaces: Sequence[Surface], entries: Sequence[End], joints: Sequence[Joint]) -> PipeRun:
    """Measure a run."""
    numbers = [entry.cylinder for entry in entries]
    parts = numbers + sorted({joint.torus for joint in joints} - {-1})
    origin = surfaces[numbers[0]].center
    # Along its axis an end of the points is as far from where the axis is held as it was found.
    heights = {
        End(number, side): float(
            (end_point(surfaces[number], side) - surfaces[number].point) @ surfaces[number].axis
        )
        for number in numbers
        for side in (-1, 1)
    }

    def measured(located: Sequence[Located]) -> Array:
        """Give the segments' ends (k, 2, 3), their lengths (k,), and the joints' angles and lengths."""
        of = dict(zip(parts, located, strict=True))
        positions = {
            end: of[end.cylinder].point + height * of[end.cylinder].axis for end, height in heights.items()
        }
        angles, between = [], []
        for joint in joints:
            positions |= _joined_at(joint, of)
            outward = [end.side * of[end.cylinder].axis for end in joint.ends]
            angles.append(_angle(outward[0], -outward[1]))
            gap = positions[joint.ends[1]] - positions[joint.ends[0]]
            straight = max(0.0, float(gap @ outward[0])) if joint.kind == "straight" else 0.0
            between.append(angles[-1] * of[joint.torus].major_radius if joint.torus >= 0 else straight)
        ends = np.array(
            [[positions[entry], positions[End(entry.cylinder, -entry.side)]] for entry in entries]
        )
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        return np.concatenate([ends.ravel(), lengths, angles, between])

    found = propagated([surfaces[number] for number in parts], measured, origin)
    ends, lengths, angles, between = np.split(
        found.value, np.cumsum([6 * len(entries), len(entries), len(joints)])
    )
    positions = ends.reshape(-1, 2, 3) + origin
    total = np.zeros(len(found.value))
    total[len(ends) : len(ends) + len(lengths)] = total[-len(joints) :] = 1.0
    stds = [found.std_along(unit) for unit in np.eye(len(total))[len(ends) :]]
    segments = [
        PipeSegment(
            surface=number,
            start=position[0],
            end=position[1],
            radius=surfaces[number].radius,
            radius_std=surfaces[number].radius_std,
            length=float(length),
            length_std=length_std,
        )
        for number, position, length, length_std in zip(numbers, positions, lengths, stds, strict=False)
    ]
    described = [
        PipeJoint(
            joint.kind,
            joint.torus,
            float(angle),
            math.nan if joint.kind == "straight" else angle_std,
            surfaces[joint.torus].major_radius if joint.torus >= 0 else math.nan,
            surfaces[joint.torus].major_radius_std if joint.torus >= 0 else math.nan,
            float(length),
        )
        for joint, angle, angle_std, length in zip(
            joints, angles, stds[len(lengths) :], between, strict=False
        )
    ]
    radius, radius_std = _mean_radius([surfaces[number] for number in numbers])
    return PipeRun(
        segments, described, radius, radius_std, float(total @ found.value), found.std_along(total)
    )


def _joined_at(joint: Joint, of: Mapping[int, Located]) -> dict[End, Array]:
    """Give where the segments end at a joint: where the elbow touches their axes, or where these meet."""
    cylinders = [of[end.cylinder] for end in joint.ends]
    if joint.kind == "straight":
        return {}
    if joint.kind == "corner":
        first, second = cylinders
        feet = nearest_of_axes(first.point, first.axis, second.point, second.axis)
        return dict(zip(joint.ends, feet, strict=True))
    torus = of[joint.torus]
    return {
        end: nearest_of_axes(torus.point, torus.axis, cylinder.point, cylinder.axis)[1]
        for end, cylinder in zip(joint.ends, cylinders, strict=True)
    }


def _angle(first: Array, second: Array) -> float:
    """Give the angle between two unit vectors, 0 to pi."""
    return math.atan2(float(np.linalg.norm(np.cross(first, second))), float(first @ second))


def _mean_radius(cylinders: Sequence[Surface]) -> tuple[float, float]:
    """Give the mean by inverse variances, and its error; the plain mean where an error is not known."""
    radii = np.array([surface.radius for surface in cylinders])
    stds = np.array([surface.radius_std for surface in cylinders])
    if not (stds > 0.0).all():
        return float(radii.mean()), math.nan
    weights = stds**-2.0
    return float(weights @ radii / weights.sum()), float(weights.sum() ** -0.5)


def _plain(part: PipeSegment | PipeJoint) -> dict[str, Any]:
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in asdict(part).items()
        if isinstance(value, str) or not np.isnan(value).all()
    }
