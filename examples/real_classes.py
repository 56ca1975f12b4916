"""Compare planes, cylinders and spheres of real scans, with and without a flat atom.

    python examples/real_classes.py FOLDER_OF_SCANS [PICTURE.png]

The scans are not part of the project; docs/zeta.md names their sources and what comes out.
"""

from __future__ import annotations

import functools
import itertools
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch

import surfsig

SEED = 0

PLACES = 100
"""Of each surface, at most."""

PURE = 0.9
"""Share of a ball's points that lie on the surface, at least."""

THRESHOLD = 0.9
"""The paper's optimal similarity; from 0.5 on it is good."""

Array = NDArray[np.float64]
Found = tuple[NDArray[np.bool_], Array]
"""Which points a surface has, (n,), and its outward normals at all points, (n, 3)."""


def plane(
    normal: tuple[float, ...], through: tuple[float, ...], tolerance: float
) -> Callable[[Array], Found]:
    """Look for the plane near one that is roughly known."""

    def find(points: Array) -> Found:
        middle, axis = np.array(through), np.array(normal)
        for _ in range(5):
            near = points[np.abs((points - middle) @ axis) < tolerance]
            middle = near.mean(axis=0)
            axis = np.linalg.eigh(np.cov(near.T))[1][:, 0]
        axis *= np.sign(axis @ normal)
        return np.abs((points - middle) @ axis) < tolerance, np.broadcast_to(axis, points.shape)

    return find


def sphere(centre: tuple[float, ...], radius: float, tolerance: float) -> Callable[[Array], Found]:
    """Look for the sphere near one that is roughly known."""

    def find(points: Array) -> Found:
        middle, size = np.array(centre), radius
        for _ in range(6):
            near = points[np.abs(np.linalg.norm(points - middle, axis=1) - size) < tolerance]
            terms = np.column_stack([2 * near, np.ones(len(near))])
            *middle, rest = np.linalg.lstsq(terms, (near**2).sum(axis=1), rcond=None)[0]
            size = float(np.sqrt(rest + np.dot(middle, middle)))
        outward = points - middle
        return np.abs(np.linalg.norm(outward, axis=1) - size) < tolerance, outward

    return find


def cylinder(
    middle: tuple[float, ...], axis: tuple[float, ...], radius: float, height: float, tolerance: float
) -> Callable[[Array], Found]:
    """Take a cylinder that is known, within a height."""

    def find(points: Array) -> Found:
        offsets = points - middle
        along = offsets @ axis
        outward = offsets - along[:, None] * np.array(axis)
        distance = np.abs(np.linalg.norm(outward, axis=1) - radius)
        return (distance < tolerance) & (np.abs(along) < height / 2), outward

    return find


@dataclass(frozen=True)
class Surface:
    """A surface of one class in a scan."""

    kind: str
    file: str
    find: Callable[[Array], Found]


STEREO_SCAN = "surfaces/table_scene_mug.pcd"

STEREO = (
    Surface("plane", STEREO_SCAN, plane((0, -0.838, -0.546), (0.054, 0.079, 0.849), 0.004)),
    # PCL's documentation fits it.
    Surface("cylinder", STEREO_SCAN,
            cylinder((0.055, 0.071, 0.769), (0, 0.834, 0.552), 0.0394, 0.08, 0.003)),
)  # fmt: skip
LIDAR = (
    Surface("plane", "surfaces/lidar_sphere_1.xyz", plane((-0.627, 0.778, -0.021), (4.5, -2.6, 0.52), 0.04)),
    Surface("sphere", "surfaces/lidar_sphere_1.xyz", sphere((1.72, 2.47, 0.01), 0.295, 0.03)),
    Surface("sphere", "surfaces/lidar_sphere_2.xyz", sphere((1.46, 2.24, -0.03), 0.295, 0.03)),
    Surface("sphere", "surfaces/lidar_sphere_3.xyz", sphere((2.09, 1.34, -0.01), 0.295, 0.03)),
)
TABLET = (
    Surface("plane", "surfaces/gym_ball.xyz", plane((0, 1, -0.024), (-0.161, -1.261, 0.452), 0.05)),
    Surface("sphere", "surfaces/gym_ball.xyz", sphere((0.1, -0.91, 0.74), 0.341, 0.04)),
)
SCENES = {
    "stereo: table, mug": (STEREO, (0.01, 0.02, 0.03)),
    "lidar: wall, spheres": (LIDAR, (0.2, 0.25)),
    "tablet: floor, gym ball": (TABLET, (0.17, 0.25)),
}
"""The surfaces of each scan, and radii of balls: at the last one all scans are drawn and compared."""

CLASSES = {"dissimilar, zeta below 0.5": "#d9d9d9", "good": "#9ecae1", "optimal, from 0.9 on": "#08519c"}
"""The paper's, and their colours."""

WAYS = ("no flat atom", "by standard errors", "by flat places")


@dataclass(frozen=True)
class Sample:
    """What was extracted at random places of one surface."""

    kind: str
    found: surfsig.Extraction
    flat: surfsig.Extraction | None
    """Of a plane, at other places: they tell by how much noise bends it."""


@functools.cache
def points_of(file: Path) -> Array:
    """Read a scan's points, without those that are missing."""
    with warnings.catch_warnings():
        # The gym ball's last line.
        warnings.filterwarnings("ignore", ".*is cut off")
        cloud = surfsig.read(file)
    return cloud.points[cloud.finite].astype(np.float64)


def sample(surface: Surface, radius: float, folder: Path) -> Sample:
    """Extract where hardly anything but the surface is in the ball, and the fit is in order."""
    points = points_of(folder / surface.file)
    member, outward = surface.find(points)

    tree = cKDTree(points)

    def pure(place: int) -> bool:
        return bool(member[tree.query_ball_point(points[place], radius)].mean() >= PURE)

    shuffled = np.random.default_rng(SEED).permutation(np.flatnonzero(member))
    at = np.array(list(itertools.islice(filter(pure, shuffled), 4 * PLACES)))
    tried = surfsig.extract(points, radius, at=at, normals=outward)
    # One scan line of a lidar spans no surface.
    at = at[(tried.status == surfsig.Status.OK) & (tried.planarity > 0.3)]
    found, flat = (
        surfsig.extract(points, radius, at=part, normals=outward)
        for part in (at[:PLACES], at[PLACES : 2 * PLACES])
    )
    return Sample(surface.kind, found, flat if surface.kind == "plane" else None)


def similarities(samples: list[Sample]) -> list[Array]:
    """Return zeta of all places with all, by each of `WAYS`."""
    measured = [s.flat for s in samples if s.flat is not None]
    lengths = [
        None,
        surfsig.flat_atom_length(*[s.found for s in samples]),
        surfsig.flat_atom_length(*measured, flat=True),
    ]
    zetas = []
    for length in lengths:
        rows = np.vstack([s.found.signatures(flat_atom=length) for s in samples])
        zetas.append(surfsig.similarity_matrix(rows, rows))
    return zetas


def table(title: str, radius: str, samples: list[Sample]) -> Iterator[str]:
    """Give a row for each two classes: pairs, mean zeta and right decisions by each of `WAYS`.

    A place beyond the vocabulary is like none.
    """
    kinds = np.array([s.kind for s in samples for _ in range(len(s.found))])
    zetas = similarities(samples)
    above = np.triu(np.ones((len(kinds), len(kinds)), bool), 1)
    for one, other in itertools.combinations_with_replacement(dict.fromkeys(kinds), 2):
        both = (kinds[:, None] == one) & (kinds[None] == other)
        pairs = above & (both | both.T)
        cells = [title, radius, f"{one}, {other}", f"{pairs.sum():,}"]
        for zeta in zetas:
            right = (zeta[pairs] >= THRESHOLD) == (one == other)
            cells.append(f"{np.nanmean(zeta[pairs]):.2f}, {right.sum():,} ({100 * right.mean():.0f} %)")
        yield "| " + " | ".join(cells) + " |"


def draw(scenes: dict[str, list[Sample]], picture: Path) -> None:
    """Draw the similarity of all places with all, a row of panels for each scan."""
    colours = ListedColormap(list(CLASSES.values()))
    figure, axes = plt.subplots(len(scenes), len(WAYS), figsize=(9, 9.8), layout="constrained")
    for row, (title, samples) in zip(axes, scenes.items(), strict=True):
        ends = np.cumsum([0] + [len(s.found) for s in samples])
        middles = 0.5 * (ends[1:] + ends[:-1])
        for ax, way, zeta in zip(row, WAYS, similarities(samples), strict=True):
            ax.imshow(
                zeta, cmap=colours, norm=BoundaryNorm([0, 0.5, THRESHOLD, 1], 3), interpolation="nearest"
            )
            for end in ends[1:-1]:
                ax.axhline(end - 0.5, color="black", linewidth=0.8)
                ax.axvline(end - 0.5, color="black", linewidth=0.8)
            ax.set_xticks(middles, [s.kind for s in samples])
            ax.set_yticks(middles, [s.kind for s in samples], rotation=90, va="center")
            ax.tick_params(length=0)
            ax.set_title(f"{title}\n{way}", fontsize=10)
    legend = [Patch(facecolor=colour, label=label) for label, colour in CLASSES.items()]
    figure.legend(handles=legend, loc="outside lower center", ncols=3)
    figure.savefig(picture, dpi=90)


def main(folder: Path, picture: Path) -> None:
    """Print a table in Markdown, and draw one radius of each scan."""
    print(f"| scan | ball's radius [m] | classes | pairs | {' | '.join(WAYS)} |")
    print("|---|---|---|---|---|---|---|")
    drawn: dict[str, list[Sample]] = {}
    for title, (surfaces, radii) in SCENES.items():
        for radius in radii:
            samples = [sample(surface, radius, folder) for surface in surfaces]
            print(*table(title, f"{radius:g}", samples), sep="\n")
        drawn[title] = samples
    print(*table("all", "the last ones", list(itertools.chain(*drawn.values()))), sep="\n")
    draw(drawn, picture)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(f"usage: {sys.argv[0]} FOLDER_OF_SCANS [PICTURE.png]")
    main(Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else "real_classes.png"))
