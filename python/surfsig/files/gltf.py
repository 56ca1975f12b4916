"""glTF 2.0 and its binary form GLB: the vertices of all meshes of a scene, where the scene puts them."""

from __future__ import annotations

import json
import os
import struct
from typing import Any, BinaryIO

from surfsig.errors import FileFormatError
from surfsig.files import mesh
from surfsig.files.columns import cloud_from_columns
from surfsig.files.encodings import decoded
from surfsig.files.gltf_accessors import Accessors
from surfsig.files.gltf_meshes import DRACO, Meshes
from surfsig.files.gltf_scene import shown_meshes
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

GLB_MAGIC = b"glTF"

_HEADER = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
# Extensions that change nothing of where vertices are; a file that requires any other is not read.
_HARMLESS = (
    "KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_mesh_quantization", "EXT_texture_", "MSFT_texture_",
)  # fmt: skip


def read(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open glTF or GLB file.

    The vertices of all meshes of the file's scene, each mesh as often as the scene shows it, moved by the
    transformations of its nodes; in metres with y up, as the format has it, not turned. Coordinates are
    float32 where no node moves anything, else float64. Normals (nx, ny, nz) and colours are there if all
    meshes have them. With `samples`, that many points spread over the triangles. Materials, textures,
    skeletons and morph targets are not read.

    Raises
    ------
    FileFormatError
        If it is of version 1, compressed (Draco, meshopt), cut off or broken, or its data lie in a file that
        is missing or not beside it.
    InvalidInputError
        If `samples` is no positive whole number, or there is no surface to spread them over.

    Warns
    -----
    UserWarning
        If triangles are left out, which refer to vertices that are missing; if only some meshes have normals
        or colours; if a mesh moves with a skeleton.
    """
    size = os.fstat(file.fileno()).st_size
    document, binary = _document(file, source, size)
    progress.advance(size)
    _check_required(document, source)
    accessors = Accessors(document, binary, source)
    meshes = Meshes(document, accessors, source, size, with_triangles=samples is not None)
    for number, matrix, has_skin in shown_meshes(document, source):
        meshes.add(number, matrix, has_skin=has_skin)
    points, columns = meshes.joined()
    mesh.check_vertices(points, source)
    if samples is not None:
        return mesh.sampled(points, meshes.triangles(), samples, source)
    axes: dict[str, Any] = dict(zip("xyz", points.T, strict=True))
    return cloud_from_columns({**axes, **columns}, source=source)


def _document(file: BinaryIO, source: str, size: int) -> tuple[dict[str, Any], bytes | None]:
    """Give the JSON, and the buffer behind it in a GLB file."""
    head = file.read(_HEADER.size)
    binary = None
    if head.startswith(GLB_MAGIC):
        text, binary = _chunks(file, head, source, size)
    else:
        file.seek(0)
        text = decoded(file).read()
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        raise FileFormatError(f"{source}: cut off or broken: its JSON makes no sense") from None
    if not isinstance(document, dict):
        raise FileFormatError(f"{source}: broken: its JSON is no glTF document")
    asset = document.get("asset")
    version = str(asset.get("version", "")) if isinstance(asset, dict) else ""
    if version.startswith("1"):
        raise FileFormatError(f"{source}: glTF version {version[:10]!r}, which is not read (2.0 is)")
    return document, binary


def _chunks(file: BinaryIO, head: bytes, source: str, size: int) -> tuple[bytes, bytes | None]:
    """Give the two chunks of a GLB file."""
    if len(head) < _HEADER.size:
        raise FileFormatError(f"{source}: cut off: a GLB file has {_HEADER.size} bytes or more")
    _, version, length = _HEADER.unpack(head)
    if version != 2:
        raise FileFormatError(f"{source}: GLB version {version}, which is not read (2 is)")
    if length > size:
        raise FileFormatError(f"{source}: cut off: its header promises {length} bytes, the file has {size}")
    found: dict[bytes, bytes] = {}
    while len(found) < 2 and len(raw := file.read(_CHUNK.size)) == _CHUNK.size:
        chunk_length, kind = _CHUNK.unpack(raw)
        if chunk_length > size - file.tell():
            raise FileFormatError(f"{source}: cut off or broken: a chunk of {chunk_length} bytes is promised")
        data = file.read(chunk_length)
        if kind in (b"JSON", b"BIN\0"):
            found.setdefault(kind, data)
    if b"JSON" not in found:
        raise FileFormatError(f"{source}: cut off or broken: the GLB file has no JSON")
    return found[b"JSON"], found.get(b"BIN\0")


def _check_required(document: dict[str, Any], source: str) -> None:
    """Refuse what cannot be read without an extension that is not known here."""
    required = document.get("extensionsRequired")
    for name in required if isinstance(required, list) else []:
        if name == DRACO:
            raise FileFormatError(f"{source}: its meshes are compressed with Draco, which is not read")
        if not str(name).startswith(_HARMLESS):
            told = "".join(letter for letter in str(name)[:60] if letter.isprintable())
            raise FileFormatError(f"{source}: requires the extension '{told}', which is not read")
