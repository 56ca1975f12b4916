"""Which files are meant: one, those of a folder, or those that a pattern matches, in their natural order."""

from __future__ import annotations

import errno
import glob
import os
import re
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from surfsig.errors import FileFormatError, InvalidInputError

PathLike = str | os.PathLike[str]
Paths = PathLike | Iterable[PathLike]


MANIFEST = "manifest.json"
"""What says of a folder of tiles how it was made."""

_PART = re.compile(r"tile_\d{6,}\.\w+")


def natural(path: Path) -> list[tuple[int, int, str]]:
    """Compare runs of digits as numbers; the name itself decides between 1 and 01."""
    words = re.split(r"(\d+)", str(path))
    return [(0, int(word), word) if word.isdecimal() else (1, 0, word) for word in words]


def files_of_folder(folder: Path) -> list[Path]:
    """Give the clouds of a folder: the files of the commonest kind, as poses and times may lie beside them.

    Of a folder of tiles, which has a manifest, those are the parts.

    Raises
    ------
    FileFormatError
        If it holds no files.

    Warns
    -----
    UserWarning
        If files are left out.
    """
    inside = [file for file in folder.iterdir() if file.is_file() and file.name[0] != "."]
    if not inside:
        raise FileFormatError(f"{folder}: holds no files")
    if (folder / MANIFEST).is_file():
        parts = [file for file in inside if _PART.fullmatch(file.name)]
        if parts:
            return sorted(parts, key=natural)
    kinds = Counter(file.suffix.lower() for file in inside)
    kind = max(sorted(kinds), key=lambda suffix: kinds[suffix])
    others = len(inside) - kinds[kind]
    if others:
        name = f"'{kind}'" if kind else "without a suffix"
        warnings.warn(f"{folder}: {others} files that are not {name} are left out", stacklevel=3)
    return sorted((file for file in inside if file.suffix.lower() == kind), key=natural)


def matches(path: Path) -> list[Path] | None:
    """Give what a pattern such as ``scan/*.laz`` matches; None where a path is no pattern, or exists itself.

    Hidden files are left out, and folders where files match as well; ``**`` stands for folders at any depth.

    Raises
    ------
    FileNotFoundError
        If nothing matches.
    """
    text = str(path)
    if not glob.has_magic(text) or os.path.lexists(path):
        return None
    found = [Path(name) for name in glob.glob(text, recursive=True)]
    found = [file for file in found if not file.is_dir()] or found
    if not found:
        raise FileNotFoundError(errno.ENOENT, "no file matches", text)
    return sorted(found, key=natural)


def files_meant(paths: Paths) -> list[Path] | None:
    """Give the files of which one cloud is to be made; None if the path is that of one file.

    Several paths keep their order; the files of each folder and pattern come in that of their names.

    Raises
    ------
    OSError
        If nothing matches a pattern, or a path is empty.
    FileFormatError
        If a folder holds no files.
    InvalidInputError
        If there is no path at all.
    """
    if isinstance(paths, (str, os.PathLike)):
        return _expanded(_path(paths))
    files = [file for path in map(_path, paths) for file in _expanded(path) or [path]]
    if not files:
        raise InvalidInputError("there are no files")
    return files


def _path(path: PathLike) -> Path:
    if not os.fspath(path):
        # `Path` would take the current folder for it.
        raise InvalidInputError("the path is empty")
    return Path(path)


def _expanded(path: Path) -> list[Path] | None:
    if path.is_dir():
        return files_of_folder(path)
    found = matches(path)
    if found is None:
        return None
    return [file for match in found for file in _expanded(match) or [match]]
