"""Take a scan from Open3D and pandas to surfsig and back; parts whose library is missing are skipped.

python examples/neighbours.py
"""

from __future__ import annotations

import numpy as np

import surfsig
from surfsig import InvalidInputError, PointCloud, simulate

RADIUS = 0.005


def main() -> None:
    """Clean a simulated scan, then go once round each library."""
    scan = simulate.part(seed=0)
    print(f"a simulated scan: {len(scan):,} points")
    for name, part in (("cleaning", cleaned), ("Open3D", open3d), ("pandas", pandas), ("Arrow", arrow)):
        try:
            print(f"{name}: {part(scan)}")
        except InvalidInputError as missing:
            print(f"{name}: skipped, {missing}")


def cleaned(scan: PointCloud) -> str:
    """Drop stray points, and put one point into each half millimetre."""
    kept = surfsig.remove_outliers(scan)
    thinned = surfsig.downsample(kept, voxel=0.0005)
    return f"{len(scan) - len(kept):,} points strayed; {len(thinned):,} voxels"


def open3d(scan: PointCloud) -> str:
    """Extract an Open3D cloud as it is, and give Open3D the normals and curvatures."""
    theirs = scan.to_open3d(tensor=True)
    s = surfsig.extract(theirs, RADIUS)
    made = PointCloud(s.points, fields=s.columns()).to_open3d(tensor=True)
    shared = np.shares_memory(s.points, theirs.point.positions.numpy())
    how = "in the same memory" if shared else "copied"
    return (
        f"{len(s):,} points {how}; Open3D now has their normals and {len(list(made.point)) - 2} values more"
    )


def pandas(scan: PointCloud) -> str:
    """Select points by their values in pandas, and go on with those."""
    frame = surfsig.extract(scan, RADIUS).to_pandas()
    curved = frame[(frame.status == 0) & (frame.mean_curvature.abs() > 100)]
    back = PointCloud.of(curved)
    return f"{len(back):,} of {len(frame):,} points have a mean curvature above 100 per metre"


def arrow(scan: PointCloud) -> str:
    """Make a table; Polars, DuckDB and others read it without a copy."""
    table = surfsig.extract(scan, RADIUS).to_arrow()
    return f"a table of {table.num_rows:,} rows and {table.num_columns} columns, {table.nbytes / 1e6:.0f} MB"


if __name__ == "__main__":
    main()
