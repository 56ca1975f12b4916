"""The records that describe the extra bytes of LAS points, all of them and as far as the points have them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from laspy import ExtraBytesParams, PointFormat
from laspy.point.dims import DimensionInfo, DimensionKind
from laspy.vlrs.known import ExtraBytesStruct

from surfsig.errors import FileFormatError
from surfsig.files.columns import unique_name

_STRUCT_BYTES = 192
# Types that LAS names: 1 to 10 are single numbers, 11 to 30 pairs and triples of them.
_LAST_TYPE = 30
_RAW = "ExtraBytes"
"""How laspy calls extra bytes that no record describes."""


def describe_extra_bytes(point_format: PointFormat, records: Sequence[bytes], source: str) -> None:
    """Add the dimensions that records describe to a point format that laspy read without them.

    Several records are one description, in their order. Bytes that none describes stay one dimension,
    `ExtraBytes`.

    Parameters
    ----------
    point_format
        Of which the last dimension is `ExtraBytes` where points have extra bytes.
    records
        The data of the records.
    source
        The file's name, for warnings.

    Raises
    ------
    FileFormatError
        If a dimension has no bytes.

    Warns
    -----
    UserWarning
        If a description is broken, or describes more bytes than there are, or fewer.
    """
    room = point_format.num_extra_bytes
    if not records:
        return
    if room:
        point_format.dimensions.pop()
    taken = {*(point_format.dtype().names or ()), *point_format.dimension_names}
    left_out: list[str] = []
    lost = False
    for described in _structs(records, source):
        name = described.name.decode("utf-8", errors="replace") or "unnamed"
        length = _bytes_of(described)
        # Behind one of unknown length, or that ends outside the points, nobody knows where the next is.
        lost = lost or length is None or length > room
        if length == 0:
            raise FileFormatError(
                f"{source}: cut off or broken: its records describe a dimension '{name}' of 0 bytes"
            )
        if lost or length is None:
            left_out.append(name)
            continue
        room -= length
        unique = unique_name(name, taken)
        if unique != name:
            warnings.warn(
                f"{source}: two dimensions are called '{name}'; the second is the field '{unique}'",
                stacklevel=4,
            )
        taken.add(unique)
        point_format.add_extra_dimension(_parameters(described, unique, source))
    if left_out:
        warnings.warn(
            f"{source}: its records describe extra bytes that its points do not have, or of an unknown type: "
            f"{', '.join(left_out)}; they are left out",
            stacklevel=4,
        )
    if room:
        warnings.warn(
            f"{source}: {room} extra bytes of each point are not described; they are the field '{_RAW}'",
            stacklevel=4,
        )
        point_format.dimensions.append(
            DimensionInfo(
                name=unique_name(_RAW, taken),
                kind=DimensionKind.UnsignedInteger,
                num_bits=8 * room,
                num_elements=room,
                is_standard=False,
            )
        )


def _structs(records: Sequence[bytes], source: str) -> list[ExtraBytesStruct]:
    found = []
    for data in records:
        if len(data) % _STRUCT_BYTES:
            warnings.warn(
                f"{source}: a record of extra bytes has {len(data)} bytes, which is no multiple of "
                f"{_STRUCT_BYTES}; its last description is left out",
                stacklevel=5,
            )
        for start in range(0, len(data) - _STRUCT_BYTES + 1, _STRUCT_BYTES):
            found.append(ExtraBytesStruct.from_buffer_copy(data[start : start + _STRUCT_BYTES]))
    return found


def _bytes_of(described: ExtraBytesStruct) -> int | None:
    """Give the length of a dimension; None if it has a type that LAS does not know."""
    if described.data_type == 0:
        # Of raw bytes, the options are their number.
        return int(described.options)
    return int(described.dtype().itemsize) if described.data_type <= _LAST_TYPE else None


def _parameters(described: ExtraBytesStruct, name: str, source: str) -> ExtraBytesParams:
    scales = offsets = None
    # Of raw bytes, the options are no options.
    if described.data_type:
        scales, offsets = described.scale, described.offset
    if scales is not None and not np.all(scales):
        warnings.warn(
            f"{source}: the scale of its dimension '{name}' is 0; the field holds the stored numbers",
            stacklevel=5,
        )
        scales = offsets = None
    if scales is not None or offsets is not None:
        count = described.num_elements()
        scales = np.ones(count) if scales is None else np.array(scales)
        offsets = np.zeros(count) if offsets is None else np.array(offsets)
    return ExtraBytesParams(name, described.dtype(), scales=scales, offsets=offsets)
