"""Clouds of rows of several files, with the fields, types and origin that `surfsig.read` gives of all files.

What the fields of each file become is seen in its sample, which is finished and joined as whole files
are. Where that is no more than another type, rows are put into their places at once; else they are
finished, too.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.files.joined import FILE, SCAN, joined
from surfsig.point_cloud import PointCloud
from surfsig.tiles.rows import FileHead, Layout


class Frame:
    """The frame of some files.

    Parameters
    ----------
    heads, layouts
        What is known of each file, and the type of its rows.
    """

    def __init__(self, heads: Sequence[FileHead], layouts: Sequence[Layout]) -> None:
        self._heads, self._layouts = heads, layouts
        nothing = [np.empty(0, layout.dtype) for layout in layouts]
        self._whole = self._joined(nothing)
        # For each field of the whole, its place among each file's fields; None where a type is not all.
        self._places = self._found_places(nothing)

    def cloud(self, parts: Sequence[NDArray[Any]]) -> PointCloud:
        """Make one cloud of the rows of all files."""
        if self._places is None:
            cloud = self._joined(parts)
            lengths = [(len(part), len(head.sample)) for part, head in zip(parts, self._heads, strict=True)]
            kept = [np.arange(rows + sample) < rows for rows, sample in lengths]
            return cloud.at(np.concatenate(kept))
        whole = self._whole
        ends = np.cumsum([0, *map(len, parts)])
        offsets = np.empty((ends[-1], 3), whole.offsets.dtype)
        fields = {
            name: np.empty((ends[-1], *values.shape[1:]), values.dtype)
            for name, values in whole.fields.items()
        }
        for file, part in enumerate(parts):
            if not len(part):
                continue
            rows = slice(int(ends[file]), int(ends[file + 1]))
            origin = self._heads[file].sample.origin
            moved = origin.any() and not np.array_equal(origin, whole.origin)
            offsets[rows] = origin + part["offsets"] if moved else part["offsets"]
            for name, places in self._places.items():
                fields[name][rows] = file if places is None else part[f"{places[file]}"]
        return PointCloud(
            offsets, whole.origin, whole.viewpoint, fields, None, whole.viewpoints, whole.coordinate_system
        )

    def _joined(self, parts: Sequence[NDArray[Any]]) -> PointCloud:
        """Join the rows of each file with its sample behind them."""
        files = zip(self._heads, self._layouts, parts, strict=True)
        with warnings.catch_warnings():
            # They were given when the files were looked at.
            warnings.simplefilter("ignore")
            return joined([head.cloud(layout, part) for head, layout, part in files], "")

    def _found_places(self, nothing: Sequence[NDArray[Any]]) -> dict[str, list[int] | None] | None:
        several = len(self._heads) > 1
        if several and self._whole.viewpoints is not None:
            return None
        names = [self._names(head, layout, rows) for head, layout, rows in zip(
            self._heads, self._layouts, nothing, strict=True
        )]  # fmt: skip
        ends = np.cumsum([0, *(len(head.sample) for head in self._heads)])
        found: dict[str, list[int] | None] = {}
        for name, values in self._whole.fields.items():
            if several and name == FILE:
                found[name] = None
                continue
            own = name.removeprefix("input_") if name in (f"input_{FILE}", f"input_{SCAN}") else name
            places = []
            for file, head in enumerate(self._heads):
                place = names[file].get(own)
                expected = values[ends[file] : ends[file + 1]]
                if place is None:
                    # A file without points may lack it.
                    if len(expected):
                        return None
                    place = -1
                elif not _is_cast(head.sample.fields[self._layouts[file].fields[place][0]], expected):
                    return None
                places.append(place)
            found[name] = places
        return found

    @staticmethod
    def _names(head: FileHead, layout: Layout, rows: NDArray[Any]) -> dict[str, int]:
        """Give the place in a row of each field of a finished file."""
        raw = [name for name, _, _ in layout.fields]
        finish, sample = head.finish, head.sample
        kept = [
            place
            for place, name in enumerate(raw)
            if not (name in finish.defaults and (sample.fields[name] == finish.defaults[name]).all())
        ]
        # Finishing may rename fields, and keeps their order.
        return dict(zip(head.cloud(layout, rows).fields, kept, strict=True))


def _is_cast(values: NDArray[Any], expected: NDArray[Any]) -> bool:
    """Tell whether values become what is expected by their type alone."""
    with np.errstate(invalid="ignore"):
        cast = values.astype(expected.dtype)
    return np.array_equal(cast, expected, equal_nan=expected.dtype.kind == "f")
