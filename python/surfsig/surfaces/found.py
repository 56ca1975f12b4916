"""The surfaces of a scan: which points are whose, and what each surface is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.colors import GREY, distinct_colors
from surfsig.page import NOTEBOOK_POINTS, notebook_html, write_page
from surfsig.point_cloud import PointCloud
from surfsig.shapes.surface import Surface
from surfsig.surfaces.classes import PointClass, classify, deviations_of
from surfsig.surfaces.export import export
from surfsig.surfaces.pipe_runs import PipeRun, find_pipe_runs
from surfsig.surfaces.report import report_html
from surfsig.surfaces.table import table_columns, write_csv, write_excel
from surfsig.surfaces.wording import HEADER, summary_of, table_rows

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False, repr=False)
class Surfaces:
    """The surfaces of a scan, the one with most points first; a sequence of `Surface`."""

    cloud: PointCloud
    """The scan."""
    labels: NDArray[np.int32]
    """The number of each point's surface, (n,); -1 for none."""
    surfaces: list[Surface]
    """The surfaces, in the order of their numbers."""
    noise: float | None = None
    """The standard deviation of the points' distances that was asked for; None where it was estimated."""
    threads: int | None = None
    """Threads that were asked for."""

    def __len__(self) -> int:
        """Return the number of surfaces."""
        return len(self.surfaces)

    def __iter__(self) -> Iterator[Surface]:
        return iter(self.surfaces)

    def __getitem__(self, number: int) -> Surface:
        return self.surfaces[number]

    def __repr__(self) -> str:
        return f"Surfaces({self.summary()})"

    @cached_property
    def _classified(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        return classify(
            self.cloud,
            self.labels,
            self.surfaces,
            self._deviations,
            noise=self.noise,
            threads=self.threads,
        )

    @cached_property
    def _deviations(self) -> NDArray[np.float64]:
        return deviations_of(self.cloud, self.labels, self.surfaces)

    @property
    def classes(self) -> NDArray[np.uint8]:
        """What each point belongs to, (n,), a `PointClass` as a number; made when first asked for.

        A point of a surface has its kind. Another point is judged by the paraboloid through its 24 nearest
        points: an edge where that does not converge, or where they stray from it at least twice as far as
        noise does and farther than from a smooth surface; else a saddle where k1 and k2 differ from 0 to
        different sides, at their standard errors (99 %); else a free form.
        """
        return self._classified[0]

    @property
    def confidence(self) -> NDArray[np.float32]:
        """How sure the class is, (n,), from 0 to 1; made with `classes`.

        Of a surface's point, 1 / (1 + exp((t^2 - 9) / 2)) at t standard deviations from the surface (0.99 on
        it, 0.5 at three), times the probability that the surface's radii and angle are no chance (at their
        standard errors). Of an edge, the share of the mean square distance that noise does not explain. Of a
        saddle, the probability that both curvatures have their sign; of a free form, what that lacks to 1.
        """
        return self._classified[1]

    def deviations(self) -> NDArray[np.float64]:
        """Give how far each point is from its own surface: a scalar field of the scan.

        Returns
        -------
        numpy.ndarray
            Signed distances (n,), in the scan's unit: positive outside, or where a plane's normal points; NaN
            for points of no surface.
        """
        return self._deviations.copy()

    def summary(self) -> str:
        """Say in words how many surfaces of each kind there are.

        Returns
        -------
        str
            For instance "7 surfaces: 6 planes, 1 sphere; 98.2 % of 12,000 points".
        """
        if not self.surfaces:
            return f"no surface found: {self._why_none()}"
        return summary_of(self.surfaces, float((self.labels >= 0).mean()), len(self.cloud))

    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Describe the surfaces for people, in sensible digits.

        Returns
        -------
        The names of the columns, and a row for each surface: its number, kind, radius, the radius's 95 %
        interval, size, area, number of points, rms.
        """
        return HEADER, table_rows(self)

    @property
    def colors(self) -> NDArray[np.uint8]:
        """A colour for each point, (n, 3): red, green and blue of its surface, grey for none."""
        return np.concatenate([distinct_colors(len(self)), [GREY]]).astype(np.uint8)[self.labels]

    def columns(self) -> dict[str, NDArray[Any]]:
        """Name what is known of each point, as files call it.

        Returns
        -------
        (n,) arrays: surface (its number, -1 for none), surface_kind (its kind as a `PointClass`, 0 for none),
        point_class, confidence, deviation (signed distance from its surface, NaN for none).
        """
        in_surface = self.labels >= 0
        return {
            "surface": self.labels,
            "surface_kind": np.where(in_surface, self.classes, PointClass.UNKNOWN).astype(np.uint8),
            "point_class": self.classes,
            "confidence": self.confidence,
            "deviation": self._deviations.astype(np.float32),
        }

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
        from surfsig.convert.libraries import library

        pandas = library("pandas", "pandas", "pandas")
        return pandas.DataFrame(table_columns(self.surfaces))

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
            Runs of two segments or more, the longest first; lengths in the scan's unit.
        """
        return find_pipe_runs(self.surfaces)

    def export(self, path: str | Path) -> None:
        """Write the bounded surfaces as meshes: GLB, OBJ or DXF, by the path's ending.

        Each surface is an object of its own colour and named by number and kind ("3 cylinder"); in DXF a
        polyface mesh on a layer of that name. Coordinates are the scan's, in its unit, and not turned: where
        a program expects y upwards (as glTF says) or metres, it must be told. Needs trimesh, or of DXF ezdxf
        (`pip install surfsig[export]`). The file is whole or as it was before.

        Parameters
        ----------
        path
            Where to write; ends in .glb, .obj or .dxf.

        Raises
        ------
        InvalidInputError
            If the ending is another one, the library is not installed, or there is no surface.
        OSError
            If it cannot be written.
        """
        export(self, path)

    def write_report(self, path: str | Path, *, title: str = "Surfaces") -> None:
        """Write one HTML page: the points coloured by surface, in a view that turns, and a table with errors.

        Coloured by their distance from the surface, they have a scale that is symmetric about 0 and as wide
        as 95 % of the distances. The page needs no network. Of more than a million points a million are
        drawn.

        Parameters
        ----------
        path
            Where to write.
        title
            The page's.
        """
        write_page(path, self.to_html(title=title))

    def to_html(self, *, title: str = "Surfaces") -> str:
        """Make the page that `write_report` writes.

        Parameters
        ----------
        title
            The page's.

        Returns
        -------
        The document, which needs no network.
        """
        return report_html(self, title)

    def _repr_html_(self) -> str:
        """Show the page in a notebook, with at most 100,000 points."""
        return notebook_html(report_html(self, "Surfaces", NOTEBOOK_POINTS), "Surfaces")

    def _why_none(self) -> str:
        finite = int(self.cloud.finite.sum())
        if not len(self.cloud):
            return "there are no points"
        if not finite:
            return f"of {len(self.cloud):,} points none is finite"
        if finite < _surfsig.FEWEST_SURFACE_POINTS:
            return f"{finite:,} points are too few"
        return f"of {finite:,} points too few lie on any one surface, within the noise around them"
