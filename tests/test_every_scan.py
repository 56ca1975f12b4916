"""Every file of the real scans reads, or fails for its reason."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from surfsig import FileFormatError, read

# Broken or empty on purpose. read_error.e57 is sound: a column of one value, over which some readers stumble.
BROKEN = {"corrupt_crc.e57": "checksum", "empty.e57": "empty|E57"}
EMPTY = {"empty_pc.e57"}
# Poses, truths and labels that stand beside the clouds.
BESIDE = ("_primitives.txt", "_parametric.txt", "_implicit.txt", "DERIVED.txt", "T_target_source.txt")


def clouds_in(folder: Path) -> list[Path]:
    kinds = {".ply", ".pcd", ".las", ".laz", ".e57", ".xyz", ".txt"}
    texts = ("README.md", "README.txt")
    files = sorted(path for path in folder.rglob("*") if path.suffix in kinds and path.name not in texts)
    return [path for path in files if not path.name.endswith(BESIDE)]


def test_every_scan(shared_data: Path) -> None:
    files = clouds_in(shared_data)
    assert len(files) > 40
    for path in files:
        if path.name in BROKEN:
            with pytest.raises(FileFormatError, match=BROKEN[path.name]) as caught:
                read(path)
            assert "\n" not in str(caught.value)
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            cloud = read(path)
        if path.name in EMPTY:
            assert len(cloud) == 0
            continue
        assert cloud.finite.any(), path
        assert np.isfinite(np.ptp(cloud.points[cloud.finite], axis=0)).all(), path


def test_ply_and_pcd_are_as_open3d_reads_them(shared_data: Path) -> None:
    o3d = pytest.importorskip("open3d")
    compared = 0
    for path in clouds_in(shared_data):
        if path.suffix not in (".ply", ".pcd"):
            continue
        cloud = read(path)
        theirs = o3d.io.read_point_cloud(
            str(path), format=path.suffix[1:], remove_nan_points=False, remove_infinite_points=False
        )
        np.testing.assert_array_equal(
            np.asarray(theirs.points).astype(np.float32), cloud.points.astype(np.float32)
        )
        if theirs.has_colors():
            ours = np.column_stack([cloud.fields[name] for name in ("red", "green", "blue")])
            np.testing.assert_array_equal(np.round(np.asarray(theirs.colors) * 255), ours)
        compared += 1
    assert compared > 15
