"""`surfsig compare`: how alike two places are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from surfsig import defaults
from surfsig.cli.console import number, print_json, print_table
from surfsig.cli.options import CLOUD, axes_option, json_option, position, threads_option


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
    help="Of the neighbourhood, in the files' unit.",
)
@axes_option
@click.option(
    "--viewpoint", type=position, metavar="X,Y,Z", help="Where the sensor stood, if the files do not say."
)
@threads_option
@json_option
def compare_command(
    a: Path,
    b: Path,
    at: tuple[tuple[float, float, float], ...],
    radius: float,
    axes: str,
    viewpoint: tuple[float, float, float] | None,
    threads: int | None,
    as_json: bool,
) -> None:
    """Compare the surface at a position in A with the surface at a position in B (which may be A).

    Shows both places' curvatures and the similarity zeta of their signatures: from 0.9 "optimal", from 0.5
    "good", below "dissimilar".

    \b
    Examples:
      surfsig compare scan.ply scan.ply --at 0.1,0.2,0.9 --at 0.3,0.2,0.9 --radius 0.02
      surfsig compare scan.ply other.pcd --at 0.1,0.2,0.9 --at 0,0,1 --radius 0.02 --json
    """  # noqa: D301
    import surfsig

    if len(at) != 2:
        raise click.UsageError("give --at twice: the position in A, then the one in B")
    places: list[dict[str, Any]] = []
    signatures = []
    clouds: dict[Path, Any] = {}
    for file, spot in zip((a, b), at, strict=True):
        if file not in clouds:
            clouds[file] = surfsig.read(file)
        result = surfsig.extract(
            clouds[file], radius, axes=axes, at=[spot], viewpoint=viewpoint, threads=threads
        )
        status = surfsig.Status(int(result.status[0]))
        if status != surfsig.Status.OK:
            reason = status.name.lower().replace("_", " ")
            where = ",".join(number(value) for value in spot)
            found = f"{int(result.count[0])} points within {number(radius)}"
            raise surfsig.InvalidInputError(f"{file}: no signature at {where}: {reason} ({found})")
        signatures.append(result.signatures()[0])
        place: dict[str, Any] = {"file": str(file), "at": spot, "count": int(result.count[0])}
        place |= {name: float(getattr(result, name)[0]) for name in ("k1", "k2", "residual")}
        places.append(place)
    zeta = float(surfsig.similarity(*signatures))
    values = {"a": places[0], "b": places[1], "radius": radius, "axes": axes, "zeta": zeta}
    values["class"] = surfsig.similarity_class(zeta)
    if as_json:
        print_json(values)
        return
    rows = [("zeta", f"{number(zeta)} ({values['class']})")]
    for name, place in zip("AB", places, strict=True):
        rows.append((name, f"{place['file']} at {', '.join(number(value) for value in place['at'])}"))
        curvature = f"k1 {number(place['k1'])}, k2 {number(place['k2'])} per unit"
        rows.append(
            ("", f"{curvature}, from {place['count']:,} points, residual {number(place['residual'])}")
        )
    print_table(f"radius {number(radius)}, {axes} axes", rows, err=False)
