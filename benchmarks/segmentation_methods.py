"""The methods that find surfaces: surfsig, CGAL's Efficient RANSAC at several settings, pyransac3d."""

from __future__ import annotations

import functools
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from peers import (
    CGAL_LIBRARIES,
    HERE,
    Command,
    PeerUnavailable,
    compiled,
    include_flags,
    peer_python,
    run_json,
)
from segmentation_score import Found

import surfsig

TIME_LIMIT_SECONDS = 120
SEED = 1
PYRANSAC3D_MOST_POINTS = 50_000


@dataclass(frozen=True)
class RansacSettings:
    """Settings of Efficient RANSAC, free of units; 0 stands for CGAL's default (1 % of diagonal and points).

    `epsilon` is a share of the diagonal, `cluster` counts point spacings (the mean distance of 6 neighbours),
    `min_points` is a share of the points.
    """

    epsilon: float = 0.0
    cluster: float = 0.0
    min_points: float = 0.0
    normal_threshold: float = 0.9
    probability: float = 0.01
    cones_and_tori: bool = True


@dataclass(frozen=True)
class Method:
    """A method and what its row says of it; `find` returns what it found and the processor seconds."""

    name: str
    label: str
    find: Callable[[surfsig.PointCloud], tuple[Found, float]]


def surfsig_surfaces(cloud: surfsig.PointCloud) -> tuple[Found, float]:
    """Find surfaces with surfsig, without parameters, in this process."""
    start = time.process_time()
    found = surfsig.find_surfaces(cloud)
    seconds = time.process_time() - start
    kinds = [surface.kind for surface in found.surfaces]
    radii = [surface.radius for surface in found.surfaces]
    return Found(np.asarray(found.labels, dtype=np.int64), kinds, radii), seconds


def cgal_ransac(settings: RansacSettings) -> Callable[[surfsig.PointCloud], tuple[Found, float]]:
    """Return Efficient RANSAC at some settings."""

    def find(cloud: surfsig.PointCloud) -> tuple[Found, float]:
        values = (
            settings.epsilon, settings.cluster, settings.min_points, settings.normal_threshold,
            settings.probability, int(settings.cones_and_tori), SEED,
        )  # fmt: skip
        return find_outside(cgal_program(), cloud, [str(value) for value in values])

    return find


def pyransac3d(cloud: surfsig.PointCloud) -> tuple[Found, float]:
    """Find surfaces with pyransac3d, which fits one model at a time.

    Raises
    ------
    PeerUnavailable
        When there are so many points that it would take many minutes.
    """
    if len(cloud.offsets) > PYRANSAC3D_MOST_POINTS:
        raise PeerUnavailable(f"takes minutes for a cloud of more than {PYRANSAC3D_MOST_POINTS:,} points")
    return find_outside(pyransac3d_program(), cloud, [str(SEED)])


def find_outside(program: Command, cloud: surfsig.PointCloud, arguments: list[str]) -> tuple[Found, float]:
    """Give the finite points of a cloud to a program, and read the labels and the numbers that it leaves."""
    points = np.asarray(cloud.offsets, dtype=np.float64)
    finite = np.isfinite(points).all(axis=1)
    with tempfile.TemporaryDirectory() as name:
        cloud_path, labels_path = Path(name) / "cloud.f64", Path(name) / "labels.i32"
        points[finite].tofile(cloud_path)
        command = [*program, cloud_path, labels_path, *arguments]
        answer = run_json(command, threads=1, seconds=TIME_LIMIT_SECONDS)
        labels: NDArray[np.int64] = np.full(len(points), -1, dtype=np.int64)
        labels[finite] = np.fromfile(labels_path, dtype=np.int32)
    return Found(labels, answer["kinds"], answer["radii"]), float(answer["seconds"])


@functools.cache
def cgal_program() -> Command:
    """Return the command of the program that runs Efficient RANSAC, compiling it where need be."""
    return compiled(HERE / "ransac_cgal.cpp", include_flags("eigen3"), CGAL_LIBRARIES)


@functools.cache
def pyransac3d_program() -> Command:
    """Return the command of the program that runs pyransac3d, in the environment of the peers."""
    return [peer_python("pyransac3d"), HERE / "ransac_pyransac3d.py"]


TUNED = RansacSettings(0.001, 4, 0.003, 0.8, cones_and_tori=False)
CGAL_SETTINGS = {
    "defaults": RansacSettings(),
    "0.05": RansacSettings(0.0005, 4, 0.003, 0.8),
    "0.1": RansacSettings(0.001, 4, 0.003, 0.8),
    "0.2": RansacSettings(0.002, 4, 0.003, 0.9),
    "0.5": RansacSettings(0.005, 4, 0.003, 0.9),
    "strict": RansacSettings(0.001, 4, 0.01, 0.95),
    "tuned": TUNED,
}


def cgal_label(settings: RansacSettings) -> str:
    """Return how the table names Efficient RANSAC at some settings."""
    if settings == RansacSettings():
        return "CGAL Efficient RANSAC, its defaults"
    kinds = "five kinds" if settings.cones_and_tori else "planes, spheres, cylinders"
    return (
        f"CGAL, epsilon {settings.epsilon:.2%}, cluster {settings.cluster:g} spacings, "
        f"least {settings.min_points:.1%}, normals {settings.normal_threshold}, {kinds}"
    )


METHODS = (
    Method("surfsig", "surfsig, no parameter", surfsig_surfaces),
    *(
        Method(f"cgal-{name}", cgal_label(settings), cgal_ransac(settings))
        for name, settings in CGAL_SETTINGS.items()
    ),
    Method("pyransac3d", "pyransac3d, one model at a time", pyransac3d),
)
