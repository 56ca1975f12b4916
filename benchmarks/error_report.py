"""What the measured errors of curvature come to: tables for BENCHMARKS.md and docs/fits.md."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from report import Results, Row, measured_on, verdict

METHODS = {
    "paraboloid": 'fit="paraboloid"',
    "quadric": 'fit="quadric"',
    "auto": 'fit="auto"',
    "jet2": "CGAL jet, degree 2",
    "jet4": "CGAL jet, degree 4",
}
COLUMNS = ("surface", "sagitta / noise", *METHODS.values())
CROSSING_COLUMNS = ("noise [mm]", "radius of curvature [mm]", "sphere: ball [mm]", "cylinder: ball [mm]")
TARGET_BALL, TARGET_NOISE, TARGET_BIAS = 20.0, 0.1, 0.01


@dataclass(frozen=True)
class Error:
    """How wrong one method is in one setting, relative to the truth; lengths in millimetres."""

    surface: str
    quantity: str
    radius: float
    """Of curvature."""
    ball: float
    noise: float
    method: str
    bias: float
    spread: float
    """The standard deviation over the draws."""
    rms: float
    valid: float
    """The share of draws that have a value; the others are left out."""
    quadrics: float
    """The share of draws in which surfsig took the quadric."""

    @property
    def sagitta(self) -> float:
        """How far the surface rises within the ball."""
        return self.ball**2 / (2 * self.radius)


def of_target(errors: Iterable[Error]) -> list[Error]:
    """Return the errors at the ball and the noise that the target names."""
    return [e for e in errors if (e.ball, e.noise) == (TARGET_BALL, TARGET_NOISE)]


def by_surface(errors: Iterable[Error]) -> dict[tuple[str, str, float], dict[str, Error]]:
    """Group errors by surface, quantity and radius, and name each by its method."""
    groups: dict[tuple[str, str, float], dict[str, Error]] = {}
    for error in errors:
        groups.setdefault((error.surface, error.quantity, error.radius), {})[error.method] = error
    return groups


def target_rows(errors: Iterable[Error]) -> list[Row]:
    """Return what was to be reached on spheres and cylinders, and what was."""
    rows: list[Row] = []
    for (surface, quantity, radius), methods in by_surface(of_target(errors)).items():
        if surface not in ("sphere", "cylinder"):
            continue
        ours, jet = methods["quadric"], methods.get("jet4")
        where = f"{quantity} of a {surface} of {radius:g} mm"
        met = abs(ours.bias) < TARGET_BIAS
        rows.append((f"Bias of {where}", "below 1 %", f"{ours.bias:+.2%}", verdict(met)))
        if jet is None:
            rows.append((f"Spread of {where}", "below degree-4 jets", "not measured without CGAL", ""))
            continue
        reached = f"{ours.spread:.2%}, jets {jet.spread:.2%}"
        rows.append((f"Spread of {where}", "below degree-4 jets", reached, verdict(ours.spread < jet.spread)))
    return rows


def error_rows(errors: Iterable[Error]) -> list[Row]:
    """Return the errors of all methods at the target's ball and noise, bias and spread apart."""
    rows: list[Row] = []
    for (surface, quantity, radius), methods in by_surface(of_target(errors)).items():
        any_error = next(iter(methods.values()))
        cells = [cell(methods[name]) if name in methods else "not measured" for name in METHODS]
        ratio = f"{any_error.sagitta / any_error.noise:.0f}"
        rows.append((f"{surface}, {radius:g} mm: {quantity}", ratio, *cells))
    return rows


def cell(error: Error) -> str:
    """Write bias and spread, and how many draws have a value where not all have."""
    missing = "" if error.valid == 1 else f" ({error.valid:.0%} valid)"
    return f"{error.bias:+.1%} ± {error.spread:.1%}{missing}"


def crossing_rows(errors: Iterable[Error]) -> list[Row]:
    """Return the ball from which the quadric errs less than the paraboloid, for each noise and radius."""
    listed = list(errors)
    rows: list[Row] = []
    for noise in sorted({e.noise for e in listed}):
        for radius in sorted({e.radius for e in listed}):
            cells = []
            for surface in ("sphere", "cylinder"):
                chosen = [e for e in listed if (e.surface, e.noise, e.radius) == (surface, noise, radius)]
                cells.append(crossing(chosen))
            rows.append((f"{noise:g}", f"{radius:g}", *cells))
    return rows


def crossing(errors: Iterable[Error]) -> str:
    """Return the ball from which the quadric is taken and errs less, by root mean square, for good."""
    listed = list(errors)
    plain = np.array([e.rms for e in listed if e.method == "paraboloid"])
    quadrics = [e for e in listed if e.method == "quadric"]
    balls = np.array([e.ball for e in quadrics])
    taken = np.array([e.quadrics > 0.5 for e in quadrics])
    gains = np.log(plain / [e.rms for e in quadrics])
    worse = np.flatnonzero(~(taken & (gains > 0)))
    if len(worse) == 0:
        return f"below {balls[0]:g}"
    last = worse[-1]
    if last == len(balls) - 1:
        return f"above {balls[-1]:g}"
    ball = balls[last + 1]
    if taken[last]:
        ball = np.exp(np.interp(0, gains[last : last + 2], np.log(balls[last : last + 2])))
    sagitta = ball**2 / (2 * listed[0].radius)
    return f"{ball:.3g} (sagitta {sagitta / listed[0].noise:.0f} noises)"


def notes(measured: Results, draws: int, points: int) -> list[str]:
    """Return the sentences that belong to the tables."""
    return [
        *measured_on(measured),
        f"{draws} draws of each setting, {points} points within every ball whatever its size. "
        "All settings: `benchmarks/curvature_error.csv`.",
    ]
