"""Points in few bytes: coordinates in 16 bits along a space-filling curve, other numbers with 2 to 3 digits.

`web/src/report_data.ts` reads them.
"""

from __future__ import annotations

import base64
import gzip
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.page.layer import Layer

MOST_POINTS = 1_000_000
"""Points of a page, all layers together; of more, a fixed random choice."""

STEPS = 65_535
"""Steps between the smallest and the largest coordinate along an axis: 0.2 mm of 13 m."""

LOGARITHMS = 253
"""Steps between the smallest and the largest of positive numbers, on a logarithmic scale."""

MORTON_BITS = 10
"""Bits of each axis in the order of the points: neighbours follow each other, which compresses well."""

HALF_RANGE = 100.0
"""What the 99th percentile of a column's sizes is scaled to: it has 11 bits from 6e-5 to 65,504."""

ERROR_COLUMNS = ("_std", "residual")
"""Ends of the names of columns that are positive and need two digits."""


class Packer:
    """Collects arrays, and says where each is."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._length = 0

    def layer(self, layer: Layer, share: float) -> dict[str, Any]:
        """Pack a share of a layer's points, evenly chosen; give what the page has to know."""
        points = np.asarray(layer.points, np.float64).reshape(-1, 3)
        finite = np.flatnonzero(np.isfinite(points).all(axis=1))
        if share < 1:
            wanted = math.floor(share * len(finite))
            finite = np.sort(np.random.default_rng(0).choice(finite, wanted, replace=False))
        origin = _origin(points[finite])
        offsets = points[finite] - origin
        order = _morton_order(offsets)
        chosen, offsets = finite[order], offsets[order]
        normals, labels = layer.normals, layer.labels
        return {
            "name": layer.name,
            "count": len(chosen),
            "total": len(points),
            "origin": origin.tolist(),
            "axes": [self._coordinates(offsets[:, axis]) for axis in range(3)],
            "normals": None if normals is None else self._normals(np.asarray(normals)[chosen]),
            "colours": None if layer.colors is None else [self._bytes(c) for c in layer.colors[chosen].T],
            "colour": None if layer.color is None else list(layer.color),
            "labels": None if labels is None else self._planes("int32", labels[chosen].astype("<i4")),
            "labelName": layer.label_name,
            "columns": [
                {"name": name, "values": self._column(name, np.asarray(values, np.float64)[chosen])}
                for name, values in layer.columns.items()
            ],
            "stage": layer.stage,
            "transform": None if layer.T_target_source is None else layer.T_target_source.ravel().tolist(),
        }

    def packed(self) -> str:
        """Give all arrays, compressed, in base64."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), mtime=0)).decode()

    def _add(
        self, kind: str, parts: Iterable[NDArray[Any]], low: float = 0.0, step: float = 1.0
    ) -> dict[str, Any]:
        start = self._length
        for part in parts:
            content = np.ascontiguousarray(part).tobytes()
            self._parts.append(content)
            self._length += len(content)
        return {"type": kind, "start": start, "low": low, "step": step}

    def _planes(self, kind: str, values: NDArray[Any], low: float = 0.0, step: float = 1.0) -> dict[str, Any]:
        """Add numbers byte by byte: all lowest bytes, then the next ones."""
        planes = values.view(np.uint8).reshape(len(values), values.itemsize).T
        return self._add(kind, planes, low, step)

    def _bytes(self, values: NDArray[Any]) -> dict[str, Any]:
        return self._add("uint8", [values.astype(np.uint8)])

    def _coordinates(self, values: NDArray[np.float64]) -> dict[str, Any]:
        low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
        step = (high - low) / STEPS if high > low else 1.0
        numbers = np.round((values - low) / step).astype(np.int64)
        # Differences wrap around.
        differences = np.diff(numbers, prepend=0).astype(np.uint16).astype("<u2")
        return self._planes("delta16", differences, low, step)

    def _column(self, name: str, values: NDArray[np.float64]) -> dict[str, Any]:
        if name.endswith(ERROR_COLUMNS) and not (values < 0).any():
            return self._logarithms(values)
        sizes = np.abs(values[np.isfinite(values)])
        typical = float(np.quantile(sizes, 0.99)) if len(sizes) else 0.0
        step = typical / HALF_RANGE if typical > 0 else 1.0
        largest = float(np.finfo(np.float16).max)
        halves = np.clip(values / step, -largest, largest).astype("<f2")
        return self._planes("float16", halves, 0.0, step)

    def _logarithms(self, values: NDArray[np.float64]) -> dict[str, Any]:
        positive = np.isfinite(values) & (values > 0)
        logarithms = np.log(values[positive])
        low, high = (float(logarithms.min()), float(logarithms.max())) if len(logarithms) else (0.0, 0.0)
        step = (high - low) / LOGARITHMS if high > low else 1.0
        numbers = np.where(values == 0, 0, 255).astype(np.uint8)
        numbers[positive] = 1 + np.round((logarithms - low) / step)
        return self._add("log8", [numbers], low - step, step)

    def _normals(self, normals: NDArray[Any]) -> list[dict[str, Any]]:
        """Project unit vectors to an octahedron (Meyer et al. 2010), unfolded to a square, in 8 bits."""
        known = np.isfinite(normals).all(axis=1)
        x, y, z = np.where(known[:, None], normals, [[0.0, 0.0, 1.0]]).T
        total = np.abs(x) + np.abs(y) + np.abs(z)
        u, v = x / total, y / total
        below = z < 0
        folded = (1 - np.abs(v)) * np.where(u < 0, -1, 1), (1 - np.abs(u)) * np.where(v < 0, -1, 1)
        u, v = np.where(below, folded[0], u), np.where(below, folded[1], v)
        # -128 stands for a normal that is not known.
        numbers = [np.where(known, np.round(127 * c), -128).astype(np.int8) for c in (u, v)]
        return [self._add("int8", [part], 0.0, 1 / 127) for part in numbers]


def _origin(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give a round position near points that are far from 0, for the browser has float32 only; else 0."""
    if not len(points):
        return np.zeros(3)
    extent = float(np.ptp(points, axis=0).max())
    middle = points.mean(axis=0)
    if not extent > 0:
        return np.asarray(middle, np.float64)
    step = 10.0 ** math.floor(math.log10(extent))
    return np.asarray(np.where(np.abs(middle) > 8 * extent, np.round(middle / step) * step, 0.0), np.float64)


def _morton_order(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Give the order of points along a Z-shaped curve that fills their cube."""
    if not len(points):
        return np.empty(0, np.intp)
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max())
    cells = ((points - low) / (extent or 1.0) * (2**MORTON_BITS - 1)).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")
