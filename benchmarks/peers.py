"""What surfsig is compared with, and how each peer's program is made ready.

The Python peers live in an environment of their own (`.venv-peers`); PCL and CGAL are compiled into one
program where their headers and a C++ compiler are installed. What cannot be had is left out, with the reason.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import venv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
ENVIRONMENT = ROOT / ".venv-peers"
BUILD = ROOT / "build" / "benchmarks"
TIME_LIMIT_SECONDS = 1800
PCL_LIBRARIES = tuple(f"-lpcl_{part}" for part in ("features", "search", "kdtree", "octree", "common"))
CGAL_LIBRARIES = ("-lgmp", "-lmpfr")

# Folders that hold the headers of a package, where pkg-config does not say.
HEADERS = {"pcl_features": ("pcl-*", "eigen3"), "eigen3": ("eigen3",)}

Command = list[str | Path]


class PeerUnavailable(Exception):
    """A peer cannot be built, installed or run here; the message says why."""


@dataclass(frozen=True)
class Peer:
    """One method of another library.

    `counterpart` names the measurement of surfsig that it is compared with; `queries` is the number of points
    timed where all of them would take too long (0: all), always with the full cloud as search surface.
    """

    name: str
    label: str
    computes: str
    counterpart: str
    program: str
    queries: int = 0
    by_default: bool = True


PEERS = (
    Peer("pcl_normals", "PCL NormalEstimationOMP", "normal, surface variation", "curvature", "c++"),
    Peer(
        "pcl_normals_unsorted",
        "PCL NormalEstimationOMP, tree told not to sort",
        "normal, surface variation",
        "curvature",
        "c++",
    ),
    Peer(
        "pcl_curvatures",
        "PCL PrincipalCurvatures",
        "spread of the neighbours' normals, normals given",
        "curvature",
        "c++",
    ),
    Peer("cgal_jet2", "CGAL jet, degree 2", "k1, k2, directions, normal", "curvature", "c++", queries=20_000),
    Peer(
        "cgal_jet4",
        "CGAL jet, degree 4",
        "k1, k2, directions, normal",
        "curvature",
        "c++",
        queries=10_000,
        by_default=False,
    ),
    Peer("open3d_normals", "Open3D estimate_normals", "normal", "curvature", "python"),
    Peer("jakteristics", "jakteristics", "4 shape features of the covariance", "curvature", "python"),
    Peer("small_gicp", "small_gicp", "normal, covariance (nearest k)", "curvature", "python"),
    Peer("pcl_fpfh", "PCL FPFHEstimationOMP", "FPFH, 33 numbers, normals given", "signatures", "c++"),
    Peer(
        "open3d_fpfh",
        "Open3D compute_fpfh_feature",
        "FPFH, 33 numbers, normals given",
        "signatures",
        "python",
    ),
)


def run_json(command: Command, threads: int, seconds: int = TIME_LIMIT_SECONDS) -> dict[str, Any]:
    """Run a program that prints one JSON line, with OpenMP held to `threads`, and return what it printed.

    Raises
    ------
    PeerUnavailable
        When it fails or does not end within so many seconds.
    """
    environment = os.environ | {"OMP_NUM_THREADS": str(threads), "PYTHONWARNINGS": "ignore"}
    try:
        run = subprocess.run(
            command, capture_output=True, text=True, timeout=seconds, env=environment, check=True
        )
        answer: dict[str, Any] = json.loads(run.stdout.splitlines()[-1])
    except subprocess.TimeoutExpired:
        raise PeerUnavailable(f"not finished within {seconds} s") from None
    except subprocess.CalledProcessError as error:
        raise PeerUnavailable(last_line(error.stderr) or f"exit status {error.returncode}") from None
    except (OSError, IndexError, ValueError) as error:
        raise PeerUnavailable(str(error)) from None
    return answer


def last_line(text: str) -> str:
    """Return the last line of a program's complaint, which says most."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else ""


def python_program() -> Command:
    """Return the command of the Python peers and install what is missing; one without a wheel stays out.

    Raises
    ------
    PeerUnavailable
        When their environment cannot be made.
    """
    return [peer_python(), HERE / "peers_python.py"]


def peer_python(name: str = "") -> Path:
    """Return the Python of the peers' environment and install what is missing: all, or one package by name.

    Raises
    ------
    PeerUnavailable
        When the environment cannot be made.
    """
    python = ENVIRONMENT / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if not python.exists():
        try:
            venv.create(ENVIRONMENT, with_pip=True)
        except subprocess.CalledProcessError as error:
            raise PeerUnavailable(f"cannot make {ENVIRONMENT.name}: {error}") from None
        (ENVIRONMENT / ".gitignore").write_text("*\n")
    for requirement in (HERE / "requirements-peers.txt").read_text().splitlines():
        if not requirement.startswith(name) or requirement.startswith("#"):
            continue
        pip: Command = [python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:", requirement]
        run = subprocess.run(pip, capture_output=True, text=True)
        if run.returncode:
            print(f"{requirement} is left out: {last_line(run.stderr)}", file=sys.stderr)
    return python


def cpp_program() -> Command:
    """Return the command of the PCL and CGAL program, compiled where needed.

    Raises
    ------
    PeerUnavailable
        When the compiler or the headers are missing, or it does not compile.
    """
    libraries = [*PCL_LIBRARIES, *CGAL_LIBRARIES]
    return compiled(HERE / "peers_pcl_cgal.cpp", include_flags("pcl_features"), libraries)


def shot_program() -> Command:
    """Return the command of the program that computes PCL's SHOT, compiled where needed.

    Raises
    ------
    PeerUnavailable
        When the compiler or the headers are missing, or it does not compile.
    """
    return compiled(HERE / "shot_pcl.cpp", include_flags("pcl_features"), PCL_LIBRARIES)


def jets_program() -> Command:
    """Return the command of the program that fits CGAL's jets to given patches, compiled where needed.

    Raises
    ------
    PeerUnavailable
        When the compiler or the headers are missing, or it does not compile.
    """
    return compiled(HERE / "jets_cgal.cpp", include_flags("eigen3"), CGAL_LIBRARIES)


def compiled(source: Path, includes: Sequence[str], libraries: Sequence[str]) -> Command:
    """Compile a C++ program where it is older than its source, and return its command.

    Raises
    ------
    PeerUnavailable
        When there is no compiler, or it does not compile.
    """
    candidates = (os.environ.get("CXX", ""), "g++", "clang++")
    compiler = next(filter(None, map(shutil.which, candidates)), None)
    if compiler is None:
        raise PeerUnavailable("no C++ compiler")
    program = BUILD / source.stem
    if program.exists() and program.stat().st_mtime > source.stat().st_mtime:
        return [program]
    BUILD.mkdir(parents=True, exist_ok=True)
    # Not -march=native: the packaged PCL is built without AVX, and Eigen would align its types differently.
    options = ("-O3", "-DNDEBUG", "-fopenmp", "-std=c++17")
    command: Command = [compiler, *options, *includes, source, "-o", program, *libraries]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        errors = [line for line in run.stderr.splitlines() if "error" in line]
        raise PeerUnavailable(errors[0] if errors else last_line(run.stderr))
    return [program]


def include_flags(package: str) -> list[str]:
    """Return where a package's headers (and Eigen's) are: as pkg-config says, else in the usual places."""
    if shutil.which("pkg-config"):
        query = ["pkg-config", "--cflags", package]
        answer = subprocess.run(query, capture_output=True, text=True)
        if answer.returncode == 0:
            return answer.stdout.split()
    for prefix in (Path("/usr/include"), Path("/usr/local/include"), Path("/opt/homebrew/include")):
        found = [sorted(prefix.glob(folder)) for folder in HEADERS[package]]
        if all(found):
            return [f"-I{folders[-1]}" for folders in found]
    raise PeerUnavailable(f"no headers of {package} (Debian: apt-get install libpcl-dev libcgal-dev)")
