"""Table III's acquisitions: objects, poses, patches; jittered and random poses keep what they must."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from surfsig import simulate as sim
from surfsig.errors import InvalidInputError

EXACT = sim.Scanner(noise=0.0, row_step=0.0, outlier_rate=0.0)
RADII = {
    8: 24.27, 9: 38.27, 10: 18.85, 11: 34.42, 12: 29.70, 13: 27.25, 14: 14.15, 15: 20.5, 16: 34.42, 17: 35.12,
    18: 20.5, 19: 14.15,
}  # fmt: skip
NORMALS = {
    4: (0.781, -0.499, -0.375),
    5: (-0.507, -0.028, -0.862),
    6: (-0.381, -0.334, -0.862),
    7: (-0.435, 0.268, -0.860),
}


@cache
def stated() -> tuple[sim.Acquisition, ...]:
    return tuple(sim.paper_acquisitions(0, scanner=EXACT, truth=True))


def patch(acquisition: sim.Acquisition, radius: float = 0.02) -> np.ndarray:
    distance = np.linalg.norm(acquisition.cloud.points - acquisition.center, axis=1)
    return np.flatnonzero(distance <= radius)


def sphere_radius(points: np.ndarray) -> float:
    """Radius of the algebraic least-squares sphere."""
    middle = points.mean(axis=0)
    q = points - middle
    solution = np.linalg.lstsq(np.column_stack([2 * q, np.ones(len(q))]), (q**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(solution[3] + solution[:3] @ solution[:3]))


def cylinder_radius(points: np.ndarray, axis: np.ndarray) -> float:
    """Radius of the algebraic least-squares circle across a known axis."""
    across = np.linalg.svd(axis[None])[2][1:]
    q = (points - points.mean(axis=0)) @ across.T
    solution = np.linalg.lstsq(np.column_stack([2 * q, np.ones(len(q))]), (q**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(solution[2] + solution[:2] @ solution[:2]))


def test_numbers_kinds_and_radii() -> None:
    twenty = stated()
    assert [a.number for a in twenty] == list(range(1, 21))
    kinds = ["plane"] * 7 + ["cylinder"] * 2 + ["sphere"] * 10 + ["irregular"]
    assert [a.kind for a in twenty] == kinds
    for a in twenty:
        if a.number in RADII:
            assert a.radius == pytest.approx(RADII[a.number] / 1000)
        else:
            assert a.radius == (None if a.number == 20 else np.inf)
    names = {a.number: a.name for a in twenty}
    assert (names[16], names[18], names[19]) == (names[11], names[15], names[14])


@pytest.mark.parametrize("number", range(1, 21))
def test_patch_belongs_to_the_object_at_its_stated_place(number: int) -> None:
    a = stated()[number - 1]
    inside = patch(a)
    own = inside[a.cloud.fields["surface"][inside] == 0]
    # No table, no neighbour within the patch, and enough of the object.
    assert len(own) == len(inside) > 1500
    points = a.cloud.points[own]
    if number <= 3:
        assert np.ptp(points[:, 2]) < 1e-12
    elif number <= 7:
        normal = np.linalg.svd(points - points.mean(axis=0))[2][2]
        expected = np.array(NORMALS[number]) / np.linalg.norm(NORMALS[number])
        assert abs(normal @ expected) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(a.center, (0.0, 0.0, -0.045), atol=1e-3)
    elif number <= 9:
        axis = np.array([0.0, 1.0, 0.0])
        assert cylinder_radius(points, axis) == pytest.approx(RADII[number] / 1000, rel=1e-9)
        # Lies on the table: the apex is a diameter above it.
        assert a.center[2] == pytest.approx(-2 * RADII[number] / 1000, abs=1e-5)
    elif number <= 19:
        assert sphere_radius(points) == pytest.approx(RADII[number] / 1000, rel=1e-9)
        assert a.center[2] == pytest.approx(-2 * RADII[number] / 1000, abs=1e-5)
        assert a.center[2] == pytest.approx(a.cloud.points[a.cloud.fields["surface"] == 0, 2].min(), abs=1e-5)


def test_repeats_are_rigid_displacements() -> None:
    a = stated()
    gap = [np.linalg.norm(a[i].center[:2] - a[j].center[:2]) for i, j in ((13, 14), (18, 17))]
    np.testing.assert_allclose(gap, 0.05, atol=6e-4)
    for first, again in ((11, 16), (15, 18), (14, 19)):
        moved = np.linalg.norm(a[first - 1].center[:2] - a[again - 1].center[:2])
        assert moved > 0.008


def test_true_normals_face_the_viewpoint() -> None:
    for a in stated():
        f = a.cloud.fields
        normals = np.column_stack([f["true_nx"], f["true_ny"], f["true_nz"]])
        assert a.cloud.viewpoint is not None
        assert (np.einsum("ij,ij->i", a.cloud.viewpoint - a.cloud.points, normals) > 0.0).all()


def test_default_scans_are_noisy_and_their_centres_are_no_outliers() -> None:
    a = sim.paper_acquisition(2, 1)
    f = a.cloud.fields
    plate = (f["surface"] == 0) & (f["outlier"] == 0)
    per_row = sim.Scanner().height_per_row / 8
    expected = np.sqrt(1e-4**2 + per_row**2 / 12)
    # Ten millimetres nearer, a row is a little finer.
    assert a.cloud.points[plate, 2].std() == pytest.approx(expected, rel=0.08)
    assert f["outlier"][a.center_index] == 0
    assert f["surface"][a.center_index] == 0
    # The irregular surface has hollows and hills of the other objects' size.
    k1, k2 = (stated()[19].cloud.fields[k][patch(stated()[19])] for k in ("true_k1", "true_k2"))
    assert k1.max() > 20.0
    assert k2.min() < -20.0


def test_seeds_and_order_do_not_matter_to_one_acquisition() -> None:
    all_of_them = {a.number: a for a in sim.paper_acquisitions(3, poses="random")}
    for number in (1, 8, 20):
        alone = sim.paper_acquisition(number, 3, poses="random")
        assert alone.cloud.offsets.tobytes() == all_of_them[number].cloud.offsets.tobytes()
        assert alone.center_index == all_of_them[number].center_index
    other = sim.paper_acquisition(8, 4, poses="random")
    assert other.cloud.offsets.tobytes() != all_of_them[8].cloud.offsets.tobytes()
    # Planes 2 and 3 have the same object, but not the same noise.
    assert not np.array_equal(all_of_them[2].cloud.points[:50, 2], all_of_them[3].cloud.points[:50, 2])


@pytest.mark.parametrize("number", [5, 9, 12, 18])
def test_jitter_moves_within_its_bounds_and_keeps_the_kind_of_pose(number: int) -> None:
    jitter = sim.Jitter(turn=np.radians(3.0), shift=0.005, pick=0.002)
    before = stated()[number - 1].scene.objects
    moves = []
    for seed in range(12):
        a = sim.paper_acquisition(number, seed, poses="jittered", jitter=jitter, scanner=EXACT)
        first = a.scene.objects[0].pose @ sim.inverse(before[0].pose)
        # A turn about the vertical, and no change of height.
        np.testing.assert_allclose(first[2], (0.0, 0.0, 1.0, 0.0), atol=1e-12)
        assert abs(np.degrees(np.arctan2(first[1, 0], first[0, 0]))) <= 3.0
        moves.append(a.scene.objects[0].pose[:2, 3] - before[0].pose[:2, 3])
        assert np.abs(moves[-1]).max() <= 0.005 + 1e-12
        # Neighbours move along; the table stays.
        for now, then in zip(a.scene.objects[1:-1], before[1:-1], strict=True):
            np.testing.assert_allclose(now.pose @ sim.inverse(then.pose), first, atol=1e-12)
        assert a.scene.objects[-1] is before[-1]
        own = patch(a)
        assert (a.cloud.fields["surface"][own] == 0).all()
    assert np.ptp(moves, axis=0).min() > 0.004
    still = sim.paper_acquisition(
        number, 1, poses="jittered", jitter=sim.Jitter(turn=0.0, shift=0.0, pick=0.0)
    )
    assert still.cloud.offsets.tobytes() == sim.paper_acquisition(number, 1).cloud.offsets.tobytes()


def test_random_poses_preserve_radii_and_turn_about_every_axis() -> None:
    tilts, offsets, headings = [], [], []
    for seed in range(25):
        for number in (4, 8, 13):
            a = sim.paper_acquisition(number, seed, poses="random", scanner=EXACT, truth=True)
            own = patch(a)
            assert len(own) > 1500
            points = a.cloud.points[own]
            rotation = a.scene.objects[0].pose[:3, :3]
            f = a.cloud.fields
            normal = np.array([f[f"true_n{axis}"][a.center_index] for axis in "xyz"])
            tilts.append(np.arccos(-normal[2]))
            offsets.append(a.center)
            if number == 4:
                assert np.abs((points - a.center) @ rotation[:, 2]).max() < 1e-12
            elif number == 8:
                assert cylinder_radius(points, rotation[:, 1]) != pytest.approx(0.02427, rel=1e-3)
                assert cylinder_radius(points, rotation[:, 2]) == pytest.approx(0.02427, rel=1e-9)
                assert (f["true_k1"][own] == 1 / 0.02427).all()  # no cap in the patch
                headings.append(np.arctan2(rotation[1, 2], rotation[0, 2]) % np.pi)
            else:
                assert sphere_radius(points) == pytest.approx(0.02725, rel=1e-9)
    # Off the apex by up to RANDOM_TILT (and half a sample's width), uniform on the sphere.
    assert max(tilts) < sim.RANDOM_TILT + 0.05
    expected = (1 + np.cos(sim.RANDOM_TILT)) / 2
    assert np.mean(np.cos(tilts)) == pytest.approx(expected, abs=0.025)
    assert np.ptp(headings) > np.radians(120)
    np.testing.assert_allclose(np.mean(offsets, axis=0), (0.0, 0.0, -0.045), atol=2.5e-3)


def test_bad_input_is_one_line() -> None:
    for arguments in ({"number": 0}, {"number": 21}, {"number": 1, "poses": "upside down"}):
        with pytest.raises(InvalidInputError) as caught:
            sim.paper_acquisition(seed=0, **arguments)
        assert "\n" not in str(caught.value)
    with pytest.raises(InvalidInputError, match="does not see"):
        sim.paper_acquisition(4, 0, scanner=sim.Scanner(max_incidence=np.radians(30)))
