"""What several test modules need."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_interface import CInterface
from numpy.typing import NDArray

from surfsig.files import write
from surfsig.point_cloud import PointCloud

SLOW_FIXTURES = {"installed": "compiles the C interface in release"}
"""Fixtures that take minutes, and why: a test that uses one is slow."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests that use slow fixtures, before those that are marked are left out."""
    for item in items:
        if SLOW_FIXTURES.keys() & set(getattr(item, "fixturenames", ())):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real scans; tests that need it are skipped where it is absent."""
    named = os.environ.get("SURFSIG_TEST_DATA")
    folder = Path(named) if named else Path(__file__).parents[1] / ".." / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no real scans at {folder} (set SURFSIG_TEST_DATA)")
    return folder


@dataclass
class Finished:
    """What a command left: its exit code and what it printed."""

    code: int
    out: str
    err: str


@pytest.fixture
def shell(capsys: pytest.CaptureFixture[str]) -> Callable[..., Finished]:
    """Run the command line in this process."""
    from surfsig.cli import run

    def finished(*arguments: object) -> Finished:
        capsys.readouterr()
        code = run([str(argument) for argument in arguments])
        return Finished(code, *capsys.readouterr())

    return finished


@pytest.fixture(scope="session")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A PLY file of 9,000 points: half a ball of radius 0.5 at (0, 0, 2), as seen from the origin."""
    count = 18_000
    height = 1 - 2 * (np.arange(count) + 0.5) / count
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    width = np.sqrt(1 - height**2)
    points = 0.5 * np.column_stack([width * np.cos(angle), width * np.sin(angle), height])
    points = points[points[:, 2] < 0] + [0, 0, 2]
    path = tmp_path_factory.mktemp("ball") / "ball.ply"
    fields: dict[str, NDArray[Any]] = {
        "intensity": np.arange(len(points), dtype=np.uint16),
        "nx": np.full(len(points), 7, np.float32),
    }
    write(path, PointCloud(points, viewpoint=np.zeros(3), fields=fields))
    return path


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that the C interface was installed into."""
    if sys.platform == "win32":
        pytest.skip("these tests call compilers in the way of Unix")
    for tool in ("cargo", "cmake", "cc", "c++"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    source = Path(__file__).parents[1] / "crates" / "surfsig-c"
    build, prefix = tmp_path_factory.mktemp("build"), tmp_path_factory.mktemp("prefix")
    for arguments in (
        ["-S", source, "-B", build],
        ["--build", build],
        ["--install", build, "--prefix", prefix],
    ):
        finished = subprocess.run(["cmake", *map(str, arguments)], capture_output=True, text=True)
        assert finished.returncode == 0, finished.stdout + finished.stderr
    return prefix


@pytest.fixture(scope="session")
def c(installed: Path) -> CInterface:
    """The functions of the installed library."""
    library = f"libsurfsig_c.{'dylib' if sys.platform == 'darwin' else 'so'}"
    return CInterface(installed / "lib" / library, installed / "include" / "surfsig.h")
