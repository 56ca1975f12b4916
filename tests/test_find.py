"""Instances of models: in simulated scenes of known poses, and in real ones."""

from pathlib import Path

import numpy as np
import pytest
from clutter import pose_error
from clutter_scene import clutter_scene
from clutter_scene import model as solid
from finding import errors, scored
from finding_scene import FindingScene, finding_scene, whole
from scipy.spatial.transform import Rotation

import surfsig


@pytest.fixture(scope="module")
def five() -> surfsig.Instances:
    """What is found in a scene of five half hidden copies."""
    return surfsig.find_instances(whole("figure"), finding_scene("figure", 1).cloud)


@pytest.mark.slow
def test_five_half_hidden_copies_are_all_found_and_nothing_else(five: surfsig.Instances) -> None:
    scene = finding_scene("figure", 1)
    assert (scene.hidden > 0.45).all()
    score = scored(scene, five)
    assert (score.right, score.false) == (5, 0)
    assert score.shift < 0.001
    assert score.turn < 1.0
    for instance in five.instances:
        assert 0.4 < instance.visible <= 1.0
        points = scene.cloud.points[instance.indices]
        assert np.linalg.norm(points - instance.center, axis=1).max() < 0.06
        assert np.linalg.eigvalsh(instance.covariance).min() > 0.0


@pytest.mark.slow
def test_instances_say_the_same_in_every_form(five: surfsig.Instances) -> None:
    frame, values = five.to_pandas(), five.values()["instances"]
    header, rows = five.table()
    assert len(frame) == len(values) == len(rows) == len(five) == 5
    assert {len(row) for row in rows} == {len(header)}
    assert five.summary() == "5 instances (5 of model)"
    for number, instance in enumerate(five.instances):
        assert frame["tx"][number] == values[number]["T_scene_model"][0][3] == instance.T_scene_model[0, 3]
        assert (five.labels == number).sum() == len(instance.indices) == values[number]["points"]


@pytest.mark.slow
def test_what_is_not_there_is_not_found() -> None:
    found = surfsig.find_instances(whole("figure"), finding_scene("figure", 1, copies=0, others=6).cloud)
    assert len(found) == 0
    assert found.summary() == "not there"
    assert (found.labels == -1).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "model", "truth"),
    [
        ("milk", "milk.pcd", "T_scene_from_milk_DERIVED.txt"),
        ("chef", "chef.pcd", "T_rs1_from_chef_DERIVED.txt"),
    ],
)
def test_real_objects_are_found_once_each(shared_data: Path, name: str, model: str, truth: str) -> None:
    folder = shared_data / "objects" / name
    cloud = surfsig.read(folder / model)
    found = surfsig.find_instances(cloud, surfsig.read(folder / "scene.pcd"))
    assert len(found) == 1
    # The chef's own origin is 0.6 m away from it: errors are those of its middle.
    middle = np.eye(4)
    middle[:3, 3] = np.median(cloud.points, axis=0)
    shift, turn = errors(found[0].T_scene_model @ middle, np.loadtxt(folder / truth) @ middle)
    assert shift < 0.005
    assert turn < 2.0


@pytest.mark.slow
def test_real_objects_are_not_found_in_each_others_scene(shared_data: Path) -> None:
    objects = shared_data / "objects"
    for name, other in (("milk", "chef"), ("chef", "milk")):
        model = surfsig.read(objects / name / f"{name}.pcd")
        assert len(surfsig.find_instances(model, surfsig.read(objects / other / "scene.pcd"))) == 0


@pytest.mark.slow
def test_clutter_is_no_model(shared_data: Path) -> None:
    room = surfsig.read(shared_data / "registration" / "redkitchen" / "cloud_bin_0.ply")
    assert len(surfsig.find_instances(surfsig.PointCloud(3.0 * whole("figure").points), room)) == 0


@pytest.mark.slow
def test_a_box_is_no_bracket() -> None:
    # Where the bracket's faces end, those of a larger box go on.
    scene = finding_scene("bracket with pin", 3, copies=0, others=9)
    assert len(surfsig.find_instances(whole("bracket with pin"), scene.cloud)) == 0


@pytest.mark.slow
def test_poses_from_noisy_scans_are_as_sure_as_they_say() -> None:
    scene = finding_scene("figure", 1, copies=3, others=0, noise=1e-3)
    found = surfsig.find_instances(whole("figure"), scene.cloud)
    # One of the three is found upside down, with a probability of 0.88: docs/limits.md.
    assert len(found) == 3
    assert scored(scene, found).right >= 2
    for instance in found.instances:
        true = min(scene.poses, key=lambda pose: errors(instance.T_scene_model, pose))
        if errors(instance.T_scene_model, true)[1] > 90.0:
            continue
        turn = Rotation.from_matrix(true[:3, :3] @ instance.T_scene_model[:3, :3].T).as_rotvec()
        way = (true @ np.linalg.inv(instance.T_scene_model) @ [*instance.center, 1.0])[:3] - instance.center
        motion = np.concatenate([turn, way])
        # Beyond 22.5 are a thousandth of all, if the errors are normal.
        assert motion @ np.linalg.solve(instance.covariance, motion) < 22.5


@pytest.mark.slow
def test_any_number_of_threads_finds_the_same(five: surfsig.Instances) -> None:
    alone = surfsig.find_instances(whole("figure"), finding_scene("figure", 1).cloud, threads=1)
    for one, other in zip(alone.instances, five.instances, strict=True):
        assert one.score == other.score
        np.testing.assert_array_equal(one.T_scene_model, other.T_scene_model)


@pytest.mark.slow
def test_far_away_coordinates_change_nothing() -> None:
    scene, far = finding_scene("figure", 2, copies=1, others=1), np.array([5e5, 5e6, 100.0])
    moved = surfsig.PointCloud(scene.cloud.offsets, origin=far, viewpoint=far)
    found = surfsig.find_instances(whole("figure"), moved)
    assert len(found) == 1
    pose = found[0].T_scene_model.copy()
    pose[:3, 3] -= far
    assert errors(pose, scene.poses[0])[0] < 0.001


@pytest.mark.slow
def test_a_scene_in_its_sensor_s_axes_needs_no_viewpoint(five: surfsig.Instances) -> None:
    scene = finding_scene("figure", 1)
    found = surfsig.find_instances(whole("figure"), surfsig.PointCloud(scene.cloud.offsets))
    assert [instance.score for instance in found.instances] == [instance.score for instance in five.instances]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_halves_of_copies_around_the_origin_are_all_found(seed: int) -> None:
    # Nobody saw that from the origin, which is in its midst, though few points hide others.
    rng = np.random.default_rng(seed)
    model, poses, parts = whole("figure").points, [], []
    for cell in rng.permutation(9)[:5]:
        pose = np.eye(4)
        pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
        pose[:3, 3] = [0.1 * (cell % 3 - 1), 0.1 * (cell // 3 - 1), rng.uniform(-0.02, 0.02)]
        half = model[(model - model.mean(axis=0)) @ rng.normal(size=3) > 0.0]
        parts.append(half @ pose[:3, :3].T + pose[:3, 3] + rng.normal(0.0, 1e-4, half.shape))
        poses.append(pose)
    floor = np.column_stack([rng.uniform(-0.2, 0.2, (20_000, 2)), np.full(20_000, -0.07)])
    found = surfsig.find_instances(whole("figure"), np.concatenate([*parts, floor]))
    score = scored(FindingScene(found.cloud, np.array(poses), np.full(5, 0.5)), found)
    assert (score.right, score.false) == (5, 0)


@pytest.mark.slow
def test_points_a_million_metres_away_change_nothing() -> None:
    scene, far = finding_scene("figure", 2, copies=1, others=1), [[1e6, -2e6, 1e6]]
    model = surfsig.PointCloud(np.concatenate([whole("figure").points, far]))
    points = np.concatenate([scene.cloud.points, far])
    found = surfsig.find_instances(model, surfsig.PointCloud(points, viewpoint=scene.cloud.viewpoint))
    assert len(found) == 1
    # That the points are there is seen in the last digits only.
    (near,) = surfsig.find_instances(whole("figure"), scene.cloud).instances
    np.testing.assert_allclose(found[0].T_scene_model, near.T_scene_model, atol=1e-6)
    assert len(points) - 1 not in found[0].indices


@pytest.mark.parametrize("score", [0.0, 1.5, np.nan, "much"])
def test_a_score_without_meaning_is_said(score: float) -> None:
    with pytest.raises(surfsig.InvalidInputError, match="score must be"):
        surfsig.find_instances(np.zeros((100, 3)), np.zeros((100, 3)), score=score)


def test_models_without_extent_or_points_are_said() -> None:
    with pytest.raises(surfsig.InvalidInputError, match="50 finite points"):
        surfsig.find_instances(np.zeros((10, 3)), np.zeros((100, 3)))
    with pytest.raises(surfsig.InvalidInputError, match="one place"):
        surfsig.find_instances(np.zeros((100, 3)), np.zeros((100, 3)))


def test_nothing_is_in_an_empty_scene() -> None:
    assert len(surfsig.find_instances(whole("figure"), np.zeros((0, 3)))) == 0
    assert len(surfsig.find_instances(whole("figure"), np.zeros((100, 3)))) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "number"), [(1008, 0), (1007, 19)])
def test_right_transforms_were_outvoted_by_matches_with_common_places(seed: int, number: int) -> None:
    """Of solids in clutter, much of whose surface is like much of the scene."""
    scene = clutter_scene(seed)
    found = surfsig.find_instances(solid(number), scene.cloud)
    true = scene.poses[list(scene.numbers).index(number)]
    assert pose_error(found[0].T_scene_model, true, number) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "number"), [(720, 15), (733, 8)], ids=["the fit", "the alignment"])
def test_true_poses_were_lost_where_a_fit_left_them(seed: int, number: int) -> None:
    """Of solids in clutter, where what a camera sees hardly determines some motions."""
    scene = clutter_scene(seed)
    found = surfsig.find_instances(solid(number), scene.cloud)
    assert len(found) == 1
    true = scene.poses[list(scene.numbers).index(number)]
    assert pose_error(found[0].T_scene_model, true, number) < 0.05


@pytest.mark.slow
def test_rivals_count_although_the_coarse_surface_refutes_them() -> None:
    cloud = clutter_scene(726).cloud
    # With so small a probability all transforms are judged by the fine surface, whatever the coarse one says.
    few, beside_all = (
        surfsig.find_instances(solid(3), cloud, score=score, at_most=1).instances for score in (0.5, 1e-9)
    )
    assert len(few) == len(beside_all) == 1
    assert few[0].score == beside_all[0].score
    assert few[0].measures["margin_over_rivals"] < 8.0
