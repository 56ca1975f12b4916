"""Points that need not be in memory: what there is, and any box of it, read when it is asked for."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.convert.arrow import pyarrow
from surfsig.convert.libraries import library
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.joined import joined
from surfsig.files.options import box_array
from surfsig.files.paths import MANIFEST, Paths
from surfsig.files.read_file import ReadOptions, read_file
from surfsig.point_cloud import PointCloud
from surfsig.tiles.manifest import read_manifest
from surfsig.tiles.source import Source

if TYPE_CHECKING:
    from surfsig.files.las_box import LasSummary


@dataclass(frozen=True)
class TilePart:
    """One part of a result.

    Attributes
    ----------
    tile
        Its number.
    box
        (2, 3), the lowest and the highest corner of its tile, infinite at the rim; the highest does not
        belong to it.
    points
        How many it has.
    path
        Its file; None where the tile has no points.
    error
        Why it is missing; None where it is there.
    """

    tile: int
    box: NDArray[np.float64]
    points: int
    path: Path | None
    error: str | None = None

    def read(self) -> PointCloud:
        """Read its points with all columns.

        Returns
        -------
        PointCloud

        Raises
        ------
        OSError, FileFormatError
            If there is no such part, or it is broken.
        """
        if self.path is None:
            raise FileFormatError(f"tile {self.tile}: {self.error or 'has no points'}")
        return read_file(self.path, ReadOptions())


class TileDataset:
    """The parts that `extract_tiles` wrote into a folder.

    Parameters
    ----------
    folder
        With a ``manifest.json``.

    Attributes
    ----------
    folder
        The folder.
    manifest
        What its manifest says.
    tiles
        The parts, in the order of their numbers.

    Raises
    ------
    InvalidInputError
        If there is no manifest.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        manifest = read_manifest(self.folder)
        if manifest is None:
            raise InvalidInputError(f"{folder}: holds no {MANIFEST}")
        self.manifest: dict[str, Any] = manifest
        records = {record["tile"]: record for record in manifest["tiles"]}
        self.tiles: list[TilePart] = []
        for tile, corners in enumerate(manifest["boxes"]):
            record = records.get(tile, {"error": "not done yet"})
            part = record.get("part")
            # A name, and no path that leads elsewhere.
            path = None if part is None else self.folder / Path(part).name
            box = np.array(
                [
                    [rim if value is None else value for value in corner]
                    for rim, corner in zip((-np.inf, np.inf), corners, strict=True)
                ]
            )
            self.tiles.append(TilePart(tile, box, record.get("points", 0), path, record.get("error")))

    def __repr__(self) -> str:
        """Say how much there is."""
        missing = sum(part.error is not None for part in self.tiles)
        told = f", {missing} missing" if missing else ""
        return f"TileDataset({str(self.folder)!r}, {len(self)} points in {len(self.tiles)} tiles{told})"

    def __len__(self) -> int:
        """Count the points of all parts."""
        return sum(part.points for part in self.tiles)

    @property
    def is_finished(self) -> bool:
        """Whether all tiles were worked on, and none is missing."""
        return bool(self.manifest["finished"]) and all(part.error is None for part in self.tiles)

    def status_counts(self) -> dict[str, int]:
        """Count the points of all parts by their status.

        Returns
        -------
        dict
            By the names of `Status`, those that occur.
        """
        counts: Counter[str] = Counter()
        for record in self.manifest["tiles"]:
            counts.update(record.get("status", {}))
        return dict(counts)

    @property
    def paths(self) -> list[Path]:
        """The files of the parts."""
        return [part.path for part in self.tiles if part.path is not None]

    def clouds(self) -> Iterator[PointCloud]:
        """Give the points of one part after the other.

        Returns
        -------
        iterator of PointCloud
            Each part is read when it is asked for.
        """
        return (part.read() for part in self.tiles if part.path is not None)

    def read(self, box: ArrayLike | None = None) -> PointCloud:
        """Read the points in a box, with all columns.

        Parameters
        ----------
        box
            (2, 3), its lowest and its highest corner, both of which belong to it; all points by default.

        Returns
        -------
        PointCloud
            Tile after tile, without the field ``file`` of several files.

        Raises
        ------
        OSError, FileFormatError
            If a part that has points there is missing or broken.
        InvalidInputError
            If the box is none.
        """
        options, parts = ReadOptions(box=box), [part for part in self.tiles if part.points or part.error]
        if box is not None:
            corners = box_array(box)
            parts = [
                part
                for part in parts
                if (part.box[0] <= corners[1]).all() and (part.box[1] >= corners[0]).all()
            ]
        for part in parts:
            if part.path is None:
                raise FileFormatError(f"tile {part.tile}: {part.error}")
        paths = [part.path for part in parts if part.path is not None]
        if not paths:
            raise FileFormatError(f"{self.folder}: no tile has points there")
        clouds = [read_file(path, options) for path in paths]
        return _of_tiles(clouds, str(self.folder))

    def to_arrow(self) -> Any:
        """Give the parts as a PyArrow dataset, which reads them when it is asked to; they must be Parquet.

        Returns
        -------
        pyarrow.dataset.Dataset

        Raises
        ------
        InvalidInputError
            If PyArrow is not installed, or the parts have another format.
        """
        if self.manifest["arguments"]["suffix"] != ".parquet":
            raise InvalidInputError(
                f"{self.folder}: a PyArrow dataset needs parts in Parquet: suffix='.parquet'"
            )
        dataset = pyarrow("pyarrow.dataset")
        return dataset.dataset([str(path) for path in self.paths], format="parquet")

    def to_dask(self) -> Any:
        """Give x, y, z and all columns as a Dask DataFrame with a partition for each part.

        Returns
        -------
        dask.dataframe.DataFrame

        Raises
        ------
        InvalidInputError
            If Dask or pandas is not installed.
        """
        frames = library("dask.dataframe", "Dask's DataFrame", "'surfsig[scale]' 'dask[dataframe]'")
        first = next(iter(self.clouds())).at(np.arange(0))
        return frames.from_map(_data_frame, self.paths, meta=first.to_pandas())


class FileDataset:
    """Files of points, of which any box can be read.

    Parameters
    ----------
    source
        Files, a folder or a pattern, as for `read`.

    Attributes
    ----------
    files
        The files.
    headers
        For each what its header says; None for formats whose header tells neither number nor box.
    """

    def __init__(self, source: Paths) -> None:
        # laspy takes a while to import.
        from surfsig.files.las_box import las_summary

        self.files: tuple[Path, ...] = Source.of(source).files
        self.headers: list[LasSummary | None] = []
        for file in self.files:
            with file.open("rb") as opened:
                is_las = opened.read(4) == b"LASF"
            self.headers.append(las_summary(file) if is_las else None)

    def __repr__(self) -> str:
        """Say how much there is."""
        points = "" if self.points is None else f", {self.points} points"
        return f"FileDataset({len(self.files)} files{points})"

    @property
    def points(self) -> int | None:
        """How many points the headers promise; None where one does not say."""
        known = [header.points for header in self.headers if header is not None]
        return sum(known) if len(known) == len(self.headers) else None

    @property
    def bounds(self) -> NDArray[np.float64] | None:
        """(2, 3), the box of all points by the headers; None where one does not say."""
        boxes = [header.box for header in self.headers if header is not None and header.points]
        if not boxes or any(header is None for header in self.headers):
            return None
        return np.array([np.min(boxes, axis=0)[0], np.max(boxes, axis=0)[1]])

    def read(self, box: ArrayLike | None = None) -> PointCloud:
        """Read the points in a box, of several files as `surfsig.read` joins them.

        Files whose header says that they have no points there are not opened; of a COPC file no more is read
        than the box asks for.

        Parameters
        ----------
        box
            (2, 3), its lowest and its highest corner, both of which belong to it; all points by default.

        Returns
        -------
        PointCloud

        Raises
        ------
        OSError, FileFormatError
            If a file cannot be read.
        InvalidInputError
            If the box is none.
        """
        options = ReadOptions(box=box)
        corners = None if box is None else box_array(box)
        clouds = []
        for file, header in zip(self.files, self.headers, strict=True):
            apart = header is not None and corners is not None and _apart(header.box, corners)
            clouds.append(PointCloud(np.empty((0, 3))) if apart else read_file(file, options))
        return joined(clouds, f"{self.files[0]} and {len(clouds) - 1} more")


def _apart(first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
    # Headers round: by less than a millionth of the coordinates.
    margin = 1e-6 * np.maximum(np.abs(first).max(axis=0), 1e-3)
    return bool(((first[0] - margin > second[1]) | (first[1] + margin < second[0])).any())


def _of_tiles(clouds: Sequence[PointCloud], source: str) -> PointCloud:
    """Join parts, without the number of the part as a field."""
    cloud = joined(clouds, source)
    if len(clouds) > 1:
        fields = {name: values for name, values in cloud.fields.items() if name != "file"}
        renamed = fields.pop("input_file", None)
        if renamed is not None:
            fields["file"] = renamed
        cloud.fields = fields
    return cloud


def _data_frame(path: Path) -> Any:
    return read_file(path, ReadOptions()).to_pandas()


def open(source: Paths) -> TileDataset | FileDataset:
    """Open files, or a folder of tiles, without reading their points.

    Parameters
    ----------
    source
        A folder with a ``manifest.json`` that `extract_tiles` wrote; or files, a folder or a pattern, as for
        `read`.

    Returns
    -------
    TileDataset or FileDataset
        Both have ``read(box)``.

    Raises
    ------
    OSError, FileFormatError, InvalidInputError
        If there is no such file, or a header is broken.
    """
    if isinstance(source, (str, os.PathLike)) and (Path(source) / MANIFEST).is_file():
        return TileDataset(source)
    return FileDataset(source)
