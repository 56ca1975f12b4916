"""What is looked for and where, and how it is written."""

import csv
import sqlite3
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from finding_scene import finding_scene, whole

import surfsig
from surfsig.cli import run
from surfsig.files.ply_elements import element_blocks
from surfsig.finding.library import stored_model
from surfsig.finding.model_files import outer_surface


@pytest.fixture(scope="module")
def found() -> surfsig.Instances:
    """One copy among two models, where a mask lets it be."""
    scene = finding_scene("figure", 2, copies=1, others=0)
    around = np.linalg.norm(scene.cloud.points - scene.poses[0][:3, 3], axis=1) < 0.06
    models = {"obj_000007": whole("figure", 6000), "ball": ball(0.02)}
    return surfsig.find_instances(models, scene.cloud, only="obj_000007", mask=around, at_most=1)


def ball(radius: float) -> surfsig.PointCloud:
    directions = np.random.default_rng(1).normal(size=(3000, 3))
    return surfsig.PointCloud(radius * directions / np.linalg.norm(directions, axis=1, keepdims=True))


def test_a_mask_keeps_the_numbers_of_the_scene_s_points(found: surfsig.Instances) -> None:
    scene = finding_scene("figure", 2, copies=1, others=0)
    assert len(found) == 1
    assert found.sought == found.values()["models"] == 1
    points = scene.cloud.points[found[0].indices]
    assert np.linalg.norm(points - scene.poses[0][:3, 3], axis=1).max() < 0.06
    assert 0.7 <= found[0].score <= 1.0
    assert set(found[0].measures) >= {"confirmed", "contradicted", "missing", "agreement"}


def test_poses_are_written_as_bop_and_ros_have_them(found: surfsig.Instances, tmp_path: Path) -> None:
    found.write_bop(tmp_path / "poses.csv", scene_id=3, image_id=14, seconds=0.5)
    with (tmp_path / "poses.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (row["scene_id"], row["im_id"], row["obj_id"], row["time"]) == ("3", "14", "7", "0.5")
    pose = found[0].T_scene_model
    np.testing.assert_allclose(np.array(row["R"].split(), float).reshape(3, 3), pose[:3, :3], atol=1e-8)
    np.testing.assert_allclose(np.array(row["t"].split(), float), 1000.0 * pose[:3, 3], atol=1e-5)
    x, y, z, w = found[0].values()["quaternion"]
    assert np.isclose(x * x + y * y + z * z + w * w, 1.0)
    assert np.isclose(pose[1, 0] - pose[0, 1], 4.0 * w * z, atol=1e-9)


def test_what_cannot_be_looked_for_is_said() -> None:
    models, scene = {"ball": ball(0.02)}, np.random.default_rng(0).normal(size=(100, 3))
    for wrong, text in (
        ({"only": "cube"}, "no model 'cube'"),
        ({"only": []}, "a model's name"),
        ({"mask": np.ones(99, bool)}, "100 values of bool"),
        ({"mask": np.ones(100)}, "100 values of bool"),
        ({"at_most": 0}, "at_most must be"),
        ({"at_most": True}, "at_most must be"),
    ):
        with pytest.raises(surfsig.InvalidInputError, match=text):
            surfsig.find_instances(models, scene, **wrong)
    with pytest.raises(surfsig.InvalidInputError, match="there is one model"):
        surfsig.find_instances(ball(0.02), scene, only="ball")


def test_what_is_inside_an_object_is_left_out() -> None:
    outer, inner = ball(0.05).points, ball(0.02).points
    normals = outer / np.linalg.norm(outer, axis=1, keepdims=True)
    inside = inner / np.linalg.norm(inner, axis=1, keepdims=True)
    # Every other outer normal points inwards.
    normals[::2] *= -1.0
    fields = dict(
        zip(("nx", "ny", "nz"), np.concatenate([normals, inside]).T.astype(np.float32), strict=True)
    )
    seen = outer_surface(surfsig.PointCloud(np.concatenate([outer, inner]), fields=fields))
    radius = np.linalg.norm(seen.points, axis=1)
    assert (radius > 0.03).sum() == len(outer)
    assert (radius < 0.03).mean() < 0.01
    found = np.stack([seen.fields[name] for name in ("nx", "ny", "nz")], axis=1)
    assert (np.einsum("ij,ij->i", found, seen.points)[radius > 0.03] > 0.0).all()


def write_box(path: Path) -> None:
    vertices = [(x, y, z) for x in (0, 80) for y in (0, 50) for z in (0, 30)]
    faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a} {b} {c} {d}" for a, b, c, d in faces]
    path.write_text("\n".join(lines) + "\n")


def test_a_folder_of_meshes_becomes_a_library(tmp_path: Path) -> None:
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    for name in ("one.obj", "two.obj"):
        write_box(meshes / name)
    (meshes / "notes.txt").write_text("no model")
    library = tmp_path / "things.db"
    assert run(["library", "add", str(library), str(meshes), "--unit", "mm"]) == 0
    assert surfsig.Library(library).names() == ("one", "two")
    points = surfsig.Library(library).get("one").points
    np.testing.assert_allclose(np.ptp(points, axis=0), [0.08, 0.05, 0.03], atol=2e-3)
    write_box(tmp_path / "one.stl.obj")
    assert set(dict(surfsig.read_models([meshes / "one.obj", tmp_path / "one.stl.obj"]))) == {
        "one",
        "one.stl",
    }
    with pytest.raises(surfsig.InvalidInputError, match="same name"):
        surfsig.read_models([meshes, meshes / "one.obj"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(surfsig.InvalidInputError, match="without models"):
        surfsig.read_models([tmp_path / "empty"])


def test_a_cloud_stays_as_it_is_and_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    surfsig.write(tmp_path / "ball.pcd", ball(0.02))
    assert len(surfsig.read_model(tmp_path / "ball.pcd")) == 3000
    surfsig.write(tmp_path / "ball.ply", ball(0.02))
    header, end, values = (tmp_path / "ball.ply").read_bytes().partition(b"end_header\n")
    faces = b"element face 0\nproperty list uchar int vertex_indices\n"
    (tmp_path / "ball.ply").write_bytes(header + faces + end + values)
    blocks = mock.Mock(side_effect=element_blocks)
    monkeypatch.setattr("surfsig.files.ply.element_blocks", blocks)
    assert len(surfsig.read_model(tmp_path / "ball.ply")) == 3000
    assert blocks.call_count == 1
    with pytest.raises(surfsig.InvalidInputError, match="no faces"):
        surfsig.read_model(tmp_path / "ball.ply", samples=100)


def test_a_model_of_an_older_library_is_prepared_again(tmp_path: Path) -> None:
    library = surfsig.Library(tmp_path / "things.db")
    library.add("figure", whole("figure", 3000))
    import io
    import zlib

    with sqlite3.connect(library.path) as store:
        (packed,) = store.execute("SELECT arrays FROM models").fetchone()
        with np.load(io.BytesIO(zlib.decompress(packed))) as arrays:
            old = {name: arrays[name] for name in ("points", "middle", "places", "normals")}
        file = io.BytesIO()
        np.savez(file, **old)
        store.execute("UPDATE models SET arrays = ?, size = ?", (zlib.compress(file.getvalue()), file.tell()))
        store.execute("PRAGMA user_version = 1")
    model = stored_model(library, "figure")
    assert len(model.larger_signatures) == 2
    radii = [model.radius, *(larger.radius for larger in model.larger_signatures)]
    np.testing.assert_allclose(np.diff(np.log2(radii)), 0.5)
