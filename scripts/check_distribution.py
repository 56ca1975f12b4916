"""Install wheels or source distributions into empty environments, and use them there: `make check-wheel`.

python scripts/check_distribution.py FILE... [--python PATH]...
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

OLDEST = (3, 10)

IN_PYTHON = """
import sys
import numpy as np
import surfsig
x, y = (0.001 * (grid.ravel() - 40) for grid in np.mgrid[0:81, 0:81])
points = np.column_stack([x, y, np.sqrt(0.01 - x**2 - y**2)])
found = surfsig.extract(points, 0.01)
middle = 40 * 81 + 40
assert abs(found.k1[middle] - 10) < 0.05 and abs(found.k2[middle] - 10) < 0.05, found.k1[middle]
w = found.signatures([middle, middle - 1])
assert surfsig.similarity(w[0], w[1]) > 0.999
surfsig.write(sys.argv[1], surfsig.PointCloud(points))
"""
"""A cap of a sphere of radius 0.1, extracted and written."""

OF_THE_SHELL = """
import sys
import surfsig
k1 = surfsig.read(sys.argv[1]).fields["k1"]
assert len(k1) == 81 * 81 and abs(k1[40 * 81 + 40] - 10) < 0.05
"""
"""What the command line made of the same points."""


def main() -> int:
    """Check every file with every interpreter; the exit code says whether all is well."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    parser.add_argument("--python", action="append", metavar="PATH", help="by default all that are found")
    arguments = parser.parse_args()
    interpreters = {
        version: path for path in arguments.python or candidates() if (version := version_of(path))
    }
    if not interpreters:
        print(f"no Python from {OLDEST[0]}.{OLDEST[1]} on was found", file=sys.stderr)
        return 1
    failed = False
    for file in arguments.files:
        for version, interpreter in sorted(interpreters.items()):
            problem = check(file.resolve(), interpreter)
            failed |= problem is not None
            print(f"{file.name}  Python {'.'.join(map(str, version))}: {problem or 'ok'}", flush=True)
    return int(failed)


def candidates() -> Iterator[str]:
    """Find interpreters in the search path and among pyenv's; some may be older than `OLDEST`, or not run."""
    yield sys.executable
    for minor in range(OLDEST[1], OLDEST[1] + 20):
        if found := shutil.which(f"python3.{minor}"):
            yield found
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    for path in pyenv.glob("versions/*/bin/python3.*"):
        if re.fullmatch(r"python3\.\d+", path.name):
            yield str(path)


def version_of(interpreter: str) -> tuple[int, ...] | None:
    """Return the version of a CPython that is not too old, else None."""
    code = "import sys; print(sys.implementation.name, *sys.version_info[:3])"
    try:
        asked = subprocess.run([interpreter, "-c", code], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    name, *numbers = asked.stdout.split()
    version = tuple(map(int, numbers))
    return version if name == "cpython" and version >= OLDEST else None


def check(file: Path, interpreter: str) -> str | None:
    """Install a file into an empty environment, use it there, and return what went wrong."""
    # A path or an environment of the caller's must not lend what the file lacks.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    with tempfile.TemporaryDirectory() as folder:
        programs = Path(folder, "venv", "Scripts" if os.name == "nt" else "bin")
        python, shell = programs / "python", programs / "surfsig"
        points, extracted = Path(folder, "cap.ply"), Path(folder, "extracted.ply")
        commands: list[list[str | Path]] = [
            [interpreter, "-m", "venv", Path(folder, "venv")],
            [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", file],
            [python, "-c", IN_PYTHON, points],
            [shell, "extract", points, "--radius", "0.01", "-o", extracted],
            [python, "-c", OF_THE_SHELL, extracted],
        ]
        for command in commands:
            done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
            if done.returncode != 0:
                return f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"
    return None


if __name__ == "__main__":
    sys.exit(main())
