import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig
from surfsig.files import read, write
from surfsig.point_cloud import PointCloud

RADIUS = 0.05
PLACES = ("--at", "0,0,1.5", "--at", "0.1,-0.1,1.5204")


@pytest.fixture(scope="module")
def saddle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    x, y = (part.ravel() for part in np.meshgrid(*[np.linspace(-0.2, 0.2, 81)] * 2))
    path = tmp_path_factory.mktemp("saddle") / "saddle.npz"
    write(path, PointCloud(np.column_stack([x, y, 1 + 2 * x * x - 2 * y * y]), viewpoint=np.zeros(3)))
    return path


def test_two_places_of_a_ball(shell: Callable[..., Any], ball: Path) -> None:
    finished = shell("compare", ball, ball, *PLACES, "--radius", RADIUS, "--json")
    assert (finished.code, finished.err) == (0, "")
    values = json.loads(finished.out)
    assert values["class"] == "optimal"
    assert 0.99 < values["zeta"] <= 1
    for name in "ab":
        assert values[name]["k1"] == pytest.approx(2, rel=0.02)
        assert values[name]["k2"] == pytest.approx(2, rel=0.02)
        assert values[name]["count"] > 20
    found = [surfsig.extract(read(ball), RADIUS, at=[at]) for at in ([0, 0, 1.5], [0.1, -0.1, 1.5204])]
    assert values["flat_atom"] == surfsig.flat_atom_length(*found)
    signatures = [one.signatures([0], flat_atom=values["flat_atom"])[0] for one in found]
    assert values["zeta"] == pytest.approx(float(surfsig.similarity(*signatures)), abs=1e-6)


def test_a_ball_and_a_saddle(shell: Callable[..., Any], ball: Path, saddle: Path) -> None:
    at = ("--at", "0,0,1.5", "--at", "0,0,1")
    values = json.loads(shell("compare", ball, saddle, *at, "--radius", RADIUS, "--json").out)
    assert values["class"] == "dissimilar"
    assert values["zeta"] < 0.5
    assert values["b"]["k1"] == pytest.approx(4, rel=0.02)
    assert values["b"]["k2"] == pytest.approx(-4, rel=0.02)


def test_two_places_of_a_perfect_plane(shell: Callable[..., Any], tmp_path: Path) -> None:
    x, y = (part.ravel() for part in np.meshgrid(*[np.linspace(-0.2, 0.2, 81)] * 2))
    path = tmp_path / "plane.npz"
    write(path, PointCloud(np.column_stack([x, y, np.ones_like(x)])))
    at = ("--at", "0,0,1", "--at", "0.05,0,1")
    values = json.loads(shell("compare", path, path, *at, "--radius", RADIUS, "--json").out)
    assert values["class"] == "optimal"
    assert values["zeta"] == pytest.approx(1, abs=1e-3)


def test_for_a_person(shell: Callable[..., Any], ball: Path) -> None:
    finished = shell("compare", ball, ball, *PLACES, "--radius", RADIUS, "--axes", "sensor")
    assert finished.code == 0
    for words in ("zeta", "k1 ", "k2 ", "sensor axes", "ball.ply at 0, 0, 1.5"):
        assert words in finished.out


@pytest.mark.parametrize(
    ("at", "message"),
    [
        (("--at", "0,0,1.5"), "give --at twice"),
        ((*PLACES, "--at", "0,0,0"), "give --at twice"),
        (("--at", "0,0,1.5", "--at", "0,0"), "'0,0' is not three numbers"),
        (
            ("--at", "0,0,1.5", "--at", "9,9,9"),
            "no signature at 9,9,9: too few points (0 points within 0.05)",
        ),
    ],
)
def test_places_that_cannot_be_compared(
    shell: Callable[..., Any], ball: Path, at: tuple[str, ...], message: str
) -> None:
    finished = shell("compare", ball, ball, *at, "--radius", RADIUS)
    assert (finished.code, finished.out) == (2, "")
    assert finished.err.startswith("surfsig: error: ")
    assert message in finished.err
    assert finished.err.count("\n") == 1
