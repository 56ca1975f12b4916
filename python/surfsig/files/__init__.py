"""Reading and writing point clouds.

A file's format is recognised by its content; only if that says nothing does the extension count. PLY bytes in
a file called ``scan.pcd`` are therefore read as PLY. What is written has the format of its extension.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from surfsig.errors import InvalidInputError
from surfsig.files import formats
from surfsig.files.atomic import check_target, replacing
from surfsig.files.columns import Chunks, output_columns
from surfsig.files.paths import Paths, files_meant
from surfsig.files.read_file import ReadOptions, read_file
from surfsig.files.sequence import ScanSequence, TimedScan, open_scan_sequence
from surfsig.files.several import read_several
from surfsig.files.trajectory import (
    Trajectory,
    read_trajectory,
    trajectory_format,
    write_covariances,
    write_trajectory,
)
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress, ProgressCallback

__all__ = [
    "Chunks",
    "ScanSequence",
    "TimedScan",
    "Trajectory",
    "check_writable",
    "format_name",
    "open_scan_sequence",
    "read",
    "read_trajectory",
    "trajectory_format",
    "write",
    "write_covariances",
    "write_trajectory",
]


def read(
    path: Paths,
    *,
    box: ArrayLike | None = None,
    unit: str | None = None,
    columns: str | Sequence[str] | None = None,
    scan: int | None = None,
    samples: int | None = None,
    intrinsics: ArrayLike | None = None,
    depth_scale: float | None = None,
    progress: ProgressCallback | None = None,
) -> PointCloud:
    """Read a point cloud.

    From PLY, PCD, LAS, LAZ, COPC, E57, text (XYZ, CSV, TXT, ASC, PTS), PTX, NPY, NPZ, Parquet, STL, OBJ, OFF,
    glTF and GLB, rows of float32 (KITTI's and nuScenes' .bin) or a depth image (PNG of 16 bits).

    Parameters
    ----------
    path
        The file; its content, not its extension, decides how it is read. Or several that make one cloud: a
        folder (its files of the commonest extension), a pattern such as ``"scan/*.laz"`` (a file of this very
        name comes first), both in the natural order of names (2 before 10), or an iterable of paths, in their
        order; formats may differ.
    box
        Only the points in this box: (2, 3), its lowest and its highest corner, in the file's coordinates and
        unit; both belong to it. A COPC file is read no further than the box asks for.
    unit
        What the file's numbers are: "mm", "cm", "m", "km", "in", "ft" or "us-ft". The cloud is then in
        metres, and in no coordinate system; by default it stays as it is.
    columns
        Of text, rows of float32, and NPY (n, k): a name for each column of the file, such as
        "x,y,z,intensity,ring" or ["_", "x", "y", "z"]; ``_`` leaves one out. By default the file's header
        says, or what the numbers can be; a file of which that is not certain is refused.
    scan
        Of an E57, PTX or PTS file with several scans, the one with this number, from 0; by default all of
        them.
    samples
        Of a mesh (OBJ, STL, PLY, OFF, glTF), this many points spread evenly over its surface, in place of
        its vertices.
    intrinsics
        Of a depth image: (fx, fy, cx, cy) in pixels.
    depth_scale
        Of a depth image: units of its numbers per unit of length; 1000 by default (millimetres to metres).
    progress
        Called with the bytes read so far and the size of the file.

    Returns
    -------
    PointCloud
        Coordinates in the file's precision (text: float64), with all other values of its points as fields.
        Of several files, with the fields that all have, and ``file``, each point's file, from 0; where each
        has a viewpoint, ``scan`` numbers the `viewpoints`.

    Raises
    ------
    OSError
        If the file is missing or cannot be opened, or no file matches a pattern.
    FileFormatError
        If it is no point cloud, broken, or cut off; if a folder is empty. One bad file of several is enough.
    InvalidInputError
        If an option has no meaning, or none for this file's format.

    Warns
    -----
    UserWarning
        If the last line of a text file is cut off (it is dropped) or may be; if values are left out that are
        no numbers, or that not all of several files have; if the coordinates are degrees, in two units, or
        not in the `unit` given; if nobody named the columns and the first three may be no coordinates; if the
        header contradicts the file, and one of the two is clearly right.

    Notes
    -----
    Memory: binary PLY and PCD, NPZ, and NPY (n, 3) need the cloud itself and a few MB (a PLY file whose lists
    differ in length also what follows the first that does); other files up to twice the cloud and more. A box
    or a unit makes a copy.
    """
    options = ReadOptions(box, unit, columns, scan, samples, intrinsics, depth_scale)
    files = files_meant(path)
    if files is not None:
        return read_several(files, lambda file, told: read_file(file, options, told), progress)
    return read_file(Path(path), options, progress)  # type: ignore[arg-type]


def format_name(path: Paths) -> str:
    """Say what format a file has by its content ("PLY", "text", ...).

    Parameters
    ----------
    path
        The file, or several, as for `read`.

    Returns
    -------
    The format's name; several, with commas between them, where files differ.

    Raises
    ------
    OSError, FileFormatError
        As `read`.
    """
    files = files_meant(path) or [Path(path)]  # type: ignore[arg-type]
    return ", ".join(dict.fromkeys(formats.of_file(file).name for file in files))


def check_writable(path: str | os.PathLike[str]) -> None:
    """Make sure, before a long computation, that `write` will be able to write to `path`.

    Parameters
    ----------
    path
        The file to be written.

    Raises
    ------
    OSError
        If the folder is missing or cannot be written to, or the file is read-only.
    InvalidInputError
        If the extension is none that can be written, a library for it is missing, or the path is a folder.
    """
    path = Path(path)
    formats.of_output(path)
    check_target(path)


def write(
    path: str | os.PathLike[str],
    cloud: PointCloud | ArrayLike,
    columns: Mapping[str, ArrayLike] | None = None,
    *,
    chunks: Chunks | tuple[str, int, object, object] | None = None,
    notes: Mapping[str, str] | None = None,
    progress: ProgressCallback | None = None,
) -> None:
    """Write a cloud with further columns: PLY, PCD, LAS, LAZ, E57, NPZ, Parquet or text, by the extension.

    The file appears whole or not at all: a failure (a full disk) leaves an old file as it was.

    Parameters
    ----------
    path
        The file; ``.ply``, ``.pcd``, ``.las``, ``.laz``, ``.e57``, ``.npz``, ``.parquet``, ``.csv``, or
        ``.xyz``, ``.txt`` and ``.asc`` with blanks between the numbers.
    cloud
        Its points come first (in PLY and E57 as double where float would change one of them; in PCD, of which
        most readers take floats only, once more as doubles, and where float is too coarse about an origin; in
        LAS and LAZ rounded to steps of 1e-3 to 1e-9, the finest that fit their extent; in text with as few
        digits as give back the same number in its type), then its fields. In E57 its viewpoint, or its
        viewpoints, become the poses of its scans; CSV has no place for it. LAS, LAZ, PCD, NPZ and Parquet
        keep its coordinate system. Or what else `PointCloud.of` takes.
    columns
        (n,) or (n, k) numbers by name. ``normals`` (n, 3) are written as nx, ny, nz and ``colors`` (n, 3 or
        4) as red, green, blue (and alpha); PCD packs colours of uint8 into ``rgb`` or ``rgba``. Any other
        (n, k) column stays one in PCD, NPZ and Parquet, and becomes NAME_0, NAME_1, ... in the others. A
        field of the cloud with the same name is kept as ``input_NAME``.
    chunks
        One more column, (n, width), given block by block so that it need not fit in memory.
    notes
        Words about the whole file (PLY and PCD comments, a record of LAS; as JSON in Parquet's metadata, the
        array ``notes`` of NPZ, the description of an E57 scan, comments ``// surfsig`` of text but CSV).
    progress
        Called with the points written so far and their number.

    Raises
    ------
    OSError
        If the file cannot be written.
    InvalidInputError
        If a column has the wrong length or type, the extension is none that can be written, or LAS cannot
        hold so wide a cloud or so many columns.

    Warns
    -----
    UserWarning
        If points that are not finite are left out (LAS and LAZ), coordinates are written about an origin
        (PCD), the coordinate system stays GeoTIFF keys (LAS and LAZ), the viewpoints of several scans cannot
        be written, because their points are mixed (E57), or the name is that of a COPC file: COPC is read,
        and not written.
    """
    path = Path(path)
    cloud = PointCloud.of(cloud)
    kind, writer = formats.of_output(path)
    block_column = None if chunks is None else Chunks(*chunks)  # type: ignore[arg-type]
    taken = set(kind.reserved)
    if block_column is not None:
        if block_column.width < 1 or np.dtype(block_column.dtype).kind not in "fiub":
            raise InvalidInputError(
                f"column '{block_column.name}' must hold at least one real number per point"
            )
        taken.add(block_column.name)
    told = dict(notes or {})
    if path.name.lower().endswith(".copc.laz"):
        warnings.warn(
            f"{path}: is written as LAZ, without the octree that its name promises: COPC is only read",
            stacklevel=2,
        )
    with replacing(path) as file:
        writer(
            file,
            cloud,
            output_columns(cloud, columns, taken),
            block_column,
            told,
            Progress(progress, len(cloud)),
        )
