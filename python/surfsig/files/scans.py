"""Several scans in one file: one of them, or all joined."""

from __future__ import annotations

import operator
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.files.colours import CHANNELS
from surfsig.files.joined import common_viewpoints
from surfsig.point_cloud import PointCloud


def scan_number(scan: object, count: int, source: str) -> int:
    """Check the number of a scan among `count`, from 0.

    Raises
    ------
    InvalidInputError
        If there is no such scan.
    """
    try:
        number = operator.index(scan)  # type: ignore[arg-type]
    except TypeError:
        raise InvalidInputError(f"{source}: scan must be a whole number") from None
    if not 0 <= number < count:
        raise InvalidInputError(
            f"{source}: there is no scan {number}: the file holds {count}, numbered from 0"
        )
    return number


def joined_scans(clouds: Sequence[PointCloud], source: str) -> PointCloud:
    """Join scans into one cloud whose field ``scan`` gives each point's, from 0; a single one stays as it is.

    A field that one of them lacks is NaN there, or 0 if it holds whole numbers.

    Warns
    -----
    UserWarning
        If the colours of some have 8 bits and those of others 16.
    """
    if len(clouds) == 1:
        return clouds[0]
    fields: dict[str, NDArray[Any]] = {
        "scan": np.repeat(
            np.arange(len(clouds), dtype=np.min_scalar_type(len(clouds) - 1)),
            [len(cloud) for cloud in clouds],
        )
    }
    names = dict.fromkeys(name for cloud in clouds for name in cloud.fields)
    if {np.dtype(np.uint8), np.dtype(np.uint16)} <= {
        cloud.fields[CHANNELS[0]].dtype for cloud in clouds if CHANNELS[0] in cloud.fields
    }:
        warnings.warn(
            f"{source}: the colours of some scans are 0 to 255, those of others go beyond: they are kept as "
            "they are, and may be on different scales",
            stacklevel=3,
        )
    for name in names:
        kind = np.result_type(*(cloud.fields[name].dtype for cloud in clouds if name in cloud.fields))
        missing = np.nan if kind.kind == "f" else 0
        parts = [cloud.fields.get(name, np.full(len(cloud), missing, kind)) for cloud in clouds]
        fields["input_scan" if name == "scan" else name] = np.concatenate(parts, dtype=kind)
    viewpoint, viewpoints = common_viewpoints(
        [None if cloud.viewpoint is None else cloud.viewpoint[None] for cloud in clouds]
    )
    offsets = np.concatenate([cloud.offsets for cloud in clouds])
    return PointCloud(offsets, viewpoint=viewpoint, viewpoints=viewpoints, fields=fields)
