"""Figures of what the reproduction found, beyond the paper's own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from .._surfsig import GOOD, OPTIMAL
from ..curvature import extract
from ..plot import draw_points, view_axes
from ..signature_similarity import similarity
from ..simulate import paper_acquisition
from ..simulate.poses import Array
from .canvas import BLUE, GREEN, GREY, ORANGE, RED, new_figure
from .comparison import OF_NEGATIVES, OF_POSITIVES, REPRODUCTION, VOCABULARIES, decide, zeta_of
from .printed import SIDE, SIMILARITIES, TABLE_III
from .random_poses import KINDS, LIBRARY, Way, self_similarity
from .report import zeta_with_plane
from .reproduction import Reproduction
from .scans import OWN, OWN_HALF, PAPER

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The default frame, eq. (4) with the power 3/2: what the library uses where nothing else is asked for.
DEFAULT = VOCABULARIES[3]
WAY_COLOURS = (ORANGE, BLUE, GREEN)


def charts(result: Reproduction) -> Iterator[tuple[str, str, Figure]]:
    """Draw what was found; as `paper_figures`: name, caption, figure, one after the other."""
    counts = decide(result.zeta[REPRODUCTION]["stated"])
    middle = counts.median_draw
    caption = (
        "Left: a simulated scan, coloured by the mean curvature measured at each point. Right: zeta of "
        f"tables IV, V and VI, printed and ours (median of {result.seeds} noise draws); "
        f"{counts.positives[middle]} of {OF_POSITIVES} positive and {counts.negatives[middle]} of "
        f"{OF_NEGATIVES} negative decisions are repeated. Framed: the decision differs."
    )
    yield "overview", caption, _overview(result)
    caption = (
        "How the decisions depend on the poses: median and range of the repeated decisions, where the poses "
        "miss the stated ones by multiples of 3 degrees, 5 mm, and 2 mm of the patch's centre."
    )
    yield "decisions_by_pose", caption, _sweep(result)
    caption = (
        "Zeta of a plane with cylinders and spheres, without noise, by the paraboloid's curvature; crosses: "
        "printed values (table IV) at 1/r; dots: ours at the fitted curvature."
    )
    yield "flat_limit", caption, _flat_limit(result)
    caption = (
        "Random poses: share of pairs of draws in which an acquisition has zeta of 0.9 or above with itself. "
        "The 14.15 mm sphere (14, 19) lies beyond the vocabulary for a ball of 20 mm."
    )
    yield "random_self", caption, _self(result)
    caption = (
        "Random poses: what each object is taken for, by the highest zeta (0.5 or above) with one scan of "
        "each object in its stated pose. Rows: shown; columns: recognised; shares of draws."
    )
    yield "random_confusion", caption, _confusion(result)
    caption = (
        "How zeta falls with the ratio of radii: pairs of spheres in random poses, median and 5-95 %. Lines: "
        "spheres without noise or bias, against one of the radius named."
    )
    yield "radius_ratio", caption, _ratio(result)
    caption = (
        "The vocabulary's end: length of a sphere's signature by its fitted mean curvature, in the surface's "
        "axes. Above 1 (crosses) the library gives the status OUTSIDE_VOCABULARY and no signature."
    )
    yield "vocabulary_end", caption, _vocabulary_end(result)


def _overview(result: Reproduction) -> Figure:
    figure = new_figure(12.6, 4.7)
    parts: Any = figure.subfigures(1, 2, width_ratios=(1.0, 2.15))
    left, right = parts
    scan = paper_acquisition(14, 0)
    own = extract(scan.cloud, OWN_HALF.radius)
    # Half a turn about x: heights upwards.
    upright = np.array([1.0, -1.0, -1.0])
    axes = left.subplots()
    points = draw_points(
        axes,
        1e3 * scan.cloud.points * upright,
        own.mean_curvature,
        normals=own.normals * upright,
        limits=(-20.0, 90.0),
        colormap="turbo",
        view=view_axes(-72.0, 40.0),
        size=1.6,
    )
    bar = left.colorbar(points, ax=axes, orientation="horizontal", shrink=0.75, pad=0.02)
    bar.set_label("mean curvature, per metre")
    counts = decide(result.zeta[REPRODUCTION]["stated"])
    middle = counts.median_draw
    headline = (
        f"The paper's decisions, repeated:\n{counts.positives[middle]} of {OF_POSITIVES} similar, "
        f"{counts.negatives[middle]} of {OF_NEGATIVES} dissimilar"
    )
    left.text(0.5, 0.96, headline, ha="center", va="top", fontsize=13)
    left.text(0.5, 0.8, "one simulated scan: spheres 5 and 6", ha="center", va="top", fontsize=10)
    strips = right.subplots(len(SIMILARITIES), 1)
    for axes, table in zip(strips, SIMILARITIES, strict=True):
        ours = np.median(zeta_of(table, result.zeta[REPRODUCTION]["stated"]), axis=0)
        rows = np.full((2, len(TABLE_III)), np.nan)
        rows[:, [n - 1 for n in table.others]] = table.zeta, ours
        image = axes.imshow(rows, cmap="YlGnBu", vmin=0.0, vmax=1.0, aspect="auto")
        name = TABLE_III[table.reference - 1].name.lower()
        axes.set_title(
            f"table {table.name}: with acquisition {table.reference}, {name}", fontsize=10, loc="left"
        )
        axes.set_yticks([0, 1], ["printed", "ours"])
        axes.set_xticks(range(len(TABLE_III)), [str(n + 1) for n in range(len(TABLE_III))])
        axes.tick_params(length=0)
        _numbers(axes, rows)
        differs = np.flatnonzero((rows[0] >= GOOD) != (rows[1] >= GOOD))
        for column in differs:
            axes.add_patch(_frame(int(column)))
    strips[-1].set_xlabel("acquisition: 1-7 planes, 8-9 cylinders, 10-19 spheres, 20 irregular")
    right.colorbar(image, ax=strips, label="zeta", shrink=0.9, pad=0.01)
    return figure


def _frame(column: int) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((column - 0.48, -0.48), 0.96, 1.96, fill=False, edgecolor=RED, linewidth=2.0)


def _numbers(axes: Any, values: Array, size: float = 8.0) -> None:
    """Write the values into an image's cells; nothing where there is none, or 0."""
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(value) and value >= 0.005:
            text = "1" if value >= 0.995 else f"{value:.2f}"[1:]
            colour = "white" if value > 0.55 else "black"
            axes.text(column, row, text, ha="center", va="center", fontsize=size, color=colour)


def _sweep(result: Reproduction) -> Figure:
    figure = new_figure(6.6, 3.2)
    panels = figure.subplots(1, 2)
    scales = np.array(list(result.sweep_decisions))
    places = np.arange(len(scales))
    every = list(result.sweep_decisions.values())
    for axes, name, of in ((panels[0], "positives", OF_POSITIVES), (panels[1], "negatives", OF_NEGATIVES)):
        counts = [getattr(decisions, name) for decisions in every]
        middle = np.array([np.median(c) for c in counts])
        ends = np.array([[np.median(c) - c.min(), c.max() - np.median(c)] for c in counts]).T
        axes.errorbar(places, middle, yerr=ends, fmt="o", color=BLUE, capsize=4)
        axes.axhline(of, color=GREY, linewidth=1.0, linestyle="--")
        axes.set_ylim(of - 6.5, of + 0.8)
        axes.set_xlim(-0.5, len(scales) - 0.5)
        axes.set_xticks(places, [f"{scale:g}" for scale in scales])
        axes.set_xlabel("jitter of the poses (0: as stated)")
        axes.set_title(f"{name}, of {of}", fontsize=10)
        axes.grid(alpha=0.3)
    return figure


def _flat_limit(result: Reproduction) -> Figure:
    figure = new_figure(6.4, 3.8)
    axes = figure.subplots()
    curvatures = np.linspace(0.5, 100.0, 300)
    table, fits = SIMILARITIES[0], result.stated[PAPER]
    ours = np.median(zeta_of(table, result.zeta[REPRODUCTION]["stated"]), axis=0)
    for kind, colour in (("cylinder", BLUE), ("sphere", ORANGE)):
        axes.plot(curvatures, zeta_with_plane(curvatures, sphere=kind == "sphere"), color=colour, label=kind)
        places = [i for i, number in enumerate(table.others) if TABLE_III[number - 1].kind == kind]
        numbers = [table.others[i] for i in places]
        true = [1.0 / TABLE_III[number - 1].radius for number in numbers]
        axes.plot(true, table.zeta[places], "x", color=colour, markersize=7)
        fitted = [float(np.median(fits.k1[:, number - 1])) for number in numbers]
        axes.plot(fitted, ours[places], "o", color=colour, markersize=5)
    axes.axhline(GOOD, color=GREY, linewidth=1.0, linestyle="--")
    axes.annotate("0.5: similar", (100.0, GOOD + 0.02), ha="right", color=GREY, fontsize=9)
    axes.set_xlabel("curvature, per metre")
    axes.set_ylabel("zeta with a plane")
    axes.set_xlim(0.0, 102.0)
    axes.set_ylim(0.0, 1.03)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure


def _self(result: Reproduction) -> Figure:
    figure = new_figure(9.0, 3.6)
    axes = figure.subplots()
    numbers = range(1, len(TABLE_III) + 1)
    width = 0.8 / len(result.ways)
    for i, (way, colour) in enumerate(zip(result.ways, WAY_COLOURS, strict=True)):
        kinds = self_similarity(way)
        label = way.label + ": " + ", ".join(f"{kind} {kinds[kind]:.2f}" for kind in KINDS)
        shares = [way.share_alike(n, n) for n in numbers]
        axes.bar(np.array(numbers) + (i - 1) * width, shares, width, color=colour, label=label)
    axes.axhline(0.9, color=GREY, linewidth=1.0, linestyle="--")
    axes.set_xticks(numbers, [_short(n) for n in numbers], fontsize=7.5)
    axes.set_xlim(0.4, len(TABLE_III) + 0.6)
    axes.set_ylim(0.0, 1.0)
    axes.set_ylabel("share with zeta ≥ 0.9")
    figure.legend(loc="outside upper left", frameon=False, fontsize=9)
    return figure


def _short(number: int) -> str:
    row = TABLE_III[number - 1]
    second = {"plane": "plane", "irregular": "irreg."}.get(
        row.kind, f"{row.kind.replace('cylinder', 'cyl.')}\n{1e3 * row.radius:.2f}"
    )
    return f"{number}\n{second}"


def _confusion(result: Reproduction) -> Figure:
    figure = new_figure(11.4, 4.3)
    names = ["plane" if TABLE_III[n - 1].kind == "plane" else _object(n) for n in LIBRARY]
    panels = figure.subplots(1, len(result.ways), sharey=True)
    for axes, way in zip(panels, result.ways, strict=True):
        shares = way.confusion()
        axes.imshow(shares, cmap="YlGnBu", vmin=0.0, vmax=1.0)
        _numbers(axes, shares, size=7.0)
        axes.set_xticks(range(len(names) + 1), [*names, "none"], rotation=90, fontsize=8)
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.tick_params(length=0)
        axes.set_title(way.label, fontsize=10)
    return figure


def _object(number: int) -> str:
    row = TABLE_III[number - 1]
    return "irregular" if row.kind == "irregular" else f"{row.kind} {1e3 * row.radius:.2f}"


def _ratio(result: Reproduction) -> Figure:
    figure = new_figure(7.6, 4.2)
    axes = figure.subplots()
    ratios = np.linspace(1.0, 2.6, 120)
    for radius, style in ((0.01415, ":"), (0.0205, "--"), (0.0297, "-")):
        curvatures = 1.0 / np.append(radius, radius * ratios)
        surfaces = np.zeros((len(curvatures), 6))
        surfaces[:, 0] = surfaces[:, 1] = curvatures / 2
        rows = DEFAULT.signatures(surfaces)
        zeta = similarity(rows[1:], rows[0])
        axes.plot(
            ratios, zeta, style, color=GREY, linewidth=1.2, label=f"exact, against r = {1e3 * radius:g} mm"
        )
    spheres = [n for n in LIBRARY if TABLE_III[n - 1].kind == "sphere"]
    for i, (way, colour) in enumerate(zip(result.ways, WAY_COLOURS, strict=True)):
        _ratio_points(axes, way, spheres, colour, shift=0.006 * (i - 1))
    axes.axhline(OPTIMAL, color=GREY, linewidth=0.8)
    axes.axhline(GOOD, color=GREY, linewidth=0.8)
    axes.axvline(1.5, color=GREY, linewidth=0.8)
    axes.set_xlabel("ratio of the radii")
    axes.set_ylabel("zeta")
    axes.set_ylim(0.0, 1.02)
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    return figure


def _ratio_points(axes: Any, way: Way, spheres: list[int], colour: str, shift: float) -> None:
    points = []
    for i, one in enumerate(spheres):
        for other in spheres[i:]:
            zeta = way.pairs(one, other)
            zeta = zeta[np.isfinite(zeta)]
            if len(zeta):
                radii = sorted((TABLE_III[one - 1].radius, TABLE_III[other - 1].radius))
                points.append((radii[1] / radii[0] + shift, *np.quantile(zeta, (0.05, 0.5, 0.95))))
    x, low, middle, high = np.array(points).T
    ends = (middle - low, high - middle)
    axes.errorbar(x, middle, ends, fmt="o", markersize=4, color=colour, elinewidth=0.8, label=way.label)


def _vocabulary_end(result: Reproduction) -> Figure:
    figure = new_figure(7.2, 4.2)
    axes = figure.subplots()
    curvatures = np.linspace(10.0, 240.0, 460)
    surfaces = np.zeros((len(curvatures), 6))
    surfaces[:, 0] = surfaces[:, 1] = curvatures / 2
    lengths = np.linalg.norm(DEFAULT.signatures(surfaces), axis=1)
    axes.semilogy(curvatures, lengths, color="black", linewidth=1.0, label="sphere, exact")
    for fit, colour in ((OWN, BLUE), (OWN_HALF, GREEN)):
        for number in (14, 19, 10, 15, 13):
            fits = result.random[fit]
            mean = (fits.k1 + fits.k2)[:, number - 1] / 2
            length = np.linalg.norm(DEFAULT.signatures(fits.surfaces[:, number - 1]), axis=1)
            for chosen, marker in ((length <= 1.0, "o"), (length > 1.0, "x")):
                axes.plot(mean[chosen], length[chosen], marker, color=colour, markersize=4, alpha=0.7)
        axes.plot([], [], "o", color=colour, label=f"random poses, {fit.label}")
    for number in (13, 15, 10, 14):
        true = 1.0 / TABLE_III[number - 1].radius
        axes.axvline(true, color=GREY, linewidth=0.8, linestyle=":")
        axes.annotate(
            f"r = {1e3 / true:.4g} mm", (true, 700.0), rotation=90, ha="right", va="top", fontsize=8
        )
    axes.axhline(1.0, color=RED, linewidth=1.0)
    axes.annotate("no signature above", (12.0, 1.15), color=RED, fontsize=9)
    axes.axvline(4.0 / SIDE, color=RED, linewidth=0.8, linestyle="--")
    axes.annotate("4/D", (4.0 / SIDE + 2.0, 300.0), color=RED, fontsize=9)
    axes.set_xlim(10.0, 240.0)
    axes.set_ylim(0.02, 1000.0)
    axes.set_xlabel("fitted mean curvature, per metre (dotted: 1/r)")
    axes.set_ylabel("length of the signature")
    axes.legend(frameon=False, fontsize=8, loc="lower right")
    return figure
