"""PTX (Leica, Cyclone): scans one after the other, each a grid of points with its pose."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import cloud_from_columns
from surfsig.files.encodings import decoded
from surfsig.files.lines import line_blocks, parse, warn_unterminated
from surfsig.files.scans import joined_scans, scan_number
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

# Two counts, a position of three numbers, three axes and the first row of a matrix.
_NUMBER = rb"[-+]?[\d.][-+.\deE]*"
_ROW = rb"[ \t]*" + rb"[ \t]+".join([_NUMBER] * 3)
MAGIC = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*\d+\s*[\r\n]\s*\d+[ \t]*[\r\n]+"
    + rb"(?:" + _ROW + rb"[ \t]*[\r\n]+){4}" + _ROW + rb"[ \t]+" + _NUMBER + rb"[ \t]*[\r\n]"
)  # fmt: skip

# Beyond any scanner's columns and rows.
_MOST_ROWS = 1e9
# Two counts, position, three axes, four rows of the matrix: how many numbers each line has.
_HEADER_WIDTHS = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)
_NAMES = {
    3: ("x", "y", "z"),
    4: ("x", "y", "z", "intensity"),
    6: ("x", "y", "z", "red", "green", "blue"),
    7: ("x", "y", "z", "intensity", "red", "green", "blue"),
}


@dataclass
class _Scan:
    """One scan: its header, and the rows that were read so far."""

    columns: int
    rows: int
    position: NDArray[np.float64]
    matrix: NDArray[np.float64]
    left: int
    blocks: list[NDArray[np.float64]] = field(default_factory=list)

    def add(self, lines: list[str], count: int, source: str, first: int) -> None:
        """Read `count` points; the first of the lines has the number `first`."""
        width = self.blocks[0].shape[1] if self.blocks else len(lines[0].split())
        if width not in _NAMES:
            raise FileFormatError(
                f"{source}: line {first}: {width} values where a point of PTX has "
                f"{', '.join(map(str, _NAMES))}"
            )
        self.blocks.append(parse(lines, np.float64, width, source=source, first=first))
        self.left -= count


def read(file: BinaryIO, source: str, progress: Progress, scan: int | None = None) -> PointCloud:
    """Read an open PTX file: one scan, or all of them joined in the common frame.

    Points are moved by their scan's matrix; missing ones, which the file writes as 0 0 0, are NaN and keep
    their place. The viewpoint is the scanner's position. The grid of a single scan has a row for each of the
    scanner's columns, as the file has them. Where several scans are joined, the field ``scan`` gives each
    point's, from 0.

    Raises
    ------
    FileFormatError
        If it is cut off, or a line makes no sense.
    InvalidInputError
        If there is no scan of the number `scan`.
    """
    file = decoded(file)
    scans = list(_scans(file, source, progress))
    if scan is not None:
        return _cloud(scans[scan_number(scan, len(scans), source)], source)
    return joined_scans([_cloud(each, source) for each in scans], source)


def _scans(file: BinaryIO, source: str, progress: Progress) -> Iterator[_Scan]:
    header: list[NDArray[np.float64]] = []
    current: _Scan | None = None
    for block in line_blocks(file, 1, progress):
        filled = [i for i, line in enumerate(block.lines) if line.strip()]
        done = 0
        while done < len(filled):
            number = block.first + filled[done]
            if current is None:
                line, width = block.lines[filled[done]], _HEADER_WIDTHS[len(header)]
                header.append(parse([line], np.float64, width, source=source, first=number)[0])
                done += 1
                if len(header) == len(_HEADER_WIDTHS):
                    current = _begun(header, source, number)
                    header = []
            else:
                end = min(done + current.left, len(filled))
                current.add(block.lines[filled[done] : filled[end - 1] + 1], end - done, source, number)
                done = end
            if current is not None and not current.left:
                yield current
                current = None
        if block.unterminated and filled:
            warn_unterminated(source, block.first + filled[-1])
    if current is not None or header:
        raise FileFormatError(f"{source}: cut off: its last scan has fewer lines than its header promises")


def _begun(rows: list[NDArray[np.float64]], source: str, number: int) -> _Scan:
    """Understand the lines above a scan's points, of which the last has this number."""
    columns, height = float(rows[0][0]), float(rows[1][0])
    if not (0 <= columns < _MOST_ROWS and 0 <= height < _MOST_ROWS and columns % 1 == height % 1 == 0):
        raise FileFormatError(
            f"{source}: line {number - 9}: a scan of {columns:g} x {height:g} points is none"
        )
    matrix = np.array(rows[6:])
    if not (np.isfinite(matrix).all() and np.isfinite(rows[2]).all()):
        raise FileFormatError(f"{source}: line {number - 3}: the pose of the scan is not finite")
    if not np.array_equal(matrix[:, 3], [0, 0, 0, 1]):
        raise FileFormatError(f"{source}: line {number - 3}: the matrix of the scan is no pose")
    return _Scan(int(columns), int(height), rows[2], matrix, int(columns) * int(height))


def _cloud(scan: _Scan, source: str) -> PointCloud:
    table = np.concatenate(scan.blocks) if scan.blocks else np.empty((0, 3))
    points = table[:, :3].copy()
    points[~points.any(axis=1)] = np.nan
    # Rows of numbers stand on the left of a matrix: its last row is where the scanner is.
    turn, position = scan.matrix[:3, :3], scan.matrix[3, :3]
    if not np.array_equal(turn, np.eye(3)):
        points = points @ turn
    if position.any():
        points += position
    columns = dict(zip("xyz", points.T, strict=True))
    columns.update({name: table[:, i] for i, name in enumerate(_NAMES[table.shape[1]]) if i >= 3})
    organised = scan.columns > 1 and scan.rows > 1
    return cloud_from_columns(
        columns,
        source=source,
        decimals=(),
        viewpoint=scan.position if scan.position.any() else position,
        grid=(scan.columns, scan.rows) if organised else None,
    )
