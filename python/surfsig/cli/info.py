"""`surfsig info`: what a file holds."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import click

from surfsig.cli.console import number, on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, input_options, json_option
from surfsig.digits import position_text


@click.command("info", no_args_is_help=True)
@click.argument("file", type=CLOUD)
@input_options
@json_option
def info_command(file: Path, as_json: bool, **reading: Any) -> None:
    """Show what a point cloud FILE holds, and how dense it is.

    FILE may be a folder or a pattern, as for all commands: its files are then one cloud. Of a folder or a
    pattern of LAS, LAZ or COPC files, and of one that `surfsig extract` wrote tiles into, only the headers
    are read.

    \b
    Examples:
      surfsig info scan.ply
      surfsig info scan.pcd --json | jq .spacing
      surfsig info 'tiles/*.laz'
      surfsig info tile.copc.laz --box 500100,4500200,0,500110,4500210,50
    """  # noqa: D301
    from surfsig.cli.info_of_many import summary_of_many
    from surfsig.files import format_name, read

    many = None if any(value is not None for value in reading.values()) else summary_of_many(file)
    if many is not None:
        values, rows = many
        if as_json:
            print_json(values)
        else:
            print_table(str(file), rows, err=False)
        return
    with progress_bar("reading", "bytes", shown=on_terminal()) as progress:
        cloud = read(file, progress=progress, **reading)
    _warn_of_feet(file, cloud)
    values = {"file": str(file), "format": format_name(file), **_describe(cloud)}
    if as_json:
        print_json(values)
    else:
        print_table(str(file), _rows(values), err=False)


def _describe(cloud: Any) -> dict[str, Any]:
    from surfsig.cli.spacing import median_spacing
    from surfsig.missing_returns import missing_returns
    from surfsig.resolution import number_step

    finite = cloud.finite
    points = cloud.points if finite.all() else cloud.points[finite]
    return {
        "points": len(cloud),
        "finite_points": int(finite.sum()),
        "missing_returns": int(missing_returns(cloud).sum()),
        "grid": cloud.grid,
        "coordinates": cloud.offsets.dtype.name,
        "minimum": points.min(axis=0) if len(points) else None,
        "maximum": points.max(axis=0) if len(points) else None,
        "viewpoint": cloud.viewpoint,
        "coordinate_system": _system(cloud.coordinate_system),
        "spacing": median_spacing(points),
        "coordinate_step": number_step(cloud),
        "fields": {
            name: values.dtype.name + (f"[{values.shape[1]}]" if values.ndim == 2 else "")
            for name, values in cloud.fields.items()
        },
    }


def _system(system: Any) -> dict[str, Any] | None:
    names = ("name", "unit", "vertical_unit", "is_geographic")
    return None if system is None else {name: getattr(system, name) for name in names}


def _warn_of_feet(file: Path, cloud: Any) -> None:
    from surfsig.files.options import unit_of

    system = cloud.coordinate_system
    unit = None if system is None else unit_of(system)
    if unit in ("ft", "us-ft"):
        warnings.warn(
            f"{file}: its coordinates are in feet ({system.unit}); --unit {unit} reads it as metres",
            stacklevel=2,
        )


def _rows(values: dict[str, Any]) -> list[tuple[str, str]]:
    rows = [("format", f"{values['format']}, coordinates {values['coordinates']}")]
    missing = values["points"] - values["finite_points"]
    apart = [f"{missing:,} not finite"] if missing else []
    if values["missing_returns"]:
        apart.append(f"{values['missing_returns']:,} at (0, 0, 0): a lidar's missing returns")
    rows.append(("points", f"{values['points']:,}" + (f" ({'; '.join(apart)})" if apart else "")))
    if values["grid"]:
        rows.append(("organised", f"{values['grid'][0]} rows of {values['grid'][1]}"))
    if values["minimum"] is not None:
        # What float32 and float64 hold, the last digit of UTM coordinates included.
        digits = 7 if values["coordinates"] == "float32" else 12
        for axis, low, high in zip("xyz", values["minimum"], values["maximum"], strict=True):
            rows.append((axis, f"{low:.{digits}g} to {high:.{digits}g}"))
    seen_from = values["viewpoint"]
    rows.append(("viewpoint", "not known" if seen_from is None else position_text(seen_from)))
    system = values["coordinate_system"]
    if system is None:
        rows.append(("coordinate system", "not known"))
    else:
        units = [system["unit"] or "not known"]
        if system["vertical_unit"] not in (None, system["unit"]):
            units.append(f"z: {system['vertical_unit']}")
        rows.append(("coordinate system", f"{system['name'] or 'without a name'}, unit: {', '.join(units)}"))
    spacing = values["spacing"]
    if spacing is not None:
        advice = f"a radius of 5 to 10 times that ({5 * spacing:.2g} to {10 * spacing:.2g}) is a start"
        rows.append(("spacing", f"{number(spacing)} to the nearest point (median); {advice}"))
        if values["coordinate_step"] > spacing:
            step = number(values["coordinate_step"])
            rows.append(("resolution", f"coordinates come in steps of {step}: too coarse for this spacing"))
    fields = ", ".join(f"{name} {kind}" for name, kind in values["fields"].items())
    rows.append(("fields", fields or "none"))
    return rows
