"""Reading one file: by its format's reader, which its content chooses; then cut, and brought to metres."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import formats
from surfsig.files.options import box_array, check_unit, column_names, cropped, in_metres, metres_per
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress, ProgressCallback
from surfsig.visibility import without_false_viewpoint


@dataclass(frozen=True)
class ReadOptions:
    """What a caller of `surfsig.read` may ask for; the names are its keywords."""

    box: ArrayLike | None = None
    unit: str | None = None
    columns: str | Sequence[str] | None = None
    scan: int | None = None
    samples: int | None = None
    intrinsics: ArrayLike | None = None
    depth_scale: float | None = None

    def of_formats(self) -> dict[str, Any]:
        """Give those that only some formats' readers take, checked, without those that nobody asked for."""
        options = {
            "columns": None if self.columns is None else column_names(self.columns),
            "scan": self.scan,
            "samples": self.samples,
            "intrinsics": self.intrinsics,
            "depth_scale": self.depth_scale,
        }
        return {name: value for name, value in options.items() if value is not None}


def read_file(
    path: Path,
    options: ReadOptions,
    progress: ProgressCallback | None = None,
    *,
    keep_default_viewpoint: bool = False,
) -> PointCloud:
    """Read a point cloud from one file; see `surfsig.read`.

    Parameters
    ----------
    path
        The file.
    options
        What is asked for.
    progress
        Called with the bytes read so far and the size of the file.
    keep_default_viewpoint
        Whether a viewpoint at (0, 0, 0) is believed: a moving sensor is the origin of its scans.
    """
    corners = None if options.box is None else box_array(options.box)
    metres = None if options.unit is None else metres_per(options.unit)
    given = options.of_formats()
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        kind, reader = formats.of_content(path, file.read(formats.HEAD_BYTES), size)
        for name in given:
            if name not in kind.takes:
                raise InvalidInputError(f"{path}: holds {kind.name} data, for which '{name}' means nothing")
        if corners is not None and "box" in kind.takes:
            given["box"] = corners
        if options.unit is not None and "unit" in kind.takes:
            given["unit"] = options.unit
        file.seek(0)
        try:
            cloud = reader(file, str(path), Progress(progress, size), **given)
        except MemoryError as error:
            raise FileFormatError(f"{path}: {error or 'too large for the memory'}") from error
        except InvalidInputError as error:
            # With options the caller may be wrong, without any only the file can be.
            if given:
                raise
            raise FileFormatError(f"{path}: {error}") from error
    if kind.has_default_viewpoint and not keep_default_viewpoint:
        cloud = without_false_viewpoint(cloud, str(path))
    check_unit(cloud.coordinate_system, options.unit, str(path))
    if corners is not None:
        cloud = cropped(cloud, corners)
    return cloud if metres is None else in_metres(cloud, metres)
