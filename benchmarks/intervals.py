"""Measure how often the 95 % intervals of surfaces that `find_surfaces` finds hold the true sizes.

Each simulated scene has one surface, a curved one over 20 to 360 degrees, among planes or pipes at its
border. A scene counts where a surface of its kind has most of its points and no more of others.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from interval_scenes import KINDS, NOISES, IntervalScene, interval_scene
from report import markdown_table, publish
from rich.console import Console
from rich.progress import Progress
from scipy.stats import t as student

import surfsig
from surfsig import Surface

COLUMNS = (
    "kind", "size", "noise", "found / scenes", "determined", "interval holds it", "error / standard error",
    "the same, median", "standard error / size",
)  # fmt: skip

ARC_COLUMNS = (
    "arc, degrees",
    "noise",
    "found / scenes",
    "determined",
    "intervals that hold",
    "error / standard error",
)

ARC_ENDS = (20.0, 60.0, 120.0, 240.0, 360.0)

LEVEL = 0.95
"""Of the intervals."""

MEDIAN = 0.6745
"""The median of a standard normal variable's absolute values."""

MOST = 0.5
"""Part of the scene's surface that the found one must have, and of the found one that must be the scene's."""


@dataclass(frozen=True)
class Found:
    """A size of a surface that was found beside the true one."""

    size: str
    determined: bool
    holds: bool
    error: float
    """In standard errors."""
    relative: float
    """The standard error in units of the size."""


@dataclass(frozen=True)
class Outcome:
    """What came of a scene; no sizes where its surface was not found."""

    kind: str
    noise: str
    arc: float
    sizes: tuple[Found, ...]


def matched(scene: IntervalScene) -> Surface | None:
    """Find the surface of the scene, if it has most of its points and the same kind."""
    found = surfsig.find_surfaces(scene.points)
    labels = found.labels[scene.members]
    counts = np.bincount(labels[labels >= 0], minlength=max(len(found), 1))
    number = int(counts.argmax())
    if counts[number] < MOST * scene.members.sum() or found[number].kind != scene.truth.kind:
        return None
    return found[number] if counts[number] > MOST * found[number].count else None


def sizes(scene: IntervalScene, surface: Surface) -> Iterator[Found]:
    """Compare the sizes of a surface with the true ones."""
    truth, determined = scene.truth, surface.radius_determined
    most = float(student.ppf(0.5 + LEVEL / 2, surface.degrees_of_freedom))
    if surface.kind == "plane":
        std = float(np.linalg.norm(surface.center_std))
        error = float((surface.center - truth.point) @ truth.axis) / std
        yield Found("offset", determined, abs(error) <= most, error, std / truth.radius)
        return
    radius = truth.radius_beside(surface.point) if truth.kind == "cone" else truth.radius
    low, high = surface.interval
    error = (surface.fitted_radius - radius) / surface.radius_std
    yield Found("radius", determined, low <= radius <= high, error, surface.radius_std / radius)
    others = {
        "torus": ("major radius", surface.major_radius, surface.major_radius_std, truth.major_radius),
        "cone": ("half angle", surface.half_angle, surface.half_angle_std, truth.half_angle),
    }
    if surface.kind in others:
        name, value, std, true = others[surface.kind]
        error = (value - true) / std
        yield Found(name, determined, abs(error) <= most, error, std / true)


def measure(seeds: Sequence[int], kinds: Sequence[str], console: Console) -> list[Outcome]:
    """Look for the surface of every scene."""
    outcomes = []
    with Progress(console=console, transient=True) as progress:
        for seed in progress.track(seeds, description="scenes"):
            for kind in kinds:
                for noise in NOISES:
                    scene = interval_scene(kind, noise, seed)
                    surface = matched(scene)
                    compared = () if surface is None else tuple(sizes(scene, surface))
                    outcomes.append(Outcome(kind, noise, scene.arc, compared))
    return outcomes


def cells(found: Sequence[Found], scenes: int, each: int = 1) -> tuple[str, ...]:
    """Summarise sizes of which each scene has so many."""
    determined = [size for size in found if size.determined]
    counts = f"{len(found) // each} / {scenes}", str(len(determined) // each)
    if not determined:
        return (*counts, "", "", "", "")
    errors = np.array([size.error for size in determined])
    held = np.mean([size.holds for size in determined])
    return (
        *counts,
        f"{held:.1%}",
        f"{math.sqrt(np.mean(errors**2)):.2f}",
        f"{np.median(np.abs(errors)) / MEDIAN:.2f}",
        f"{np.median([size.relative for size in determined]):.2%}",
    )


def rows(outcomes: Sequence[Outcome]) -> list[tuple[str, ...]]:
    """Return a row for each size of each kind, for each noise."""
    table = []
    for kind in KINDS:
        for size in dict.fromkeys(
            found.size for each in outcomes if each.kind == kind for found in each.sizes
        ):
            for noise in NOISES:
                scenes = [each for each in outcomes if (each.kind, each.noise) == (kind, noise)]
                found = [found for each in scenes for found in each.sizes if found.size == size]
                table.append((kind, size, noise, *cells(found, len(scenes))))
    return table


def arc_rows(outcomes: Iterable[Outcome]) -> list[tuple[str, ...]]:
    """Return a row for each range of arcs, for each noise: the radii of all kinds."""
    table = []
    for low, high in pairwise(ARC_ENDS):
        for noise in NOISES:
            scenes = [
                each
                for each in outcomes
                if each.noise == noise and each.kind != "plane" and low <= each.arc < high
            ]
            found = [found for each in scenes for found in each.sizes if found.size == "radius"]
            table.append((f"{low:.0f} to {high:.0f}", noise, *cells(found, len(scenes))[:4]))
    return table


def markdown(outcomes: Sequence[Outcome], seeds: Sequence[int]) -> str:
    """Return all tables and notes as Markdown."""
    notes = (
        f"- Seeds {seeds[0]} to {seeds[-1]}. `find_surfaces` has no parameter set. The radius's interval is "
        "`interval`; those of the other sizes are Student's t with `degrees_of_freedom`.\n"
        "- Error / standard error: the root of the mean square, and the median of the absolute values in "
        "units of a normal variable's. Intervals count where `radius_determined` is true. A plane's offset "
        "is that of its `center`, in units of the radius of its neighbour.\n"
    )
    return "\n\n".join(
        [markdown_table(COLUMNS, rows(outcomes)), markdown_table(ARC_COLUMNS, arc_rows(outcomes)), notes]
    )


def read_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seeds", type=int, nargs=2, default=(2000, 2050), metavar=("FIRST", "END"),
        help="the scenes' seeds, without END (default: 2000 2050)",
    )  # fmt: skip
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    if not 0 <= arguments.seeds[0] < arguments.seeds[1]:
        parser.error("seeds are not negative, and END is above FIRST")
    return arguments


def main() -> None:
    """Measure, print and write."""
    arguments = read_arguments()
    seeds = range(*arguments.seeds)
    outcomes = measure(seeds, arguments.kinds, Console(stderr=True))
    publish(markdown(outcomes, seeds), "make bench-intervals", arguments.write)


if __name__ == "__main__":
    main()
