"""Tiles of COPC files: their octree says where points are, so nothing is binned."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.blocks import BLOCK_POINTS, Finish, open_blocks, stacked
from surfsig.files.joined import joined
from surfsig.files.read_file import ReadOptions
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress, ProgressCallback
from surfsig.tiles.binning import Cut
from surfsig.tiles.plan import Plan
from surfsig.tiles.rows import FileHead, Layout
from surfsig.tiles.sampling import Sampling, WholeFacts
from surfsig.tiles.source import Source
from surfsig.tiles.store import TileCloud
from surfsig.tiles.survey import Survey, Unreadable

if TYPE_CHECKING:
    from surfsig.files.laz_chunks import CopcNode


@dataclass(frozen=True)
class CopcSource:
    """Files with an octree, cut into tiles; the attributes are those of a `Store`."""

    files: tuple[Path, ...]
    heads: tuple[FileHead, ...]
    plan: Plan
    counts: tuple[int, ...]
    facts: WholeFacts
    unreadable: tuple[Unreadable, ...] = ()

    def read(self, tile: int, halo: float) -> TileCloud:
        """Read a tile, and all points within a distance of it.

        Raises
        ------
        OSError, FileFormatError
            If a file cannot be read.
        """
        complete = self.plan.boxes[tile] + np.array([[-halo], [halo]])
        cloud = self.read_box(complete)
        own = self.plan.owners(cloud.points) == tile
        # No number is known without reading everything before it; the order is that of the input.
        numbers = np.arange(len(cloud), dtype=np.uint64)
        return TileCloud(cloud, own, numbers, self.facts.without_rim(complete))

    def read_box(self, box: NDArray[np.float64]) -> PointCloud:
        """Read the points in a box (2, 3), to which both corners belong, in the order of the input."""
        clouds, kept = [], []
        with warnings.catch_warnings():
            # They were given when the files were looked at first.
            warnings.simplefilter("ignore")
            for file, head in zip(self.files, self.heads, strict=True):
                with open_blocks(file, ReadOptions(box=box)) as opened:
                    cloud = stacked(list(opened.clouds))
                clouds.append(opened.finish.cloud(cloud, head.sample))
                kept.append(np.arange(len(clouds[-1])) < len(cloud))
            return joined(clouds, str(self.files[0])).at(np.concatenate(kept))


class _Indexed(NamedTuple):
    """A file with the nodes of its octree, in the file's order."""

    path: Path
    nodes: list[CopcNode]
    points: int


def copc_of(source: Source, cut: Cut, progress: ProgressCallback | None = None) -> CopcSource | None:
    """Cut files into tiles by their octrees; None where one has none, or an option needs all points.

    Parameters
    ----------
    source
        The files.
    cut
        Makes the plan.
    progress
        Called with the files that were looked at, and their number.

    Raises
    ------
    OSError, FileFormatError
        If a file cannot be read.
    """
    if source.options != ReadOptions():
        return None
    indexed = [_indexed(file) for file in source.files]
    if any(one is None for one in indexed):
        return None
    found = [one for one in indexed if one is not None]
    survey = Survey()
    survey.count = survey.finite = sum(one.points for one in found)
    sampling = Sampling(survey.count, survey.finite)
    first = 0
    for number, one in enumerate(found):
        _look(one, number, first, sampling, survey)
        first += one.points
        if progress is not None:
            progress(number + 1, len(found))
    plan = cut(survey)
    middles = np.array([node.middle for one in found for node in one.nodes]).reshape(-1, 3)
    points = [node.chunk.points for one in found for node in one.nodes]
    counts = np.bincount(plan.owners(middles), weights=points, minlength=len(plan)).astype(int)
    facts = sampling.facts(survey)
    return CopcSource(
        tuple(one.path for one in found), tuple(survey.heads), plan, tuple(counts.tolist()), facts
    )


def _look(one: _Indexed, number: int, first: int, sampling: Sampling, survey: Survey) -> None:
    """Look at those chunks of a file that have points which tell of all."""
    from surfsig.files.las import OpenLas

    with one.path.open("rb") as file:
        las = OpenLas(file, str(one.path), Progress(None, 0))
        header = las.header
        finish = Finish(colours=True, bytes_in_16_bits=True, defaults=las.defaults)
        las.only([])
        sample = stacked(list(las.clouds(BLOCK_POINTS)))
        for node in one.nodes:
            points = node.chunk.points
            if sampling.wants(first, first + points):
                las.only([node.chunk])
                cloud = stacked(list(las.clouds(BLOCK_POINTS)))
                sampling.take(number, cloud, np.asarray(cloud.points, np.float64), first, first)
                sample = finish.sample_of(stacked([sample, finish.sample_of(cloud)]))
            first += points
    survey.files.append(one.path)
    survey.heads.append(FileHead(finish, sample, one.points))
    survey.layouts.append(Layout.of(sample))
    survey.cells.add_cells(
        np.array([node.middle for node in one.nodes]).reshape(-1, 3),
        np.array([node.chunk.points for node in one.nodes], np.int64),
    )
    # What the header says may be rounded by half a step.
    margin = np.abs(header.scales)
    survey.lowest = np.minimum(survey.lowest, header.mins - margin)
    survey.highest = np.maximum(survey.highest, header.maxs + margin)


def _indexed(file: Path) -> _Indexed | None:
    from surfsig.files.las import OpenLas
    from surfsig.files.las_box import las_summary

    try:
        if not las_summary(file).is_copc:
            return None
    except FileFormatError:
        # Another format, or broken, which whoever reads it says.
        return None
    with file.open("rb") as opened:
        las = OpenLas(opened, str(file), Progress(None, 0))
        nodes = las.nodes()
        return None if nodes is None else _Indexed(file, nodes, las.header.point_count)
