"""`surfsig compare`: how alike two places are."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from surfsig import defaults
from surfsig.cli.console import number, print_json, print_table
from surfsig.cli.options import CLOUD, axes_option, input_options, json_option, position, threads_option
from surfsig.digits import position_text, with_error

if TYPE_CHECKING:
    from surfsig import Extraction, PointCloud
    from surfsig.defaults import Axes


@click.command("compare", no_args_is_help=True)
@click.argument("a", type=CLOUD)
@click.argument("b", type=CLOUD)
@click.option(
    "--at",
    type=position,
    metavar="X,Y,Z",
    multiple=True,
    required=True,
    help="Given twice: the position in A, then the one in B. The surface is fitted at the position itself.",
)
@click.option(
    "--radius",
    type=float,
    default=defaults.RADIUS,
    show_default=True,
    help="Of the neighbourhood, in the files' unit; with --unit, in metres.",
)
@axes_option
@click.option(
    "--viewpoint", type=position, metavar="X,Y,Z", help="Where the sensor stood, if the files do not say."
)
@input_options
@threads_option
@json_option
def compare_command(
    a: Path,
    b: Path,
    at: tuple[tuple[float, float, float], ...],
    radius: float,
    axes: Axes,
    viewpoint: tuple[float, float, float] | None,
    threads: int | None,
    as_json: bool,
    **reading: Any,
) -> None:
    """Compare the surface at a position in A with the surface at a position in B (which may be A).

    Shows both places' curvatures and the similarity zeta of their signatures: from 0.9 "optimal", from 0.5
    "good", below "dissimilar". The signatures have a flat atom, as long as the places' noise asks for.
    Where nobody says from which side the surfaces were seen (--viewpoint), zeta is the larger one of both
    sides.

    \b
    Examples:
      surfsig compare scan.ply scan.ply --at 0.1,0.2,0.9 --at 0.3,0.2,0.9 --radius 0.02
      surfsig compare scan.ply other.pcd --at 0.1,0.2,0.9 --at 0,0,1 --radius 0.02 --json
    """  # noqa: D301
    import numpy as np

    import surfsig

    if len(at) != 2:
        raise click.UsageError("give --at twice: the position in A, then the one in B")
    places: list[dict[str, Any]] = []
    found: list[Extraction] = []
    clouds: dict[Path, PointCloud] = {}
    for file in (a, b):
        if file not in clouds:
            clouds[file] = surfsig.read(file, **reading)
    for file, spot in zip((a, b), at, strict=True):
        result = surfsig.extract(
            clouds[file], radius, axes=axes, at=[spot], viewpoint=viewpoint, threads=threads
        )
        found.append(result)
        rows, statuses = result.signatures(return_status=True)
        status = surfsig.Status(int(statuses[0])).name.lower()
        if not np.isfinite(rows).all():
            where = position_text(spot, ",")
            why = f"{status.replace('_', ' ')} ({int(result.count[0])} points within {number(radius)})"
            hint = _hint(a, b, clouds)
            text = f"{file}: no signature at {where}: {why}"
            raise surfsig.InvalidInputError(text if hint is None else f"{text}; {hint}")
        place: dict[str, Any] = {"file": str(file), "at": spot, "status": status}
        place |= {"count": int(result.count[0])}
        names = ("k1", "k2", "k1_std", "k2_std", "residual")
        place |= {name: float(getattr(result, name)[0]) for name in names}
        places.append(place)
    flat = surfsig.flat_atom_length(*found)
    rows = np.vstack([result.signatures(flat_atom=flat) for result in found])
    either_side = axes == "surface" and not all(result.oriented for result in found)
    zeta = float(surfsig.similarity(rows[0], rows[1], either_side=either_side))
    hint = _hint(a, b, clouds) if surfsig.similarity_class(zeta) == "dissimilar" else None
    if hint is not None:
        warnings.warn(hint, stacklevel=1)
    values = {"a": places[0], "b": places[1], "radius": radius, "axes": axes, "flat_atom": flat}
    values |= {"zeta": zeta, "class": surfsig.similarity_class(zeta)}
    if as_json:
        print_json(values)
        return
    table = [("zeta", f"{number(zeta)} ({values['class']})")]
    for name, place in zip("AB", places, strict=True):
        table.append((name, f"{place['file']} at {position_text(place['at'])}"))
        k1, k2 = (_curvature(place[name], place[f"{name}_std"]) for name in ("k1", "k2"))
        curvature = f"k1 {k1}, k2 {k2} per unit"
        table.append(
            ("", f"{curvature}, from {place['count']:,} points, residual {number(place['residual'])}")
        )
    print_table(f"radius {number(radius)}, {axes} axes", table, err=False)


def _hint(a: Path, b: Path, clouds: dict[Path, PointCloud]) -> str | None:
    """Say whether the two files seem to be in different units."""
    import surfsig

    return None if a == b else surfsig.unit_mismatch(clouds[a], clouds[b], (str(a), str(b)))


def _curvature(value: float, error: float) -> str:
    """Write a curvature with its standard error, which the sensor's axes have not."""
    return with_error(value, error) if error > 0.0 else number(value)
