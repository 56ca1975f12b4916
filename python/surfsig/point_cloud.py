"""A point cloud as it came from a file or an array: coordinates, viewpoint, further fields."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from surfsig.coordinate_system import CoordinateSystem
from surfsig.errors import InvalidInputError

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


def plain_array(values: ArrayLike) -> NDArray[Any]:
    """Give an array without a mask: what NumPy's masked arrays hide is NaN.

    Whole numbers of which some are masked become floating point, float32 where that holds them all (16 bits
    or less). Where nothing is masked, the memory is the same.
    """
    if not isinstance(values, np.ma.MaskedArray):
        return np.asarray(values)
    if values.dtype.names:
        parts = {name: plain_array(values[name]) for name in values.dtype.names}
        dtype = [(name, part.dtype, part.shape[values.ndim :]) for name, part in parts.items()]
        rows = np.empty(values.shape, dtype)
        for name, part in parts.items():
            rows[name] = part
        return rows
    if not np.ma.is_masked(values) or values.dtype.kind not in "fiub":
        return np.asarray(values.data)
    floating = values.dtype if values.dtype.kind == "f" else np.result_type(values.dtype, np.float32)
    plain = values.data.astype(floating)
    plain[np.ma.getmaskarray(values)] = np.nan
    return plain


def coordinate_array(points: ArrayLike, name: str = "points") -> NDArray[Any]:
    """Check coordinates and bring them into the form that the library works with.

    float32 stays float32 and float64 stays float64; integers become the smaller of the two that holds all
    their values (16 bits or less: float32).

    Parameters
    ----------
    points
        (n, 3) numbers; NaN and infinity are allowed. What a masked array hides is NaN.
    name
        What an error calls them.

    Returns
    -------
    numpy.ndarray
        (n, 3) float32 or float64, C-contiguous; the same memory where nothing had to change.

    Raises
    ------
    InvalidInputError
        If the array is not (n, 3), or does not hold real numbers.
    """
    try:
        array = plain_array(points)
    except ValueError:
        raise InvalidInputError(f"{name} must be an (n, 3) array; its rows differ in length") from None
    if array.dtype.kind not in "fiu":
        raise InvalidInputError(f"{name} must be real numbers, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidInputError(f"{name} must have the shape (n, 3), not {array.shape}")
    kept = np.float32 if np.can_cast(array.dtype, np.float32, "safe") else np.float64
    return np.require(array, kept, ["C_CONTIGUOUS", "ALIGNED"])


def finite_rows(points: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell of which points (n, 3) all three coordinates are finite."""
    # Column by column: a reduction along the short axis of (n, 3) is several times slower.
    x, y, z = points.T
    finite: NDArray[np.bool_] = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
    return finite


def position_array(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """Check one position, and return it as (3,) float64; an `InvalidInputError` says what `name` lacks."""
    try:
        array = plain_array(values)
        # NumPy only warns of what it leaves out of complex numbers.
        position = np.array(array, np.float64) if array.dtype.kind != "c" else np.empty(0)
    except (TypeError, ValueError):
        raise InvalidInputError(f"{name} must be three numbers") from None
    if position.shape != (3,) or not np.isfinite(position).all():
        raise InvalidInputError(f"{name} must be three finite numbers")
    return position


@dataclass(eq=False)
class PointCloud:
    """Points with what a file says about them.

    The true coordinates are ``origin + offsets``: a cloud far from 0 (UTM) can keep small, exact offsets.

    Attributes
    ----------
    offsets
        (n, 3) float32 or float64, C-contiguous, in the file's precision.
    origin
        (3,) float64, added to the offsets; zeros by default.
    viewpoint
        (3,) float64, where the sensor stood, in true coordinates; None where nobody said.
    viewpoints
        (s, 3) float64, of a cloud that was joined from several scans: where the sensor stood for each; a
        point's own is the one that its field ``scan`` numbers, from 0. None for any other cloud.
    fields
        Further values per point, (n,) or (n, k), by name and in the file's order. Colours are ``red``,
        ``green``, ``blue`` (and ``alpha``): uint8 of 0 to 255, uint16 of 0 to 65535, or floating point where
        they are neither, or missing in places.
    grid
        (height, width) of an organised cloud, whose points come row by row; None for any other.
    coordinate_system
        What the file said about the frame and the unit of the true coordinates; None where it said nothing,
        and for clouds that were moved or scaled.

    Raises
    ------
    InvalidInputError
        If shapes, lengths or types do not fit together.
    """

    offsets: NDArray[Any]
    origin: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    viewpoint: NDArray[np.float64] | None = None
    fields: dict[str, NDArray[Any]] = field(default_factory=dict)
    grid: tuple[int, int] | None = None
    viewpoints: NDArray[np.float64] | None = None
    coordinate_system: CoordinateSystem | None = None

    def __post_init__(self) -> None:
        self.offsets = coordinate_array(self.offsets)
        self.origin = position_array(self.origin, "origin")
        if self.viewpoint is not None:
            self.viewpoint = position_array(self.viewpoint, "viewpoint")
        self.fields = {str(name): plain_array(values) for name, values in self.fields.items()}
        for name, values in self.fields.items():
            if values.ndim not in (1, 2) or len(values) != len(self):
                raise InvalidInputError(
                    f"field '{name}' must have one row for each of the {len(self)} points, not the shape "
                    f"{values.shape}"
                )
            if values.dtype.kind not in "fiub":
                raise InvalidInputError(f"field '{name}' must hold real numbers, not {values.dtype}")
        if self.viewpoints is not None:
            self.viewpoints = coordinate_array(self.viewpoints, "viewpoints").astype(np.float64)
            scan = self.fields.get("scan")
            if scan is None or scan.ndim != 1 or scan.dtype.kind not in "iu":
                raise InvalidInputError("viewpoints need a field 'scan' of whole numbers (n,)")
            if len(scan) and not (int(scan.min()) >= 0 and int(scan.max()) < len(self.viewpoints)):
                raise InvalidInputError(f"field 'scan' must be 0 to {len(self.viewpoints) - 1}")
        if self.grid is not None:
            height, width = (int(side) for side in self.grid)
            if height < 0 or width < 0 or height * width != len(self):
                raise InvalidInputError(f"a grid of {height} x {width} does not hold {len(self)} points")
            self.grid = (height, width)

    @classmethod
    def of(cls, data: object) -> PointCloud:
        """Take a point cloud from another library, without copying it where the memory can be shared.

        Functions that take a cloud (`surfsig.extract`, ...) take these objects as they are. What shares its
        memory changes with it, and must not be resized or freed as long as the result is used.

        Parameters
        ----------
        data
            One of:

            - a `PointCloud`, which is returned itself;
            - an array (n, 3) of any library that knows NumPy's protocols or DLPack (PyTorch, JAX, ...); what
              a masked array hides is NaN;
            - a structured array, pandas DataFrame or Arrow table (PyArrow, Polars, ...) with x, y, z in any
              case, or ``points`` (n, 3); the other columns of numbers become fields;
            - a point cloud of Open3D, legacy or tensor; normals become the fields nx, ny, nz, and colours
              red, green, blue (uint8).

            Shared are C-contiguous coordinates in float32 or float64; ``points`` of Arrow where they are
            in one chunk and none is missing.

        Returns
        -------
        PointCloud

        Raises
        ------
        InvalidInputError
            If there are no coordinates in it, or it lies on a GPU.
        """
        if isinstance(data, PointCloud):
            return data
        from surfsig.convert import cloud_of

        return cloud_of(data)

    def to_open3d(self, *, tensor: bool = False) -> Any:
        """Give the cloud to Open3D.

        Parameters
        ----------
        tensor
            Whether to make an ``open3d.t.geometry.PointCloud``, which holds all fields and shares the
            points' memory, or an ``open3d.geometry.PointCloud`` (float64), which holds normals and colours.

        Returns
        -------
        The fields nx, ny, nz are its normals, and red, green, blue (uint8 or uint16) its colours. It knows no
        viewpoint and no grid.

        Raises
        ------
        InvalidInputError
            If Open3D is not installed.
        """
        from surfsig.convert.open3d import point_cloud

        return point_cloud(self, tensor=tensor)

    def to_pandas(self) -> pd.DataFrame:
        """Give x, y, z and the fields as a pandas DataFrame; (n, k) fields become NAME_0, NAME_1, ...

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        InvalidInputError
            If pandas is not installed.
        """
        from surfsig.convert.pandas import data_frame

        return data_frame(self)

    def to_arrow(self) -> pa.Table:
        """Give x, y, z and the fields as a PyArrow table, with viewpoint and grid in its metadata.

        (n, k) fields become lists of k numbers. The table is the one that `surfsig.write` writes to Parquet.

        Returns
        -------
        pyarrow.Table

        Raises
        ------
        InvalidInputError
            If PyArrow is not installed.
        """
        from surfsig.convert.arrow import table

        return table(self)

    def _repr_html_(self) -> str:
        """Show the cloud in a notebook, with at most 100,000 points."""
        from surfsig.page import cloud_html

        return cloud_html(self)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """Give `points` to NumPy: ``numpy.asarray(cloud)``."""
        points = self.points
        if copy is False and (points is not self.offsets or dtype not in (None, points.dtype)):
            raise ValueError("the points cannot be given without a copy")
        return np.array(points, dtype) if copy else np.asarray(points, dtype)

    def __len__(self) -> int:
        """Count the points, those that are not finite included."""
        return int(self.offsets.shape[0])

    @property
    def points(self) -> NDArray[Any]:
        """(n, 3) true coordinates: the offsets themselves where the origin is 0, else float64."""
        return self.origin + self.offsets if self.origin.any() else self.offsets

    def at(self, indices: ArrayLike) -> PointCloud:
        """Give some of the points with their fields.

        Parameters
        ----------
        indices
            Whole numbers (m,), or a mask (n,).

        Returns
        -------
        PointCloud
            A list of points, even where the whole was organised.
        """
        chosen = np.asarray(indices)
        fields = {name: values[chosen] for name, values in self.fields.items()}
        return replace(self, offsets=self.offsets[chosen], fields=fields, grid=None)

    @property
    def finite(self) -> NDArray[np.bool_]:
        """(n,) True where all three coordinates are finite."""
        return finite_rows(self.offsets)
