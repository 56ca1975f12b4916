"""Try values of one setting on simulated scenes: what is right, wrong and missing, and how long it takes.

It repeats the choices that `RegistrationSettings`, `OdometrySettings` and `FindSettings` explain, and shows
what another value costs::

    python benchmarks/sweep_settings.py find proposals 600 1000 1500
    python benchmarks/sweep_settings.py register keypoints 300 1000 --seeds 11 12
    python benchmarks/sweep_settings.py odometry voxels_of_scan 1000 3000 9000
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import finding
import moving_sensor
import numpy as np
from finding_scene import OBJECTS, finding_scene, whole
from report import Row, markdown_table
from rich.progress import track

import surfsig

COLUMNS = ("value", "asked", "right", "wrong", "largest error of right", "processor seconds")
SCANS = 70
"""Of the way through the building."""
APART = (2, 4, 8)
"""Scans of the way between two that are registered."""
RIGHT = 0.1
"""Metres within which a pose in the building is right."""
ONE_THREAD = 1


class Score(NamedTuple):
    """Answers to one seed, the largest error of the right ones in metres, and the time they took."""

    asked: int
    right: int
    wrong: int
    error: float
    seconds: float


def timed(function: Callable[..., Any], *arguments: Any, settings: Any) -> tuple[Any, float]:
    """Give a result and the processor seconds that it took."""
    start = time.process_time()
    result = function(*arguments, settings=settings, threads=ONE_THREAD)
    return result, time.process_time() - start


def find(seed: int, settings: Any) -> list[Score]:
    """Look for five half hidden copies of each object."""
    scores = []
    for name in OBJECTS:
        scene, model = finding_scene(name, seed), whole(name)
        found, seconds = timed(surfsig.find_instances, model, scene.cloud, settings=settings)
        score = finding.scored(scene, found)
        scores.append(Score(len(scene.poses), score.right, score.false, score.shift, seconds))
    return scores


def register(seed: int, settings: Any) -> list[Score]:
    """Register scans of a building; an answer that is not trusted is no answer."""
    building, true = moving_sensor.building(seed), moving_sensor.way(SCANS)
    scores = []
    for step in APART:
        for first in range(0, SCANS - step, 20):
            pair = [moving_sensor.scan(building, true[i], i) for i in (first + step, first)]
            found, seconds = timed(surfsig.register, *pair, settings=settings)
            truth = np.linalg.inv(true[first]) @ true[first + step]
            off = float(np.linalg.norm((found.T_target_source - truth)[:3, 3])) if found.trusted else np.inf
            is_right = off <= RIGHT
            wrong = int(found.trusted and not is_right)
            scores.append(Score(1, int(is_right), wrong, off if is_right else 0.0, seconds))
    return scores


def odometry(seed: int, settings: Any) -> list[Score]:
    """Follow a lidar through a building; a scan that is lost has no answer."""
    building, true = moving_sensor.building(seed), moving_sensor.way(SCANS)
    scans = [moving_sensor.scan(building, pose, number) for number, pose in enumerate(true)]
    found, seconds = timed(surfsig.estimate_odometry, scans, settings=settings)
    off, _ = moving_sensor.errors(found.poses, true)
    right = off <= RIGHT
    wrong = int((off > RIGHT).sum())
    return [Score(SCANS, int(right.sum()), wrong, float(off[right].max(initial=0.0)), seconds)]


TASKS: dict[str, tuple[Callable[[int, Any], list[Score]], Any]] = {
    "find": (find, surfsig.FindSettings),
    "register": (register, surfsig.RegistrationSettings),
    "odometry": (odometry, surfsig.OdometrySettings),
}


def row(value: str, scores: Sequence[Score]) -> Row:
    """Sum up what one value gives."""
    asked, right, wrong, _, seconds = np.sum(scores, axis=0)
    error = max(score.error for score in scores)
    return value, f"{asked:.0f}", f"{right:.0f}", f"{wrong:.0f}", f"{1000 * error:.1f} mm", f"{seconds:.2f}"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("task", choices=list(TASKS))
    parser.add_argument("setting", help="a keyword of the task's settings class")
    parser.add_argument("values", nargs="+", help="as JSON: 5, 0.3, [4, 2.5, 4]")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    arguments = parser.parse_args()
    work, settings_class = TASKS[arguments.task]
    try:
        choices = {text: settings_class(**{arguments.setting: json.loads(text)}) for text in arguments.values}
    except (TypeError, ValueError) as error:
        sys.exit(f"{arguments.task}: {error}")
    rows = [
        row(
            text,
            [score for seed in track(arguments.seeds, text, transient=True) for score in work(seed, choice)],
        )
        for text, choice in choices.items()
    ]
    print(
        f"{arguments.task}, {arguments.setting}; seeds {', '.join(map(str, arguments.seeds))}; one thread\n"
    )
    print(markdown_table(COLUMNS, rows))


if __name__ == "__main__":
    main()
