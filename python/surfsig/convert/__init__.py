"""Point clouds from and for other libraries, one library a file.

An object is recognised by its type's module and by the protocols that it speaks, so that none of these
libraries is imported before its own objects come. `PointCloud.of` and the methods `to_...` are the way in.
"""

from __future__ import annotations

from surfsig.point_cloud import PointCloud


def cloud_of(data: object) -> PointCloud:
    """Make a cloud of another library's object; see `PointCloud.of`."""
    kinds = {(kind.__module__.partition(".")[0], kind.__name__) for kind in type(data).__mro__}
    if ("open3d", "PointCloud") in kinds:
        from surfsig.convert import open3d

        return open3d.cloud_of(data)
    if ("pandas", "DataFrame") in kinds:
        from surfsig.convert import pandas

        return pandas.cloud_of(data)
    if hasattr(data, "__arrow_c_stream__"):
        from surfsig.convert import arrow

        return arrow.cloud_of(data)
    from surfsig.convert import arrays

    return arrays.cloud_of(data)
