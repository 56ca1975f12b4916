"""Reading several files as one cloud."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from surfsig.files import formats
from surfsig.files.joined import joined
from surfsig.point_cloud import PointCloud
from surfsig.progress import ProgressCallback

# Formats whose colours have 16 bits, into which programs write those of 8.
_BYTES_IN_16_BITS = ("LAS", "LAZ")


def read_several(
    files: Sequence[Path],
    read_one: Callable[[Path, ProgressCallback | None], PointCloud],
    progress: ProgressCallback | None,
) -> PointCloud:
    """Read files, each with `read_one`, and join them.

    Raises
    ------
    OSError, FileFormatError
        Naming the first file that cannot be read.
    """
    sizes = [file.stat().st_size for file in files]
    clouds, kinds, done = [], [], 0
    for file, size in zip(files, sizes, strict=True):
        kinds.append(formats.of_file(file).name)
        clouds.append(read_one(file, _after(progress, done, sum(sizes))))
        done += size
        if progress is not None:
            progress(done, sum(sizes))
    source = f"{files[0]} and {len(files) - 1} more"
    return joined(clouds, source, [kind in _BYTES_IN_16_BITS for kind in kinds])


def _after(progress: ProgressCallback | None, before: int, total: int) -> ProgressCallback | None:
    """Tell how far all files are read, by how far one is."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)
