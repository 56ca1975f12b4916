"""Parquet, through PyArrow, which is an optional dependency (``surfsig[parquet]``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.convert import arrow
from surfsig.errors import FileFormatError
from surfsig.files.columns import Chunks, aligned_blocks
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

MAGIC = b"PAR1"


def check_available() -> None:
    """Make sure that PyArrow is installed; an `InvalidInputError` says how to."""
    arrow.pyarrow("pyarrow.parquet")


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
    return arrow.cloud_of(table, source, FileFormatError)


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
    parts = [(name, arrow.field_type(values.dtype, values.shape[1:])) for name, values in arrays.items()]
    if chunks is not None:
        parts.append((chunks.name, arrow.field_type(np.dtype(chunks.dtype), (chunks.width,))))
    schema = pa.schema(parts, metadata=arrow.metadata(cloud, notes))
    # Signatures hardly repeat a value: dictionaries would only cost time and memory.
    with pq.ParquetWriter(file, schema, compression="zstd", use_dictionary=False) as writer:
        for rows, block in aligned_blocks(chunks, len(cloud)):
            values = [array[rows] for array in arrays.values()] + ([] if block is None else [block])
            writer.write_table(pa.table([arrow.arrow_array(array) for array in values], schema=schema))
            progress.advance(rows.stop - rows.start)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:100]
