"""Surfaces of real scans, found by one call without parameters."""

from pathlib import Path

import pytest

import surfsig
from surfsig import Surface

pytestmark = pytest.mark.filterwarnings("ignore:.*the last line .* is cut off:UserWarning")

NOISY = "surfaces hardly grow where neighbouring points err alike"


def found_in(path: Path, kind: str, near: float) -> Surface:
    """Give the surface of a kind whose radius is nearest to what is expected."""
    candidates = [surface for surface in surfsig.surfaces(surfsig.read(path)) if surface.kind == kind]
    assert candidates
    return min(candidates, key=lambda surface: abs(surface.radius - near))


@pytest.mark.xfail(reason=NOISY)
def test_the_mug(shared_data: Path) -> None:
    mug = found_in(shared_data / "surfaces" / "table_scene_mug.pcd", "cylinder", 0.039)
    assert mug.radius == pytest.approx(0.039, abs=0.0015)
    assert mug.count > 1000


@pytest.mark.parametrize("number", [1, 2, 3])
def test_the_lidar_sphere(shared_data: Path, number: int) -> None:
    sphere = found_in(shared_data / "surfaces" / f"lidar_sphere_{number}.xyz", "sphere", 0.295)
    assert sphere.radius == pytest.approx(0.295, abs=0.006)
    assert sphere.count > 100


def test_three_scans_of_one_sphere_agree_within_their_intervals(shared_data: Path) -> None:
    scans = [shared_data / "surfaces" / f"lidar_sphere_{number}.xyz" for number in (1, 2, 3)]
    spheres = [found_in(scan, "sphere", 0.295) for scan in scans]
    low = max(sphere.interval[0] for sphere in spheres)
    high = min(sphere.interval[1] for sphere in spheres)
    assert low < high
    for sphere in spheres:
        assert 0.001 < sphere.radius_std < 0.006


@pytest.mark.xfail(reason=NOISY)
def test_the_gym_ball(shared_data: Path) -> None:
    ball = found_in(shared_data / "surfaces" / "gym_ball.xyz", "sphere", 0.341)
    assert ball.radius == pytest.approx(0.341, abs=0.005)
    assert ball.count > 1000
