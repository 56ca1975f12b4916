"""Whatever is written is read back: property tests of every format that is written."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, seed, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from surfsig import PointCloud, read, write

SEED = 4
# What rounding to steps may move a point by; the others give back every bit.
STEPS = {".las": 5.1e-4, ".laz": 5.1e-4}
NAMES = st.text("abcdefgh_XYZ01 é", min_size=1, max_size=12).filter(lambda name: name.strip("_ ") == name)
KINDS = st.sampled_from(["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"])


@st.composite
def clouds(draw: st.DrawFn) -> PointCloud:
    count = draw(st.integers(1, 40))
    dtype = draw(st.sampled_from([np.float32, np.float64]))
    numbers = st.floats(-5e5, 5e5, width=32)
    points = draw(hnp.arrays(np.float32, (count, 3), elements=numbers)).astype(dtype)
    fields: dict[str, Any] = {}
    for name in draw(st.lists(NAMES, max_size=3, unique_by=str.lower)):
        if name.lower() not in ("x", "y", "z", "points", "notes", "grid", "origin"):
            kind = np.dtype(draw(KINDS))
            values = st.floats(-1e6, 1e6, width=32) if kind.kind == "f" else None
            fields[f"q{name}"] = draw(hnp.arrays(kind, count, elements=values))
    viewpoint = draw(st.none() | st.just(np.array([1.5, -2.0, 3.25])))
    return PointCloud(points, viewpoint=viewpoint, fields=fields)


@pytest.mark.parametrize("extension", [".ply", ".pcd", ".las", ".laz", ".e57", ".npz", ".parquet"])
def test_what_is_written_is_read_back(extension: str) -> None:
    if extension == ".parquet":
        pytest.importorskip("pyarrow")

    @seed(SEED)
    @settings(max_examples=60, deadline=None, database=None)
    @given(clouds())
    def check(cloud: PointCloud) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"cloud{extension}"
            write(path, cloud)
            again = read(path)
        moved = np.abs(again.points.astype(np.float64) - cloud.points.astype(np.float64)).max()
        assert moved <= STEPS.get(extension, 1e-9)
        if cloud.viewpoint is not None:
            assert again.viewpoint is not None
            np.testing.assert_allclose(again.viewpoint, cloud.viewpoint)
        # Names may be made fit for the format; values and their order stay.
        kept = [values for name, values in again.fields.items() if name.lower().startswith("q")]
        assert len(kept) == len(cloud.fields)
        for found, written in zip(kept, cloud.fields.values(), strict=True):
            np.testing.assert_array_equal(found, written)

    check()
