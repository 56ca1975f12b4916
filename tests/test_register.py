"""How a scan lies in another: poses that are known, and what is said where there is none."""

from pathlib import Path

import numpy as np
import pytest
from register_scenes import error, moved, pose, terrain

import surfsig
from surfsig import InvalidInputError, PointCloud, Registration

SEED = 31
ABOVE = np.array([0.2, 0.1, 4.0])


@pytest.fixture(scope="module")
def parts() -> tuple[PointCloud, PointCloud, np.ndarray]:
    """Two scans of one terrain that overlap by a half, the first moved; and T_second_first."""
    rng = np.random.default_rng(SEED)
    first, second = terrain(rng, 25_000, -1.4, 0.6), terrain(rng, 25_000, -0.4, 1.6)
    truth = pose(rng)
    back = np.linalg.inv(truth)
    source = PointCloud(moved(first, back), viewpoint=moved(ABOVE[None], back)[0])
    return source, PointCloud(second, viewpoint=ABOVE), truth


def check(found: Registration, truth: np.ndarray) -> None:
    """The pose is within its errors, which are small."""
    assert found.trusted
    assert found.free_directions == []
    motion = error(found.T_target_source, truth, found.center)
    assert motion @ np.linalg.solve(found.covariance, motion) < 30
    assert np.sqrt(np.diag(found.covariance)).max() < 0.002


def test_two_scans_that_overlap_by_half(parts: tuple[PointCloud, PointCloud, np.ndarray]) -> None:
    source, target, truth = parts
    found = surfsig.register(source, target)
    check(found, truth)
    assert 0.35 < found.overlap < 0.6
    assert found.rms == pytest.approx(0.002 * np.sqrt(1.25), rel=0.15)
    assert 32 <= found.inliers <= found.matches


@pytest.mark.slow
def test_nobody_knows_where_the_sensors_stood(parts: tuple[PointCloud, PointCloud, np.ndarray]) -> None:
    source, target, truth = parts
    check(surfsig.register(source.offsets, target.offsets), truth)
    check(surfsig.register(source.offsets, target), truth)
    check(surfsig.register(source, target.offsets), truth)


def test_the_way_back_is_the_inverse(parts: tuple[PointCloud, PointCloud, np.ndarray]) -> None:
    source, target, truth = parts
    check(surfsig.register(target, source), np.linalg.inv(truth))


def test_far_from_zero(parts: tuple[PointCloud, PointCloud, np.ndarray]) -> None:
    """At UTM coordinates, where float32 has steps of half a metre."""
    source, target, truth = parts
    far = np.array([500_000.0, 4_500_000.0, 100.0])
    moved_target = PointCloud(target.offsets, origin=far, viewpoint=ABOVE + far)
    found = surfsig.register(source, moved_target)
    shift = np.eye(4)
    shift[:3, 3] = far
    check(found, shift @ truth)


def test_threads_and_repetition_do_not_matter(parts: tuple[PointCloud, PointCloud, np.ndarray]) -> None:
    source, target, _ = parts
    first, second = (surfsig.register(source, target, threads=threads) for threads in (1, 2))
    assert np.array_equal(first.T_target_source, second.T_target_source)
    assert np.array_equal(first.covariance, second.covariance)
    assert first.values() == second.values()


def test_a_start_is_refined(parts: tuple[PointCloud, PointCloud, np.ndarray]) -> None:
    source, target, truth = parts
    rough = np.eye(4)
    rough[:3, 3] = (0.01, -0.01, 0.01)
    found = surfsig.register(source, target, init=rough @ truth)
    check(found, truth)
    assert (found.matches, found.inliers) == (0, 0)


@pytest.mark.slow
def test_covariances_are_those_of_many_draws() -> None:
    """The mean squared error in units of the covariance is that of six numbers."""
    squares = []
    for seed in range(SEED, SEED + 25):
        rng = np.random.default_rng(seed)
        source, target = terrain(rng, 2500, -1, 1), terrain(rng, 2500, -1, 1)
        truth = pose(rng)
        found = surfsig.register(moved(source, np.linalg.inv(truth)), target, init=truth)
        motion = error(found.T_target_source, truth, found.center)
        squares.append(motion @ np.linalg.solve(found.covariance, motion) / 6)
    assert 0.7 < np.mean(squares) < 1.45


def test_what_does_not_belong_together_is_not_trusted(
    parts: tuple[PointCloud, PointCloud, np.ndarray],
) -> None:
    rng = np.random.default_rng(SEED)
    # The waves come again after 2 pi: from 5 to 7 they would be those of the first scan.
    other = terrain(rng, 25_000, 7.5, 9.5)
    assert not surfsig.register(parts[0], PointCloud(other, viewpoint=ABOVE + np.array([8.5, 0, 0]))).trusted


def test_a_plane_slides_and_turns() -> None:
    rng = np.random.default_rng(SEED)
    flat = [np.column_stack([rng.uniform(-1, 1, (8000, 2)), 0.002 * rng.normal(size=8000)]) for _ in "ab"]
    found = surfsig.register(flat[0], flat[1], init=np.eye(4))
    assert not found.trusted
    assert sorted(free.motion for free in found.free_directions) == ["rotation", "translation", "translation"]
    for free in found.free_directions:
        assert abs(free.axis[2]) == pytest.approx(float(free.motion == "rotation"), abs=0.02)


def test_a_pipe_slides_along_its_axis() -> None:
    rng = np.random.default_rng(SEED)
    pipes = []
    for _ in "ab":
        turn, height = rng.uniform(0, 2 * np.pi, 8000), rng.uniform(-2, 2, 8000)
        radius = 0.5 + 0.002 * rng.normal(size=8000)
        pipes.append(np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height]))
    found = surfsig.register(pipes[0], pipes[1], init=np.eye(4))
    assert not found.trusted
    assert sorted(free.motion for free in found.free_directions) == ["rotation", "translation"]
    assert all(abs(free.axis[2]) > 0.999 for free in found.free_directions)


@pytest.mark.parametrize(
    "cloud",
    [np.zeros((0, 3)), np.eye(3), np.ones((500, 3)), np.full((500, 3), np.nan)],
    ids=["empty", "three points", "one place", "nothing finite"],
)
def test_nothing_to_register(cloud: np.ndarray, parts: tuple[PointCloud, PointCloud, np.ndarray]) -> None:
    for found in (surfsig.register(cloud, parts[1]), surfsig.register(parts[0], cloud)):
        assert not found.trusted
        assert np.isnan(found.T_target_source).all()
        assert np.isnan(found.covariance).all()
        assert found.values()["T_target_source"] is None


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"init": np.zeros((3, 3))}, "init must be a pose .*its shape is"),
        ({"init": "here"}, "init must be a pose .*it is no array of numbers"),
        ({"init": np.diag([2, 2, 2, 1])}, "init must be a pose .*it scales or shears"),
        ({"init": np.diag([1, 1, -1, 1])}, "init must be a pose .*it mirrors"),
        ({"radius": 0}, "radius must be"),
        ({"count": 0}, "count must be"),
        ({"threads": 0}, "threads must be"),
    ],
)
def test_arguments_without_a_meaning(wrong: dict[str, object], words: str) -> None:
    with pytest.raises(InvalidInputError, match=words):
        surfsig.register(np.eye(3), np.eye(3), **wrong)  # type: ignore[arg-type]


def test_a_cloud_is_moved_with_its_viewpoint_and_normals(
    parts: tuple[PointCloud, PointCloud, np.ndarray],
) -> None:
    source, target, _ = parts
    found = surfsig.register(source, target)
    named = PointCloud(
        source.offsets[:5],
        viewpoint=source.viewpoint,
        fields={"nx": np.ones(5), "ny": np.zeros(5), "nz": np.zeros(5), "intensity": np.arange(5)},
    )
    there = found.transform_cloud(named)
    np.testing.assert_allclose(there.points, found.transform_points(source.points[:5]), atol=1e-9)
    assert there.viewpoint is not None
    np.testing.assert_allclose(there.viewpoint, ABOVE, atol=0.01)
    turned = np.column_stack([there.fields[name] for name in ("nx", "ny", "nz")])
    np.testing.assert_allclose(turned, np.tile(found.T_target_source[:3, 0], (5, 1)))
    assert there.fields["intensity"].tolist() == [0, 1, 2, 3, 4]


@pytest.mark.slow
def test_fragments_of_a_kitchen(shared_data: Path) -> None:
    """Two that overlap by a fifth, each in the axes of its own camera."""
    folder = shared_data / "registration" / "redkitchen"
    clouds = [
        PointCloud(surfsig.read(folder / f"cloud_bin_{number}.ply").points, viewpoint=np.zeros(3))
        for number in (1, 5)
    ]
    lines = (folder / "gt.log").read_text().splitlines()
    place = next(i for i, line in enumerate(lines) if line.split()[:2] == ["1", "5"])
    truth = np.array([[float(value) for value in line.split()] for line in lines[place + 1 : place + 5]])
    found = surfsig.register(clouds[1], clouds[0])
    assert found.trusted
    motion = error(found.T_target_source, truth, np.zeros(3))
    assert np.degrees(np.linalg.norm(motion[:3])) < 5
    assert np.linalg.norm(motion[3:]) < 0.1
