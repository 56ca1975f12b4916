"""`surfsig extract`: curvature, and signatures, of the points of a file."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from surfsig.cli.console import number, on_terminal, print_json, print_table, progress_bar, quantity
from surfsig.cli.options import (
    CLOUD,
    axes_option,
    fit_option,
    input_options,
    json_option,
    position,
    quiet_option,
    radius_or_auto,
    threads_option,
)
from surfsig.cli.tiles import (
    extract_in_tiles,
    is_tiled,
    name_of,
    refuse_in_tiles,
    refuse_too_large,
    split_options,
    tile_options,
)
from surfsig.digits import position_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from surfsig import Extraction, PointCloud
    from surfsig.defaults import Axes, Fit
    from surfsig.files import Chunks

QUANTILES = (0.05, 0.5, 0.95)


@click.command("extract", no_args_is_help=True)
@click.argument("files", type=CLOUD, nargs=-1, required=True)
@click.option(
    "--radius",
    type=radius_or_auto,
    metavar="R|auto",
    help="Of the neighbourhood, in the file's unit; with --unit, in metres. auto: for each point the largest "
    "that its surface explains.",
)
@click.option(
    "--neighbors",
    type=int,
    metavar="K",
    help="In place of --radius, the K nearest points; with --radius, at most so many of those within it.",
)
@click.option(
    "-o",
    "--output",
    type=CLOUD,
    required=True,
    help="A .ply, .pcd, .las, .laz, .e57, .npz, .parquet, .csv or .xyz file; or a folder, for clouds "
    "of any size: they are worked on in tiles, a file each.",
)
@click.option("--signatures", is_flag=True, help="Write the signature of each point too (242 numbers).")
@click.option(
    "--like",
    type=position,
    metavar="X,Y,Z",
    help="Write zeta, the similarity of each point's surface with the one at this position.",
)
@axes_option
@fit_option
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
@tile_options
@input_options
@threads_option
@json_option
@click.option("--robust", is_flag=True, help="Leave out points that are far from the fitted surface.")
@click.option("--report", type=CLOUD, metavar="FILE.html", help="Write a page with the points by curvature.")
@quiet_option
def extract_command(
    files: tuple[Path, ...],
    radius: float | Literal["auto"] | None,
    neighbors: int | None,
    output: Path,
    signatures: bool,
    like: tuple[float, float, float] | None,
    axes: Axes,
    fit: Fit,
    at: tuple[tuple[float, float, float], ...],
    voxel: float | None,
    viewpoint: tuple[float, float, float] | None,
    threads: int | None,
    as_json: bool,
    robust: bool,
    report: Path | None,
    quiet: bool,
    **more: Any,
) -> None:
    """Write the points of FILES with their signed curvature, normals and quality.

    The output has the input's points and fields, and k1, k2, gaussian_curvature, mean_curvature (per unit of
    length; a bump seen from the sensor is positive), nx ny nz, direction_x _y _z (along k1), the standard
    errors mean_curvature_std, k1_std, k2_std, noise, residual, condition, count, status (0 is ok), linearity,
    planarity, scattering; zeta with --like; radius with --neighbors or --radius auto. NaN where there is no
    value.

    Where the output is a folder, clouds need not fit into memory: they are worked on in tiles, with the same
    results, and a second call goes on where the first was stopped.

    \b
    Examples:
      surfsig extract scan.ply --radius 0.02 -o out.ply
      surfsig extract part.ply --unit mm --radius 0.002 -o out.ply
      surfsig extract scan.pcd --radius 0.02 --signatures -o out.npz
      surfsig extract scan.ply --radius 0.02 --like 0.1,0.2,0.9 -o alike.ply
      surfsig extract city/*.laz --radius 0.5 -o out/ --memory 4GB
      surfsig extract scan.xyz --radius 0.02 --at 0.1,0.2,0.9 --viewpoint 0,0,0 -o one.parquet
    """  # noqa: D301
    import numpy as np

    import surfsig
    from surfsig.files import check_writable, write
    from surfsig.files.atomic import check_target
    from surfsig.missing_returns import warn_of_missing_returns

    if at and voxel is not None:
        raise click.UsageError("--at and --voxel exclude each other")
    shown = on_terminal() and not quiet
    tiling, reading = split_options(more)
    if is_tiled(output, tiling):
        refuse_in_tiles(report=report, signatures=signatures, like=like, at=at, voxel=voxel, **reading)
        how_in_tiles = {
            "radius": radius,
            "neighbors": neighbors,
            "axes": axes,
            "fit": fit,
            "viewpoint": viewpoint,
        }
        extract_in_tiles(
            files,
            output,
            {**how_in_tiles, "robust": robust, "threads": threads},
            tiling,
            reading,
            shown,
            as_json,
        )
        return
    file = files[0] if len(files) == 1 else files
    told = name_of(files)
    check_writable(output)
    if report is not None:
        check_target(report)
    refuse_too_large(file, told)
    how = {"radius": radius, "neighbors": neighbors, "axes": axes, "fit": fit, "robust": robust}
    clock = [time.perf_counter()]
    with progress_bar("reading", "bytes", shown=shown) as progress:
        cloud = surfsig.read(file, progress=progress, **reading)
    warn_of_missing_returns(cloud, told)
    clock.append(time.perf_counter())
    with progress_bar("extracting", "points", shown=shown) as progress:
        extract = partial(
            surfsig.extract,
            cloud,
            radius,
            neighbors=neighbors,
            axes=axes,
            fit=fit,
            viewpoint=viewpoint,
            robust=robust,
            threads=threads,
        )
        result = extract(at=np.array(at) if at else None, voxel=voxel, progress=progress)
    clock.append(time.perf_counter())
    typical = float(np.median(result.radius)) if len(result) else np.nan
    status = result.status.copy()
    columns: dict[str, ArrayLike] = {**result.columns(), "status": status}
    if like is not None:
        columns["zeta"] = _similarity_to(like, result, extract(at=[like]))
    with progress_bar("writing", "points", shown=shown) as progress:
        write(
            output,
            cloud if not at and voxel is None else _part_of(cloud, result),
            columns,
            chunks=_signature_chunks(result, status) if signatures else None,
            notes={name: str(value) for name, value in how.items() if value is not None},
            progress=progress,
        )
    clock.append(time.perf_counter())
    if report is not None:
        zeta = {"zeta": columns["zeta"]} if "zeta" in columns else None
        result.write_report(report, title=f"Curvature of {told}", columns=zeta)
    seconds = dict(zip(("read", "extract", "write"), np.diff(clock).tolist(), strict=True))
    summary: dict[str, Any] = {"input": told, "output": str(output), **how}
    summary |= {"signatures": signatures, **_summary(result, status), "seconds": seconds}
    summary["points_per_second"] = len(result) / seconds["extract"] if seconds["extract"] else None
    if len(result) and not np.isfinite(result.k1).any():
        asked = f"the radius {number(typical)}"
        if neighbors is not None:
            asked = f"the number of neighbors {neighbors}"
        why = " at any radius" if radius == "auto" else f"; is {asked} right?"
        warnings.warn(f"{output}: no point has a curvature{why}", stacklevel=1)
    if as_json:
        print_json(summary)
    elif shown:
        print_table(f"{output}, radius {number(typical)}, {axes} axes", _rows(summary), err=True)


def _part_of(cloud: PointCloud, result: Extraction) -> PointCloud:
    """Give the places of the result, with the input's fields where they are points of the input."""
    from surfsig import PointCloud

    if result.indices is not None:
        return cloud.at(result.indices)
    return PointCloud(result.points, viewpoint=cloud.viewpoint, coordinate_system=cloud.coordinate_system)


def _similarity_to(
    place: tuple[float, float, float], result: Extraction, there: Extraction
) -> NDArray[np.float32]:
    """Compare all places with one, with a flat atom as long as the whole scan's noise asks for."""
    import numpy as np

    import surfsig

    flat = surfsig.flat_atom_length(result if len(result) > 1 else there)
    signature, status = there.signatures(flat_atom=flat, return_status=True)
    if np.isnan(signature).any():
        why = surfsig.Status(int(status[0])).name.lower().replace("_", " ")
        raise surfsig.InvalidInputError(f"--like: no signature at {position_text(place, ',')}: {why}")
    return result.similarity_to(signature[0])


def _signature_chunks(result: Extraction, status: NDArray[np.uint8]) -> Chunks:
    """Make signatures when they are to be written; where there is none, that shows in `status`."""
    import numpy as np

    from surfsig.files import Chunks

    def blocks() -> Iterator[NDArray[np.float32]]:
        for places, rows, statuses in result.iter_signatures():
            status[places] = statuses
            yield rows

    return Chunks("signature", result.signatures([]).shape[1], np.float32, blocks())


def _summary(result: Extraction, status: NDArray[np.uint8]) -> dict[str, Any]:
    import numpy as np

    from surfsig import Status

    counts = np.bincount(status, minlength=len(Status))
    values: dict[str, Any] = {
        "points": len(result),
        "status": {kind.name.lower(): int(counts[kind]) for kind in Status},
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
