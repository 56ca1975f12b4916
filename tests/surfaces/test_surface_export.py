"""Bounded surfaces as meshes: they lie on the surfaces, cover what the points cover, and can be read back."""

import io
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drawn_shapes
import numpy as np
import pytest
import surface_scenes
from conftest import Finished
from numpy.typing import NDArray
from surface_points import UTM, Array

import surfsig
from surfsig import InvalidInputError, PointCloud, SurfacePatch, Surfaces
from surfsig.shapes.geodesic import geodesic_sphere, halved

Shell = Callable[..., Finished]
Parts = dict[str, tuple[Array, NDArray[np.int64]]]

SCENES: dict[str, Array] = {
    "ball, pipe and floor": surface_scenes.on_a_plane().points,
    "box": surface_scenes.box().points,
    "cone": surface_scenes.cone(0.4),
    "torus": surface_scenes.torus(1.0, 0.3),
    "half a torus": surface_scenes.torus(1.0, 0.3)[surface_scenes.torus(1.0, 0.3)[:, 0] > 0],
}


@pytest.fixture(scope="module")
def found() -> Surfaces:
    return surfsig.find_surfaces(PointCloud(SCENES["ball, pipe and floor"], UTM))


def normals(patch: SurfacePatch) -> Array:
    corners = patch.vertices[patch.faces]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


@pytest.mark.parametrize("name", SCENES)
def test_a_patch_lies_on_its_surface_and_covers_what_its_points_cover(name: str) -> None:
    scene = surfsig.find_surfaces(SCENES[name])
    for surface in scene:
        patch = surface.patch(scene.cloud)
        assert np.abs(surface.distances(patch.vertices + patch.origin)).max() < 1e-12
        assert patch.area == pytest.approx(surface.area, rel=0.05)
        assert sorted(np.unique(patch.faces)) == list(range(len(patch.vertices)))
        # Outwards is where the signed distance grows.
        middles = patch.vertices[patch.faces].mean(axis=1) + patch.origin
        large = np.linalg.norm(normals(patch), axis=1) > 1e-12
        outwards = normals(patch)[large] / np.linalg.norm(normals(patch)[large], axis=1, keepdims=True)
        beyond = surface.distances(middles[large] + 1e-4 * outwards) - surface.distances(middles[large])
        assert (beyond > 0.9e-4).all()


def open_edges(patch: SurfacePatch) -> int:
    edges = np.sort(patch.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return int((np.unique(edges, axis=0, return_counts=True)[1] == 1).sum())


def test_a_pipe_is_closed_around_and_a_torus_everywhere() -> None:
    torus = surfsig.find_surfaces(SCENES["torus"])
    assert open_edges(torus[0].patch(torus.cloud)) == 0
    turns, heights = (grid.ravel() for grid in np.meshgrid(np.arange(0, 6.28, 0.05), np.arange(0, 2, 0.05)))
    points = np.column_stack([np.cos(turns), np.sin(turns), heights])
    patch = surfsig.fit_cylinder(points).patch(points)
    ends = np.abs(np.abs(patch.vertices[:, 2]) - 0.975) < 1e-9
    assert open_edges(patch) == ends.sum()
    assert patch.area == pytest.approx(2 * math.pi * 1.95, rel=0.005)


@pytest.mark.parametrize("frequency", [1, 2, 5])
def test_an_icosahedron_is_divided_evenly(frequency: int) -> None:
    vertices, faces = geodesic_sphere(frequency)
    assert (len(vertices), len(faces)) == (10 * frequency**2 + 2, 20 * frequency**2)
    patch = SurfacePatch(np.zeros(3), vertices, faces)
    assert open_edges(patch) == 0
    assert (np.sum(normals(patch) * vertices[faces].mean(axis=1), axis=1) > 0.0).all()
    finer = SurfacePatch(np.zeros(3), *halved(vertices, faces))
    assert (len(finer.vertices), len(finer.faces)) == (40 * frequency**2 + 2, 80 * frequency**2)
    assert open_edges(finer) == 0
    assert patch.area < finer.area < 4 * math.pi


def test_a_whole_ball_is_closed_and_one_on_a_stand_is_open_below() -> None:
    towards = np.random.default_rng(11).normal(size=(6000, 3))
    points = 2.0 * towards / np.linalg.norm(towards, axis=1, keepdims=True)
    whole = surfsig.fit_sphere(points).patch(points)
    assert open_edges(whole) == 0
    assert whole.area == pytest.approx(16 * math.pi, rel=0.01)
    kept = points[points[:, 2] > -1.6]
    surface = surfsig.fit_sphere(kept)
    stood = surface.patch(kept)
    assert np.abs(surface.distances(stood.vertices + stood.origin)).max() < 1e-12
    assert stood.area == pytest.approx(2 * math.pi * 2.0 * 3.6, rel=0.03)
    assert stood.vertices[:, 2].min() > -1.75


def test_holes_and_corners_are_cut_out() -> None:
    rng = np.random.default_rng(7)
    points = drawn_shapes.plane(rng, 0.0, 40_000)
    kept = (np.linalg.norm(points, axis=1) > 0.5) & ~((points[:, 0] > 0) & (points[:, 1] > 0))
    patch = surfsig.fit_plane(points[kept]).patch(points[kept])
    assert patch.area == pytest.approx(3 - 0.75 * math.pi * 0.25, rel=0.02)
    middles = patch.vertices[patch.faces].mean(axis=1) + patch.origin
    assert (np.linalg.norm(middles, axis=1) > 0.45).all()
    assert (middles[:, :2].min(axis=1) < 0.05).all()


def test_a_narrow_strip_across_the_axes_is_covered() -> None:
    rng = np.random.default_rng(8)
    along, beside = rng.uniform(0, 10, 3000), rng.uniform(0, 0.02, 3000)
    points = np.column_stack([0.6 * along - 0.8 * beside, 0.8 * along + 0.6 * beside, 0 * along])
    assert surfsig.fit_plane(points).patch(points).area == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize("ending", ["glb", "obj", "dxf"])
def test_a_file_has_each_surface_by_name_and_in_its_place(
    found: Surfaces, tmp_path: Path, ending: str
) -> None:
    path = tmp_path / f"model.{ending}"
    pytest.importorskip("ezdxf" if ending == "dxf" else "trimesh")
    found.export(path)
    parts = {"glb": read_glb, "obj": read_obj, "dxf": read_dxf}[ending](path)
    assert list(parts) == ["0 plane", "1 cylinder", "2 sphere"]
    for surface, (vertices, faces) in zip(found, parts.values(), strict=True):
        patch = surface.patch(found.cloud)
        assert np.abs(surface.distances(vertices)).max() < 1e-6
        assert len(faces) == len(patch.faces)
        assert SurfacePatch(np.zeros(3), vertices - UTM, faces).area == pytest.approx(patch.area, rel=1e-5)
    if ending != "dxf":
        every = surfsig.read(path)
        assert len(every) == sum(len(vertices) for vertices, _ in parts.values())
        nearest = np.min([np.abs(surface.distances(every)) for surface in found], axis=0)
        assert nearest.max() < 1e-6


def read_glb(path: Path) -> Parts:
    import trimesh

    scene = trimesh.load_scene(path, process=False, maintain_order=True)
    return {
        name: (mesh.vertices, mesh.faces)
        for name in sorted(scene.geometry)
        for mesh in [scene.geometry[name].copy().apply_transform(transform_of(scene, name))]
    }


def read_obj(path: Path) -> Parts:
    """Read line by line, for libraries join the objects of one material."""
    lines = [line.split() for line in path.read_text().splitlines() if line]
    starts = [number for number, line in enumerate(lines) if line[0] == "o"]
    parts, before = {}, 0
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        vertices = np.array([line[1:4] for line in lines[start:end] if line[0] == "v"], float)
        colors = {tuple(line[4:7]) for line in lines[start:end] if line[0] == "v"}
        faces = np.array([line[1:4] for line in lines[start:end] if line[0] == "f"], np.int64)
        assert len(colors) == 1
        parts[" ".join(lines[start][1:])] = (vertices, faces - 1 - before)
        before += len(vertices)
    return parts


def transform_of(scene: object, name: str) -> Array:
    (node,) = [node for node in scene.graph.nodes_geometry if scene.graph[node][1] == name]  # type: ignore[attr-defined]
    matrix: Array = scene.graph[node][0]  # type: ignore[attr-defined]
    return matrix


def read_dxf(path: Path) -> Parts:
    from ezdxf.filemanagement import read
    from ezdxf.render.mesh import MeshBuilder

    drawing = read(io.StringIO(path.read_text()))
    entities: list[Any] = list(drawing.modelspace())
    meshes = {entity.dxf.layer: MeshBuilder.from_polyface(entity) for entity in entities}
    assert drawing.layers.get("0 plane").rgb != drawing.layers.get("1 cylinder").rgb
    return {name: (np.array(m.vertices), np.array([list(f) for f in m.faces])) for name, m in meshes.items()}


def test_a_scan_without_surfaces_has_no_model(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    with pytest.raises(InvalidInputError, match="there is no surface to write"):
        surfsig.find_surfaces(np.zeros((0, 3))).export(tmp_path / "model.glb")
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_exported_is_refused_before_the_work(
    shell: Shell, found: Surfaces, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InvalidInputError, match=r"surfaces are written as \.glb, \.obj, \.dxf, not '\.step'"):
        found.export(tmp_path / "model.step")
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    scan = tmp_path / "scan.ply"
    surfsig.write(scan, found.cloud)
    finished = shell("surfaces", scan, "--export", tmp_path / "model.dxf")
    assert (finished.code, finished.err.count("\n")) == (2, 1)
    assert "ezdxf is not installed: pip install surfsig[export]" in finished.err
    assert [path.name for path in tmp_path.iterdir()] == ["scan.ply"]


@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_a_radius_that_is_not_determined_has_a_patch(kind: str) -> None:
    rng = np.random.default_rng(5)
    x, y = rng.uniform(-0.5, 0.5, (2, 2000))
    bow = x**2 if kind == "cylinder" else x**2 + y**2
    points = np.column_stack([x, y, -bow / (2.0 * 200.0)]) + rng.normal(0.0, 0.01, (2000, 3)) + 7.0
    surface = surfsig.fit_sphere(points) if kind == "sphere" else surfsig.fit_cylinder(points, axis=(0, 1, 0))
    assert math.isnan(surface.radius)
    assert not surface.radius_determined
    patch = surface.patch(points)
    assert np.abs(surface.distances(patch.vertices + patch.origin)).max() < 1e-9
    # Counted from where it is, and not from a center that may be anywhere.
    assert np.abs(patch.vertices).max() < 1.0
    assert patch.area == pytest.approx(1.0, rel=0.1)


def test_the_shell_exports(shell: Shell, found: Surfaces, tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    scan = tmp_path / "scan.ply"
    surfsig.write(scan, found.cloud)
    finished = shell("surfaces", scan, "-q", "--export", tmp_path / "model.glb")
    assert (finished.code, finished.out, finished.err) == (0, "", "")
    assert list(read_glb(tmp_path / "model.glb")) == ["0 plane", "1 cylinder", "2 sphere"]
