"""`surfsig surfaces`: a table for a person, JSON for a program, colours for a viewer."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import surface_scenes
from conftest import Finished
from drawn_shapes import sphere
from recurrence_scene import PITCH, SCANNER, recurrence_scene
from surface_points import Array
from test_cli_errors import one_line

import surfsig
from surfsig import PointClass, PointCloud

Shell = Callable[..., Finished]


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("surfaces") / "scan.ply"
    surfsig.write(path, PointCloud(surface_scenes.on_a_plane().points))
    return path


@pytest.fixture(scope="module")
def expected(scan: Path) -> surfsig.Surfaces:
    """What is found in the file without options."""
    return surfsig.find_surfaces(surfsig.read(scan))


def test_a_table(shell: Shell, scan: Path) -> None:
    finished = shell("surfaces", scan)
    assert (finished.code, finished.err) == (0, "")
    title, header, *rows = finished.out.splitlines()
    assert title.startswith(f"{scan}: 3 surfaces: 1 plane, 1 cylinder, 1 sphere; 99")
    assert header.split()[:3] == ["kind", "radius", "95"]
    assert [row.split()[:2] for row in rows] == [["0", "plane"], ["1", "cylinder"], ["2", "sphere"]]
    assert float(rows[1].split()[2]) == pytest.approx(0.2, rel=1e-3)
    assert "0.799 long, 359° round" in rows[1]
    assert shell("surfaces", scan, "--quiet").out == ""


def test_json(shell: Shell, scan: Path, expected: surfsig.Surfaces, tmp_path: Path) -> None:
    finished = shell("surfaces", scan, "--json", "-")
    values = json.loads(finished.out)
    assert values["points"] == len(expected.cloud)
    assert values["classes"]["sphere"] == expected[2].count
    assert sum(values["classes"].values()) == len(expected.cloud)
    floor, pipe, ball = values["surfaces"]
    assert (floor["kind"], floor["number"]) == ("plane", 0)
    assert "radius" not in floor
    assert "axis" not in ball
    assert ball["center"] == expected[2].center.tolist()
    assert pipe["radius"] == expected[1].radius
    file = tmp_path / "surfaces.json"
    shell("surfaces", scan, "--json", file)
    assert json.loads(file.read_text()) == values


@pytest.mark.parametrize("ending", ["ply", "pcd", "npz", "las"])
def test_a_labelled_file(
    shell: Shell, scan: Path, expected: surfsig.Surfaces, tmp_path: Path, ending: str
) -> None:
    output = tmp_path / f"labelled.{ending}"
    assert shell("surfaces", scan, "-o", output).code == 0
    labelled = surfsig.read(output)
    found = expected
    np.testing.assert_array_equal(labelled.fields["surface"], found.labels)
    np.testing.assert_array_equal(labelled.fields["point_class"], found.classes)
    np.testing.assert_array_equal(labelled.fields["confidence"], found.confidence)
    np.testing.assert_array_equal(labelled.fields["deviation"], found.deviations().astype(np.float32))
    kinds = labelled.fields["surface_kind"]
    assert set(np.unique(kinds[found.labels == 2])) == {PointClass.SPHERE}
    if ending in ("ply", "pcd"):
        colors = np.column_stack([labelled.fields[name] for name in ("red", "green", "blue")])
        np.testing.assert_array_equal(colors, found.colors)


def test_options_reach_the_search(shell: Shell, scan: Path) -> None:
    values = json.loads(
        shell("surfaces", scan, "--json", "-", "--kinds", "plane,sphere", "--min-points", 2500).out
    )
    cloud = surfsig.read(scan)
    expected = surfsig.find_surfaces(cloud, kinds=["plane", "sphere"], min_points=2500)
    assert [entry["count"] for entry in values["surfaces"]] == [surface.count for surface in expected]
    millimetres = json.loads(shell("surfaces", scan, "--json", "-", "--unit", "mm").out)["surfaces"]
    assert millimetres[2]["radius"] == pytest.approx(0.0003, rel=1e-3)


@pytest.mark.parametrize(
    ("points", "why"),
    [
        (np.zeros((0, 3)), "there are no points"),
        (np.full((50, 3), np.nan), "of 50 points none is finite"),
        (np.eye(3)[:2], "2 points are too few"),
        (np.linspace(0, 1, 300)[:, None] * [1, 2, 3], "of 300 points too few lie on any one surface"),
    ],
)
def test_nothing_found_is_said(shell: Shell, tmp_path: Path, points: Array, why: str) -> None:
    path = tmp_path / "scan.ply"
    surfsig.write(path, PointCloud(points))
    finished = shell("surfaces", path, "-o", tmp_path / "out.ply", "--json", tmp_path / "out.json")
    assert (finished.code, finished.out) == (0, "")
    assert finished.err.startswith(f"surfsig: warning: {path}: no surface found: {why}")
    assert finished.err.count("\n") == 1
    assert len(surfsig.read(tmp_path / "out.ply")) == len(points)
    assert json.loads((tmp_path / "out.json").read_text())["surfaces"] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--kinds", "plane,ball"), "kinds must be of plane, sphere, cylinder, cone, torus, not 'ball'"),
        (("--noise", "0"), "noise must be a finite number above 0"),
        (("--min-points", "0"), "min_points must be 1 to"),
        (("-o", "scan.jpg"), "scan.jpg"),
        (("--json", "nowhere/out.json"), "nowhere/out.json: No such file or directory"),
        (("--report", "nowhere/out.html"), "nowhere/out.html: No such file or directory"),
    ],
)
def test_mistakes(shell: Shell, scan: Path, options: tuple[str, str], message: str) -> None:
    assert message in one_line(shell("surfaces", scan, *options))


def test_two_balls_recur(shell: Shell, tmp_path: Path) -> None:
    rng = np.random.default_rng(52)
    balls = [0.5 * sphere(rng, 0.0, 0.002, 600) + [x, 0, 0] for x in (0.0, 2.0)]
    scan = tmp_path / "scan.pcd"
    surfsig.write(scan, PointCloud(np.concatenate(balls), viewpoint=np.array([1.0, 0.0, 30.0])))
    finished = shell("surfaces", scan, "--recurrences", "--kinds", "sphere", "--json", "-")
    assert (finished.code, finished.err) == (0, "")
    values = json.loads(finished.out)["recurrences"]
    assert [[member["piece"] for member in group["members"]] for group in values["groups"]] == [[0, 1]]
    (equal,) = values["equal_surfaces"]
    assert equal["size"]["radius"] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.slow
def test_what_recurs(shell: Shell, tmp_path: Path) -> None:
    scene = recurrence_scene(7, columns=2, rows=2, kinds=("large ball",))
    path, labelled = tmp_path / "scan.pcd", tmp_path / "labelled.npz"
    # Most of the scan is the table beyond the balls.
    near = (np.abs(scene.cloud.offsets[:, :2]) < PITCH + 0.04).all(axis=1)
    surfsig.write(path, PointCloud(scene.cloud.offsets[near], viewpoint=SCANNER.viewpoint))
    finished = shell("surfaces", path, "--recurrences", "-o", labelled, "--json", tmp_path / "out.json")
    assert (finished.code, finished.err) == (0, "")
    assert f"{path}: 4 of 4 pieces in 1 groups, 1 sizes of equal surfaces" in finished.out.splitlines()
    group, balls = (line.split() for line in finished.out.splitlines()[-2:])
    assert group[:8] == ["0", "piece", "4", "0", "1", "2", "3", "score"]
    assert balls[:2] == ["sphere", "4"]
    assert float(balls[balls.index("radius") + 1]) == pytest.approx(0.021, abs=1e-4)
    values = json.loads((tmp_path / "out.json").read_text())["recurrences"]
    members = values["groups"][0]["members"]
    assert [member["piece"] for member in members] == [0, 1, 2, 3]
    assert [direction["motion"] for direction in values["groups"][0]["free_directions"]] == ["rotation"]
    # A ball may be turned: only the first one's pose is what it is by definition.
    assert [member["doubts"] for member in members] == [[], *[["free_directions"]] * 3]
    assert [member["trusted"] for member in members] == [True, False, False, False]
    assert members[1]["reasons"] == ["the overlap does not determine 1 motion"]
    assert members[1]["scale"] == pytest.approx(1.0, abs=0.01)
    (equal,) = values["equal_surfaces"]
    first, other = (values["pieces"][number]["center"] for number in (0, 1))
    moved = np.array(members[1]["pose"]) @ [*first, 1.0]
    # The middles of what is seen of two balls.
    np.testing.assert_allclose(moved[:3], other, atol=5e-3)
    assert equal["size"]["radius"] == pytest.approx(0.021, abs=1e-4)
    assert len(equal["members"]) == 4
    fields = surfsig.read(labelled).fields
    assert np.unique(fields["piece"]).tolist() == [-1, 0, 1, 2, 3]
    np.testing.assert_array_equal(fields["recurrence"], np.where(fields["piece"] >= 0, 0, -1))
