"""One cloud of several: points one after the other, with what all have in common."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.files.colours import ALPHA, CHANNELS
from surfsig.point_cloud import PointCloud

FILE = "file"
"""The field that says of which cloud a point is."""
SCAN = "scan"

# What 255 of 8 bits is in 16: 65535.
_TO_16_BITS = 257


def joined(
    clouds: Sequence[PointCloud], source: str, bytes_in_16_bits: Sequence[bool] | None = None
) -> PointCloud:
    """Make one cloud of one or more; of several, the field ``file`` numbers that of each point, from 0.

    Coordinates are those of the clouds to the last bit: offsets from their common origin, or from 0 where
    they have different ones. Viewpoints are kept if every cloud has its own; the field ``scan`` then numbers
    them. Fields are kept if every cloud with points has them, as one that holds the values of all; colours of
    8 bits become those of 16 where some have 16.

    Parameters
    ----------
    clouds
        In their order.
    source
        What the warning calls them.
    bytes_in_16_bits
        For each, whether its colours were 16 bits in its file, and are uint8 as none is above 255: then they
        are not scaled.

    Raises
    ------
    InvalidInputError
        If they are in different coordinate systems.

    Warns
    -----
    UserWarning
        If fields or viewpoints are left out.
    """
    if len(clouds) == 1:
        return clouds[0]
    systems = {cloud.coordinate_system for cloud in clouds} - {None}
    if len(systems) > 1:
        names = " and ".join(sorted(system.name or "one without a name" for system in systems if system))
        raise InvalidInputError(f"{source}: the files are in different coordinate systems ({names})")
    in_16_bits = bytes_in_16_bits or [False] * len(clouds)
    fields = {
        FILE: np.repeat(np.arange(len(clouds), dtype=_number_type(len(clouds))), list(map(len, clouds)))
    }
    viewpoint, viewpoints = common_viewpoints([_viewpoints(cloud) for cloud in clouds])
    if viewpoints is not None:
        fields[SCAN] = _scans(clouds, len(viewpoints))
    # A cloud without points lacks no values.
    pairs = list(zip(clouds, in_16_bits, strict=True))
    filled = [pair for pair in pairs if len(pair[0])] or pairs
    left_out = []
    for name in dict.fromkeys(name for cloud, _ in filled for name in cloud.fields):
        if name == SCAN and viewpoints is not None and any(cloud.viewpoints is not None for cloud in clouds):
            # Those are in the new numbers.
            continue
        parts = [(cloud.fields.get(name), of_bytes) for cloud, of_bytes in filled]
        values = _joined_field([part for part, _ in parts], name, [of_bytes for _, of_bytes in parts])
        if values is None:
            left_out.append(name)
        else:
            fields[f"input_{name}" if name in (FILE, SCAN) and name in fields else name] = values
    known = [cloud.viewpoint is not None or cloud.viewpoints is not None for cloud in clouds]
    told = [f"the fields {', '.join(left_out)}"] if left_out else []
    if any(known) and not all(known):
        told.append("the viewpoints")
    if told:
        warnings.warn(
            f"{source}: {' and '.join(told)} are left out: not all of the {len(clouds)} files have them, or "
            "not of one kind",
            stacklevel=4,
        )
    origin, offsets = _placed(clouds)
    return PointCloud(
        offsets,
        origin,
        viewpoint,
        fields,
        viewpoints=viewpoints,
        coordinate_system=next(iter(systems), None),
    )


def common_viewpoints(
    places: Sequence[NDArray[np.float64] | None],
) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]:
    """Give the viewpoint and the viewpoints of a cloud that is joined of several.

    Parameters
    ----------
    places
        Of each, (s, 3); None where nobody said.

    Returns
    -------
    viewpoint
        (3,), the only one; None where there are several, or not all are known.
    viewpoints
        (s, 3), all of them where they differ, else None.
    """
    known = [place for place in places if place is not None]
    if len(known) < len(places):
        return None, None
    viewpoints = np.concatenate(known)
    if (viewpoints == viewpoints[0]).all():
        return viewpoints[0], None
    return None, viewpoints


def _viewpoints(cloud: PointCloud) -> NDArray[np.float64] | None:
    if cloud.viewpoints is not None:
        return cloud.viewpoints
    return None if cloud.viewpoint is None else cloud.viewpoint[None]


def _number_type(count: int) -> np.dtype[Any]:
    """Give the type of numbers of so many files or scans: 16 bits, or 32 where these are not enough."""
    return np.result_type(np.uint16, np.min_scalar_type(count))


def _scans(clouds: Sequence[PointCloud], count: int) -> NDArray[Any]:
    """Give each point's scan, numbered through all clouds."""
    parts, first = [], 0
    for cloud in clouds:
        if cloud.viewpoints is None:
            parts.append(np.full(len(cloud), first, _number_type(count)))
            first += 1
        else:
            parts.append(cloud.fields[SCAN].astype(_number_type(count)) + _number_type(count).type(first))
            first += len(cloud.viewpoints)
    return np.concatenate(parts)


def _joined_field(
    parts: Sequence[NDArray[Any] | None], name: str, bytes_in_16_bits: Sequence[bool]
) -> NDArray[Any] | None:
    """Join a field of all clouds; None where one has none, or of another kind."""
    values = [part for part in parts if part is not None]
    if len(values) < len(parts) or len({part.shape[1:] for part in values}) > 1:
        return None
    kinds = {part.dtype for part in values}
    if name in (*CHANNELS, ALPHA) and len(kinds) > 1:
        if kinds != {np.dtype(np.uint8), np.dtype(np.uint16)}:
            return None
        values = [
            part.astype(np.uint16) * np.uint16(1 if part.dtype == np.uint16 or unscaled else _TO_16_BITS)
            for part, unscaled in zip(values, bytes_in_16_bits, strict=True)
        ]
    kind = np.result_type(*(part.dtype for part in values))
    if kind.kind == "f" and all(part.dtype.kind in "iu" for part in values):
        # No whole numbers hold those of int64 and uint64.
        return None
    return np.concatenate(values, dtype=kind)


def _placed(clouds: Sequence[PointCloud]) -> tuple[NDArray[np.float64], NDArray[Any]]:
    """Give origin and offsets of all points."""
    origin = clouds[0].origin
    if all(np.array_equal(cloud.origin, origin) for cloud in clouds):
        return origin, np.concatenate([cloud.offsets for cloud in clouds])
    return np.zeros(3), np.concatenate([cloud.points for cloud in clouds])
