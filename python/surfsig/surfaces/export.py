"""Bounded surfaces for programs that show or build: meshes as GLB, OBJ and DXF.

trimesh (MIT, 5 MB, needs NumPy only, a release every few weeks) writes GLB and OBJ; pygltflib knows glTF
only, needs four more packages and is released once a year. ezdxf (MIT, a release every few months) writes
DXF. STEP would need Open CASCADE: cadquery-ocp is of LGPL and larger than all else that surfsig needs
together, and what is small (steputils) has had no release since 2022.
"""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from surfsig.colors import distinct_colors
from surfsig.convert.libraries import library
from surfsig.errors import InvalidInputError
from surfsig.files.atomic import replacing
from surfsig.geometry import from_translation

if TYPE_CHECKING:
    from surfsig.shapes.patch import SurfacePatch
    from surfsig.surfaces.found import Surfaces

_EXTRA = "surfsig[export]"

_DIGITS = 9
"""Of text, after the leading digit of the largest patch: vertices are on their surface to 1e-9 of it."""

_ROUGHNESS = 0.8
"""Of the material, from 0 to 1: dull, so that no highlight hides a colour."""


@dataclass(frozen=True, eq=False)
class _Part:
    """A patch with its name and colour."""

    name: str
    color: tuple[int, int, int]
    patch: SurfacePatch


def check_export(path: str | Path) -> None:
    """Refuse an ending that is not written, or whose library is missing, before there is work.

    Raises
    ------
    InvalidInputError
        Its text says which endings there are, or what is to be installed.
    """
    _, import_library = _format(Path(path))
    import_library()


def export(found: Surfaces, path: str | Path) -> None:
    """Write the patches, as `Surfaces.export` says."""
    check_export(path)
    if not len(found):
        raise InvalidInputError(f"{path}: there is no surface to write")
    write, _ = _format(Path(path))
    colors = distinct_colors(len(found)).tolist()
    parts = [
        _Part(f"{number} {surface.kind}", tuple(color), surface.patch(found.cloud))
        for number, (surface, color) in enumerate(zip(found, colors, strict=True))
    ]
    data = write(parts)
    with replacing(Path(path)) as file:
        file.write(data)


def _format(path: Path) -> tuple[Callable[[Sequence[_Part]], bytes], Callable[[], Any]]:
    """Give what writes a file of this ending, and what imports its library."""
    formats = {".glb": (_glb, _trimesh), ".obj": (_obj, _trimesh), ".dxf": (_dxf, _ezdxf)}
    if path.suffix.lower() not in formats:
        raise InvalidInputError(f"{path}: surfaces are written as {', '.join(formats)}, not {path.suffix!r}")
    return formats[path.suffix.lower()]


def _trimesh() -> Any:
    return library("trimesh", "trimesh", _EXTRA)


def _ezdxf() -> Any:
    return library("ezdxf", "ezdxf", _EXTRA)


def _glb(parts: Sequence[_Part]) -> bytes:
    """Write a node for each surface; it has the position, so that its float32 vertices keep their digits."""
    material = _trimesh().visual.material.PBRMaterial

    def painted(part: _Part, mesh: Any) -> None:
        mesh.visual = _trimesh().visual.TextureVisuals(
            material=material(
                name=part.name,
                baseColorFactor=[*part.color, 255],
                metallicFactor=0.0,
                roughnessFactor=_ROUGHNESS,
                doubleSided=True,
            )
        )

    data: bytes = _scene(parts, painted).export(file_type="glb")
    return data


def _obj(parts: Sequence[_Part]) -> bytes:
    """Write an object for each surface, its colour at each vertex: one file, with no materials beside it."""

    def painted(part: _Part, mesh: Any) -> None:
        mesh.visual.vertex_colors = [[*part.color, 255]] * len(mesh.vertices)

    largest = max(float(np.ptp(part.patch.vertices, axis=0).max()) for part in parts)
    digits = max(0, _DIGITS - math.floor(math.log10(largest)))
    write = _trimesh().exchange.obj.export_obj
    text: str = write(_scene(parts, painted), include_normals=False, digits=digits, header=None)
    return text.encode()


def _scene(parts: Sequence[_Part], paint: Callable[[_Part, Any], None]) -> Any:
    """Give a scene of trimesh with a node of its own for each patch, at the patch's origin."""
    trimesh = _trimesh()
    scene = trimesh.Scene()
    for part in parts:
        mesh = trimesh.Trimesh(part.patch.vertices, part.patch.faces, process=False)
        paint(part, mesh)
        transform = from_translation(part.patch.origin)
        scene.add_geometry(mesh, node_name=part.name, geom_name=part.name, transform=transform)
    return scene


def _dxf(parts: Sequence[_Part]) -> bytes:
    """Write a polyface mesh for each surface, on a layer of its own; the drawing has no unit."""
    ezdxf = _ezdxf()
    from ezdxf.render.mesh import MeshBuilder

    drawing = ezdxf.new("R2010", units=0)
    for part in parts:
        drawing.layers.add(part.name, true_color=ezdxf.rgb2int(part.color))
        mesh = MeshBuilder()
        mesh.vertices = [ezdxf.math.Vec3(vertex) for vertex in part.patch.vertices + part.patch.origin]
        mesh.faces = part.patch.faces.tolist()
        mesh.render_polyface(drawing.modelspace(), dxfattribs={"layer": part.name})
    text = io.StringIO()
    drawing.write(text)
    return drawing.encode(text.getvalue())  # type: ignore[no-any-return]
