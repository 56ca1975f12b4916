"""Arrow tables: PyArrow's, and those of all libraries that export Arrow streams (Polars, DuckDB, ...)."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.convert.libraries import library
from surfsig.coordinate_system import CoordinateSystem
from surfsig.errors import InvalidInputError, SurfsigError
from surfsig.files.columns import cloud_from_columns, output_columns
from surfsig.point_cloud import PointCloud, position_array

if TYPE_CHECKING:
    import pyarrow as pa

_NOTES = b"surfsig"


def cloud_of(
    data: Any, source: str = "the Arrow table", error: type[SurfsigError] = InvalidInputError
) -> PointCloud:
    """Make a cloud of a table with columns x, y, z, or with one of lists of three numbers, ``points``.

    Parameters
    ----------
    data
        A table, a record batch, or an object with ``__arrow_c_stream__``. Columns of numbers, and of lists
        of a fixed size, become fields; viewpoint, grid and coordinate system come from the metadata that
        `table` writes.
    source
        What messages call it.
    error
        What is raised if a coordinate is missing.
    """
    pa = pyarrow()
    try:
        table = data if isinstance(data, pa.Table) else pa.table(data)
    except (pa.ArrowException, TypeError) as broken:
        raise error(f"{source}: not a table ({' '.join(str(broken).split())[:100]})") from None
    try:
        names = table.column_names
    except UnicodeDecodeError:
        raise error(f"{source}: a column's name is not in UTF-8") from None
    columns: dict[str, NDArray[Any]] = {}
    words: list[str] = []
    for name, column in zip(names, table.columns, strict=True):
        values = _numbers(column)
        if values is not None:
            columns.setdefault(name, values)
        else:
            words.append(name)
    if words:
        told = ", ".join(f"'{name}'" for name in words)
        warnings.warn(f"{source}: left out what holds no numbers: {told[:200]}", stacklevel=3)
    try:
        notes = json.loads((table.schema.metadata or {}).get(_NOTES, b"{}"))
        viewpoint, grid = notes.get("viewpoint"), notes.get("grid")
        # Rows that were taken from a table keep the metadata of the whole.
        organised = (int(grid[0]), int(grid[1])) if grid and grid[0] * grid[1] == len(table) else None
        sensor = None if viewpoint is None else position_array(viewpoint, "viewpoint")
        system = CoordinateSystem.from_text(notes.get("coordinate_system", ""))
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):
        raise error(f"{source}: its metadata 'surfsig' are broken") from None
    cloud = cloud_from_columns(columns, source=source, viewpoint=sensor, grid=organised, error=error)
    return replace(cloud, coordinate_system=system)


def table(
    cloud: PointCloud,
    columns: Mapping[str, ArrayLike] | None = None,
    notes: Mapping[str, str] | None = None,
) -> pa.Table:
    """Put points, fields and further columns into a table; (n, k) columns become lists of k numbers.

    Raises
    ------
    InvalidInputError
        If PyArrow is not installed.
    """
    values: dict[str, NDArray[Any]] = dict(zip("xyz", cloud.points.T, strict=True))
    values.update(output_columns(cloud, columns, "xyz"))
    parts = [(name, field_type(array.dtype, array.shape[1:])) for name, array in values.items()]
    schema = pyarrow().schema(parts, metadata=metadata(cloud, notes or {}))
    return pyarrow().table([arrow_array(array) for array in values.values()], schema=schema)


def pyarrow(module: str = "pyarrow") -> Any:
    """Import PyArrow, or a part of it; an `InvalidInputError` says how to install it."""
    return library(module, "PyArrow", "'surfsig[parquet]'")


def metadata(cloud: PointCloud, notes: Mapping[str, str]) -> dict[bytes, str]:
    """Write what is said about the whole cloud into a table's metadata."""
    told: dict[str, Any] = dict(notes)
    if cloud.viewpoint is not None:
        told["viewpoint"] = cloud.viewpoint.tolist()
    if cloud.grid is not None:
        told["grid"] = list(cloud.grid)
    if cloud.coordinate_system is not None:
        told["coordinate_system"] = cloud.coordinate_system.to_text()
    return {_NOTES: json.dumps(told)}


def field_type(dtype: np.dtype[Any], shape: tuple[int, ...]) -> pa.DataType:
    """Give the type of a column (n,), or (n, k) where the shape is (k,).

    Raises
    ------
    InvalidInputError
        If k is 0, which Arrow has no type for.
    """
    if shape == (0,):
        raise InvalidInputError("Arrow and Parquet cannot hold a column (n, 0)")
    kind = pyarrow().from_numpy_dtype(dtype)
    return pyarrow().list_(kind, shape[0]) if shape else kind


def arrow_array(values: NDArray[Any]) -> pa.Array:
    """Give (n,) numbers as an array, and (n, k) ones as one of lists."""
    pa = pyarrow()
    flat = pa.array(np.ascontiguousarray(values).ravel())
    return flat if values.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _numbers(column: pa.ChunkedArray) -> NDArray[Any] | None:
    """Give a column's numbers as (n,) or (n, k), a missing one as NaN; None if it does not hold numbers.

    A column in one piece without missing numbers is not copied.
    """
    types = pyarrow().types
    kind = column.type
    shape: tuple[int, ...] = (len(column),)
    array = column.chunk(0) if column.num_chunks == 1 else column.combine_chunks()
    if types.is_fixed_size_list(kind) and not column.null_count:
        shape = (len(column), kind.list_size)
        array, kind = array.flatten(), kind.value_type
    if types.is_decimal(kind):
        # Databases' exact numbers, as DuckDB and Spark write them.
        array, kind = array.cast(pyarrow().float64()), pyarrow().float64()
    if not (types.is_floating(kind) or types.is_integer(kind) or types.is_boolean(kind)):
        return None
    values: NDArray[Any] = np.asarray(array)
    return values.reshape(shape)
