"""Parquet, through PyArrow, which is an optional dependency (``surfsig[parquet]``)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.columns import Chunks, aligned_blocks, cloud_from_columns
from surfsig.files.progress import Progress
from surfsig.point_cloud import PointCloud

if TYPE_CHECKING:
    import pyarrow as pa

MAGIC = b"PAR1"
_NOTES = b"surfsig"


def check_available() -> None:
    """Make sure that PyArrow is installed.

    Raises
    ------
    InvalidInputError
        With the command that installs it.
    """
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        raise InvalidInputError("Parquet needs PyArrow: pip install 'surfsig[parquet]'") from None


def read(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read an open Parquet file with columns x, y, z; other numeric columns become fields.

    Raises
    ------
    FileFormatError
        If it is cut off, broken, or has no coordinates.
    """
    check_available()
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(file)
    except (pa.ArrowException, OSError) as error:
        raise FileFormatError(
            f"{source}: the Parquet file is cut off or broken ({_one_line(error)})"
        ) from None
    columns = {}
    for name in table.column_names:
        values = _numpy(table.column(name))
        if values is not None:
            columns[name] = values
    notes = json.loads((table.schema.metadata or {}).get(_NOTES, b"{}"))
    grid = notes.get("grid")
    return cloud_from_columns(
        columns, source=source, viewpoint=notes.get("viewpoint"), grid=(grid[0], grid[1]) if grid else None
    )


def write(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write points as x, y, z and each column under its name; (n, k) columns become lists of k numbers.

    There is a row group for each block of `chunks`.
    """
    check_available()
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays: dict[str, NDArray[Any]] = dict(zip("xyz", cloud.points.T, strict=True))
    arrays.update(columns)
    parts = [(name, _type(values.dtype, values.shape[1:])) for name, values in arrays.items()]
    if chunks is not None:
        parts.append((chunks.name, _type(np.dtype(chunks.dtype), (chunks.width,))))
    told: dict[str, Any] = dict(notes)
    if cloud.viewpoint is not None:
        told["viewpoint"] = cloud.viewpoint.tolist()
    if cloud.grid is not None:
        told["grid"] = list(cloud.grid)
    schema = pa.schema(parts, metadata={_NOTES: json.dumps(told)})
    # Signatures hardly repeat a value: dictionaries would only cost time and memory.
    with pq.ParquetWriter(file, schema, compression="zstd", use_dictionary=False) as writer:
        for rows, block in aligned_blocks(chunks, len(cloud)):
            values = [array[rows] for array in arrays.values()] + ([] if block is None else [block])
            writer.write_table(pa.table([_arrow(array) for array in values], schema=schema))
            progress.advance(rows.stop - rows.start)


def _type(dtype: np.dtype[Any], shape: tuple[int, ...]) -> pa.DataType:
    import pyarrow as pa

    kind = pa.from_numpy_dtype(dtype)
    return pa.list_(kind, shape[0]) if shape else kind


def _arrow(array: NDArray[Any]) -> pa.Array:
    import pyarrow as pa

    flat = pa.array(np.ascontiguousarray(array).ravel())
    return flat if array.ndim == 1 else pa.FixedSizeListArray.from_arrays(flat, array.shape[1])


def _numpy(column: pa.ChunkedArray) -> NDArray[Any] | None:
    """Give a column's numbers as (n,) or (n, k), a missing one as NaN; None if it does not hold numbers."""
    import pyarrow as pa

    kind = column.type
    shape: tuple[int, ...] = (len(column),)
    if pa.types.is_fixed_size_list(kind) and not column.null_count:
        shape = (len(column), kind.list_size)
        column, kind = column.combine_chunks().flatten(), kind.value_type
    if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind)):
        return None
    values: NDArray[Any] = np.asarray(column)
    return values.reshape(shape)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:100]
