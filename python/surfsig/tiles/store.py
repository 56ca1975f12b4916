"""A store of tiles on the disk: points of files without an index, binned once, and read by tile and by box.

A folder with a file of rows for each tile. Within it, rows stand in blocks of neighbouring points, in the
order of the input, and the store knows each block's box; so what lies along a tile's border is read without
the rest of its neighbours.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.atomic import replacing
from surfsig.point_cloud import PointCloud
from surfsig.tiles.frame import Frame
from surfsig.tiles.plan import Plan
from surfsig.tiles.rows import FileHead, Layout
from surfsig.tiles.sampling import WholeFacts
from surfsig.tiles.survey import Unreadable

INDEX = "index.json"
VERSION = 1


@dataclass(frozen=True)
class TileCloud:
    """The points of a tile, with those around it.

    Attributes
    ----------
    cloud
        In the order of the input, with what `surfsig.read` gives of all files together.
    own
        (n,) True for the tile's own points, False for those of its halo.
    numbers
        (n,) uint64, each point's number in the input.
    complete
        (2, 3), the box in which there are all points of the input.
    """

    cloud: PointCloud
    own: NDArray[np.bool_]
    numbers: NDArray[np.uint64]
    complete: NDArray[np.float64]


@dataclass(frozen=True)
class Store:
    """A finished store.

    Attributes
    ----------
    folder
        Where it is.
    plan
        Its tiles.
    counts
        (t,) points of each tile.
    heads, layouts, layout_of_file
        What is known of each file that was read; the types of rows, and which of them each file has.
    unreadable
        Files that could not be read.
    facts
        What is known of all points.
    """

    folder: Path
    plan: Plan
    counts: tuple[int, ...]
    heads: tuple[FileHead, ...]
    layouts: tuple[Layout, ...]
    layout_of_file: tuple[int, ...]
    unreadable: tuple[Unreadable, ...]
    facts: WholeFacts
    _blocks: dict[tuple[int, int], Blocks] = field(default_factory=dict, repr=False, compare=False)
    _frames: list[Frame] = field(default_factory=list, repr=False, compare=False)

    def read(self, tile: int, halo: float) -> TileCloud:
        """Read a tile, and all points within a distance of it.

        Parameters
        ----------
        tile
            Its number.
        halo
            In the input's own unit; infinity reads everything.

        Raises
        ------
        OSError, FileFormatError
            If the store cannot be read.
        """
        own_box = self.plan.boxes[tile]
        complete = own_box + np.array([[-halo], [halo]])
        parts: list[list[NDArray[Any]]] = [[] for _ in self.layouts]
        for layout in range(len(self.layouts)):
            parts[layout].append(self._all_rows(tile, layout))
            for other in self.plan.touching(complete):
                if other != tile:
                    parts[layout] += self._rows_in(other, layout, complete)
        cloud, numbers, tiles = self._cloud(parts, tile)
        return TileCloud(cloud, tiles, numbers, self.facts.without_rim(complete))

    def read_box(self, box: NDArray[np.float64]) -> PointCloud:
        """Read the points in a box (2, 3), to which both corners belong, in the order of the input."""
        parts = [
            [rows for tile in self.plan.touching(box) for rows in self._rows_in(tile, layout, box)]
            for layout in range(len(self.layouts))
        ]
        return self._cloud(parts, None)[0]

    def frame(self) -> PointCloud:
        """Give the cloud of all files without its points: fields, viewpoints, coordinate system."""
        return self._cloud([[] for _ in self.layouts], None)[0]

    def _all_rows(self, tile: int, layout: int) -> NDArray[Any]:
        dtype = self.layouts[layout].dtype
        count = self._index(tile, layout).count
        return rows_from(self._path(tile, layout), dtype, 0, count)

    def _rows_in(self, tile: int, layout: int, box: NDArray[np.float64]) -> list[NDArray[Any]]:
        """Read those blocks of a tile that meet a box, and of these the points in it."""
        dtype, index = self.layouts[layout].dtype, self._index(tile, layout)
        found = []
        meets = ((index.lowest <= box[1]) & (index.highest >= box[0])).all(axis=1)
        for block in np.flatnonzero(meets):
            start, stop = int(index.starts[block]), int(index.starts[block + 1])
            rows = rows_from(self._path(tile, layout), dtype, start, stop - start)
            points = self.coordinates(rows)
            with np.errstate(invalid="ignore"):
                inside = ((points >= box[0]) & (points <= box[1])).all(axis=1)
            found.append(rows.take(np.flatnonzero(inside)))
        return found

    def coordinates(self, rows: NDArray[Any]) -> NDArray[np.float64]:
        """Give the true coordinates (n, 3) of rows."""
        return coordinates(rows, np.array([head.sample.origin for head in self.heads]))

    def _cloud(
        self, parts: Sequence[Sequence[NDArray[Any]]], tile: int | None
    ) -> tuple[PointCloud, NDArray[np.uint64], NDArray[np.bool_]]:
        """Make one cloud of rows of all layouts, in the order of their numbers; say which are a tile's own.

        Fields, types and frame are those that `surfsig.read` gives of all files.
        """
        stacks, numbers = [], []
        for kind, found in zip(self.layouts, parts, strict=True):
            rows = np.concatenate([np.empty(0, kind.dtype), *found]) if len(found) != 1 else found[0]
            own = np.zeros(len(rows), np.bool_)
            if tile is not None and found:
                own[: len(found[0])] = True
            order = np.argsort(rows["number"], kind="stable")
            stacks.append((rows.take(order), own[order]))
        ends = [
            np.searchsorted(np.ascontiguousarray(rows["file"]), np.arange(len(self.heads) + 1)).tolist()
            for rows, _ in stacks
        ]
        files, owned = [], []
        for file, layout in enumerate(self.layout_of_file):
            rows, own = stacks[layout]
            part = slice(ends[layout][file], ends[layout][file + 1])
            files.append(rows[part])
            numbers.append(rows["number"][part])
            owned.append(own[part])
        return self._frame.cloud(files), np.concatenate(numbers), np.concatenate(owned)

    @property
    def _frame(self) -> Frame:
        """The frame of all files, made when it is first needed."""
        if not self._frames:
            self._frames.append(Frame(self.heads, [self.layouts[layout] for layout in self.layout_of_file]))
        return self._frames[0]

    def _path(self, tile: int, layout: int) -> Path:
        return rows_path(self.folder, tile, layout)

    def _index(self, tile: int, layout: int) -> Blocks:
        key = tile, layout
        if key not in self._blocks:
            self._blocks[key] = Blocks.read(self._path(tile, layout))
        return self._blocks[key]

    def is_whole(self) -> bool:
        """Tell whether all rows are there, by the sizes of their files."""
        found = [0] * len(self.plan)
        for layout, kind in enumerate(self.layouts):
            for tile in range(len(self.plan)):
                path = self._path(tile, layout)
                found[tile] += path.stat().st_size // kind.dtype.itemsize if path.exists() else 0
        return tuple(found) == self.counts

    def write_index(self, fingerprint: dict[str, Any]) -> None:
        """Write what makes a folder of rows a finished store."""
        for file, head in enumerate(self.heads):
            layout = self.layouts[self.layout_of_file[file]]
            rows = layout.rows(head.sample, np.arange(len(head.sample), dtype=np.uint64), file)
            with replacing(self.folder / f"sample_{file}.rows") as out:
                out.write(rows.tobytes())
        values = {
            "version": VERSION,
            "source": fingerprint,
            "plan": self.plan.to_json(),
            "counts": list(self.counts),
            "heads": [head.to_json() for head in self.heads],
            "layouts": [layout.to_json() for layout in self.layouts],
            "layout_of_file": list(self.layout_of_file),
            "unreadable": [
                {"path": str(one.path), "error": one.error, "box": one.box.tolist()}
                for one in self.unreadable
            ],
            "facts": self.facts.to_json(),
        }
        with replacing(self.folder / INDEX) as out:
            out.write(json.dumps(values).encode())

    @classmethod
    def open(cls, folder: Path) -> Store:
        """Open a finished store.

        Raises
        ------
        FileFormatError
            If there is none, or it is broken, or of another version.
        """
        values = read_index(folder)
        if values is None:
            raise FileFormatError(f"{folder}: is no finished store of tiles that this version can read")
        layouts = tuple(map(Layout.from_json, values["layouts"]))
        of_file = tuple(values["layout_of_file"])
        heads = []
        for file, head in enumerate(values["heads"]):
            layout = layouts[of_file[file]]
            path = folder / f"sample_{file}.rows"
            heads.append(FileHead.from_json(head, layout, np.fromfile(path, layout.dtype)))
        return cls(
            folder,
            Plan.from_json(values["plan"]),
            tuple(values["counts"]),
            tuple(heads),
            layouts,
            of_file,
            tuple(
                Unreadable(Path(one["path"]), one["error"], np.array(one["box"]))
                for one in values["unreadable"]
            ),
            WholeFacts.from_json(values["facts"]),
        )


@dataclass(frozen=True)
class Blocks:
    """Where the blocks of a file of rows begin (b + 1,), and the boxes of their points (b, 3)."""

    starts: NDArray[np.int64]
    lowest: NDArray[np.float64]
    highest: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Rows of all blocks."""
        return int(self.starts[-1])

    def write(self, rows: Path) -> None:
        """Write them beside the rows."""
        with replacing(rows.with_suffix(".npz")) as file:
            np.savez(file, starts=self.starts, lowest=self.lowest, highest=self.highest)

    @classmethod
    def read(cls, rows: Path) -> Blocks:
        """Read them; where there are no rows, there are no blocks."""
        path = rows.with_suffix(".npz")
        if not path.exists() and not rows.exists():
            return cls(np.zeros(1, np.int64), np.empty((0, 3)), np.empty((0, 3)))
        try:
            with np.load(path) as arrays:
                return cls(arrays["starts"], arrays["lowest"], arrays["highest"])
        except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise FileFormatError(f"{path}: broken ({error})") from None


def rows_path(folder: Path, tile: int, layout: int) -> Path:
    """Name the file of a tile's rows of one layout."""
    return folder / f"tile_{tile:06d}_{layout}.rows"


def rows_from(path: Path, dtype: np.dtype[Any], start: int, count: int) -> NDArray[Any]:
    """Read rows from a file.

    Raises
    ------
    FileFormatError
        If it is cut off.
    """
    if not count:
        return np.empty(0, dtype)
    rows = np.fromfile(path, dtype, count, offset=start * dtype.itemsize)
    if len(rows) < count:
        raise FileFormatError(f"{path}: cut off: {len(rows)} of {count} rows are there")
    return rows


def coordinates(rows: NDArray[Any], origins: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give the true coordinates (n, 3) of rows, from the origins (f, 3) of their files."""
    if not origins.any():
        return np.asarray(rows["offsets"], np.float64)
    # Float64 added to what is float32 or float64, as `PointCloud.points` adds.
    moved = origins[0] if (origins == origins[0]).all() else origins[rows["file"]]
    return np.asarray(moved + rows["offsets"], np.float64)


def read_index(folder: Path) -> dict[str, Any] | None:
    """Read the index of a store; None where there is none, or none of this version."""
    try:
        values: dict[str, Any] = json.loads((folder / INDEX).read_text())
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return None
    return values if values.get("version") == VERSION else None


def removed(folder: Path) -> None:
    """Remove a store, finished or not; nothing else that may be in the folder."""
    if not folder.is_dir():
        return
    (folder / INDEX).unlink(missing_ok=True)
    for pattern in ("tile_*.rows", "tile_*.npz", "tile_*.tmp", "sample_*.rows"):
        for file in folder.glob(pattern):
            file.unlink()
