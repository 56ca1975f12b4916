"""`surfsig extract`: curvature, and signatures, of the points of a file."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from surfsig.cli.console import number, on_terminal, print_json, print_table, progress_bar, quantity
from surfsig.cli.options import CLOUD, axes_option, json_option, position, threads_option

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from surfsig import Extraction, PointCloud

# Signatures made and written at a time: 8 MB.
ROWS_AT_ONCE = 8192
QUANTILES = (0.05, 0.5, 0.95)


@click.command("extract", no_args_is_help=True)
@click.argument("file", type=CLOUD)
@click.option("--radius", type=float, required=True, help="Of the neighbourhood, in the file's unit.")
@click.option("-o", "--output", type=CLOUD, required=True, help="A .ply, .npz or .parquet file.")
@click.option("--signatures", is_flag=True, help="Write the signature of each point too (242 numbers).")
@axes_option
@click.option(
    "--at",
    type=position,
    metavar="X,Y,Z",
    multiple=True,
    help="Only at this position; may be given repeatedly.",
)
@click.option("--voxel", type=float, help="Only at one point per cell of this size.")
@click.option(
    "--viewpoint", type=position, metavar="X,Y,Z", help="Where the sensor stood, if the file does not say."
)
@threads_option
@json_option
@click.option("-q", "--quiet", is_flag=True, help="No progress and no summary.")
def extract_command(
    file: Path,
    radius: float,
    output: Path,
    signatures: bool,
    axes: str,
    at: tuple[tuple[float, float, float], ...],
    voxel: float | None,
    viewpoint: tuple[float, float, float] | None,
    threads: int | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Write the points of FILE with their signed curvature, normals and quality.

    The output has the input's points and fields, and k1, k2, gaussian_curvature, mean_curvature (per unit of
    length; a bump seen from the sensor is positive), nx ny nz, direction_x _y _z (along k1), residual,
    condition, count, status (0 is ok), linearity, planarity, scattering. NaN where there is no value.

    \b
    Examples:
      surfsig extract scan.ply --radius 0.02 -o out.ply
      surfsig extract scan.pcd --radius 0.02 --signatures -o out.npz
      surfsig extract scan.xyz --radius 0.02 --at 0.1,0.2,0.9 --viewpoint 0,0,0 -o one.parquet
    """  # noqa: D301
    import numpy as np
    import surfsig
    from surfsig.files import check_writable, write

    if at and voxel is not None:
        raise click.UsageError("--at and --voxel exclude each other")
    check_writable(output)
    shown = on_terminal() and not quiet
    clock = [time.perf_counter()]
    with progress_bar("reading", "bytes", shown=shown) as progress:
        cloud = surfsig.read(file, progress=progress)
    clock.append(time.perf_counter())
    with progress_bar("extracting", "points", shown=shown) as progress:
        result = surfsig.extract(
            cloud,
            radius,
            axes=axes,
            at=np.array(at) if at else None,
            voxel=voxel,
            viewpoint=viewpoint,
            threads=threads,
            progress=progress,
        )
    clock.append(time.perf_counter())
    with progress_bar("writing", "points", shown=shown) as progress:
        write(
            output,
            _output_cloud(cloud, result),
            _columns(result),
            chunks=("signature", *_signature_blocks(result)) if signatures else None,
            notes={"radius": repr(radius), "axes": axes},
            progress=progress,
        )
    clock.append(time.perf_counter())
    seconds = dict(zip(("read", "extract", "write"), np.diff(clock).tolist(), strict=True))
    summary = {"input": str(file), "output": str(output), "radius": radius, "axes": axes}
    summary |= {"signatures": signatures, **_summary(result), "seconds": seconds}
    summary["points_per_second"] = len(result) / seconds["extract"] if seconds["extract"] else None
    if as_json:
        print_json(summary)
    elif shown:
        print_table(f"{output}, radius {number(radius)}, {axes} axes", _rows(summary), err=True)


def _output_cloud(cloud: PointCloud, result: Extraction) -> PointCloud:
    """Give the points of the result, with the input's fields where they are points of the input."""
    from surfsig.point_cloud import PointCloud

    if len(result) == len(cloud) and result.indices is None:
        return cloud
    chosen = result.indices
    fields = {} if chosen is None else {name: values[chosen] for name, values in cloud.fields.items()}
    return PointCloud(result.points, viewpoint=cloud.viewpoint, fields=fields)


def _columns(result: Extraction) -> dict[str, NDArray[Any]]:
    columns: dict[str, NDArray[Any]] = {
        name: getattr(result, name)
        for name in ("k1", "k2", "gaussian_curvature", "mean_curvature", "normals")
    }
    columns |= {f"direction_{axis}": result.directions[:, i] for i, axis in enumerate("xyz")}
    quality = ("residual", "condition", "count", "status", "linearity", "planarity", "scattering")
    return columns | {name: getattr(result, name) for name in quality}


def _signature_blocks(result: Extraction) -> tuple[int, str, Iterator[NDArray[Any]]]:
    """Give the width, the type and the blocks of the signatures, each made when it is to be written."""
    import numpy as np

    def rows(start: int, stop: int) -> NDArray[Any]:
        part: NDArray[Any] = result.signatures(at=np.arange(start, min(stop, len(result))))
        return part

    blocks = (rows(start, start + ROWS_AT_ONCE) for start in range(0, len(result), ROWS_AT_ONCE))
    return rows(0, 0).shape[1], "float32", blocks


def _summary(result: Extraction) -> dict[str, Any]:
    import numpy as np
    import surfsig

    counts = np.bincount(result.status, minlength=len(surfsig.Status))
    values: dict[str, Any] = {
        "points": len(result),
        "status": {status.name.lower(): int(counts[status]) for status in surfsig.Status},
    }
    for name in ("k1", "k2"):
        numbers = getattr(result, name)
        numbers = numbers[np.isfinite(numbers)]
        quantiles = np.quantile(numbers, QUANTILES) if len(numbers) else [np.nan] * len(QUANTILES)
        values[name] = {f"p{100 * q:02.0f}": float(v) for q, v in zip(QUANTILES, quantiles, strict=True)}
    return values


def _rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    rows = [("points", f"{summary['points']:,}")]
    rows += [(status.replace("_", " "), f"{count:,}") for status, count in summary["status"].items() if count]
    for name in ("k1", "k2"):
        values = ", ".join(f"{q} {number(v)}" for q, v in summary[name].items())
        rows.append((f"{name} per unit", values))
    took = ", ".join(f"{name} {value:.2f} s" for name, value in summary["seconds"].items())
    rate = summary["points_per_second"]
    rows.append(("time", took + (f" ({quantity(rate)} points/s)" if rate else "")))
    return rows
