"""The trajectory of a simulated lidar through a building, whose truth is known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import moving_sensor
import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, Odometry, PointCloud, ScanStatus, TimedScan, simulate
from surfsig._surfsig import SCAN_STATUS_NAMES
from surfsig.geometry import adjoint

Array = NDArray[np.float64]

NOTHING = PointCloud(np.zeros((0, 3)))


@dataclass
class Walk:
    """Scans, and where they were taken: T_building_sensor, (n, 4, 4)."""

    scans: list[PointCloud]
    true: Array


@pytest.fixture(scope="module")
def walk() -> Walk:
    """Through the first room and into the corridor: 12 m in steps of 28 cm."""
    scene = moving_sensor.building()
    true = moving_sensor.way(90)[:42]
    return Walk([moving_sensor.scan(scene, pose, seed) for seed, pose in enumerate(true)], true)


@pytest.fixture(scope="module")
def found(walk: Walk) -> Odometry:
    return surfsig.estimate_odometry(walk.scans)


@pytest.mark.slow
def test_drift_is_below_two_thousandths_of_the_way(found: Odometry, walk: Walk) -> None:
    assert found.counts() == {"tracked": 42, "relocalised": 0, "lost": 0, "too_few_points": 0}
    off, turned = moving_sensor.errors(found.poses, walk.true)
    steps = np.linalg.norm(np.diff(walk.true[:, :3, 3], axis=0), axis=1)
    assert found.length == pytest.approx(steps.sum(), rel=2e-3)
    assert off.max() < 0.002 * found.length
    assert np.degrees(turned.max()) < 0.1
    np.testing.assert_array_equal(found.poses[0], np.eye(4))
    np.testing.assert_array_equal(found.timestamps, np.arange(42))


@pytest.mark.slow
def test_covariances_are_as_large_as_the_errors(found: Odometry, walk: Walk) -> None:
    motions = moving_sensor.missing_motions(found.poses, walk.true)[1:]
    nees = np.einsum("ni,nij,nj->n", motions, np.linalg.inv(found.covariances[1:]), motions)
    # 6 for Gaussian errors whose covariance is known.
    assert 6 / 4 < nees.mean() < 6 * 4
    np.testing.assert_allclose(found.covariances, found.covariances.transpose(0, 2, 1), atol=1e-18)
    # The map goes on from the first scan, and errors with it.
    sizes = np.trace(found.covariances[:, 3:, 3:], axis1=1, axis2=2)
    assert sizes[0] == 0
    assert sizes[-8:].mean() > 2 * sizes[1:9].mean()


@pytest.mark.slow
def test_a_sensor_that_was_carried_away_is_found_again(walk: Walk) -> None:
    carried = [*range(0, 32, 2), 5, 7]
    result = surfsig.estimate_odometry([walk.scans[number] for number in carried])
    assert result.status.tolist() == [0] * 16 + [ScanStatus.RELOCALISED, 0]
    off, turned = moving_sensor.errors(result.poses, walk.true[carried])
    assert off.max() < 0.03
    assert np.degrees(turned.max()) < 0.2


@pytest.mark.slow
def test_a_building_with_the_same_walls_was_taken_for_the_mapped_one(walk: Walk) -> None:
    other = moving_sensor.building(100)
    away = [moving_sensor.scan(other, walk.true[number], 1000 + number) for number in (3, 4, 12)]
    result = surfsig.estimate_odometry([*walk.scans[:20:2], *away])
    assert result.status.tolist() == [0] * 10 + [ScanStatus.LOST] * 3


@pytest.mark.slow
def test_a_fast_sensor_was_lost_for_good_after_two_scans_of_noise(walk: Walk) -> None:
    """It is looked for where its motion brought it meanwhile, beyond the map's rim."""
    scans, true = walk.scans[:41:4], walk.true[:41:4]
    noise = np.random.default_rng(1).normal(0.0, 2.0, (2, 5000, 3))
    scans[7:9] = [PointCloud(points, viewpoint=np.zeros(3)) for points in noise]
    result = surfsig.estimate_odometry(scans)
    assert result.status.tolist() == [0] * 7 + [ScanStatus.LOST] * 2 + [0] * 2
    off, _ = moving_sensor.errors(result.poses, true)
    assert np.nanmax(off) < 0.02


@pytest.mark.slow
def test_something_that_moves_before_the_sensor_does_not_end_the_way(walk: Walk) -> None:
    """A column 0.6 m wide crosses the room 1.5 m ahead."""
    scans = list(walk.scans[:16])
    for step, number in enumerate(range(8, 13)):
        pose = walk.true[number]
        place = pose[:3, 3] + pose[:3, :3] @ np.array([1.5, 0.4 * step - 0.8, 0.0])
        column = simulate.Placed(simulate.Box((0.6, 0.6, 2.0)), simulate.pose(tuple(place)))
        scene = simulate.Scene([*moving_sensor.building().objects, column])
        scans[number] = moving_sensor.scan(scene, pose, number)
    result = surfsig.estimate_odometry(scans)
    assert result.counts()["tracked"] == 16
    off, _ = moving_sensor.errors(result.poses, walk.true[:16])
    assert off.max() < 0.02


def test_scans_without_a_place_do_not_stop_the_rest(walk: Walk) -> None:
    """No points, a few, none that is finite, and a place that was never seen: then on as before."""
    elsewhere = moving_sensor.scan(
        simulate.Scene([simulate.Placed(simulate.Box((1.0, 0.7, 0.5)))]), np.eye(4), seed=0
    )
    few = PointCloud(walk.scans[3].points[:49])
    blind = PointCloud(np.concatenate([np.full((500, 3), np.nan), np.full((500, 3), 1e200)]))
    scans = [NOTHING, *walk.scans[:4], NOTHING, walk.scans[5], few, blind, elsewhere, *walk.scans[8:10]]
    result = surfsig.estimate_odometry(scans)
    few_points, lost = ScanStatus.TOO_FEW_POINTS, ScanStatus.LOST
    assert result.status.tolist() == [
        few_points, 0, 0, 0, 0, few_points, 0, few_points, few_points, lost, 0, 0
    ]  # fmt: skip
    without = np.isin(result.status, (few_points, lost))
    assert np.isnan(result.poses[without]).all()
    assert np.isnan(result.covariances[without]).all()
    off, _ = moving_sensor.errors(result.poses[~without], walk.true[[0, 1, 2, 3, 5, 8, 9]])
    assert off.max() < 0.02


def test_only_empty_scans() -> None:
    result = surfsig.estimate_odometry([NOTHING, NOTHING])
    assert result.status.tolist() == [ScanStatus.TOO_FEW_POINTS] * 2
    assert np.isnan(result.poses).all()
    assert np.isnan(result.voxel)
    assert result.length == 0


@pytest.mark.slow
def test_the_same_for_any_number_of_threads(walk: Walk) -> None:
    scans = [*walk.scans[:12:3], walk.scans[1]]
    first, second = (surfsig.estimate_odometry(scans, threads=threads) for threads in (1, 2))
    for name in ("poses", "covariances", "status", "overlaps", "voxel"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_unit_and_place_of_the_frame_do_not_matter(walk: Walk) -> None:
    """In millimetres, and the sensor not at 0 of its frame but at a known viewpoint."""
    plain = surfsig.estimate_odometry(walk.scans[:8])
    shift = np.array([3000.0, -2000.0, 500.0])
    scans = [
        PointCloud(1000.0 * c.points.astype(np.float64) + shift, viewpoint=shift) for c in walk.scans[:8]
    ]
    result = surfsig.estimate_odometry(scans)
    frame = np.eye(4)
    frame[:3, 3] = shift
    expected = plain.poses.copy()
    expected[:, :3, 3] *= 1000.0
    expected = frame @ expected @ np.linalg.inv(frame)
    np.testing.assert_allclose(result.poses, expected, atol=1.0)
    unit = np.repeat([1.0, 1000.0], 3)
    carried = adjoint(frame) * unit
    # Another rounding may take other places for the same.
    np.testing.assert_allclose(
        np.sqrt(np.diagonal(result.covariances, axis1=1, axis2=2)),
        np.sqrt(np.diagonal(carried @ plain.covariances @ carried.T, axis1=1, axis2=2)),
        rtol=0.3,
    )


def test_a_stray_point_far_away_does_not_make_the_voxel(walk: Walk) -> None:
    stray = PointCloud(np.vstack([walk.scans[0].points, [[1e9, 0, 0]]]), viewpoint=np.zeros(3))
    result = surfsig.estimate_odometry([stray, walk.scans[1]])
    assert result.status.tolist() == [0, 0]
    assert result.voxel == pytest.approx(surfsig.estimate_odometry(walk.scans[:1]).voxel, rel=0.05)


def test_a_map_that_is_empty_is_no_new_beginning(walk: Walk) -> None:
    """With no place in the map's range the second scan is lost, not the first of a new way."""
    result = surfsig.estimate_odometry(walk.scans[:2], map_range=0.01)
    assert result.status.tolist() == [ScanStatus.TRACKED, ScanStatus.LOST]


@pytest.mark.parametrize("viewpoint", [None, np.zeros(3)], ids=["none", "a PCD's"])
def test_scans_in_coordinates_of_a_map_without_a_true_viewpoint(walk: Walk, viewpoint: Array | None) -> None:
    origin = np.array([5e5, 5e6, 100.0])
    scans = [PointCloud(cloud.points, origin=origin, viewpoint=viewpoint) for cloud in walk.scans[:3]]
    result = surfsig.estimate_odometry(scans)
    assert result.status.tolist() == [0, 0, 0]
    frame = np.eye(4)
    frame[:3, 3] = origin
    off, _ = moving_sensor.errors(np.linalg.inv(frame) @ result.poses @ frame, walk.true[:3])
    assert off.max() < 0.01


def test_scans_are_read_one_by_one(walk: Walk) -> None:
    """Each is asked for after the one before is done, and let go."""
    events: list[str] = []

    def scans() -> Iterator[TimedScan]:
        for number, cloud in enumerate(walk.scans[:3]):
            events.append(f"read {number}")
            yield TimedScan(10.5 + number, cloud)

    result = surfsig.estimate_odometry(
        scans(), progress=lambda done, total: events.append(f"{done} of {total}")
    )
    assert events == ["read 0", "1 of 1", "read 1", "2 of 2", "read 2", "3 of 3"]
    assert result.timestamps.tolist() == [10.5, 11.5, 12.5]


def test_mistakes_are_told() -> None:
    cloud = PointCloud(np.random.default_rng(0).normal(size=(100, 3)))
    for name in ("voxel", "distance", "map_range"):
        with pytest.raises(InvalidInputError, match=f"^{name} must be"):
            surfsig.estimate_odometry([cloud], **{name: -1.0})  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match="there are no scans"):
        surfsig.estimate_odometry([])
    with pytest.raises(InvalidInputError, match="scans must be several"):
        surfsig.estimate_odometry(cloud)  # type: ignore[arg-type]


def test_statuses_have_the_numbers_and_names_of_the_core() -> None:
    assert [status.name.lower() for status in ScanStatus] == SCAN_STATUS_NAMES
    assert [int(status) for status in ScanStatus] == list(range(len(SCAN_STATUS_NAMES)))
