"""A sequence of surfaces with its table: what surfaces of one scan and of a cloud in tiles share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from surfsig.convert.libraries import library
from surfsig.shapes.surface import Surface
from surfsig.surfaces.pipe_runs import PipeRun, find_pipe_runs
from surfsig.surfaces.table import table_columns, write_csv, write_excel
from surfsig.surfaces.wording import HEADER, table_rows

if TYPE_CHECKING:
    import pandas as pd

SurfaceType = TypeVar("SurfaceType", bound=Surface)


class SurfaceList(Generic[SurfaceType]):
    """Surfaces in the order of their numbers."""

    surfaces: list[SurfaceType]

    def __len__(self) -> int:
        """Return the number of surfaces."""
        return len(self.surfaces)

    def __iter__(self) -> Iterator[SurfaceType]:
        return iter(self.surfaces)

    def __getitem__(self, number: int) -> SurfaceType:
        return self.surfaces[number]

    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Describe the surfaces for people, in sensible digits.

        Returns
        -------
        The names of the columns, and a row for each surface: its number, kind, radius, the radius's 95 %
        interval, size, area, number of points, rms.
        """
        return HEADER, table_rows(self.surfaces)

    def to_pandas(self) -> pd.DataFrame:
        """Give the surfaces as a pandas DataFrame, a row each; the index has their numbers.

        Returns
        -------
        pandas.DataFrame
            kind, radius, radius_std, radius_low, radius_high, major_radius, half_angle, center_x, ...,
            axis_x, ..., length, width, arc, area, count, rms.

        Raises
        ------
        InvalidInputError
            If pandas is not installed.
        """
        return library("pandas", "pandas", "pandas").DataFrame(table_columns(self.surfaces))

    def write_csv(self, path: str | Path) -> None:
        """Write the table of `to_pandas` as text with commas, the surfaces' numbers first.

        A value that a kind does not have is left empty. The file is whole or as it was before.

        Parameters
        ----------
        path
            Where to write.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        write_csv(self.surfaces, path)

    def write_excel(self, path: str | Path) -> None:
        """Write the table of `to_pandas` as an Excel workbook (.xlsx), the surfaces' numbers first.

        Needs XlsxWriter (`pip install surfsig[excel]`). A value that a kind does not have is an empty cell.
        The file is whole or as it was before.

        Parameters
        ----------
        path
            Where to write.

        Raises
        ------
        InvalidInputError
            If XlsxWriter is not installed.
        OSError
            If it cannot be written.
        """
        write_excel(self.surfaces, path)

    def pipe_runs(self) -> list[PipeRun]:
        """Join the pipes: cylinders of equal radius, end to end.

        Two ends are joined by a torus of the same radius whose circle touches both axes (an elbow), where
        the axes meet near both ends (a corner: an elbow that is hidden or too short to be found), or where
        two pieces lie in line. Radii are equal if they differ insignificantly (99 %) or by less than 3 %.
        Near is within four diameters, which is farther than most elbows and flanges reach; a pipe that goes
        on past the joint, as at a tee, is not joined there.

        Returns
        -------
        list of PipeRun
            Runs of two segments or more, the longest first; lengths in the points' unit.
        """
        return find_pipe_runs(self.surfaces)
