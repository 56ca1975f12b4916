"""How far the points of a surface are from it, at most: flatness, roundness of a sphere, cylindricity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from surfsig.shapes.overlap import member_points

if TYPE_CHECKING:
    from surfsig.point_cloud import PointCloud
    from surfsig.shapes.surface import Surface


@dataclass(frozen=True)
class FormError:
    """The spread of the points of a fitted surface about it, in the points' unit: `Surface.form_error`."""

    peak_to_valley: float
    """The largest signed distance less the smallest: of a plane its flatness, of a cylinder its cylindricity,
    about the least-squares surface. It has the scanner's noise in it, and grows with the number of points."""
    std: float
    """Standard deviation of the distances, corrected for the fitted parameters."""
    lowest: float
    """The smallest signed distance: inside, or against a plane's normal."""
    highest: float
    """The largest signed distance."""


def form_error(surface: Surface, cloud: PointCloud) -> FormError:
    """Measure the members' distances; see `Surface.form_error`."""
    distances = surface.distances(member_points(surface, cloud) + surface.center)
    lowest, highest = float(distances.min()), float(distances.max())
    return FormError(highest - lowest, surface.deviation, lowest, highest)
