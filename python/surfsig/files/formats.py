"""The formats: how a file is recognised, who reads and who writes it. A new format is one entry here."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Protocol

from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import e57, e57_writer, kitti, numpy_files, obj, parquet, pcd, pcd_write, ply, stl, text
from surfsig.files.columns import Chunks
from surfsig.files.opening import Opening, Recogniser, begins, matches
from surfsig.files.progress import Progress
from surfsig.point_cloud import PointCloud

# Reads from an open file with a name (for messages); the options that the format takes come by keyword.
Reader = Callable[..., PointCloud]


class Writer(Protocol):
    """Writes a cloud with its columns to an open file."""

    def __call__(
        self,
        file: BinaryIO,
        cloud: PointCloud,
        columns: Mapping[str, NDArray[Any]],
        chunks: Chunks | None,
        notes: Mapping[str, str],
        progress: Progress,
        /,
    ) -> None:
        """Write everything; an exception leaves the file to the caller."""


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes
    ----------
    name
        As a person calls it.
    extensions
        In lower case, with the dot.
    recognise
        Tells from what can be seen of a file at once whether it has this format.
    read
        Reads from an open file; None if the format is only recognised, to be named in a message. A name
        (MODULE:FUNCTION) where the library behind it takes a while to import.
    write
        Writes to an open file; None if the format is not written.
    check
        Raises where the format cannot be used here (a library is missing).
    reserved
        Names that a column cannot have.
    takes
        The options of `surfsig.read` that mean something to this format's reader.
    needs
        Those of them without which nothing can be read.
    """

    name: str
    extensions: tuple[str, ...]
    recognise: Recogniser
    read: Reader | str | None = None
    write: Writer | str | None = None
    check: Callable[[], None] = lambda: None
    reserved: tuple[str, ...] = ("x", "y", "z")
    takes: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()


def _function(of: Callable[..., Any] | str) -> Any:
    """Give a function, imported now where it is named: MODULE:FUNCTION of this package."""
    if not isinstance(of, str):
        return of
    module, _, name = of.partition(":")
    return getattr(importlib.import_module(f"surfsig.files.{module}"), name)


# Bit 7 of the point format's number says that the points are compressed.
_LAZ = re.compile(rb"LASF.{100}[\x80-\xff]", re.DOTALL)

_HTML = re.compile(rb"\s*<(!doctype|html|\?xml)", re.IGNORECASE)

# The order matters: what the content tells comes before what size and extension tell, and text comes last,
# because every PCD header, every OBJ file and every HTML page is text as well.
FORMATS = (
    Format("PLY", (".ply",), matches(ply.MAGIC), ply.read, ply.write),
    Format("PCD", (".pcd",), matches(pcd.MAGIC), pcd.read, pcd_write.write, reserved=pcd_write.RESERVED),
    Format("NPY", (".npy",), begins(numpy_files.NPY_MAGIC), numpy_files.read_npy),
    Format(
        "NPZ",
        (".npz",),
        begins(numpy_files.ZIP_MAGIC),
        numpy_files.read_npz,
        numpy_files.write_npz,
        reserved=(*numpy_files.RESERVED, "x", "y", "z"),
    ),
    Format(
        "Parquet", (".parquet",), begins(parquet.MAGIC), parquet.read, parquet.write, parquet.check_available
    ),
    Format("LAZ", (".laz",), matches(_LAZ), "las:read", "las_write:write_laz", takes=("box",)),
    Format("LAS", (".las",), begins(b"LASF"), "las:read", "las_write:write_las", takes=("box",)),
    Format("E57", (".e57",), begins(e57.MAGIC), e57.read, e57_writer.write, takes=("scan",)),
    Format(
        "PNG image",
        (".png",),
        begins(b"\x89PNG"),
        "depth_image:read",
        takes=("intrinsics", "depth_scale"),
        needs=("intrinsics",),
    ),
    Format("JPEG image", (".jpg", ".jpeg"), begins(b"\xff\xd8\xff")),
    Format("PDF", (".pdf",), begins(b"%PDF")),
    Format("gzip archive", (".gz",), begins(b"\x1f\x8b")),
    Format("binary glTF", (".glb",), begins(b"glTF")),
    Format("HDF5", (".h5", ".hdf5"), begins(b"\x89HDF")),
    Format("web page or XML", (".html", ".htm", ".xml"), matches(_HTML)),
    Format("STL", (".stl",), stl.recognise, stl.read, takes=("samples",)),
    Format("OBJ", (".obj",), obj.recognise, obj.read, takes=("samples",)),
    Format("KITTI", (".bin",), kitti.recognise, kitti.read),
    Format("text", (".xyz", ".csv", ".txt", ".asc"), lambda opening: opening.is_text, text.read),
)


def of_content(path: Path, file: BinaryIO) -> tuple[Format, Reader]:
    """Recognise an open file by its content, by its extension only where that says nothing.

    Raises
    ------
    FileFormatError
        If it is nothing that can be read; the message says what it is, where that is known.
    """
    opening = Opening.of(path, file)
    if not opening.head:
        raise FileFormatError(f"{path}: the file is empty")
    by_name = next((kind for kind in FORMATS if opening.extension in kind.extensions), None)
    readable = ", ".join(kind.name for kind in FORMATS if kind.read is not None)
    for kind in FORMATS:
        if kind.recognise(opening):
            if kind.read is None:
                raise FileFormatError(
                    f"{path}: holds {kind.name} data, which cannot be read (only {readable} can)"
                )
            return kind, _function(kind.read)
    if by_name is not None:
        raise FileFormatError(
            f"{path}: is not a {by_name.name} file, nor any other that can be read ({readable})"
        )
    raise FileFormatError(f"{path}: is no point cloud that can be read ({readable})")


def of_output(path: Path) -> tuple[Format, Writer]:
    """Choose the format to write by the extension.

    Raises
    ------
    InvalidInputError
        If nothing is written under this extension, or a library for it is missing.
    """
    for kind in FORMATS:
        if kind.write is not None and path.suffix.lower() in kind.extensions:
            kind.check()
            return kind, _function(kind.write)
    known = ", ".join(
        extension for kind in FORMATS if kind.write is not None for extension in kind.extensions
    )
    raise InvalidInputError(f"{path}: the extension must be one of {known}")
