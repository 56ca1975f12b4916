"""pandas DataFrames."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.convert.libraries import library
from surfsig.errors import InvalidInputError
from surfsig.files.columns import cloud_from_columns, output_columns, scalar_columns
from surfsig.point_cloud import PointCloud

if TYPE_CHECKING:
    import pandas as pd


def cloud_of(frame: pd.DataFrame) -> PointCloud:
    """Make a cloud of a DataFrame with columns x, y, z; the other columns of numbers become fields.

    Raises
    ------
    InvalidInputError
        If a coordinate is missing.
    """
    columns: dict[str, NDArray[Any]] = {}
    # By position: two columns may have the same name, of which the first counts.
    for i, name in enumerate(frame.columns):
        values = _numbers(frame.iloc[:, i])
        if values is not None:
            columns.setdefault(str(name), values)
    return cloud_from_columns(columns, source="the DataFrame", error=InvalidInputError)


def data_frame(
    cloud: PointCloud, columns: Mapping[str, ArrayLike] | None = None, index: NDArray[np.int64] | None = None
) -> pd.DataFrame:
    """Put points, fields and further columns into a DataFrame; (n, k) columns become NAME_0, NAME_1, ...

    Raises
    ------
    InvalidInputError
        If pandas is not installed.
    """
    pandas = library("pandas", "pandas", "pandas")
    values = output_columns(cloud, columns, "xyz")
    axes = dict(zip("xyz", cloud.points.T, strict=True))
    return pandas.DataFrame({**axes, **scalar_columns(values)}, index=index)


def _numbers(series: pd.Series) -> NDArray[Any] | None:
    """Give a column's numbers, a missing one as NaN; None if it does not hold real numbers."""
    # pandas' own types of numbers say which of NumPy's they are; its others (text, categories) have none.
    kind = getattr(series.dtype, "numpy_dtype", series.dtype)
    if not isinstance(kind, np.dtype) or kind.kind not in "fiub":
        return None
    if isinstance(series.dtype, np.dtype) or not series.isna().any():
        values: NDArray[Any] = series.to_numpy(dtype=kind)
    else:
        values = series.to_numpy(dtype=kind if kind.kind == "f" else np.float64, na_value=np.nan)
    return values
