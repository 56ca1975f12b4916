"""What a page holds, read as slowly as the format says it."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def report_of(page: Path | str) -> dict[str, Any]:
    """Give the report inside a page, each layer with its arrays as numbers."""
    text = page.read_text(encoding="utf-8") if isinstance(page, Path) else page
    (content,) = re.findall(r'<script type="application/json" id="report-data">(.*?)</script>', text)
    report: dict[str, Any] = json.loads(content)
    data = gzip.decompress(base64.b64decode(report.pop("bytes")))
    for layer in report["layers"]:
        count = layer["count"]
        axes = [numbers(axis, count, data) for axis in layer["axes"]]
        layer["points"] = np.column_stack(axes).reshape(count, 3) + layer["origin"]
        layer["columns"] = {c["name"]: numbers(c["values"], count, data) for c in layer["columns"]}
        if layer["labels"] is not None:
            layer["labels"] = numbers(layer["labels"], count, data).astype(int)
        for name in ("normals", "colours"):
            parts = layer[name]
            layer[name] = None if parts is None else np.column_stack([numbers(p, count, data) for p in parts])
    return report


def numbers(packed: dict[str, Any], count: int, data: bytes) -> NDArray[np.float64]:
    """Read one array."""
    kind, start, low, step = (packed[name] for name in ("type", "start", "low", "step"))

    def byte(plane: int, i: int) -> int:
        return int(data[start + plane * count + i])

    values = np.empty(count)
    total = 0
    for i in range(count):
        if kind == "delta16":
            total = (total + byte(0, i) + 256 * byte(1, i)) % 65536
            values[i] = low + step * total
        elif kind == "float16":
            values[i] = step * float(np.frombuffer(bytes([byte(0, i), byte(1, i)]), "<f2")[0])
        elif kind == "log8":
            logarithm = byte(0, i)
            values[i] = {0: 0.0, 255: np.nan}.get(logarithm, np.exp(low + step * logarithm))
        elif kind == "int32":
            values[i] = np.frombuffer(bytes([byte(k, i) for k in range(4)]), "<i4")[0]
        elif kind == "int8":
            values[i] = low + step * np.frombuffer(bytes([byte(0, i)]), np.int8)[0]
        else:
            values[i] = low + step * byte(0, i)
    return values
