"""The examples, and the README's own code, do what they say."""

import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import Finished

import surfsig

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
TOP = np.array([0.1, 0.2, 0.9])
"""The place that the README's `--like` names."""


def run(*command: object, warnings: int = 0) -> list[str]:
    """Run an example as a user would, and return the lines that it prints; so many warnings may go by."""
    done = subprocess.run([sys.executable, *map(str, command)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("surfsig: warning: ") == len(done.stderr.splitlines()) == warnings
    return done.stdout.splitlines()


@pytest.fixture
def scan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scan.ply in the working folder: a cap of a sphere of radius 0.1 below `TOP`."""
    monkeypatch.chdir(tmp_path)
    x, y = 0.001 * (np.mgrid[0:81, 0:81].reshape(2, -1) - 40)
    points = np.column_stack([x, y, np.sqrt(0.01 - x**2 - y**2) - 0.1]) + TOP
    surfsig.write("scan.ply", surfsig.PointCloud(points, viewpoint=np.array([0.1, 0.2, 2.0])))
    return tmp_path / "scan.ply"


def readme(pattern: str) -> str:
    """Find the one piece of the README that fits."""
    (found,) = re.findall(pattern, (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    return str(found)


@pytest.mark.usefixtures("scan")
def test_the_code_of_the_readme(capsys: pytest.CaptureFixture[str]) -> None:
    exec(readme(r"```python\n(.*?)```"), {})
    curvature, zeta = (float(word) for word in capsys.readouterr().out.split())
    # At a rim, with a ball of a fifth of the radius.
    assert curvature == pytest.approx(10, rel=0.03)
    assert zeta > 0.99


def test_the_command_of_the_readme(scan: Path, shell: Callable[..., Finished]) -> None:
    program, *arguments = shlex.split(readme(r"\n    (surfsig extract [^\n]*)"))
    assert program == "surfsig"
    assert shell(*arguments).code == 0
    found = surfsig.read(scan.with_name("out.ply"))
    middle = np.linalg.norm(found.points - TOP, axis=1).argmin()
    assert found.fields["k1"][middle] == pytest.approx(10, rel=0.02)
    assert found.fields["zeta"][middle] == pytest.approx(1, abs=1e-6)


@pytest.mark.slow
def test_demo(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    lines = run(EXAMPLES / "demo.py", tmp_path)
    for name, radius in (("dome, r 30 mm", 30), ("dome, r 15 mm", 15), ("dimple, r -25 mm", -25)):
        (row,) = (line for line in lines if line.startswith(name))
        assert float(row.split()[-1]) == pytest.approx(radius, rel=0.05)
    assert (tmp_path / "part.png").stat().st_size > 50_000
    assert {"k1", "zeta", "nx"} <= surfsig.read(tmp_path / "part.ply").fields.keys()


@pytest.mark.slow
def test_neighbours() -> None:
    lines = run(EXAMPLES / "neighbours.py")
    assert [line.partition(":")[0] for line in lines[1:]] == ["cleaning", "Open3D", "pandas", "Arrow"]


@pytest.mark.slow
def test_real_scans(shared_data: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "scans.png"
    # The gym ball's last line is cut off.
    assert run(EXAMPLES / "real_scans.py", shared_data, picture, warnings=1) == []
    assert picture.stat().st_size > 50_000


@pytest.mark.slow
def test_surfaces(shared_data: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "surfaces.png"
    lines = run(EXAMPLES / "surfaces.py", shared_data, picture)
    # Fit4CAD says 39.6875 for the largest cylinder of PC101.
    assert any(re.match(r"0 +cylinder +39\.68[78]", line) for line in lines)
    assert picture.stat().st_size > 30_000


@pytest.mark.slow
def test_find_again(shared_data: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture = tmp_path / "again.png"
    lines = run(EXAMPLES / "find_again.py", shared_data, picture)
    assert any(re.match(r"trusted +yes", line) for line in lines)
    assert any(line.endswith("scene.pcd: 1 instance (1 of chef)") for line in lines)
    assert picture.stat().st_size > 50_000


@pytest.mark.slow
def test_real_classes(shared_data: Path, tmp_path: Path) -> None:
    """The table of docs/zeta.md: right decisions, in percent, without a flat atom and with either length."""
    pytest.importorskip("matplotlib")
    picture = tmp_path / "classes.png"
    lines = run(EXAMPLES / "real_classes.py", shared_data, picture)
    rows = {tuple(cells[1:4]): cells[4:7] for line in lines[2:] if (cells := line.split(" | "))}
    right = {key: [int(re.findall(r"\((\d+) %", cell)[0]) for cell in row] for key, row in rows.items()}
    # A mug on a table, where neighbours err together: flat places tell by how much, standard errors do not.
    assert right["0.03", "plane, plane", "4,950"] == pytest.approx([74, 28, 90], abs=3)
    assert right["0.03", "plane, cylinder", "10,000"] == pytest.approx([100, 100, 95], abs=3)
    assert right["0.03", "cylinder, cylinder", "4,950"] == pytest.approx([72, 73, 99], abs=3)
    # With a ball of 10 mm the table's waves bend it as the mug is bent.
    assert right["0.01", "plane, cylinder", "10,000"][2] == 0
    # Where standard errors are right, they make the lidar's three scans of one sphere alike.
    assert right["0.25", "sphere, sphere", "44,850"] == pytest.approx([75, 91, 100], abs=3)
    assert right["0.25", "plane, sphere", "30,000"][1] >= 99
    assert picture.stat().st_size > 50_000


def test_every_example_has_a_test() -> None:
    here = Path(__file__).read_text(encoding="utf-8")
    # The tour has a file of its own.
    for example in EXAMPLES.glob("*.py"):
        assert example.name == "tour.py" or f'"{example.name}"' in here
