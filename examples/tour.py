"""Run the code of docs/tour.md, and draw its pictures from what it leaves: `make tour`.

python examples/tour.py [FOLDER_OF_PICTURES]
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from surfsig import plot

ROOT = Path(__file__).parents[1]
TOUR = ROOT / "docs" / "tour.md"

BLOCK = re.compile(r"```python\n(?P<code>.*?)```\n(?:\n```text\n(?P<output>.*?)```\n)?", re.DOTALL)
"""Code, and what the tour says that it prints."""

VIEW = plot.view_axes(-62.0, -48.0) * np.array([[-1.0], [-1.0], [1.0]])
"""From the scanner's side, a little from the front; the part's heights run along negative z."""

COLOURS = 160
"""Of a picture: few enough for 150 kB."""

Values = dict[str, Any]


def code_blocks() -> list[tuple[str, str]]:
    """Give the tour's code blocks in order, each with the output that the tour quotes."""
    return [(m["code"], m["output"] or "") for m in BLOCK.finditer(TOUR.read_text(encoding="utf-8"))]


def run(code: str, values: Values) -> str:
    """Run one block with the values of those before it, and return what it printed."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(code, str(TOUR), "exec"), values)
    return printed.getvalue()


def draw(
    ax: Axes,
    points: ArrayLike,
    values: ArrayLike,
    limits: tuple[float, float],
    *,
    normals: ArrayLike | None = None,
    colormap: str = "coolwarm",
    label: str = "",
    size: float = 0.4,
    view: ArrayLike = VIEW,
) -> None:
    """Draw points as `plot.draw_points` does; with a label, beside a colour bar."""
    shown = plot.draw_points(
        ax, points, values, normals=normals, limits=limits, colormap=colormap, size=size, view=view
    )
    if label:
        ax.figure.colorbar(shown, ax=ax, shrink=0.7, label=label)


def panels(count: int = 1) -> tuple[Figure, list[Axes]]:
    """Make a figure of panels side by side."""
    figure, axes = plt.subplots(1, count, figsize=(7.0, 4.2 if count == 1 else 3.0), layout="constrained")
    return figure, list(np.atleast_1d(axes))


def read(v: Values) -> Figure:
    """Draw heights."""
    figure, (ax,) = panels()
    scan = v["scan"]
    draw(ax, scan.points, -1000 * scan.points[:, 2], (-15, 20), colormap="viridis", label="height [mm]")
    return figure


def clean(v: Values) -> Figure:
    """Draw what stays grey, what strays red."""
    figure, (ax,) = panels()
    scan, kept = v["scan"], v["kept"]
    stays = np.isin(_rows(scan.points), _rows(kept.points))
    draw(ax, scan.points, np.where(stays, np.nan, 1.0), (-1, 1), size=0.6)
    return figure


def curvature(v: Values) -> Figure:
    """Draw mean curvature."""
    return _of_extraction(v, v["s"].mean_curvature, (-150, 150), label="H [1/m]")


def errors(v: Values) -> Figure:
    """Draw what is flat grey and what is curved red, where a paraboloid fits."""
    s = v["s"]
    figure, (ax,) = panels()
    draw(
        ax,
        s.points[v["fits"]],
        np.where(v["flat"], 0.0, 1.0)[v["fits"]],
        (-1, 1),
        normals=s.normals[v["fits"]],
    )
    return figure


def neighbors(v: Values) -> Figure:
    """Draw each place's own radius."""
    return _of_extraction(v, 1000 * v["nearest"].radius, (2.5, 4.5), colormap="viridis", label="radius [mm]")


def robust(v: Values) -> Figure:
    """Draw the dome's error, fitted both ways; without the outliers themselves, which would hide it."""
    figure, axes = panels(2)
    good = v["dome"] & (v["bad"].fields["outlier"] == 0)
    for ax, name in zip(axes, ("plain", "robust"), strict=True):
        found = v[name]
        draw(
            ax,
            found.points[good],
            found.mean_curvature[good] - 1 / 0.03,
            (-15, 15),
            normals=found.normals[good],
            size=2.0,
        )
        ax.set_title(f"{name}: H - 1 / 30 mm, to 15 per metre")
    return figure


def similarity(v: Values) -> Figure:
    """Draw zeta, and the place that all others are compared with."""
    figure = _of_extraction(v, v["zeta"], (0, 1), colormap="viridis", label="zeta, eq. (12)")
    points = v["s"].points
    place = (points[v["top"]] - points.mean(axis=0)) @ VIEW.T
    figure.axes[0].plot(*place[:2], "+", color="white", markersize=12, markeredgewidth=2)
    return figure


def pandas(v: Values) -> Figure:
    """Draw the selected places in colour."""
    k1 = np.full(len(v["s"]), np.nan)
    k1[v["tight"].index] = v["tight"].k1
    return _of_extraction(v, k1, (-300, 300), label="k1 [1/m]")


def write(v: Values) -> Figure:
    """Draw what an E57 file brings back."""
    figure, (ax,) = panels()
    back = v["e57"]
    normals = np.column_stack([back.fields[name] for name in ("nx", "ny", "nz")])
    gaussian = back.fields["gaussian_curvature"]
    draw(ax, back.points, gaussian, (-8000, 8000), normals=normals, label="K [1/m²]")
    return figure


def cpp(v: Values) -> Figure:
    """Draw the three patches of examples/cpp, each about its own middle."""
    figure, axes = panels(3)
    found = v["found"]
    for i, (ax, name) in enumerate(zip(axes, ("sphere", "sphere", "saddle"), strict=True)):
        patch = slice(3600 * i, 3600 * (i + 1))
        view = plot.view_axes(-60.0, 30.0)
        draw(
            ax,
            found.points[patch],
            found.k2[patch],
            (-15, 15),
            normals=found.normals[patch],
            size=3,
            view=view,
        )
        ax.set_title(f"{name}: k2 = {found.k2[v['places'][i]]:.2f} / m")
    return figure


def paper(v: Values) -> Figure:
    """Draw two matrices of zeta."""
    figure, axes = panels(2)
    titles = ("the paper's way, stated poses", "own axes, random poses")
    for ax, zeta, title in zip(axes, (v["printed"], v["ours"]), titles, strict=True):
        shown = ax.imshow(zeta, vmin=0, vmax=1, extent=(0.5, 20.5, 20.5, 0.5))
        ax.set_title(title, fontsize=10)
        ax.set_xlabel("acquisition")
    figure.colorbar(shown, ax=axes, shrink=0.8, label="zeta")
    return figure


STEPS: tuple[Callable[[Values], Figure], ...] = (
    read, clean, curvature, errors, neighbors, robust, similarity, pandas, write, cpp, paper,
)  # fmt: skip
"""What draws the picture of each of the tour's steps, in their order."""


def _of_extraction(v: Values, values: ArrayLike, limits: tuple[float, float], **style: Any) -> Figure:
    figure, (ax,) = panels()
    draw(ax, v["s"].points, values, limits, normals=v["s"].normals, **style)
    return figure


def _rows(points: np.ndarray) -> np.ndarray:
    """Make each row one value, to compare whole points."""
    return np.ascontiguousarray(points).view(np.dtype((np.void, points.dtype.itemsize * 3)))[:, 0]


def save(figure: Figure, path: Path) -> None:
    """Write a small PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=120)
    plt.close(figure)
    Image.open(buffer).convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE).save(path, optimize=True)


def main(folder: Path) -> None:
    """Run all blocks in a scratch folder, print what they print, and draw."""
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    values: Values = {}
    home = Path.cwd()
    with tempfile.TemporaryDirectory() as scratch:
        os.chdir(scratch)
        try:
            for number, ((code, _), step) in enumerate(zip(code_blocks(), STEPS, strict=True), start=1):
                print(f"{number}.\n{run(code, values)}", end="")
                save(step(values), folder / f"tour_{number}_{step.__name__}.png")
        finally:
            os.chdir(home)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures")
