"""One run at a time in a folder: a lock that the system takes back when its process ends, however it ends."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from surfsig.errors import InvalidInputError

LOCK = ".lock"


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder.

    Raises
    ------
    InvalidInputError
        If another run holds it.
    OSError
        If the folder cannot be written to.
    """
    path = folder / LOCK
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        if not _lock(descriptor):
            process = os.pread(descriptor, 40, 0).decode(errors="replace").strip() if _CAN_PREAD else ""
            who = f" (process {process})" if process else ""
            raise InvalidInputError(f"{folder}: another run{who} is writing into this folder")
        os.ftruncate(descriptor, 0)
        os.write(descriptor, str(os.getpid()).encode())
        yield
    finally:
        os.close(descriptor)


_CAN_PREAD = hasattr(os, "pread")


def _lock(descriptor: int) -> bool:
    """Take the lock; False if another process has it."""
    try:
        _take(descriptor)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        # Some network file systems have no locks: two runs then write the same parts, each whole.
        return True
    return True


def _take(descriptor: int) -> None:
    module: Any
    if os.name == "nt":
        import msvcrt as module

        module.locking(descriptor, module.LK_NBLCK, 1)
    else:
        import fcntl as module

        module.flock(descriptor, module.LOCK_EX | module.LOCK_NB)
