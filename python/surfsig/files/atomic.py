"""Writing a file whole or not at all: the old one stays until the new one is complete on the disk."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from surfsig.errors import InvalidInputError


def check_target(path: Path) -> None:
    """Make sure, before a long computation, that a file can be written at `path`.

    Raises
    ------
    OSError
        If the folder is missing or cannot be written to, or the file exists and is read-only.
    InvalidInputError
        If the path is a folder or a device.
    """
    descriptor, temporary = _create_beside(_resolve(path), path)
    os.close(descriptor)
    temporary.unlink()


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file beside `path` that takes its place at the end of the block.

    If the block fails (a full disk, Ctrl-C), the temporary file is removed and the old file is untouched.

    Yields
    ------
    BinaryIO
        A buffered, seekable file open for writing, and for reading what was written.

    Raises
    ------
    OSError
        With the name of the output, whatever call it came from.
    InvalidInputError
        If the path is a folder or a device.
    """
    target = _resolve(path)
    descriptor, temporary = _create_beside(target, path)
    try:
        with os.fdopen(descriptor, "w+b") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            temporary.chmod(stat.S_IMODE(target.stat().st_mode))
        temporary.replace(target)
        _sync_folder(target.parent)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise _named(error, path) from error
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _resolve(path: Path) -> Path:
    """Follow links, so that a link stays one and the file that it names is replaced."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise InvalidInputError(f"{path}: is a folder, not a file that can be written")
    if target.exists() and not target.is_file():
        raise InvalidInputError(f"{path}: is a device or a pipe; write to a file")
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(13, "the file is read-only", str(path))
    return target


def _create_beside(target: Path, path: Path) -> tuple[int, Path]:
    # Made by os.open and not by tempfile: the file then has the permissions that the umask gives.
    temporary = target.parent / f".{target.name[:100]}.{os.urandom(6).hex()}.tmp"
    flags = os.O_CREAT | os.O_EXCL | os.O_RDWR | getattr(os, "O_BINARY", 0)
    try:
        return os.open(temporary, flags, 0o666), temporary
    except OSError as error:
        raise _named(error, path) from error


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let what goes wrong in the block name a file: a write to a full disk does not."""
    try:
        yield
    except OSError as error:
        raise _named(error, path) from error


def _named(error: OSError, path: Path) -> OSError:
    return type(error)(error.errno, error.strerror or str(error), str(path)) if error.errno else error


def _sync_folder(folder: Path) -> None:
    """Make the new name last through a power cut; where the system cannot, the file itself still does."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
