"""Between the columns of a file and a `PointCloud`: names and precision, for every format."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from surfsig.errors import FileFormatError, InvalidInputError, SurfsigError
from surfsig.files.colours import with_colours
from surfsig.files.coordinate_names import coordinates_of, warn_of_units
from surfsig.point_cloud import PointCloud, plain_array

# Coordinates printed as text and declared float32 stay float64 where float32 would move a point by more than
# this share of the cloud's extent (many programs print UTM coordinates in full and declare them "float").
LOSS_ALLOWED = 1e-6

# What PCL, and Open3D in PCD, call normals.
PCL_NORMALS = {"normal_x": "nx", "normal_y": "ny", "normal_z": "nz"}

# What (n, 3) coordinates are called; `points` is what surfsig writes.
TRIPLES = frozenset(
    {"points", "xyz", "pos", "position", "positions", "coord", "coords", "coordinates", "vertices"}
)

# What a `PointCloud` keeps as it is.
_COORDINATES = (np.dtype("<f4"), np.dtype(">f4"), np.dtype("<f8"), np.dtype(">f8"))


class Chunks(NamedTuple):
    """A column too large for the memory, made and written block by block.

    Attributes
    ----------
    name
        Its name; in PLY and E57, which know single numbers only, `name_0`, `name_1`, ...
    width
        Numbers per point.
    dtype
        Their type.
    blocks
        Arrays of the shape (m_i, width) in the order of the points; the m_i add up to the number of points.
        The other columns' values for these points are taken after the block, so that making it may still
        fill them in (whether there is a signature is known when it is made).
    """

    name: str
    width: int
    dtype: DTypeLike
    blocks: Iterable[NDArray[Any]]


def cloud_from_columns(
    columns: Mapping[str, NDArray[Any]],
    *,
    source: str,
    viewpoint: ArrayLike | None = None,
    grid: tuple[int, int] | None = None,
    declared_float32: bool = False,
    decimals: Collection[str] | None = None,
    error: type[SurfsigError] = FileFormatError,
    unit: str | None = None,
    typed_colours: bool = True,
) -> PointCloud:
    """Make a cloud of named columns; those that are no coordinates are its fields.

    Coordinates are x, y, z in any case, or `points` (n, 3) and its like (xyz, pos, ...), or what else
    `coordinate_names` knows (pos_x, Easting, ...). Those that lie in memory as (n, 3) are not copied.

    Parameters
    ----------
    columns
        (n,) or (n, k) arrays by name, in the file's order and of any byte order.
    source
        The file's name, for messages.
    viewpoint, grid
        As in `PointCloud`.
    declared_float32
        The coordinates were parsed as float64 from text that declares float32: narrow them where that
        loses nothing that matters (see `LOSS_ALLOWED`).
    decimals
        Of text: the columns that are written with a decimal point, by which colours are told apart (see
        `with_colours`). None where the file has types.
    error
        What is raised if a coordinate is missing, is no number, or may be several columns.
    unit
        What the caller says that the coordinates' unit is.
    typed_colours
        Whether colours get the type that says what they mean, which all points of a file tell together.

    Warns
    -----
    UserWarning
        If the coordinates' names give another unit than metres and `unit`.
    """
    by_lower_name = {name.lower(): name for name in reversed(list(columns))}
    triples = [
        name
        for lower, name in by_lower_name.items()
        if lower in TRIPLES and columns[name].ndim == 2 and columns[name].shape[1] == 3
    ]
    # The one that surfsig writes wins; of others nobody can say which is meant.
    chosen = by_lower_name.get("points", "") if len(triples) > 1 else "".join(triples)
    if chosen in triples and not by_lower_name.keys() & {*"xyz"}:
        rest = {name: values for name, values in columns.items() if name != chosen}
        columns = {**dict(zip("xyz", columns[chosen].T, strict=True)), **rest}
        by_lower_name |= {axis: axis for axis in "xyz"}
    single = [name for name, values in columns.items() if values.ndim == 1]
    coordinates = coordinates_of(single, source, error)
    if coordinates is None:
        wide = next(
            (axis for axis in "xyz" if axis in by_lower_name and columns[by_lower_name[axis]].ndim > 1), ""
        )
        if wide:
            count = columns[by_lower_name[wide]].shape[1]
            raise error(f"{source}: column '{wide}' holds {count} numbers per point, not one")
        missing = next((axis for axis in "xyz" if axis not in by_lower_name), "x")
        raise error(
            f"{source}: no column '{missing}' among the point's values ({', '.join(columns) or 'none'})"
        )
    warn_of_units(coordinates, source, unit)
    axes = coordinates.names
    first = columns[axes[0]]
    for axis in axes:
        if columns[axis].dtype.kind not in "fiu":
            raise error(f"{source}: column '{axis}' holds {columns[axis].dtype}, not real numbers")
    # Joining with float32 gives float32 to small types, and float64 to all that would lose digits.
    joint = np.result_type(np.float32, *(columns[axis].dtype for axis in axes))
    shared = _shared_rows(*(columns[axis] for axis in axes))
    if shared is None:
        offsets = np.empty((len(first), 3), np.float32 if joint == np.float32 else np.float64)
        for i, axis in enumerate(axes):
            offsets[:, i] = columns[axis]
    else:
        offsets = shared
    if declared_float32:
        offsets = _narrowed(offsets)
    others = {name: _native(values) for name, values in columns.items() if name not in axes}
    fields = _with_normals(others)
    return PointCloud(
        offsets,
        viewpoint=None if viewpoint is None else np.asarray(viewpoint, dtype=np.float64),
        fields=with_colours(fields, decimals=decimals, source=source) if typed_colours else fields,
        grid=grid,
    )


def output_columns(
    cloud: PointCloud, columns: Mapping[str, ArrayLike] | None, reserved: Collection[str]
) -> dict[str, NDArray[Any]]:
    """Put the input's fields and the new columns into one order with unique names.

    A name that both have is the new column's; the input's field is kept as ``input_NAME``, at the end, where
    programs that take the first column whose name fits (CloudCompare) find the new one first.

    Parameters
    ----------
    cloud
        Gives the fields.
    columns
        (n,) or (n, k) arrays by name; ``normals`` (n, 3) becomes nx, ny, nz and ``colors`` (n, 3 or 4)
        becomes red, green, blue (and alpha).
    reserved
        Names that neither may take (the format's own).

    Raises
    ------
    InvalidInputError
        If a new column has the wrong length or type, or a reserved name.
    """
    new: dict[str, NDArray[Any]] = {}
    for name, values in (columns or {}).items():
        array = plain_array(values)
        if array.ndim not in (1, 2) or len(array) != len(cloud):
            raise InvalidInputError(
                f"column '{name}' must have one row for each of the {len(cloud)} points, "
                f"not the shape {array.shape}"
            )
        if array.dtype.kind not in "fiub":
            raise InvalidInputError(f"column '{name}' must hold real numbers, not {array.dtype}")
        new.update(_split(name, array))
    clash = next((name for name in new if name in reserved), None)
    if clash is not None:
        raise InvalidInputError(f"a column cannot be called '{clash}' in this format")
    kept: dict[str, NDArray[Any]] = {}
    renamed: dict[str, NDArray[Any]] = {}
    taken = {*reserved, *new, *cloud.fields}
    for name, values in cloud.fields.items():
        if name in new or name in reserved:
            other = "input_" + name
            while other in taken:
                other = "input_" + other
            taken.add(other)
            renamed[other] = values
        else:
            kept[name] = values
    return {**kept, **new, **renamed}


def scalar_columns(columns: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Split (n, k) columns into k columns NAME_0, NAME_1, ... and make names fit for a header of words."""
    scalars: dict[str, NDArray[Any]] = {}
    for name, values in columns.items():
        word = header_word(name)
        parts = [(word, values)]
        if values.ndim == 2:
            parts = list(zip(column_names(word, values.shape[1]), values.T, strict=True))
        for part, column in parts:
            scalars[unique_name(part, scalars)] = column
    return scalars


def header_word(name: str) -> str:
    """Make a name fit for a header of words."""
    return "_".join(name.split()) or "field"


def unique_name(name: str, taken: Collection[str]) -> str:
    """Give the name, with _2, _3, ... behind it if it is taken."""
    unique, number = name, 2
    while unique in taken:
        unique, number = f"{name}_{number}", number + 1
    return unique


def column_names(name: str, width: int) -> list[str]:
    """Name the single columns of an (n, width) one."""
    return [f"{name}_{i}" for i in range(width)]


def exact_float32(points: NDArray[Any]) -> bool:
    """Tell whether float32 holds these coordinates without changing any of them."""
    # Coordinates beyond float32's range become infinite, hence unequal: nothing to warn about.
    with np.errstate(over="ignore"):
        return all(
            np.array_equal(part.astype(np.float32), part, equal_nan=True) for part in blocks_of(points)
        )


def blocks_of(array: NDArray[Any], rows: int = 1 << 16) -> Iterable[NDArray[Any]]:
    """Cut an array into blocks of rows, so that copies of it stay small."""
    return (array[start : start + rows] for start in range(0, len(array), rows))


def aligned_blocks(chunks: Chunks | None, count: int) -> Iterable[tuple[slice, NDArray[Any] | None]]:
    """Give the rows to write together: the slice of the points, and the chunked column's block for it.

    Raises
    ------
    InvalidInputError
        If the blocks are not (m, width), or do not add up to `count` rows.
    """
    if chunks is None:
        for start in range(0, count, 1 << 16):
            yield slice(start, min(count, start + (1 << 16))), None
        return
    done = 0
    for block in chunks.blocks:
        if block.ndim != 2 or block.shape[1] != chunks.width:
            raise InvalidInputError(
                f"a block of '{chunks.name}' has the shape {block.shape}, not (m, {chunks.width})"
            )
        rows = slice(done, done + len(block))
        done += len(block)
        if done > count:
            break
        yield rows, np.ascontiguousarray(block, dtype=chunks.dtype)
    if done != count:
        raise InvalidInputError(
            f"the blocks of '{chunks.name}' hold {done} rows or more, the cloud {count} points"
        )


def columns_of(rows: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Take a structured array apart, as `filled_columns` does."""
    return filled_columns(rows.dtype, len(rows), blocks_of(rows, 4096))


def filled_columns(
    dtype: np.dtype[Any], count: int, blocks: Iterable[NDArray[Any]]
) -> dict[str, NDArray[Any]]:
    """Take structured blocks apart into columns of the machine's byte order.

    By blocks, because a wide row (signatures: a kilobyte) would otherwise be fetched once per column. Columns
    x, y and z of one floating type lie side by side in memory, where `cloud_from_columns` takes them as the
    cloud's coordinates without a copy; all others are contiguous.

    Parameters
    ----------
    dtype
        Structured: what the blocks have.
    count
        Rows of all blocks together.
    blocks
        In their order.
    """
    columns = _empty_columns(dtype, count)
    start = 0
    for block in blocks:
        for name, column in columns.items():
            column[start : start + len(block)] = block[name]
        start += len(block)
    return columns


def numeric_columns(rows: NDArray[Any], source: str) -> dict[str, NDArray[Any]]:
    """Give a structured array's (n,) fields of numbers, as (n, k) where they have further axes.

    Warns
    -----
    UserWarning
        If a field holds no numbers.
    """
    names = rows.dtype.names or ()
    numeric = [name for name in names if rows.dtype[name].base.kind in "fiub"]
    for name in sorted(set(names) - set(numeric)):
        warnings.warn(f"{source}: left out the field '{name}', which holds no numbers", stacklevel=3)
    return {
        name: rows[name].reshape(len(rows), -1) if rows[name].ndim > 1 else rows[name] for name in numeric
    }


def _empty_columns(dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    names = dtype.names or ()
    kinds = {name: dtype[name].base.newbyteorder("=") for name in names}
    axes = [next((name for name in names if name.lower() == axis), "") for axis in "xyz"]
    if "" in axes or any(dtype[n] not in _COORDINATES or kinds[n] != kinds[axes[0]] for n in axes):
        axes = []
    points = np.empty((count if axes else 0, 3), kinds[axes[0]] if axes else None)
    return {
        name: points[:, axes.index(name)]
        if name in axes
        else np.empty((count, *dtype[name].shape), kinds[name])
        for name in names
    }


def _shared_rows(x: NDArray[Any], y: NDArray[Any], z: NDArray[Any]) -> NDArray[Any] | None:
    """Give three columns as the C-contiguous (n, 3) array that they are columns of; None if they are not."""
    step = x.dtype.itemsize
    start = x.ctypes.data
    if not (x.dtype == y.dtype == z.dtype and x.dtype.isnative and x.dtype in (np.float32, np.float64)):
        return None
    if len(x) < 2 or any(column.strides != (3 * step,) for column in (x, y, z)):
        return None
    if (y.ctypes.data, z.ctypes.data) != (start + step, start + 2 * step):
        return None
    return np.lib.stride_tricks.as_strided(x, (len(x), 3), (3 * step, step), writeable=x.flags.writeable)


def _with_normals(fields: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Call normals nx, ny, nz, also where they have PCL's names, or CloudCompare's in text (Nx, Ny, Nz)."""
    if set(PCL_NORMALS.values()) & fields.keys():
        return fields
    for names in (PCL_NORMALS, {name.capitalize(): name for name in PCL_NORMALS.values()}):
        if names.keys() <= fields.keys():
            return {names.get(name, name): values for name, values in fields.items()}
    return fields


def _narrowed(offsets: NDArray[Any]) -> NDArray[Any]:
    with np.errstate(over="ignore", invalid="ignore"):
        narrow = offsets.astype(np.float32)
        loss = np.abs(narrow - offsets)
    finite = np.isfinite(offsets).all(axis=1)
    if not finite.any():
        return narrow
    extent = np.ptp(offsets[finite], axis=0).max()
    return narrow if loss[finite].max() <= LOSS_ALLOWED * extent else offsets


def _native(values: NDArray[Any]) -> NDArray[Any]:
    return np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("="))


def _split(name: str, array: NDArray[Any]) -> dict[str, NDArray[Any]]:
    if array.ndim == 2 and name == "normals" and array.shape[1] == 3:
        return dict(zip(("nx", "ny", "nz"), array.T, strict=True))
    if array.ndim == 2 and name == "colors" and array.shape[1] in (3, 4):
        return dict(zip(("red", "green", "blue", "alpha"), array.T, strict=False))
    return {name: array}
