"""The paper's figures 1 to 7, drawn from the simulated scans."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..simulate import paper_acquisition
from ..simulate.acquisitions import Acquisition
from ..simulate.poses import Array
from .canvas import BLUE, GREEN, GREY, limit, new_figure, sample, space
from .comparison import REPRODUCTION
from .printed import SIDE, STEP, TABLE_III
from .scans import PAPER, fit_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Draw of the scans that are shown.
SEED = 0


def paper_figures() -> Iterator[tuple[str, str, Figure]]:
    """Draw figures 1 to 7 one after the other.

    Yields
    ------
    name, caption, figure
        The name is a file's, without its ending.
    """
    scans = {number: paper_acquisition(number, SEED) for number in (5, 8, 12, 14)}
    surfaces = {number: fit_rows(scan, [PAPER])[0][:6] for number, scan in scans.items()}
    yield "figure1", "Figure 1: a paraboloid, eq. (5), on the frame's grid.", _paraboloid()
    caption = (
        "Figure 2: scan of two spheres of different radius (acquisition 14; sphere 6 stands beside). Green: "
        "the patch, inside a ball of diameter D = 40 mm. As the paper has it, heights run along negative z."
    )
    yield "figure2", caption, _cloud(scans[14], azimuth=-70.0)
    caption = "Figure 3: the paraboloid that approximates the green points of figure 2, on the sampling grid."
    yield "figure3", caption, _fit(scans[14], surfaces[14])
    caption = (
        f"Figure 4: signatures c = pinv(F) alpha ({len(REPRODUCTION.frame):,} numbers) of (a) a plane, "
        "acquisition 5, and (b) a sphere, acquisition 12."
    )
    yield "figure4", caption, _signatures(surfaces[5], surfaces[12])
    yield "figure5", "Figure 5: acquisition 5 (tilted plane 2) and its patch.", _cloud(scans[5])
    yield "figure6", "Figure 6: acquisition 8 (cylinder 1) and its patch.", _cloud(scans[8], azimuth=-35.0)
    caption = "Figure 7: the scan of spheres 5 (green) and 6 (acquisitions 14 and 15)."
    yield "figure7", caption, _two_spheres(scans[14])


def _grid() -> tuple[Array, Array]:
    """Make the paper's 11 x 11 grid, metres."""
    steps = np.arange(-SIDE / 2, SIDE / 2 + STEP / 2, STEP)
    x, y = np.meshgrid(steps, steps)
    return x, y


def _heights(surface: Array, x: Array, y: Array) -> Array:
    a, b, c, d, e, f = surface
    return np.asarray(a * x**2 + b * y**2 + c * x + d * y + e * x * y + f)


def _paraboloid() -> Figure:
    x, y = _grid()
    # A hyperbolic one of the vocabulary: a > 0 > b.
    z = _heights(np.array([30.0, -20.0, 0.0, 0.0, 10.0, 0.0]), x, y)
    figure = new_figure(5.4, 4.2)
    axes = space(figure, azimuth=-50.0)
    axes.plot_surface(1e3 * x, 1e3 * y, 1e3 * z, cmap="viridis", edgecolor="white", linewidth=0.4)
    axes.set_box_aspect((1, 1, 0.6), zoom=0.95)
    axes.set_title("z = 30 x² − 20 y² + 10 xy  (metres)", fontsize=10)
    return figure


def _in_patch(scan: Acquisition) -> npt.NDArray[np.bool_]:
    return np.asarray(np.linalg.norm(scan.cloud.points - scan.center, axis=1) <= SIDE / 2)


def _cloud(scan: Acquisition, azimuth: float = -60.0) -> Figure:
    figure = new_figure(6.2, 4.6)
    axes = space(figure, azimuth=azimuth)
    points, inside = 1e3 * scan.cloud.points, _in_patch(scan)
    for part, colour, size in ((points[~inside], BLUE, 0.5), (points[inside], GREEN, 1.2)):
        axes.scatter(*sample(part).T, s=size, c=colour, linewidths=0, depthshade=False)
    limit(axes, points)
    axes.set_title(f"acquisition {scan.number}: {TABLE_III[scan.number - 1].name.lower()}", fontsize=10)
    return figure


def _fit(scan: Acquisition, surface: Array) -> Figure:
    x, y = _grid()
    z = _heights(surface, x, y)
    figure = new_figure(5.6, 4.6)
    axes = space(figure, elevation=18.0)
    shown = [1e3 * (values + middle) for values, middle in zip((x, y, z), scan.center, strict=True)]
    points = 1e3 * scan.cloud.points[_in_patch(scan)]
    axes.plot_surface(*shown, color=BLUE, alpha=0.25, linewidth=0)
    axes.plot_wireframe(*shown, color=BLUE, linewidth=0.6)
    axes.scatter(*points.T, s=2, c=GREEN, linewidths=0, depthshade=False)
    limit(axes, np.vstack([points, np.stack(shown, axis=-1).reshape(-1, 3)]))
    a, b = surface[:2]
    axes.set_title(
        f"a = {a:.1f}, b = {b:.1f} per metre; 1/2r = {0.5 / TABLE_III[13].radius:.1f}", fontsize=10
    )
    return figure


def _signatures(plane: Array, sphere: Array) -> Figure:
    figure = new_figure(7.6, 4.2)
    scale = np.array([SIDE, SIDE, 1.0, 1.0, SIDE, 1.0 / SIDE])
    panels = figure.subplots(2, 1, sharex=True)
    for axes, surface, name in zip(panels, (plane, sphere), ("(a) plane", "(b) sphere"), strict=True):
        axes.plot(REPRODUCTION.frame.coefficients(surface * scale), color=BLUE, linewidth=0.5)
        axes.axhline(0.0, color=GREY, linewidth=0.5)
        axes.set_ylabel("weight")
        axes.set_title(name, fontsize=10, loc="left")
        axes.ticklabel_format(axis="y", scilimits=(-2, 2))
        axes.margins(x=0.0)
    panels[1].set_xlabel("atom of the frame")
    return figure


def _two_spheres(scan: Acquisition) -> Figure:
    figure = new_figure(6.2, 4.6)
    axes = space(figure, azimuth=-100.0)
    points, surface = 1e3 * scan.cloud.points, scan.cloud.fields["surface"]
    # In acquisition 14's scene: sphere 5, sphere 6, the table.
    for number, colour, size in ((2, GREY, 0.3), (1, BLUE, 1.0), (0, GREEN, 1.0)):
        axes.scatter(*sample(points[surface == number]).T, s=size, c=colour, linewidths=0, depthshade=False)
    limit(axes, points)
    axes.set_title("sphere 5 (r = 14.15 mm) and sphere 6 (r = 20.5 mm)", fontsize=10)
    return figure
