"""The surfaces of a scan: which points are whose, and what each surface is."""

from __future__ import annotations

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
from surfsig.surfaces.report import report_html
from surfsig.surfaces.surface_list import SurfaceList
from surfsig.surfaces.wording import summary_of

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, eq=False, repr=False)
class Surfaces(SurfaceList[Surface]):
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
