"""The formats: how a file is recognised, who reads and who writes it. A new format is one entry here."""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, Protocol

from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import (
    depth_image,
    e57,
    e57_writer,
    float32_rows,
    gltf,
    numpy_files,
    obj,
    off,
    parquet,
    pcd,
    pcd_header,
    pcd_write,
    ply,
    ply_header,
    ptx,
    stl,
    text,
    text_write,
)
from surfsig.files.columns import Chunks
from surfsig.files.encodings import WIDE_MARKS, decoded_head
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

HEAD_BYTES = 4096
# What hardly occurs in a text: control characters that are no white space.
_CONTROLS = bytes(byte for byte in range(32) if not 9 <= byte <= 13)


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


class Look(NamedTuple):
    """What a file is recognised by.

    Attributes
    ----------
    head
        Its first bytes.
    extension
        In lower case, with the dot: for formats without a mark of their own.
    size
        Its bytes.
    """

    head: bytes
    extension: str
    size: int

    @property
    def text(self) -> bytes:
        """The head of a text, without a byte order mark and in UTF-8."""
        return decoded_head(self.head)


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
        Tells from the first bytes, or else extension and size, whether a file has this format.
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
        The options of `surfsig.read` that mean something to this format's reader; any takes a box and a unit,
        which are named here where it must know of them.
    """

    name: str
    extensions: tuple[str, ...]
    recognise: Callable[[Look], bool]
    read: Reader | str | None = None
    write: Writer | str | None = None
    check: Callable[[], None] = lambda: None
    reserved: tuple[str, ...] = ("x", "y", "z")
    takes: tuple[str, ...] = ()
    has_default_viewpoint: bool = False


def _begins(*marks: bytes) -> Callable[[Look], bool]:
    return lambda look: look.head.startswith(marks)


def _matches(pattern: re.Pattern[bytes]) -> Callable[[Look], bool]:
    return lambda look: pattern.match(look.head) is not None


def _is_text(look: Look) -> bool:
    # UTF-16 and UTF-32 begin with a mark; any other text has no zero and hardly a control character.
    if look.head.startswith(WIDE_MARKS):
        return True
    controls = len(look.head) - len(look.head.translate(None, _CONTROLS))
    return 0 not in look.head and controls * 50 <= len(look.head)


def _is_binary_stl(look: Look) -> bool:
    # One that is cut off is known by its name only.
    cut_off = look.extension == ".stl" and not _is_text(look)
    return cut_off or stl.is_whole_binary(look.head, look.size)


def _is_obj(look: Look) -> bool:
    return _is_text(look) and (look.extension == ".obj" or obj.MAGIC.match(look.text) is not None)


def _is_off(look: Look) -> bool:
    word_left_out = look.extension == ".off" and off.COUNTS_ALONE.match(look.text) is not None
    return word_left_out or off.MAGIC.match(look.text) is not None


def _is_gltf(look: Look) -> bool:
    text = look.text.lstrip()
    return text.startswith(b"{") and (look.extension == ".gltf" or b'"asset"' in text)


def _is_float32_rows(look: Look) -> bool:
    # Nothing but zeros is a file that was never filled.
    return look.extension == ".bin" and not _is_text(look) and any(look.head)


def _is_ptx(look: Look) -> bool:
    return _is_text(look) and ptx.MAGIC.match(look.head) is not None


def _is_pts(look: Look) -> bool:
    return _is_text(look) and _COUNTED.match(look.head) is not None


def _function(of: Callable[..., Any] | str) -> Any:
    """Give a function, imported now where it is named: MODULE:FUNCTION of this package."""
    if not isinstance(of, str):
        return of
    module, _, name = of.partition(":")
    return getattr(importlib.import_module(f"surfsig.files.{module}"), name)


# Bit 7 of the point format's number says that the points are compressed.
_LAZ = re.compile(rb"LASF.{100}[\x80-\xff]", re.DOTALL)

# The number of points stands above them; CloudCompare names the columns first.
_COUNTED = re.compile(rb"(?:\xef\xbb\xbf)?(?:\s*//[^\r\n]*[\r\n])*\s*\d+[ \t]*[\r\n]")

_HTML = re.compile(rb"\s*<(!doctype|html|\?xml)", re.IGNORECASE)

_OF_TEXT = ("columns", "unit")

# The order matters: text comes last, because every PCD header and every HTML page is text as well; before it
# those that have no mark of their own.
FORMATS = (
    Format("PLY", (".ply",), _matches(ply_header.MAGIC), ply.read, ply.write, takes=("samples",)),
    Format(
        "PCD",
        (".pcd",),
        _matches(pcd_header.MAGIC),
        pcd.read,
        pcd_write.write,
        reserved=pcd_write.RESERVED,
        has_default_viewpoint=True,
    ),
    Format("NPY", (".npy",), _begins(numpy_files.NPY_MAGIC), numpy_files.read_npy, takes=("columns",)),
    Format(
        "NPZ",
        (".npz",),
        _begins(numpy_files.ZIP_MAGIC),
        numpy_files.read_npz,
        numpy_files.write_npz,
        reserved=(*numpy_files.RESERVED, "x", "y", "z"),
    ),
    Format(
        "Parquet", (".parquet",), _begins(parquet.MAGIC), parquet.read, parquet.write, parquet.check_available
    ),
    Format("LAZ", (".laz",), _matches(_LAZ), "las:read", "las_write:write_laz", takes=("box",)),
    Format("LAS", (".las",), _begins(b"LASF"), "las:read", "las_write:write_las", takes=("box",)),
    Format(
        "E57",
        (".e57",),
        _begins(e57.MAGIC),
        e57.read,
        e57_writer.write,
        takes=("scan",),
        has_default_viewpoint=True,
    ),
    Format(
        "PNG image",
        (".png",),
        _begins(depth_image.MAGIC),
        depth_image.read,
        takes=("intrinsics", "depth_scale"),
    ),
    Format("JPEG image", (".jpg", ".jpeg"), _begins(b"\xff\xd8\xff")),
    Format("PDF", (".pdf",), _begins(b"%PDF")),
    Format("gzip archive", (".gz",), _begins(b"\x1f\x8b")),
    Format("GLB", (".glb",), _begins(gltf.GLB_MAGIC), gltf.read, takes=("samples",)),
    Format("HDF5", (".h5", ".hdf5"), _begins(b"\x89HDF")),
    Format("web page or XML", (".html", ".htm", ".xml"), _matches(_HTML)),
    # A binary file may begin with "solid" too.
    Format("STL", (".stl",), _is_binary_stl, stl.read_binary, takes=("samples",)),
    Format("ASCII STL", (".stl",), _matches(stl.ASCII_MAGIC), stl.read_ascii, takes=("samples",)),
    Format("glTF", (".gltf",), _is_gltf, gltf.read, takes=("samples",)),
    Format("OFF", (".off",), _is_off, off.read, takes=("samples",)),
    Format("float32 rows", (".bin",), _is_float32_rows, float32_rows.read, takes=("columns",)),
    Format("OBJ", (".obj",), _is_obj, obj.read, takes=("samples",)),
    Format("PTX", (".ptx",), _is_ptx, ptx.read, takes=("scan",)),
    Format("PTS", (".pts",), _is_pts, text.read, takes=(*_OF_TEXT, "scan")),
    Format("text", (".xyz", ".txt", ".asc"), _is_text, text.read, text_write.write_plain, takes=_OF_TEXT),
    # Read as any other text, and written otherwise.
    Format("CSV", (".csv",), lambda look: False, write=text_write.write_csv),
)


def of_content(path: Path, head: bytes, size: int) -> tuple[Format, Reader]:
    """Recognise a file by its first bytes, whatever its extension says; only where those tell nothing by it.

    Raises
    ------
    FileFormatError
        If it is nothing that can be read; the message says what it is, where that is known.
    """
    if not head:
        raise FileFormatError(f"{path}: the file is empty")
    look = Look(head, path.suffix.lower(), size)
    if head.startswith(WIDE_MARKS):
        for name, magic in (("PLY", ply_header.MAGIC), ("PCD", pcd_header.MAGIC)):
            if magic.match(look.text):
                raise FileFormatError(
                    f"{path}: is a {name} file in UTF-16, as Windows PowerShell writes output to files: save "
                    "it as ASCII or UTF-8"
                )
    by_name = next((kind for kind in FORMATS if look.extension in kind.extensions), None)
    readable = ", ".join(kind.name for kind in FORMATS if kind.read is not None)
    for kind in FORMATS:
        if kind.recognise(look):
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


def of_file(path: Path) -> Format:
    """Recognise a file, as `of_content` does."""
    with path.open("rb") as file:
        kind, _ = of_content(path, file.read(HEAD_BYTES), os.fstat(file.fileno()).st_size)
    return kind


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
