"""Memory that a tile needs: chooses BASE_BYTES, POINT_BYTES and SURFACE_POINT_BYTES of surfsig.tiles.memory.

python scripts/measure_tile_memory.py

Simulated towns of several sizes are worked on as one tile, each in a process of its own; the peak of its
resident memory grows with the points as a line does. What rows of the store take is known, and left out of
its slope.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

MILLIONS = (0.5, 1.0, 2.0, 4.0)
JOBS = ("extract", "extract robust", "surfaces")


def worked(job: str, source: Path, out: Path) -> None:
    """Do a job, and print the peak of memory and the bytes of a row."""
    import surfsig
    from surfsig.tiles.store import Store

    if job == "surfaces":
        surfsig.find_surfaces_tiles(source, out, tiles=1, memory="64GB", restart=True)
    else:
        surfsig.extract_tiles(source, out, 0.5, robust="robust" in job, tiles=1, memory="64GB", restart=True)
    status = Path("/proc/self/status").read_text()
    peak = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM"))
    print(peak << 10, Store.open(out / "store").layouts[0].dtype.itemsize)


def main() -> None:
    """Measure, and print a line for each job."""
    if len(sys.argv) > 1:
        job, source, out = sys.argv[1:]
        worked(job, Path(source), Path(out))
        return
    from scale import make_input

    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for millions in MILLIONS:
            make_input(folder / f"{millions}", int(1e6 * millions), 4)
        for job in JOBS:
            peaks = []
            for millions in MILLIONS:
                command: list[str | Path] = [
                    sys.executable,
                    __file__,
                    job,
                    folder / f"{millions}",
                    folder / f"{job} {millions}",
                ]
                done = subprocess.run(command, check=True, capture_output=True, text=True)
                peak, row = map(int, done.stdout.split())
                peaks.append(peak)
                print(f"{job}, {millions} million points: {peak / 1e6:.0f} MB, {row} bytes a row")
            slope, base = np.polyfit(1e6 * np.array(MILLIONS), peaks, 1)
            print(
                f"{job}: {base / 1e6:.0f} MB and {slope:.0f} bytes a point, "
                f"{slope - 2 * row:.0f} beside two rows"
            )


if __name__ == "__main__":
    main()
