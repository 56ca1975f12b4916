"""Read one file with one library and print the seconds as a line of JSON.

Runs in surfsig's environment or in that of the peers. Imports, and the first reading of a small file of the
same format, are not in the time; the file is in the system's cache.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from timing import seconds_of

DISTRIBUTIONS = ("open3d-cpu", "laspy", "lazrs", "pandas")


def surfsig(path: Path) -> Any:
    """Read everything in the file with surfsig."""
    import surfsig

    return surfsig.read(path).offsets


def open3d(path: Path) -> Any:
    """Read the coordinates with Open3D, which leaves the intensity out."""
    import open3d  # type: ignore[import-not-found]

    return np.asarray(open3d.io.read_point_cloud(str(path)).points)


def laspy(path: Path) -> Any:
    """Read with laspy, and let it scale the coordinates; the intensity stays in the records."""
    import laspy

    return laspy.read(path).xyz


def numpy(path: Path) -> Any:
    """Read the array of an NPY file, or all arrays of an NPZ file."""
    loaded = np.load(path)
    if isinstance(loaded, np.ndarray):
        return loaded
    return {name: loaded[name] for name in loaded.files}["points"]


def pandas_csv(path: Path) -> Any:
    """Read a table with a line of names with pandas, by its parser in C."""
    import pandas

    return pandas.read_csv(path).to_numpy()


METHODS: dict[str, Callable[[Path], Any]] = {
    "surfsig": surfsig, "open3d": open3d, "laspy": laspy, "numpy": numpy, "pandas": pandas_csv,
}  # fmt: skip


def installed_versions() -> dict[str, str]:
    """Return the versions of the readers that this environment has."""
    versions = {}
    for name in DISTRIBUTIONS:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def main() -> None:
    """Read the command line, and one file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("method", choices=["versions", *METHODS])
    parser.add_argument("small", type=Path, nargs="?", help="file to warm up on")
    parser.add_argument("file", type=Path, nargs="?", help="file to read")
    arguments = parser.parse_args()
    if arguments.method == "versions":
        print(json.dumps(installed_versions()))
        return
    try:
        METHODS[arguments.method](arguments.small)
    except ImportError as error:
        sys.exit(str(error))
    with arguments.file.open("rb") as file:
        while file.read(1 << 24):
            pass
    counts: list[int] = []
    seconds = seconds_of(lambda: counts.append(len(METHODS[arguments.method](arguments.file))))
    print(json.dumps({"seconds": seconds, "points": counts[0]}))


if __name__ == "__main__":
    main()
