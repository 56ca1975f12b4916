"""Draws the errors of curvature against the size of the patch."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from error_report import METHODS, Error
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# The colour-blind can tell these apart.
COLORS = {
    "paraboloid": "#0072B2",
    "quadric": "#CC3311",
    "auto": "#000000",
    "jet2": "#E69F00",
    "jet4": "#009E73",
}
DRAWN = (("sphere", 29.15), ("cylinder", 29.15), ("torus", 29.15))
LIMITS = (7e-4, 1.0)
TICKS = (4, 6, 8, 11, 14, 17, 20, 24)

# Width, opacity and dashes of what lies on another line, and has its bias: auto takes one of two others, and
# a jet of degree 2 is nearly a paraboloid.
STYLES = {"auto": (6.0, 0.22, "-"), "jet2": (2.2, 1.0, ":")}

# A bias above this share of the spread is three standard errors or more in 1000 draws.
SIGNIFICANT = 0.1


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
    """Draw each method's root mean square error, and its bias where the draws show one."""
    for method, label in METHODS.items():
        own = sorted((e for e in errors if e.method == method), key=lambda e: e.ball)
        if not own:
            continue
        balls, color = [e.ball for e in own], COLORS[method]
        width, opacity, dashes = STYLES.get(method, (1.6, 1.0, "-"))
        rms = [e.rms for e in own]
        ax.plot(balls, rms, dashes, color=color, linewidth=width, alpha=opacity, label=label)
        if method not in STYLES:
            bias = [abs(e.bias) if abs(e.bias) > SIGNIFICANT * e.spread else np.nan for e in own]
            ax.plot(balls, bias, "--", color=color, linewidth=0.9, marker=".", markersize=4)
    ax.plot([], [], color="grey", label="rms error")
    ax.plot(
        [], [], "--", color="grey", linewidth=0.9, marker=".", markersize=4, label="bias, where significant"
    )
    ax.set(xscale="log", yscale="log", ylim=LIMITS)
    ax.set_xticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
    ax.minorticks_off()
    ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:g} %")
    ax.grid(alpha=0.3)
