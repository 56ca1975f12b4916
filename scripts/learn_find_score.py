"""Learn the coefficients of the probability that `find_instances` gives, from simulated scenes alone.

python scripts/learn_find_score.py --seeds 500 501 502 --unseen 540 541 542

It prints the arrays for `crates/surfsig/src/finding/likelihood.rs`, whose terms `terms`,
`terms_among_rivals` and `terms_without_free_space` repeat, and how many of the instances are right by the
probability that is learnt without their scene. Instances are found with a probability that is next to
nothing, so that wrong ones are among them, in cluttered scenes (`benchmarks/clutter_scene.py`), where the
whole library is looked for at once, and each object alone, and in those of half hidden copies
(`benchmarks/finding_scene.py`); other such scenes are thinned and moved, so that nobody knows from where they
were seen. They are kept in a file, so that the fit can be repeated.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import track
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import simulate

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from clutter import RIGHT, pose_error
from clutter_scene import LIBRARY, ClutterScene, clutter_scene, model
from finding import SHIFT, TURN, errors
from finding_scene import OBJECTS, FindingScene, finding_scene, whole

Array = NDArray[np.float64]

LEAST = 0.03
"""Probability, by the coefficients that are replaced, of what is learnt from."""
RIDGE = 0.002
"""Weight of the squared coefficients of standardised terms, so that few examples do not drive them away."""
SIGNS = (0, 1, -1, -1, -1, 1, 1, 1, -1, -1)
"""Of the coefficients, as few examples tell them badly: 1 of what speaks for a pose, -1 of what speaks
against it, 0 of both."""
SIGNS_AMONG_RIVALS = (0, 1, -1, -1, -1, -1, 1, 1, 1)
"""The same of the coefficients where rivals count, too."""
SIGNS_WITHOUT_FREE_SPACE = (0, 1, -1, 1, -1, 1)
"""The same where nobody knows what the sensor saw through."""
EVEN_MARGIN = 0.5
"""Margin over rivals at which the odds are even at most, where free space is known."""
NOT_SHOWN = 3
"""Objects that are not in the scene and are looked for, too; each counts as many as are not there."""
SHOWN = 4
"""Objects of a scene whose viewpoint is not known that are looked for."""
STRETCHED = 2
"""Objects of a scene of which a longer one is looked for, too."""
STRETCH = 1.2
"""Of objects that are looked for, too, and are not in the scene: nearly of the shape of one that is."""
OF_STRETCHED = 0.5
"""What an instance of these counts: a library has few such pairs, and stretched copies would outweigh all."""
NOISES = (2e-4, 1e-3)
"""Of the scenes of half hidden copies, in metres."""
THINNED = 0.003
"""Distance between the points of a scene whose viewpoint nobody knows, in those from the camera."""
THINNED_COPIES = 0.0012
"""The same in scenes of half hidden copies, in metres."""
LEAST_WITHOUT_FREE_SPACE = 0.3
"""Probability of what is learnt from there, where many transforms have little."""
BINS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
"""Between probabilities, for the table of how many instances of each are right."""


@dataclass
class Examples:
    """Instances: their measures by name, whether they are right, what they count, and their scenes.

    `is_seen` says whether the scene's viewpoint was known.
    """

    measures: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    right: list[bool] = field(default_factory=list)
    weight: list[float] = field(default_factory=list)
    scene: list[int] = field(default_factory=list)
    is_seen: list[bool] = field(default_factory=list)

    def add(
        self,
        found: surfsig.Instances,
        is_right: Callable[[surfsig.Instance], bool],
        weight: float,
        scene: int,
        is_seen: bool,
    ) -> None:
        """Add what was found in a scene."""
        for instance in found.instances:
            for name, value in instance.measures.items():
                self.measures[name].append(value)
            self.right.append(is_right(instance))
            self.weight.append(weight)
            self.scene.append(scene)
            self.is_seen.append(is_seen)


@dataclass
class Learning:
    """What one model is learnt from: terms, whether instances are right, what they count, their scenes."""

    x: Array
    right: Array
    weight: Array
    scene: NDArray[np.int64]
    signs: tuple[int, ...]
    most: Array
    """Logarithm of the odds of each instance at most."""

    def without(self, chosen: NDArray[np.bool_]) -> Learning:
        """Leave some instances out."""
        keep = ~chosen
        return Learning(
            self.x[keep], self.right[keep], self.weight[keep], self.scene[keep], self.signs, self.most[keep]
        )

    def coefficients(self) -> Array:
        """Fit a logistic model whose coefficients have certain signs; x has a constant first column."""
        mean, deviation = self.x.mean(axis=0), self.x.std(axis=0)
        mean[0], deviation[0] = 0.0, 1.0
        deviation[deviation == 0.0] = 1.0
        z = (self.x - mean) / deviation

        def loss(w: Array) -> tuple[float, Array]:
            odds = z @ w
            penalty = RIDGE * self.weight.sum() * np.r_[0.0, w[1:]]
            value = self.weight @ (np.logaddexp(0.0, odds) - odds * self.right) + 0.5 * penalty @ w
            return float(value), z.T @ (self.weight * (1.0 / (1.0 + np.exp(-odds)) - self.right)) + penalty

        bounds = [(None if sign <= 0 else 0.0, None if sign >= 0 else 0.0) for sign in self.signs]
        start = np.zeros(self.x.shape[1])
        w = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=bounds).x / deviation
        w[0] -= w @ mean
        return np.asarray(w)

    def left_out(self) -> Array:
        """Give each instance's probability by what is learnt from the other scenes."""
        probability = np.empty(len(self.right))
        for seed in np.unique(self.scene):
            own = self.scene == seed
            log_odds = np.minimum(self.x[own] @ self.without(own).coefficients(), self.most[own])
            probability[own] = 1.0 / (1.0 + np.exp(-log_odds))
        return probability


def terms(measures: dict[str, Array]) -> list[Array]:
    """Give what `Measures::terms` computes."""
    return [
        np.ones_like(measures["visible"]),
        measures["visible"],
        measures["front_mismatched"],
        measures["front_contradicted"],
        measures["going_on"],
        np.log(measures["constraint"] + 0.003),
        np.log(np.minimum(measures["pixels"], 2500.0) + 10.0),
        measures["outline_ends"],
        measures["outline_goes_on"],
        np.log(measures["uncovered"] + 0.02),
    ]


def terms_among_rivals(measures: dict[str, Array]) -> list[Array]:
    """Give what `Measures::terms_among_rivals` computes."""
    return [
        np.ones_like(measures["visible"]),
        np.log(measures["constraint"] + 0.003),
        np.minimum(measures["outline_goes_on"], 0.003),
        np.minimum(measures["front_contradicted"], 0.003),
        np.minimum(measures["contradicted"], 0.1),
        np.log(measures["misfit"] + 0.005),
        np.minimum(measures["roundness"], 0.3),
        np.maximum(measures["own_log_odds"], -5.0),
        measures["margin_over_rivals"],
    ]


def terms_without_free_space(measures: dict[str, Array]) -> list[Array]:
    """Give what `Measures::terms_without_free_space` computes."""
    return [
        np.ones_like(measures["visible"]),
        measures["own_log_odds"],
        measures["going_on"],
        np.log(measures["constraint"] + 0.003),
        np.log(measures["misfit"] + 0.005),
        measures["margin_over_rivals"],
    ]


def stretched(cloud: surfsig.PointCloud, rng: np.random.Generator) -> surfsig.PointCloud:
    """Give points of an object that is longer in one direction, without their normals."""
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    return surfsig.PointCloud(cloud.points + (STRETCH - 1.0) * np.outer(cloud.points @ direction, direction))


def in_clutter(number: int, scene: ClutterScene, T_found_scene: Array) -> Callable[[surfsig.Instance], bool]:
    """Tell whether an instance of an object is right in a cluttered scene that was moved."""
    true = T_found_scene @ scene.poses[scene.numbers == number]
    return lambda found: any(pose_error(found.T_scene_model, pose, number) <= RIGHT for pose in true)


def in_library(number_of: dict[str, int], scene: ClutterScene) -> Callable[[surfsig.Instance], bool]:
    """Tell whether an instance of any object, by its name, is right in a cluttered scene."""
    return lambda found: in_clutter(number_of[found.name], scene, np.eye(4))(found)


def among_copies(scene: FindingScene, T_found_scene: Array) -> Callable[[surfsig.Instance], bool]:
    """Tell whether an instance is right in a scene of copies that was moved."""

    def is_right(found: surfsig.Instance) -> bool:
        off = [errors(found.T_scene_model, T_found_scene @ pose) for pose in scene.poses]
        return any(shift <= SHIFT and turn <= TURN for shift, turn in off)

    return is_right


def never(_: surfsig.Instance) -> bool:
    """Tell that an instance is wrong: the object is not in the scene."""
    return False


def add_seen(examples: Examples, seed: int) -> None:
    """Add what is found in scenes whose viewpoint is known."""
    scene, rng = clutter_scene(seed), np.random.default_rng(seed)
    others = np.setdiff1d(np.arange(LIBRARY), scene.numbers)
    find = partial(surfsig.find_instances, score=LEAST, threads=1)
    number_of = {f"object {number}": number for number in range(LIBRARY)}
    found = find({name: model(number) for name, number in number_of.items()}, scene.cloud)
    examples.add(found, in_library(number_of, scene), 1.0, seed, is_seen=True)
    for number in map(int, [*scene.numbers, *rng.permutation(others)[:NOT_SHOWN]]):
        weight = 1.0 if number in scene.numbers else len(others) / NOT_SHOWN
        found = find(model(number), scene.cloud)
        examples.add(found, in_clutter(number, scene, np.eye(4)), weight, seed, is_seen=True)
    for number in map(int, rng.permutation(scene.numbers)[:STRETCHED]):
        found = find(stretched(model(number), rng), scene.cloud)
        examples.add(found, never, OF_STRETCHED, seed, is_seen=True)
    name = list(OBJECTS)[seed % len(OBJECTS)]
    for noise in NOISES:
        copies = finding_scene(name, 100 + seed, noise=noise)
        found = find(whole(name), copies.cloud)
        examples.add(found, among_copies(copies, np.eye(4)), 1.0, seed, is_seen=True)
        examples.add(find(stretched(whole(name), rng), copies.cloud), never, OF_STRETCHED, seed, is_seen=True)


def add_unseen(examples: Examples, seed: int) -> None:
    """Add what is found in scenes that are thinned and moved, so that their viewpoint is not known."""
    scene, rng = clutter_scene(seed), np.random.default_rng(seed)
    T_found_scene = simulate.pose((3.0, -2.0, 1.0), Rotation.random(random_state=seed).as_matrix())
    others = np.setdiff1d(np.arange(LIBRARY), scene.numbers)
    find = partial(surfsig.find_instances, score=LEAST_WITHOUT_FREE_SPACE, threads=1)
    cloud = thinned(scene.cloud, T_found_scene, THINNED * scene.distance)
    for number in map(int, [*scene.numbers[:SHOWN], *rng.permutation(others)[:NOT_SHOWN]]):
        weight = 1.0 if number in scene.numbers else len(others) / NOT_SHOWN
        is_right = in_clutter(number, scene, T_found_scene)
        examples.add(find(model(number), cloud), is_right, weight, seed, is_seen=False)
    name = list(OBJECTS)[seed % len(OBJECTS)]
    copies = finding_scene(name, 100 + seed, noise=NOISES[0])
    found = find(whole(name), thinned(copies.cloud, T_found_scene, THINNED_COPIES))
    examples.add(found, among_copies(copies, T_found_scene), 1.0, seed, is_seen=False)


def thinned(cloud: surfsig.PointCloud, T_found_scene: Array, voxel: float) -> surfsig.PointCloud:
    """Move a cloud, thin it, and forget from where it was seen."""
    points = cloud.points[cloud.finite] @ T_found_scene[:3, :3].T + T_found_scene[:3, 3]
    return surfsig.downsample(points, voxel)


def report(name: str, learning: Learning) -> None:
    """Print coefficients, and how right the probabilities are that are learnt without a scene."""
    print(f"{name}: {', '.join(f'{value:.2f}' for value in learning.coefficients())}")
    print(
        f"  {learning.right.sum():.0f} of {len(learning.right)} instances are right; left out scene by scene:"
    )
    probability = learning.left_out()
    for low, high in itertools.pairwise(BINS):
        chosen = (probability >= low) & (probability < high)
        print(f"  {low:.1f} to {high:.1f}: {learning.right[chosen].sum():.0f} of {chosen.sum()} right")


def main() -> None:
    """Learn and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(1000, 1027)))
    parser.add_argument("--unseen", type=int, nargs="+", default=list(range(540, 558)))
    parser.add_argument("--examples", type=Path, default=Path("find_examples.json"), help="read if there")
    arguments = parser.parse_args()
    if arguments.examples.exists():
        examples = Examples(**json.loads(arguments.examples.read_text()))
    else:
        examples = Examples()
        for seed in track(arguments.seeds, transient=True):
            add_seen(examples, seed)
        for seed in track(arguments.unseen, transient=True):
            add_unseen(examples, seed)
        arguments.examples.write_text(json.dumps(vars(examples)))
    is_seen = np.array(examples.is_seen)
    for name, chosen, of, signs in (
        ("by their own evidence", is_seen, terms, SIGNS),
        ("among rivals", is_seen, terms_among_rivals, SIGNS_AMONG_RIVALS),
        ("without free space", ~is_seen, terms_without_free_space, SIGNS_WITHOUT_FREE_SPACE),
    ):
        measures = {key: np.array(values)[chosen] for key, values in examples.measures.items()}
        right, weight = np.array(examples.right, float)[chosen], np.array(examples.weight)[chosen]
        x = np.column_stack(of(measures))
        is_capped = of is terms_among_rivals
        most = measures["margin_over_rivals"] - EVEN_MARGIN if is_capped else np.full(len(x), np.inf)
        report(name, Learning(x, right, weight, np.array(examples.scene)[chosen], signs, most))


if __name__ == "__main__":
    main()
