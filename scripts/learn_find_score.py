"""Learn the coefficients of the probability that `find_instances` gives, from simulated scenes alone.

python scripts/learn_find_score.py --seeds 10 11 12 13 14 15 16 17

It prints the array for `crates/surfsig/src/finding/likelihood.rs`, whose terms `terms` repeats. Instances are
found with a probability that is next to nothing, so that wrong ones are among them, in cluttered scenes
(`benchmarks/clutter_scene.py`) and in those of half hidden copies (`benchmarks/finding_scene.py`).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

import surfsig

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from clutter import RIGHT, pose_error
from clutter_scene import LIBRARY, clutter_scene, model
from finding import SHIFT, TURN, errors
from finding_scene import OBJECTS, finding_scene, whole

Array = NDArray[np.float64]

LEAST = 0.01
"""Probability, by the coefficients that are replaced, of what is learnt from."""
RIDGE = 0.0005
"""Weight of the squared coefficients of standardised terms, so that few examples do not drive them away."""
SIGNS = (0, 1, 1, -1, -1, 1, -1, 1)
"""Of the coefficients, as few examples tell them badly: 1 of what speaks for a pose, -1 of what speaks
against it, 0 of both."""
NOT_SHOWN = 3
"""Objects that are not in the scene and are looked for, too."""


def terms(measures: dict[str, float]) -> list[float]:
    """Give what `Measures::terms` computes."""
    confirmed = measures["confirmed"]

    def of(part: float) -> float:
        return part / max(confirmed + part, 1e-9)

    return [
        1.0,
        np.log(max(confirmed, 1e-3)),
        measures["visible"],
        of(measures["contradicted"]),
        of(measures["missing"]),
        measures["agreement"],
        measures["going_on"],
        min(measures["roundness"] / 0.1, 1.0),
    ]


def fitted(x: Array, y: Array) -> Array:
    """Fit a logistic model whose coefficients have the signs of `SIGNS`; x has a constant first column."""
    mean, deviation = x.mean(axis=0), x.std(axis=0)
    mean[0], deviation[0] = 0.0, 1.0
    deviation[deviation == 0.0] = 1.0
    z = (x - mean) / deviation

    def loss(w: Array) -> tuple[float, Array]:
        odds = z @ w
        penalty = RIDGE * len(y) * np.r_[0.0, w[1:]]
        value = np.logaddexp(0.0, odds).sum() - odds @ y + 0.5 * penalty @ w
        return float(value), z.T @ (1.0 / (1.0 + np.exp(-odds)) - y) + penalty

    bounds = [(None if sign <= 0 else 0.0, None if sign >= 0 else 0.0) for sign in SIGNS]
    w = minimize(loss, np.zeros(x.shape[1]), jac=True, method="L-BFGS-B", bounds=bounds).x / deviation
    w[0] -= w @ mean
    return np.asarray(w)


def examples(seeds: list[int]) -> tuple[list[list[float]], list[bool]]:
    """Find instances, and tell which are right."""
    x, y = [], []
    for seed in seeds:
        scene = clutter_scene(seed)
        rng = np.random.default_rng(seed)
        others = np.setdiff1d(np.arange(LIBRARY), scene.numbers)
        for number in [*scene.numbers, *rng.permutation(others)[:NOT_SHOWN]]:
            found = surfsig.find_instances(model(int(number)), scene.cloud, score=LEAST)
            true = scene.poses[scene.numbers == number]
            for instance in found.instances:
                x.append(terms(instance.measures))
                y.append(any(pose_error(instance.T_scene_model, pose, int(number)) <= RIGHT for pose in true))
        name = list(OBJECTS)[seed % len(OBJECTS)]
        copies = finding_scene(name, 100 + seed)
        for instance in surfsig.find_instances(whole(name), copies.cloud, score=LEAST).instances:
            off = [errors(instance.T_scene_model, pose) for pose in copies.poses]
            x.append(terms(instance.measures))
            y.append(any(shift <= SHIFT and turn <= TURN for shift, turn in off))
    return x, y


def main() -> None:
    """Learn and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(10, 18)))
    x, y = examples(parser.parse_args().seeds)
    coefficients = fitted(np.array(x), np.array(y, np.float64))
    print(f"{len(y)} instances, {sum(y)} of them right")
    print(", ".join(f"{value:.2f}" for value in coefficients))


if __name__ == "__main__":
    main()
