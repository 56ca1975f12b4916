"""`surfsig odometry`: where the sensor was at each scan of a sequence."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from surfsig.cli.console import number, on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, input_options, json_option, quiet_option, threads_option

if TYPE_CHECKING:
    from surfsig.files.sequence import ScanSequence
    from surfsig.files.trajectory import TrajectoryFormat
    from surfsig.odometry import Odometry


@click.command("odometry", no_args_is_help=True)
@click.argument("scans", type=CLOUD, nargs=-1, required=True)
@click.option("-o", "--output", type=CLOUD, required=True, help="The trajectory, a text file.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["kitti", "tum"]),
    help="Of the output.  [default: tum for .tum, else kitti]",
)
@click.option(
    "--covariances",
    type=CLOUD,
    metavar="FILE",
    help="Write each pose's covariance: 36 numbers a line, for rotation and translation in the scan's frame.",
)
@click.option("--topic", metavar="NAME", help="Of a ROS bag with several topics of point clouds, which.")
@click.option("--voxel", type=float, help="Thin scans and map to a place per voxel.  [default: by the scans]")
@click.option(
    "--distance", type=float, help="To partners in the map, at most.  [default: by how well motion is known]"
)
@click.option("--map-range", type=float, help="Of the map about the sensor.  [default: by the scans]")
@click.option(
    "--spin-rate",
    type=float,
    metavar="HZ",
    help="Of a lidar that spins while it moves, where points have no times; negative if clockwise.",
)
@click.option("--no-loops", is_flag=True, help="Leave the trajectory as it is where the sensor comes back.")
@click.option(
    "--map",
    "map_file",
    type=CLOUD,
    metavar="FILE",
    help="Write what all scans saw: a point per voxel, its normal, and by how many scans it was seen.",
)
@click.option(
    "--deskewed",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="FOLDER",
    help="Write the scans without the sensor's motion within them, as PLY.",
)
@click.option(
    "--report", type=CLOUD, metavar="FILE.html", help="Write a page with the trajectory and the map."
)
@input_options
@threads_option
@json_option
@quiet_option
def odometry_command(
    scans: tuple[Path, ...],
    output: Path,
    form: TrajectoryFormat | None,
    covariances: Path | None,
    topic: str | None,
    voxel: float | None,
    distance: float | None,
    map_range: float | None,
    spin_rate: float | None,
    no_loops: bool,
    map_file: Path | None,
    deskewed: Path | None,
    report: Path | None,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find the pose of each scan of a sequence: of SCANS, which are files, folders or ROS bags.

    Nothing needs to be set. A pattern stands for the files that it matches. Scans are taken in the natural
    order of their names (2 before 10), or of the messages. One that cannot be placed has a line of nan
    (KITTI) or none (TUM), and does not stop the rest. TUM's timestamps are the messages', or the files' names
    where these are numbers.

    \b
    Examples:
      surfsig odometry scans/* -o trajectory.txt
      surfsig odometry scans/ -o trajectory.tum
      surfsig odometry 'scans/scan_*.ply' -o trajectory.txt
      surfsig odometry drive.bag --topic /points -o trajectory.tum
      surfsig odometry drive.bag -o trajectory.tum --deskewed straight/
    """  # noqa: D301
    import surfsig
    from surfsig.files import trajectory_format
    from surfsig.files.atomic import check_target

    for target in (output, covariances, map_file, report):
        if target is not None:
            check_target(target)
    shown = on_terminal() and not quiet
    given = {name: value for name, value in reading.items() if value is not None}
    sequence = surfsig.open_scan_sequence(scans, topic=topic, **given)
    with progress_bar("finding poses", "scans", shown=shown) as progress:
        found = surfsig.estimate_odometry(
            sequence,
            voxel=voxel,
            distance=distance,
            map_range=map_range,
            spin_rate=spin_rate,
            close_loops=not no_loops,
            threads=threads,
            progress=progress,
        )
    counts = found.counts()
    if not counts["tracked"]:
        raise surfsig.InvalidInputError(f"{scans[0]}: no scan has enough points to find its pose")
    if counts["lost"]:
        warnings.warn(f"{counts['lost']} of {len(found)} scans are lost", stacklevel=1)
    chosen = trajectory_format(output) if form is None else form
    longest = found.longest_segment
    surfsig.write_trajectory(output, found.poses_of(longest), found.timestamps, format=chosen)
    others = [segment for segment in sorted(set(found.segments.tolist())) if segment not in (-1, longest)]
    for segment in others:
        beside = output.with_name(f"{output.stem}.segment{segment}{output.suffix}")
        surfsig.write_trajectory(beside, found.poses_of(segment), found.timestamps, format=chosen)
        warnings.warn(
            f"{int((found.segments == segment).sum())} scans are in another map, whose relation to the "
            f"first is not known: {beside}",
            stacklevel=1,
        )
    if covariances is not None:
        surfsig.write_covariances(covariances, found.covariances)
    if map_file is not None:
        surfsig.write(map_file, found.map(sequence, spin_rate=spin_rate))
    if deskewed is not None:
        _write_deskewed(deskewed, sequence, found, spin_rate)
    if report is not None:
        # Read once more: a sequence may be larger than memory.
        clouds = (scan.cloud for scan in sequence)
        found.write_report(report, clouds, title=f"Trajectory of {scans[0].name}")
    if as_json:
        values = {
            "output": str(output),
            "format": chosen,
            "scans": len(found),
            **counts,
            "segments": 1 + len(others),
            "loops": len(found.loops),
        }
        print_json({**values, "length": found.length, "voxel": found.voxel})
    elif shown:
        rows = [("scans", f"{len(found):,}")]
        rows += [(name.replace("_", " "), f"{count:,}") for name, count in counts.items() if count]
        rows += [("length", number(found.length)), ("voxel", number(found.voxel))]
        print_table(f"{output}", rows, err=True)


def _write_deskewed(folder: Path, sequence: ScanSequence, found: Odometry, spin_rate: float | None) -> None:
    """Read the scans once more, and write each as it would be if its sensor had stood still."""
    import numpy as np

    import surfsig

    if not np.isfinite(found.twists).any():
        raise surfsig.InvalidInputError(
            "no scan has times of its points: --spin-rate gives them by the angle"
        )
    folder.mkdir(parents=True, exist_ok=True)
    digits = len(str(len(found)))
    for index, cloud in enumerate(found.deskewed(sequence, spin_rate=spin_rate)):
        surfsig.write(folder / f"{index:0{digits}d}.ply", cloud)
