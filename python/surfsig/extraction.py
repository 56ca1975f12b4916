"""What an extraction gives: curvature at every place, and signatures when asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig._surfsig import Frame
from surfsig.arguments import progress_callback
from surfsig.defaults import SIGNATURE_BLOCK, Axes
from surfsig.errors import InvalidInputError
from surfsig.extraction_report import report_html
from surfsig.flat_atom import length_asked_for
from surfsig.page import NOTEBOOK_POINTS, notebook_html, write_page
from surfsig.places import place_numbers
from surfsig.point_cloud import PointCloud
from surfsig.progress import ProgressCallback
from surfsig.signature_similarity import SIGNATURE, similarity
from surfsig.status import FitUsed, Status, count_statuses

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

FloatArray = NDArray[np.float32]


_NO_COLUMNS = {"radius", "axes", "oriented", "points", "indices", "coefficients"}
"""Attributes of an extraction that are no columns of files and tables."""
_PREFIXES = {"normals": "n", "directions": "direction_"}
"""Before x, y and z in the names of vectors' columns."""
_DERIVED_AFTER = {"k2": ("gaussian_curvature", "mean_curvature"), "k2_std": ("noise",)}
"""Columns that are made of others, each after one of them."""


@dataclass(frozen=True, eq=False, repr=False)
class Extraction:
    """Curvature at m places: one struct of arrays, with a status for each place.

    Lengths are in the cloud's own unit, curvatures per that unit. NaN stands where there is no value.
    """

    radius: float | FloatArray
    """Radius of the balls; with "auto" each place's own, (m,); with `neighbors` too: the distance to the
    farthest point that counts, or the radius asked for where there are no more points within it."""
    axes: Axes
    """Axes in which the paraboloids were fitted."""
    oriented: bool
    """Whether a known viewpoint, or normals that came with the cloud, oriented the normals; otherwise
    their side, and with it the sign of curvature, is a convention (z, else y, else x of the normal is
    positive)."""
    points: NDArray[np.floating]
    """The places, (m, 3)."""
    indices: NDArray[np.int64] | None
    """Their numbers in the cloud, (m,); None for places of their own."""
    k1: FloatArray
    """Larger principal curvature by value, (m,); a bump seen from the sensor is positive."""
    k2: FloatArray
    """Smaller principal curvature by value, (m,)."""
    normals: FloatArray
    """Unit normals, (m, 3), towards the sensor."""
    directions: FloatArray
    """Unit tangents along k1, (m, 3); their sign means nothing."""
    mean_curvature_std: FloatArray
    """Standard error of the mean curvature, (m,), from the actual normal equations and the residual; NaN
    in the sensor's axes, and where no more than six points are in the ball."""
    k1_std: FloatArray
    """Standard error of k1, (m,); where k1 and k2 do not differ significantly, they are biased apart by
    0.7 to 0.8 of it, by nature."""
    k2_std: FloatArray
    """Standard error of k2, (m,)."""
    residual: FloatArray
    """Root mean square of the points' heights above the fit, (m,)."""
    condition: FloatArray
    """At least this factor is on the standard error of the worst determined coefficient, (m,)."""
    count: NDArray[np.uint32]
    """Points in the ball, (m,), the place itself included where it is a point of the cloud."""
    status: NDArray[np.uint8]
    """`Status` as a number, (m,)."""
    linearity: FloatArray
    """(l1 - l2) / l1 of the eigenvalues of the ball's covariance, (m,)."""
    planarity: FloatArray
    """(l2 - l3) / l1, (m,)."""
    scattering: FloatArray
    """l3 / l1, (m,)."""
    fit_used: NDArray[np.uint8] | None = field(default=None)
    """Whose curvature each place has, (m,), a `FitUsed` as a number; None where only paraboloids were
    fitted."""
    coefficients: FloatArray | None = field(default=None)
    """In the sensor's axes: a, b, c, d, e, f of eq. (5), (m, 6), about each place, with heights that
    grow away from the sensor."""

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.k1)

    def __repr__(self) -> str:
        """Say what was extracted, and how it went."""
        counts = ", ".join(f"{name}: {n}" for name, n in self.status_counts().items())
        radius = f"{self.radius:g}" if isinstance(self.radius, float) else "its own"
        return f"Extraction({len(self)} places, radius={radius}, axes={self.axes!r}, {counts})"

    @property
    def gaussian_curvature(self) -> FloatArray:
        """K = k1 k2, (m,), per unit squared: table I."""
        return self.k1 * self.k2

    @property
    def mean_curvature(self) -> FloatArray:
        """H = (k1 + k2) / 2, (m,), per unit: table I."""
        return 0.5 * (self.k1 + self.k2)

    @property
    def noise(self) -> FloatArray:
        """Standard deviation of a point's distance to the surface, (m,), from the residual and the count."""
        count = self.count.astype(np.float32)
        unknowns = 6 if self.fit_used is None else np.where(self.fit_used == FitUsed.QUADRIC, 9, 6)
        with np.errstate(invalid="ignore", divide="ignore"):
            freedom = np.where(count > unknowns, count - unknowns, np.nan)
            return np.asarray(self.residual * np.sqrt(count / freedom), np.float32)

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Where all values are there and mean what they say, (m,): `Status.OK` and `Status.ONE_SIDED`."""
        return np.isin(self.status, (Status.OK, Status.ONE_SIDED))

    def columns(self) -> dict[str, NDArray[Any]]:
        """Name all values of the places, as files and tables call them.

        Returns
        -------
        (m,) arrays: k1, k2, gaussian_curvature, mean_curvature, nx, ny, nz, direction_x, direction_y,
        direction_z, mean_curvature_std, k1_std, k2_std, noise, residual, condition, count, status, linearity,
        planarity, scattering; and radius where each place has its own, and fit_used where there is a choice.
        """
        columns: dict[str, NDArray[Any]] = {}
        for column in fields(self):
            name = column.name
            values = getattr(self, name)
            if name in _PREFIXES:
                columns |= {_PREFIXES[name] + axis: values[:, i] for i, axis in enumerate("xyz")}
            elif name not in _NO_COLUMNS and values is not None:
                columns[name] = values
            for derived in _DERIVED_AFTER.get(name, ()):
                columns[derived] = getattr(self, derived)
            if name == "directions" and not isinstance(self.radius, float):
                columns["radius"] = self.radius
        return columns

    def to_pandas(self) -> pd.DataFrame:
        """Give x, y, z and `columns` as a pandas DataFrame, whose index has the points' numbers (`indices`).

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        InvalidInputError
            If pandas is not installed.
        """
        from surfsig.convert.pandas import data_frame

        return data_frame(PointCloud(self.points), self.columns(), self.indices)

    def to_arrow(self) -> pa.Table:
        """Give x, y, z and `columns` as a PyArrow table, with radius and axes in its metadata.

        Returns
        -------
        pyarrow.Table

        Raises
        ------
        InvalidInputError
            If PyArrow is not installed.
        """
        from surfsig.convert.arrow import table

        fixed = {"radius": repr(self.radius)} if isinstance(self.radius, float) else {}
        notes = {**fixed, "axes": str(self.axes)}
        return table(PointCloud(self.points), self.columns(), notes)

    def to_html(self, *, title: str = "Curvature") -> str:
        """Make a page that needs no network: the places in a view that turns, coloured by curvature.

        Parameters
        ----------
        title
            The page's.

        Returns
        -------
        The document, which needs no network.
        """
        return report_html(self, title)

    def write_report(
        self, path: str | Path, *, title: str = "Curvature", columns: Mapping[str, ArrayLike] | None = None
    ) -> None:
        """Write the page of `to_html`. Of more than a million places a million are drawn.

        Parameters
        ----------
        path
            Where to write.
        title
            The page's.
        columns
            Further numbers of each place, (m,), by name, such as zeta.
        """
        write_page(path, report_html(self, title, columns))

    def _repr_html_(self) -> str:
        """Show the page in a notebook, with at most 100,000 places."""
        return notebook_html(report_html(self, "Curvature", most_points=NOTEBOOK_POINTS), "Curvature")

    def status_counts(self) -> dict[str, int]:
        """Count the places of each status.

        Returns
        -------
        The counts, by the status's name in lower case; none that has no place.
        """
        return count_statuses(self.status)

    @overload
    def signatures(
        self,
        at: ArrayLike | None = ...,
        *,
        frame: Frame | None = ...,
        flat_atom: float | Literal["auto"] | None = ...,
        return_status: Literal[False] = ...,
    ) -> FloatArray: ...
    @overload
    def signatures(
        self,
        at: ArrayLike | None = ...,
        *,
        frame: Frame | None = ...,
        flat_atom: float | Literal["auto"] | None = ...,
        return_status: Literal[True],
    ) -> tuple[FloatArray, NDArray[np.uint8]]: ...
    def signatures(
        self,
        at: ArrayLike | None = None,
        *,
        frame: Frame | None = None,
        flat_atom: float | Literal["auto"] | None = None,
        return_status: bool = False,
    ) -> FloatArray | tuple[FloatArray, NDArray[np.uint8]]:
        """Make signatures: the 242 numbers w, which have the lengths and dot products of eq. (2)'s c.

        Parameters
        ----------
        at
            Which places, as numbers (k,) or a mask (m,); all of them by default. For millions, see
            `iter_signatures`.
        frame
            The vocabulary; `Frame.default()` by default.
        flat_atom
            Length of one more coordinate, the same for all, appended as the last column. A few times
            the length of a signature of pure noise, it tells "flat within its error" from "slightly
            curved". "auto" takes `flat_atom_length` of this extraction, all its places; what is compared
            with another extraction's signatures needs that of both.
        return_status
            Whether to return the places' statuses too, (k,) uint8, `Status.OUTSIDE_VOCABULARY` among
            them.

        Returns
        -------
        (k, 242) float32, or (k, 243) with a flat atom. Rows are NaN where there is no signature.

        Raises
        ------
        InvalidInputError
            If `at` is no set of places, `flat_atom` is neither "auto" nor a finite number above 0, or as
            `flat_atom_length`.
        """
        places = place_numbers(at, len(self))
        frame = Frame.default() if frame is None else frame
        length = length_asked_for(flat_atom, self, frame)
        rows, status = self._signatures(places, frame)
        if length is not None:
            flat = np.full((len(rows), 1), length, np.float32)
            flat[np.isnan(rows[:, 0])] = np.nan
            rows = np.hstack([rows, flat])
        if not return_status:
            return rows
        # The fit's own status says more, but for places that it left in order.
        fitted = self.status[places]
        return rows, np.where(status == Status.OK, fitted, status).astype(np.uint8)

    def _signatures(self, places: NDArray[np.int64], frame: Frame) -> tuple[FloatArray, NDArray[np.uint8]]:
        side, curvatures, surfaces = 1.0, (self.k1[places], self.k2[places]), self.coefficients
        surfaces = None if surfaces is None else surfaces[places]
        if isinstance(self.radius, float):
            side = 2 * self.radius
        else:
            # In patch units a side is 1, so that each place may have its own.
            sides = 2 * self.radius[places]
            curvatures = (curvatures[0] * sides, curvatures[1] * sides)
            if surfaces is not None:
                one = np.ones_like(sides)
                with np.errstate(divide="ignore", invalid="ignore"):
                    surfaces = surfaces * np.column_stack([sides, sides, one, one, sides, 1 / sides])
        if surfaces is None:
            return frame.signatures_of_curvatures(*curvatures, side=side)
        return frame.signatures_of_surfaces(surfaces, side=side)

    def iter_signatures(
        self,
        *,
        frame: Frame | None = None,
        flat_atom: float | Literal["auto"] | None = None,
        block: int = SIGNATURE_BLOCK,
    ) -> Iterator[tuple[slice, FloatArray, NDArray[np.uint8]]]:
        """Make the signatures of all places a block at a time, in order, for more than memory holds.

        Parameters
        ----------
        frame, flat_atom
            As in `signatures`.
        block
            Rows at a time.

        Yields
        ------
        Which places, their signatures (k, 242) or (k, 243), and their statuses (k,).

        Raises
        ------
        InvalidInputError
            If `block` is below 1, or as `signatures`.
        """
        if block < 1:
            raise InvalidInputError(f"block must be 1 or more, not {block}")
        frame = Frame.default() if frame is None else frame
        length = length_asked_for(flat_atom, self, frame)
        for start in range(0, len(self), block):
            places = slice(start, min(start + block, len(self)))
            rows, status = self.signatures(
                np.arange(places.start, places.stop), frame=frame, flat_atom=length, return_status=True
            )
            yield places, rows, status

    def similarity_to(
        self,
        signature: ArrayLike,
        *,
        frame: Frame | None = None,
        progress: ProgressCallback | None = None,
    ) -> FloatArray:
        """Compare every place with one signature, to see where else its surface is.

        Parameters
        ----------
        signature
            (242,), or (243,) with a flat atom, which the places then get too. It must have been made
            at the same radius, in the same axes, and with the same frame.
        frame
            The vocabulary; `Frame.default()` by default.
        progress
            Called with the number of places compared, and of all.

        Returns
        -------
        zeta of eq. (12), (m,); of the more similar side where no viewpoint is known, in the surface's
        axes. NaN where there is no signature.

        Raises
        ------
        InvalidInputError
            If the signature has another shape.
        """
        tell = progress_callback(progress)
        reference = np.asarray(signature)
        if reference.shape not in ((SIGNATURE,), (SIGNATURE + 1,)):
            raise InvalidInputError(f"a signature has the shape (242,) or (243,), not {reference.shape}")
        flat_atom = float(reference[SIGNATURE]) if len(reference) > SIGNATURE else None
        either_side = not self.oriented and self.axes == "surface"
        zeta = np.empty(len(self), np.float32)
        for places, rows, _ in self.iter_signatures(frame=frame, flat_atom=flat_atom):
            zeta[places] = similarity(rows, reference, either_side=either_side)
            if tell is not None:
                tell(places.stop, len(self))
        return zeta
