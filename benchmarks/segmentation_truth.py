"""Clouds whose surfaces or objects are known: Fit4CAD's models, and labelled scans of tables."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import surfsig

FIT4CAD = Path("primitives") / "fit4cad"
TABLES = Path("labelled_tables")
TABLE_LABEL = 1
PRIMITIVE = re.compile(r"Primitive(\d+):=\[([^;]*)\];")
KINDS_WITH_RADIUS = ("cylinder", "sphere")


@dataclass(frozen=True)
class Segment:
    """A surface of a model: its kind, the radius of a cylinder or sphere, and the indices of its points."""

    kind: str
    radius: float | None
    points: NDArray[np.intp]


@dataclass(frozen=True)
class Model:
    """A cloud sampled from a CAD model, and its surfaces; a point of an edge is in several of them."""

    name: str
    cloud: surfsig.PointCloud
    segments: tuple[Segment, ...]


@dataclass(frozen=True)
class TableScene:
    """An organised scan, and the object that every point belongs to: (n,) numbers, 0 for none."""

    name: str
    cloud: surfsig.PointCloud
    objects: NDArray[np.int64]


def read_model(path: Path) -> Model:
    """Read a cloud of Fit4CAD (`PCn.txt`) with the two files beside it that list its surfaces.

    Raises
    ------
    ValueError
        When the files disagree on how many points or surfaces there are; the message begins with the path.
    """
    points = numbers(path.read_text().partition(":=")[2]).reshape(-1, 3)
    indices = primitives(path.with_name(f"{path.stem}_primitives.txt"))
    shapes = primitives(path.with_name(f"{path.stem}_parametric.txt"))
    if indices.keys() != shapes.keys():
        raise ValueError(f"{path}: {len(indices)} surfaces have points, {len(shapes)} have a shape")
    segments = []
    for number, text in indices.items():
        # Fit4CAD counts points from 1.
        members = np.unique(numbers(text).astype(np.intp)) - 1
        if len(members) == 0 or members[0] < 0 or members[-1] >= len(points):
            raise ValueError(f"{path}: surface {number} has points that are not among the {len(points):,}")
        segments.append(Segment(*kind_and_radius(shapes[number]), members))
    return Model(path.stem, surfsig.PointCloud(points), tuple(segments))


def numbers(text: str) -> NDArray[np.float64]:
    """Return the numbers of a list of Maple, whatever its brackets."""
    return np.array(re.sub(r"[\[\],;:]", " ", text).split(), dtype=np.float64)


def primitives(path: Path) -> dict[int, str]:
    """Return what a file of Fit4CAD says of each numbered surface."""
    return {int(number): text for number, text in PRIMITIVE.findall(path.read_text())}


def kind_and_radius(text: str) -> tuple[str, float | None]:
    """Return the kind and the radius of a surface: the length of the first of its parametric vectors."""
    kind, _, values = text.partition(",")
    kind = kind.strip().lower()
    if kind not in KINDS_WITH_RADIUS:
        return kind, None
    return kind, float(np.linalg.norm(numbers(values)[:3]))


def read_table(path: Path) -> TableScene:
    """Read a labelled scan. A label's tens number the object and its ones the part; 1 is the table itself."""
    cloud = surfsig.read(path)
    labels = cloud.fields["label"].astype(np.int64)
    return TableScene(path.stem, cloud, np.where(labels == TABLE_LABEL, TABLE_LABEL, labels // 10))


def read_models(data: Path) -> list[Model]:
    """Read all clouds of Fit4CAD in the folder of real scans (or in a folder of their own), by number."""
    folder = data / FIT4CAD if (data / FIT4CAD).is_dir() else data
    numbered = [(int(path.stem[2:]), path) for path in folder.glob("PC*.txt") if path.stem[2:].isdecimal()]
    return [read_model(path) for _, path in sorted(numbered)]


def read_tables(data: Path) -> list[TableScene]:
    """Read all labelled scans of tables in the folder of real scans."""
    return [read_table(path) for path in sorted((data / TABLES).glob("*.pcd"))]


def with_noise(model: Model, share: float, seed: int) -> Model:
    """Move every point by Gaussian noise, its standard deviation a share of the diagonal in each axis."""
    if share == 0:
        return model
    points = model.cloud.offsets
    noise = np.random.default_rng(seed).normal(scale=share * diagonal(points), size=points.shape)
    return replace(model, cloud=surfsig.PointCloud(points + noise))


def with_share(model: Model, share: float, seed: int) -> Model:
    """Return the model with some of its points, each as likely as any other."""
    count = len(model.cloud)
    kept = np.sort(np.random.default_rng(seed).choice(count, round(share * count), replace=False))
    place = np.full(count, -1)
    place[kept] = np.arange(len(kept))
    segments = [replace(each, points=place[each.points][place[each.points] >= 0]) for each in model.segments]
    cloud = surfsig.PointCloud(model.cloud.points[kept])
    return Model(model.name, cloud, tuple(each for each in segments if len(each.points)))


def diagonal(points: NDArray[np.floating]) -> float:
    """Return the diagonal of the box around finite points."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))
