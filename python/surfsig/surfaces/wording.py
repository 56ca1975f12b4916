"""The surfaces in words and sensible digits: a table for people."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from surfsig.digits import decimals_of, with_error
from surfsig.shapes.surface import Surface
from surfsig.surfaces.pipe_runs import PipeRun

HEADER = ("", "kind", "radius", "95 % interval", "size", "area", "points", "rms")

_JOINTS = {"elbow": "elbows", "corner": "corners", "straight": "straight joints"}


def summary_of(surfaces: Sequence[Surface], share: float, points: int) -> str:
    """Say how many surfaces of each kind there are, and which share of how many points they have."""
    counts = Counter(surface.kind for surface in surfaces).most_common()
    kinds = ", ".join(f"{count} {_plural(kind, count)}" for kind, count in counts)
    total = f"{len(surfaces)} {_plural('surface', len(surfaces))}"
    return f"{total}: {kinds}; {share:.1%} of {points:,} points"


def _plural(word: str, count: int) -> str:
    return word if count == 1 else {"torus": "tori"}.get(word, word + "s")


def table_rows(surfaces: Iterable[Surface]) -> list[tuple[str, ...]]:
    """Describe each surface in as many words as `HEADER` has."""
    return [
        (
            str(number),
            surface.kind,
            *_radius(surface),
            _size(surface),
            _number(surface.area),
            f"{surface.count:,}",
            f"{surface.rms:.2g}",
        )
        for number, surface in enumerate(surfaces)
    ]


def run_rows(runs: Iterable[PipeRun]) -> list[tuple[str, ...]]:
    """Describe each run of pipes in as many words as `HEADER` has."""
    rows: list[tuple[str, ...]] = []
    for run in runs:
        path = "-".join(str(segment.surface) for segment in run.segments)
        length = with_error(run.length, run.length_std)
        kinds = Counter(joint.kind for joint in run.joints)
        joints = ", ".join(
            f"{count} {kind if count == 1 else _JOINTS[kind]}" for kind, count in kinds.items()
        )
        rows.append(("", f"pipe {path}", f"{run.radius:.5g}", "", f"{length} long, {joints}", "", "", ""))
    return rows


def _radius(surface: Surface) -> tuple[str, str]:
    """Write the radius and its interval with two digits of the error."""
    if math.isnan(surface.fitted_radius):
        return "", ""
    low, high = surface.interval
    if not surface.radius_determined:
        return "not determined", f"above {low:.3g}" if low > 0 else ""
    if not high > low:
        return f"{surface.radius:.5g}", ""
    decimals = decimals_of(surface.radius, 0.5 * (high - low))
    return f"{surface.radius:.{decimals}f}", f"{low:.{decimals}f} to {high:.{decimals}f}"


def _size(surface: Surface) -> str:
    degrees = math.degrees(surface.arc)
    if surface.kind == "plane":
        return f"{_number(surface.length)} x {_number(surface.width)}"
    if surface.kind == "sphere":
        return f"{degrees:.0f}° wide"
    size = f"{_number(surface.length)} long, {degrees:.0f}° round"
    if surface.kind == "cone":
        error = _error(math.degrees(surface.half_angle_std))
        return f"half angle {math.degrees(surface.half_angle):.4g}°{error}, {size}"
    if surface.kind == "torus":
        return f"major radius {surface.major_radius:.5g}{_error(surface.major_radius_std)}, {size}"
    return size


def _error(error: float) -> str:
    return "" if math.isnan(error) else f" +- {error:.2g}"


def _number(value: float) -> str:
    return f"{value:.3g}"
