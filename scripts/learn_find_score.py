"""Learn the coefficients of the probability that `find_instances` gives, from simulated scenes alone.

python scripts/learn_find_score.py --seeds 500 501 502 503 504 505 506 507 508 509 510 511

It prints the arrays for `crates/surfsig/src/finding/likelihood.rs`, whose terms `terms` and
`terms_among_rivals` repeat, and how many of the instances are right by the probability that is learnt
without their scene. Instances are found with a probability that is next to nothing, so that wrong ones are
among them, in cluttered scenes (`benchmarks/clutter_scene.py`) and in those of half hidden copies
(`benchmarks/finding_scene.py`). They are kept in a file, so that the fit can be repeated.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import track
from scipy.optimize import minimize

import surfsig

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from clutter import RIGHT, pose_error
from clutter_scene import LIBRARY, clutter_scene, model
from finding import SHIFT, TURN, errors
from finding_scene import OBJECTS, finding_scene, whole

Array = NDArray[np.float64]

LEAST = 0.03
"""Probability, by the coefficients that are replaced, of what is learnt from."""
RIDGE = 0.002
"""Weight of the squared coefficients of standardised terms, so that few examples do not drive them away."""
SIGNS = (0, 1, -1, -1, -1, 1, 1, 1, -1, -1, -1)
"""Of the coefficients, as few examples tell them badly: 1 of what speaks for a pose, -1 of what speaks
against it, 0 of both."""
SIGNS_AMONG_RIVALS = (0, 1, 1, 1)
"""The same of the coefficients by which rivals count."""
NOT_SHOWN = 3
"""Objects that are not in the scene and are looked for, too; each counts as many as are not there."""
STRETCH = 1.2
"""Of objects that are looked for, too, and are not in the scene: others of nearly the shape of one that is."""
OF_COPIES = 3.0
"""What an instance in a scene of half hidden copies counts: there are fewer of them."""
NOISES = (2e-4, 1e-3)
"""Of the scenes of half hidden copies, in metres."""
BINS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
"""Between probabilities, for the table of how many instances of each are right."""


@dataclass
class Examples:
    """Instances: their terms, own and among rivals, whether they are right, weights, and their scenes."""

    x: Array
    among_rivals: Array
    right: NDArray[np.bool_]
    weight: Array
    scene: NDArray[np.int64]


def terms(measures: dict[str, float]) -> list[float]:
    """Give what `Measures::terms` computes."""
    return [
        1.0,
        measures["visible"],
        measures["front_mismatched"],
        measures["front_contradicted"],
        measures["going_on"],
        np.log(measures["constraint"] + 0.003),
        np.log(min(measures["pixels"], 2500.0) + 10.0),
        measures["outline_ends"],
        measures["outline_goes_on"],
        np.log(measures["uncovered"] + 0.02),
        np.log(measures["misfit"] + 0.005),
    ]


def terms_among_rivals(measures: dict[str, float]) -> list[float]:
    """Give the terms that `Measures::among_rivals` weighs."""
    return [1.0, *(measures[name] for name in ("own_log_odds", "margin_here", "margin_elsewhere"))]


def fitted(x: Array, y: Array, weight: Array, signs: tuple[int, ...]) -> Array:
    """Fit a logistic model whose coefficients have certain signs; x has a constant first column."""
    mean, deviation = x.mean(axis=0), x.std(axis=0)
    mean[0], deviation[0] = 0.0, 1.0
    deviation[deviation == 0.0] = 1.0
    z = (x - mean) / deviation

    def loss(w: Array) -> tuple[float, Array]:
        odds = z @ w
        penalty = RIDGE * weight.sum() * np.r_[0.0, w[1:]]
        value = weight @ (np.logaddexp(0.0, odds) - odds * y) + 0.5 * penalty @ w
        return float(value), z.T @ (weight * (1.0 / (1.0 + np.exp(-odds)) - y)) + penalty

    bounds = [(None if sign <= 0 else 0.0, None if sign >= 0 else 0.0) for sign in signs]
    w = minimize(loss, np.zeros(x.shape[1]), jac=True, method="L-BFGS-B", bounds=bounds).x / deviation
    w[0] -= w @ mean
    return np.asarray(w)


def stretched(cloud: surfsig.PointCloud, rng: np.random.Generator) -> surfsig.PointCloud:
    """Give points of an object that is longer in one direction, without their normals."""
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    return surfsig.PointCloud(cloud.points + (STRETCH - 1.0) * np.outer(cloud.points @ direction, direction))


def examples(seeds: list[int]) -> Examples:
    """Find instances, and tell which are right."""
    x, rivals, right, weight, of = [], [], [], [], []
    for seed in track(seeds, transient=True):
        scene = clutter_scene(seed)
        rng = np.random.default_rng(seed)
        others = np.setdiff1d(np.arange(LIBRARY), scene.numbers)
        for number in [*scene.numbers, *rng.permutation(others)[:NOT_SHOWN]]:
            found = surfsig.find_instances(model(int(number)), scene.cloud, score=LEAST, threads=1)
            true = scene.poses[scene.numbers == number]
            for instance in found.instances:
                x.append(terms(instance.measures))
                rivals.append(terms_among_rivals(instance.measures))
                right.append(
                    any(pose_error(instance.T_scene_model, pose, int(number)) <= RIGHT for pose in true)
                )
                weight.append(1.0 if len(true) else len(others) / NOT_SHOWN)
                of.append(seed)
        name = list(OBJECTS)[seed % len(OBJECTS)]
        for noise in NOISES:
            copies = finding_scene(name, 100 + seed, noise=noise)
            found = surfsig.find_instances(whole(name), copies.cloud, score=LEAST, threads=1)
            for instance in found.instances:
                off = [errors(instance.T_scene_model, pose) for pose in copies.poses]
                x.append(terms(instance.measures))
                rivals.append(terms_among_rivals(instance.measures))
                right.append(any(shift <= SHIFT and turn <= TURN for shift, turn in off))
                weight.append(OF_COPIES)
                of.append(seed)
    return Examples(np.array(x), np.array(rivals), np.array(right), np.array(weight), np.array(of))


def left_out(all_of: Examples, x: Array, signs: tuple[int, ...]) -> Array:
    """Give each instance's probability by what is learnt from the other scenes."""
    probability = np.empty(len(all_of.right))
    for seed in np.unique(all_of.scene):
        own = all_of.scene == seed
        w = fitted(x[~own], all_of.right[~own].astype(np.float64), all_of.weight[~own], signs)
        probability[own] = 1.0 / (1.0 + np.exp(-x[own] @ w))
    return probability


def main() -> None:
    """Learn and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(500, 512)))
    parser.add_argument(
        "--examples", type=Path, default=Path("find_examples.npz"), help="read if it is there"
    )
    arguments = parser.parse_args()
    if arguments.examples.exists():
        with np.load(arguments.examples) as file:
            all_of = Examples(**{name: file[name] for name in file.files})
    else:
        all_of = examples(arguments.seeds)
        np.savez(arguments.examples, **vars(all_of))
    print(f"{len(all_of.right)} instances, {all_of.right.sum()} of them right")
    for name, x, signs in (
        ("by their own evidence", all_of.x, SIGNS),
        ("among rivals", all_of.among_rivals, SIGNS_AMONG_RIVALS),
    ):
        coefficients = fitted(x, all_of.right.astype(np.float64), all_of.weight, signs)
        print(f"{name}: {', '.join(f'{value:.2f}' for value in coefficients)}")
        probability = left_out(all_of, x, signs)
        print("by the probability learnt without their scene:")
        for low, high in itertools.pairwise(BINS):
            chosen = (probability >= low) & (probability < high)
            print(f"  {low:.1f} to {high:.1f}: {all_of.right[chosen].sum()} of {chosen.sum()} right")


if __name__ == "__main__":
    main()
