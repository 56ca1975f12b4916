"""What a point's values are called in E57 files, and what here."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

EXTENSIONS = (
    ("surfsig", "https://github.com/surfsig/surfsig"),
    ("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt"),
)
"""Prefix and address of the sets of names that are used beside the standard's own."""

_FIELDS = {
    "intensity": "intensity",
    "isIntensityInvalid": "intensity_invalid",
    "colorRed": "red",
    "colorGreen": "green",
    "colorBlue": "blue",
    "isColorInvalid": "color_invalid",
    "rowIndex": "row_index",
    "columnIndex": "column_index",
    "returnIndex": "return_index",
    "returnCount": "return_count",
    "timeStamp": "time_stamp",
    "isTimeStampInvalid": "time_stamp_invalid",
    "cartesianX": "cartesian_x",
    "cartesianY": "cartesian_y",
    "cartesianZ": "cartesian_z",
    "cartesianInvalidState": "cartesian_invalid",
    "sphericalRange": "spherical_range",
    "sphericalAzimuth": "spherical_azimuth",
    "sphericalElevation": "spherical_elevation",
    "sphericalInvalidState": "spherical_invalid",
    "nor:normalX": "nx",
    "nor:normalY": "ny",
    "nor:normalZ": "nz",
}
# A point has all of a group or none; a flag says of another value whether it means something.
_GROUPS = (("red", "green", "blue"), ("return_index", "return_count"), ("nx", "ny", "nz"))
_WHOLE = ("row_index", "column_index", "return_index", "return_count")
_FLAGS = {"intensity_invalid": "intensity", "color_invalid": "red", "time_stamp_invalid": "time_stamp"}
_WRITTEN = {field: name for name, field in _FIELDS.items() if not name.startswith(("cartesian", "spherical"))}


def field_names(names: Iterable[str]) -> dict[str, str]:
    """Name the fields of a file's values; an extension's keep their prefix where they would clash."""
    given: dict[str, str] = {}
    taken = {*_FIELDS.values(), "x", "y", "z"}
    for name in names:
        field = _FIELDS.get(name)
        if field is None:
            field = name.partition(":")[2] or name
            if field in taken:
                field = name.replace(":", "_")
            while field in taken:
                field += "_"
        given[name] = field
        taken.add(field)
    return given


def record_names(columns: Mapping[str, NDArray[Any]]) -> dict[str, str]:
    """Name the columns of numbers in the file: the standard's names where it allows them, else our own."""
    standard = {field for field in columns if field in _WRITTEN}
    standard -= {field for field in _WHOLE if field in columns and columns[field].dtype.kind not in "iub"}
    for group in _GROUPS:
        if not standard.issuperset(group):
            standard.difference_update(group)
    for field, about in _FLAGS.items():
        if field in standard and (about not in standard or not _is_flag(columns[field])):
            standard.discard(field)
    # Some readers, ours among them, look at a name without its prefix.
    taken = {name.partition(":")[2] or name for name in _FIELDS}
    given = {}
    for field in columns:
        if field in standard:
            given[field] = _WRITTEN[field]
            continue
        word = re.sub(r"[^A-Za-z0-9_-]", "_", field)
        if not re.match(r"(?!xml)[a-z_]", word, re.IGNORECASE):
            word = "_" + word
        unique, number = word, 2
        while unique in taken:
            unique, number = f"{word}_{number}", number + 1
        taken.add(unique)
        given[field] = f"surfsig:{unique}"
    return given


def _is_flag(values: NDArray[Any]) -> bool:
    return values.dtype.kind in "iub" and bool(np.isin(values, (0, 1)).all())
