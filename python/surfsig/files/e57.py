"""E57: scans with their poses, one by one or joined; written with every field."""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.errors import FileFormatError
from surfsig.files.colours import with_colours
from surfsig.files.e57_names import field_names
from surfsig.files.scans import joined_scans, scan_number
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

MAGIC = b"ASTM-E57"

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ", "cartesianInvalidState")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation", "sphericalInvalidState")


def read(file: BinaryIO, source: str, progress: Progress, scan: int | None = None) -> PointCloud:
    """Read an open E57 file: one scan, or all of them joined in the file's common frame.

    Points that the file calls invalid, or of which it gives only the direction, are NaN and keep their
    place. Coordinates are float64, or float32 where a scan without a pose (or with one that moves nothing)
    stores them so. Where several scans are joined, the field ``scan`` gives each point's, from 0; a field
    that one of them lacks is NaN there, or 0 if it holds whole numbers.

    Raises
    ------
    FileFormatError
        If it is cut off, broken, or holds no scan.
    InvalidInputError
        If there is no scan of the number `scan`.

    Warns
    -----
    UserWarning
        If the colours of some scans have 8 bits and those of others 16.
    """
    reader = _surfsig.E57Reader(file, source, progress.advance)
    if not len(reader):
        raise FileFormatError(f"{source}: the E57 file holds no scan")
    if scan is None:
        return joined_scans([_scan(reader, number, source) for number in range(len(reader))], source)
    return _scan(reader, scan_number(scan, len(reader), source), source)


def _scan(reader: _surfsig.E57Reader, number: int, source: str) -> PointCloud:
    columns, pose = reader.scan(number)
    points = _points(columns, f"{source}: scan {number}")
    fields = with_colours({field: columns[name] for name, field in field_names(columns).items()})
    viewpoint = None
    if pose is not None:
        rotation, viewpoint = _rotation(pose[0], source), np.array(pose[1])
        if not np.isfinite(viewpoint).all():
            raise FileFormatError(f"{source}: the pose of scan {number} is not finite")
        if not np.array_equal(rotation, np.eye(3)):
            points = points @ rotation.T
            normals = [fields.get(name) for name in ("nx", "ny", "nz")]
            if all(values is not None for values in normals):
                turned = np.stack(normals, axis=1) @ rotation.T  # type: ignore[arg-type]
                fields.update(zip(("nx", "ny", "nz"), turned.T.copy(), strict=True))
        if viewpoint.any():
            points = points + viewpoint
    return PointCloud(points, viewpoint=viewpoint, fields=fields, grid=_grid(fields, len(points)))


def _points(columns: dict[str, NDArray[Any]], where: str) -> NDArray[Any]:
    """Give (n, 3) coordinates in the scanner's frame, NaN where there are none.

    Cartesian ones come first; where they are invalid, the spherical ones stand in, if they are there.
    """
    points: NDArray[Any] | None = None
    if all(name in columns for name in _CARTESIAN[:3]):
        xyz = [columns.pop(name) for name in _CARTESIAN[:3]]
        kept = np.float32 if all(axis.dtype == np.float32 for axis in xyz) else np.float64
        points = np.stack(xyz, axis=1, dtype=kept)
        points[_invalid(columns, _CARTESIAN[3], len(points))] = np.nan
    if all(name in columns for name in _SPHERICAL[:3]):
        reach, azimuth, elevation = (columns[name].astype(np.float64) for name in _SPHERICAL[:3])
        flat = reach * np.cos(elevation)
        turned = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), reach * np.sin(elevation)], axis=1)
        turned[_invalid(columns, _SPHERICAL[3], len(turned))] = np.nan
        if points is None:
            points = turned
            for name in _SPHERICAL[:3]:
                del columns[name]
        else:
            missing = np.isnan(points).any(axis=1)
            if not np.isnan(turned[missing]).all():
                points = np.where(missing[:, None], turned, points)
    if points is None:
        names = ", ".join(list(columns)[:8]) or "none"
        raise FileFormatError(f"{where} has no coordinates among the point's values ({names})")
    return points


def _invalid(columns: dict[str, NDArray[Any]], name: str, count: int) -> NDArray[np.bool_]:
    state = columns.pop(name, None)
    return np.zeros(count, np.bool_) if state is None else state != 0


def _rotation(quaternion: list[float], source: str) -> NDArray[np.float64]:
    """Make the matrix (3, 3) of a quaternion, w first, that need not have the length 1."""
    length = np.linalg.norm(quaternion)
    if not (np.isfinite(length) and length > 0):
        raise FileFormatError(f"{source}: a pose's rotation {quaternion} is none")
    w, x, y, z = np.array(quaternion) / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _grid(fields: dict[str, NDArray[Any]], count: int) -> tuple[int, int] | None:
    """Give (height, width) if the points fill a grid row by row."""
    rows, columns = fields.get("row_index"), fields.get("column_index")
    if rows is None or columns is None or not count:
        return None
    height, width = int(rows[-1]) + 1, int(columns[-1]) + 1
    if height * width != count or height == 1:
        return None
    places = np.arange(count)
    filled = np.array_equal(rows, places // width) and np.array_equal(columns, places % width)
    return (height, width) if filled else None
