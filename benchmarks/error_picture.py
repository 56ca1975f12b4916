"""Draws the errors of curvature against the size of the patch."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from error_report import METHODS, Error
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

# Of Okabe and Ito, which the colour-blind can tell apart.
COLORS = {
    "paraboloid": "#0072B2",
    "quadric": "#D55E00",
    "auto": "#000000",
    "jet2": "#56B4E9",
    "jet4": "#009E73",
}
DRAWN = (("sphere", 29.15), ("cylinder", 29.15), ("torus", 29.15))
LIMITS = (3e-4, 3.0)


def draw_picture(path: Path, errors: Iterable[Error]) -> None:
    """Draw a column of panels for each noise and a row for each of some surfaces, and save them."""
    listed = list(errors)
    noises = sorted({e.noise for e in listed})
    figure = Figure(figsize=(10, 8.5), layout="constrained")
    panels = figure.subplots(len(DRAWN), len(noises), sharex=True, sharey=True, squeeze=False)
    for row, (surface, radius) in zip(panels, DRAWN, strict=True):
        for ax, noise in zip(row, noises, strict=True):
            chosen = [e for e in listed if (e.surface, e.radius, e.noise) == (surface, radius, noise)]
            draw_panel(ax, chosen)
            ax.set_title(
                f"{chosen[0].quantity} of a {surface} of {radius:g} mm, noise {noise:g} mm", fontsize=9
            )
        row[0].set_ylabel("error / truth")
    for ax in panels[-1]:
        ax.set_xlabel("ball radius [mm], 500 points in each")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def draw_panel(ax: Axes, errors: list[Error]) -> None:
    """Draw each method's root mean square error, and its bias, which is dashed."""
    for method, label in METHODS.items():
        own = sorted((e for e in errors if e.method == method), key=lambda e: e.ball)
        if not own:
            continue
        balls = [e.ball for e in own]
        # What auto takes is one of two others: it is drawn beneath them, and wider.
        wide = {"linewidth": 5, "alpha": 0.25, "zorder": 1} if method == "auto" else {"linewidth": 1.6}
        ax.plot(balls, [e.rms for e in own], color=COLORS[method], label=label, **wide)
        if method != "auto":
            ax.plot(balls, np.abs([e.bias for e in own]), "--", color=COLORS[method], linewidth=0.9)
    ax.plot([], [], color="grey", label="rms error")
    ax.plot([], [], "--", color="grey", linewidth=0.9, label="bias alone")
    ax.set(xscale="log", yscale="log", ylim=LIMITS)
    ax.set_xticks([4, 6, 8, 11, 14, 20], labels=["4", "6", "8", "11", "14", "20"])
    ax.minorticks_off()
    ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=None))
    ax.grid(alpha=0.3)
