"""Depth images of copies of an object on a table, half hidden by boards before them, among other objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from recurrence_scene import KINDS
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import simulate
from surfsig.simulate.ellipsoid import Ellipsoid

Array = NDArray[np.float64]

WIDTH, HEIGHT, FOCAL = 640, 480, 900.0
TABLE, NOISE = 0.6, 2e-4
"""From the camera to the table, and the standard deviation of distances, in metres."""
COLUMNS, ROWS, PITCH = 4, 3, 0.09
RAISED = 0.038
"""Of the objects' middles over the table: they are turned in any way, and do not touch it."""
BOARD = (0.025, 0.075, 0.003)

OBJECTS: dict[str, list[tuple[simulate.Surface, Array]]] = {
    "figure": [
        (Ellipsoid((0.014, 0.018, 0.022)), simulate.pose((0.0, 0.0, -0.004))),
        (simulate.Sphere(0.011), simulate.pose((0.002, 0.0, 0.024))),
        (
            simulate.Cylinder(0.005, 0.044),
            simulate.pose((0.006, 0.008, 0.004), simulate.turn((1, 0, 0), 1.1)),
        ),
        (simulate.Box((0.024, 0.034, 0.006)), simulate.pose((0.004, 0.0, -0.027))),
    ],
    "bracket with pin": [
        *KINDS["bracket"],
        (simulate.Cylinder(0.006, 0.024), simulate.pose((0.012, 0.004, 0.0))),
    ],
    "frustum with fin": [
        *KINDS["frustum"],
        (simulate.Box((0.030, 0.005, 0.030)), simulate.pose((0.015, 0.0, 0.0))),
    ],
}
OTHERS = ("thick can", "thin can", "large ball", "small ball", "box", "frustum", "egg")


@dataclass(frozen=True, eq=False)
class FindingScene:
    """A depth image and its truth: where the copies are, (copies, 4, 4), and what share of each is hidden."""

    cloud: surfsig.PointCloud
    poses: Array
    hidden: Array


def whole(name: str, points: int = 12_000) -> surfsig.PointCloud:
    """Give an object's whole surface, without normals: what rays from all around meet first."""
    rng = np.random.default_rng(0)
    scene = simulate.Scene([simulate.Placed(surface, own) for surface, own in OBJECTS[name]])
    ways = rng.normal(size=(5 * points, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    hits = scene.cast(rng.uniform(-0.03, 0.03, ways.shape) - ways, ways).points
    return surfsig.PointCloud(hits[np.isfinite(hits[:, 0])][:points])


def finding_scene(name: str, seed: int, *, copies: int = 5, others: int = 4) -> FindingScene:
    """Place copies and other objects, hide half of what is seen of each copy, and take a depth image.

    Parameters
    ----------
    name
        Of `OBJECTS`.
    seed
        Of places, turns, kinds and noise.
    copies, others
        How many; up to 12 together.
    """
    rng = np.random.default_rng(seed)
    back = simulate.pose((0.0, 0.0, TABLE), simulate.facing(simulate.UP))
    placed = [simulate.Placed(simulate.Rectangle((1.0, 1.0)), back, "table")]
    owner, poses = [-1], []
    for number, cell in enumerate(rng.permutation(COLUMNS * ROWS)[: copies + others]):
        parts = OBJECTS[name] if number < copies else KINDS[OTHERS[int(rng.integers(len(OTHERS)))]]
        column, row = cell % COLUMNS - (COLUMNS - 1) / 2, cell // COLUMNS - (ROWS - 1) / 2
        turn = np.asarray(Rotation.random(random_state=rng).as_matrix())
        pose = simulate.pose((column * PITCH, row * PITCH, TABLE - RAISED), turn)
        poses.append(pose)
        for surface, own in parts:
            placed.append(simulate.Placed(surface, pose @ own, "object"))
            owner.append(number)
    ways = _ways()
    bare = _seen(placed, owner, ways)
    boards = [_board(ways[bare == number], rng) for number in range(copies)]
    scene = simulate.Scene([*placed, *boards])
    hits = scene.cast(np.zeros_like(ways), ways)
    seen = np.array([*owner, *[-1] * copies])[hits.surface]
    noise = rng.normal(0.0, NOISE, (len(ways), 1))
    cloud = surfsig.PointCloud(
        (hits.points + noise * ways).astype(np.float32), viewpoint=np.zeros(3), grid=(HEIGHT, WIDTH)
    )
    hidden = [1.0 - (seen == number).sum() / (bare == number).sum() for number in range(copies)]
    return FindingScene(cloud, np.array(poses[:copies]).reshape(-1, 4, 4), np.array(hidden))


def _ways() -> Array:
    """Give the directions of the pixels, row by row, with z component 1."""
    x, y = np.meshgrid(np.arange(WIDTH) - WIDTH / 2 + 0.5, np.arange(HEIGHT) - HEIGHT / 2 + 0.5)
    return np.column_stack([x.ravel() / FOCAL, y.ravel() / FOCAL, np.ones(x.size)])


def _seen(placed: list[simulate.Placed], owner: list[int], ways: Array) -> NDArray[np.int64]:
    return np.array(owner)[simulate.Scene(placed).cast(np.zeros_like(ways), ways).surface]


def _board(ways: Array, rng: np.random.Generator) -> simulate.Placed:
    """Hold a board before an object seen along `ways`, whose long edge passes the median of them."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    across = np.array([np.cos(angle), np.sin(angle)])
    distance = TABLE - 2.5 * RAISED
    edge = np.median(ways[:, :2] @ across) * distance
    along = np.array([-across[1], across[0]])
    middle = (edge + BOARD[0] / 2) * across + np.mean(ways[:, :2] @ along) * distance * along
    where = simulate.pose((*middle, distance), simulate.turn((0.0, 0.0, 1.0), angle))
    return simulate.Placed(simulate.Box(BOARD), where, "board")
