"""Reads mutated files, one after the other, in a process that may be lost, and sends what each came to."""

from __future__ import annotations

import os
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow
from corpus import Seed
from mutations import mutant

import surfsig

if sys.platform == "linux":
    import resource

MEMORY_FACTOR = 10
MEMORY_BASE = 500_000_000
"""A file of n bytes may take MEMORY_FACTOR n + MEMORY_BASE bytes more than the process has before."""

LONGEST_MESSAGE = 500


class Outcome(NamedTuple):
    """What reading a file came to: "read", "refused", or what was found, with a line and the traceback."""

    kind: str
    line: str = ""
    details: str = ""

    @property
    def allowed(self) -> bool:
        """Tell whether nothing is wrong with it."""
        return self.kind in ("read", "refused")


@contextmanager
def limited_memory(size: int) -> Iterator[None]:
    """Bound the address space, which counts what is asked for, used or not (Linux only)."""
    if sys.platform != "linux":
        yield
        return
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + MEMORY_FACTOR * size + MEMORY_BASE
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def outcome(path: Path, options: dict[str, Any]) -> Outcome:
    """Read a file and judge what comes of it; a crash of the process is left to the one who started it."""
    try:
        with limited_memory(path.stat().st_size):
            cloud = surfsig.read(path, **options)
    except MemoryError as error:
        return found("memory", error)
    except (surfsig.SurfsigError, OSError) as error:
        text = str(error)
        # `surfsig.read` makes one line of a lack of memory as well; no small file may lead to it.
        if isinstance(error.__cause__, MemoryError):
            return found("memory", error)
        if len(text.splitlines()) != 1 or not text.isprintable():
            return found("message of several lines", error)
        if len(text) > LONGEST_MESSAGE:
            return found("long message", error)
        if isinstance(error, surfsig.FileFormatError) and not text.startswith(f"{path}: "):
            return found("message without the path", error)
        return Outcome("refused")
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:
        # A panic in Rust arrives as a class of its own that is no `Exception`.
        return found("exception", error)
    if not isinstance(cloud, surfsig.PointCloud):
        return Outcome("no cloud", type(cloud).__name__)
    return Outcome("read")


def found(kind: str, error: BaseException) -> Outcome:
    """Return an error as a finding."""
    line = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    return Outcome(kind, line, "".join(traceback.format_exception(error)))


def work(pipe: Connection, corpus: list[Seed], seed: int, indices: range) -> None:
    """Read the files of these numbers and send what each came to; None says that the process is ready."""
    pyarrow.set_memory_pool(pyarrow.system_memory_pool())  # the others keep a gigabyte in reserve
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 2)
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        for whole in corpus:  # what a first call loads and reserves belongs to no file
            path = Path(folder) / whole.name
            path.write_bytes(whole.content)
            surfsig.read(path, **whole.options)
        pipe.send(None)
        for index in indices:
            whole, content = mutant(corpus, seed, index)
            path = Path(folder) / f"a{Path(whole.name).suffix}"
            path.write_bytes(content)
            pipe.send(outcome(path, whole.options))
    pipe.close()
