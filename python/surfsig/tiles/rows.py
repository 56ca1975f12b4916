"""Points as rows of a store: number, file, coordinates and fields, side by side as they lie on the disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.coordinate_system import CoordinateSystem
from surfsig.files.blocks import Finish
from surfsig.point_cloud import PointCloud

_ROWS_AT_ONCE = 4096
"""Rows whose columns are filled one after the other: they stay in the cache of a core, some 300 KB."""


@dataclass(frozen=True)
class Layout:
    """The type of the rows of files whose points have the same fields.

    Attributes
    ----------
    coordinates
        NumPy's name of the offsets' type.
    fields
        Name, type and further shape of each field.
    """

    coordinates: str
    fields: tuple[tuple[str, str, tuple[int, ...]], ...]

    @classmethod
    def of(cls, cloud: PointCloud) -> Layout:
        """Give the layout of a cloud's points."""
        fields = ((name, values.dtype.str, values.shape[1:]) for name, values in cloud.fields.items())
        return cls(cloud.offsets.dtype.str, tuple(fields))

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of a row; fields are called by their place, as their names may be anything."""
        parts: list[tuple[Any, ...]] = [
            ("number", "<u8"), ("file", "<u4"), ("offsets", self.coordinates, (3,)),
        ]  # fmt: skip
        return np.dtype([*parts, *((f"{i}", kind, shape) for i, (_, kind, shape) in enumerate(self.fields))])

    def rows(self, cloud: PointCloud, numbers: NDArray[np.uint64], file: int) -> NDArray[Any]:
        """Put points side by side."""
        rows = np.empty(len(cloud), self.dtype)
        for start in range(0, len(rows), _ROWS_AT_ONCE):
            part = slice(start, start + _ROWS_AT_ONCE)
            some = rows[part]
            some["number"], some["file"], some["offsets"] = numbers[part], file, cloud.offsets[part]
            for i, (name, _, _) in enumerate(self.fields):
                some[f"{i}"] = cloud.fields[name][part]
        return rows

    def columns(self, rows: NDArray[Any]) -> tuple[NDArray[Any], dict[str, NDArray[Any]]]:
        """Give the offsets and the fields of rows, each for itself."""
        fields = {name: np.ascontiguousarray(rows[f"{i}"]) for i, (name, _, _) in enumerate(self.fields)}
        return np.ascontiguousarray(rows["offsets"]), fields

    def to_json(self) -> Any:
        """Give the layout as lists."""
        return [self.coordinates, [[name, kind, list(shape)] for name, kind, shape in self.fields]]

    @classmethod
    def from_json(cls, values: Any) -> Layout:
        """Take it back."""
        coordinates, fields = values
        return cls(coordinates, tuple((name, kind, tuple(shape)) for name, kind, shape in fields))


@dataclass(frozen=True)
class FileHead:
    """What is known of one file beside its points.

    Attributes
    ----------
    finish
        What makes its rows what `surfsig.read` gives.
    sample
        A few of its points, which tell of its fields what all of them tell; with its origin, viewpoints and
        coordinate system.
    count
        Points of the file.
    """

    finish: Finish
    sample: PointCloud
    count: int

    def cloud(self, layout: Layout, rows: NDArray[Any]) -> PointCloud:
        """Give points of this file, and its sample behind them, as `surfsig.read` does."""
        offsets, fields = layout.columns(rows)
        head = self.sample
        cloud = PointCloud(
            offsets, head.origin, head.viewpoint, fields, None, head.viewpoints, head.coordinate_system
        )
        return self.finish.cloud(cloud, head)

    def to_json(self) -> dict[str, Any]:
        """Give everything but the sample's rows."""
        cloud, finish = self.sample, self.finish
        system = cloud.coordinate_system
        return {
            "count": self.count,
            "origin": cloud.origin.tolist(),
            "viewpoint": None if cloud.viewpoint is None else cloud.viewpoint.tolist(),
            "viewpoints": None if cloud.viewpoints is None else cloud.viewpoints.tolist(),
            "coordinate_system": "" if system is None else system.to_text(),
            "finish": {
                "colours": finish.colours,
                "bytes_in_16_bits": finish.bytes_in_16_bits,
                "decimals": finish.decimals,
                "defaults": dict(finish.defaults),
            },
        }

    @classmethod
    def from_json(cls, values: Mapping[str, Any], layout: Layout, rows: NDArray[Any]) -> FileHead:
        """Take it back, with the sample's rows."""
        offsets, fields = layout.columns(rows)
        finish = values["finish"]
        decimals = finish["decimals"]
        cloud = PointCloud(
            offsets,
            np.array(values["origin"]),
            values["viewpoint"],
            fields,
            viewpoints=values["viewpoints"],
            coordinate_system=CoordinateSystem.from_text(values["coordinate_system"]),
        )
        return cls(
            Finish(
                finish["colours"],
                finish["bytes_in_16_bits"],
                None if decimals is None else tuple(decimals),
                finish["defaults"],
            ),
            cloud,
            values["count"],
        )
