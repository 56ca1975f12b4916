"""Small whole meshes, and clouds of mesh formats, that are made by hand: PLY, OBJ, OFF and glTF."""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Callable
from typing import Any

import numpy as np

COUNT = 48
POINTS = np.random.default_rng(2).normal(size=(COUNT, 3)).astype("<f4")
FACES = np.random.default_rng(3).integers(0, COUNT, (20, 3))
SQUARES = np.random.default_rng(4).integers(0, COUNT, (10, 4))
AXES = "property float x\nproperty float y\nproperty float z\n"


def lines(rows: Any, form: str = "{}") -> str:
    """Return rows as text."""
    return "".join(form.format(" ".join(f"{value:g}" for value in row)) + "\n" for row in rows)


def ply_mesh(data: str) -> bytes:
    """Return a mesh of triangles and squares, with further properties before and behind their corners."""
    faces = "property uchar flags\nproperty list uchar int vertex_indices\nproperty list uchar float more\n"
    rest = f"element face {len(FACES) + len(SQUARES)}\n{faces}end_header\n"
    head = f"ply\nformat {data} 1.0\nelement vertex {COUNT}\n{AXES}{rest}".encode()
    corners = [*FACES.tolist(), *SQUARES.tolist()]
    if data == "ascii":
        rows = "".join(f"7 {len(face)} {' '.join(map(str, face))} 1 0.5\n" for face in corners)
        return head + (lines(POINTS) + rows).encode()
    order = "<" if "little" in data else ">"
    packed = [struct.pack(f"{order}BB{len(face)}iBf", 7, len(face), *face, 1, 0.5) for face in corners]
    return head + POINTS.astype(order + "f4").tobytes() + b"".join(packed)


def ply_odd(end: str, data: str = "ascii") -> bytes:
    """Return a cloud with a byte order mark, 64-bit numbers, a name twice, and lists of any length's type."""
    properties = f"property long id\n{AXES}property float x\nproperty double red\nproperty double green\n"
    properties += "property double blue\nproperty list float int more\n"
    head = f"\ufeffply\nobj_info by hand\nformat {data} 1.0\nelement point {COUNT}\n{properties}end_header\n"
    text = head.replace("\n", end)
    rows = [(i, *point, 2.0, 0.0, 0.5, 1.0, i % 3) for i, point in enumerate(POINTS.tolist())]
    if data == "ascii":
        return (text + "".join(lines([(*row, *[9] * row[-1])]) for row in rows).replace("\n", end)).encode()
    packed = [struct.pack(f"<q4f3df{row[-1]}i", *row, *[9] * row[-1]) for row in rows]
    return text.encode() + b"".join(packed)


def obj_odd() -> bytes:
    """Return vertices with colours, weights and neither, continued lines, and faces that are none."""
    more = ("", " 1", " 0.5 0 1", " 1 0 0.5 1", " 7 8")
    vertices = [f"v {x:g} {y:g} {z:g}{more[i % 5]}\n" for i, (x, y, z) in enumerate(POINTS.tolist())]
    text = "".join(vertices) + "v 1 2 \\\n3\nf 1 2\nf 0 1 2\nf 1//1 2//1 99\nf -1 -2 -3 \\\n-4\n"
    return text.encode("utf-16")


def off(word: str, more: str) -> bytes:
    """Return an OFF file whose vertices have further numbers."""
    corners = [*FACES.tolist(), *SQUARES.tolist()]
    faces = "".join(f"{len(face)} {' '.join(map(str, face))} 255 0 0\n" for face in corners)
    return f"{word}\n# by hand\n{COUNT} {len(corners)} 0\n{lines(POINTS, '{} ' + more)}{faces}".encode()


def document() -> tuple[dict[str, Any], bytes]:
    """Return a glTF scene of two nodes, and its buffer: strided vertices, colours, a sparse accessor."""
    rows = np.zeros(COUNT, [("point", "<f4", 3), ("normal", "<f4", 3), ("colour", "u1", 4)])
    rows["point"], rows["normal"], rows["colour"] = POINTS, (0, 0, 1), (255, 128, 0, 255)
    indices = FACES.astype("<u2").tobytes()
    places, others = np.array([1, 5], "<u2").tobytes(), POINTS[:2].tobytes()
    parts = [rows.tobytes(), indices, places, others]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    views: list[dict[str, Any]] = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
        for start, part in zip(starts, parts, strict=False)
    ]
    views[0]["byteStride"] = rows.itemsize
    colour = {"componentType": 5121, "count": COUNT, "type": "VEC4", "normalized": True}
    vector = {"bufferView": 0, "componentType": 5126, "count": COUNT, "type": "VEC3"}
    sparse = {"count": 2, "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 3}}
    accessors = [
        vector,
        {**vector, "byteOffset": 12},
        {**colour, "bufferView": 0, "byteOffset": 24},
        {"bufferView": 1, "componentType": 5123, "count": FACES.size, "type": "SCALAR"},
        {**vector, "sparse": sparse},
    ]
    attributes = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}
    whole = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"children": [1], "translation": [5, 0, 0], "rotation": [0, 0, 0.6, 0.8], "scale": [1, 2, 1]},
            {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 3, 1], "children": [2]},
            {"mesh": 0},
        ],
        "meshes": [
            {
                "primitives": [
                    {"attributes": attributes, "indices": 3},
                    {"attributes": {**attributes, "POSITION": 4}, "indices": 3, "mode": 5},
                ]
            }
        ],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }
    return whole, b"".join(parts)


def glb() -> bytes:
    """Return the scene in one binary file."""
    whole, data = document()
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf() -> bytes:
    """Return the scene as text, with its buffer in base64."""
    whole, data = document()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(whole | {"buffers": [{"byteLength": len(data), "uri": uri}]}, indent=1).encode()


MADE: dict[str, tuple[Callable[[], bytes], dict[str, Any]]] = {
    "mesh.ascii.ply": (lambda: ply_mesh("ascii"), {"samples": 50}),
    "mesh.little.ply": (lambda: ply_mesh("binary_little_endian"), {"samples": 50}),
    "mesh.big.ply": (lambda: ply_mesh("binary_big_endian"), {"samples": 50}),
    "odd.ascii.ply": (lambda: ply_odd("\r"), {}),
    "odd.binary.ply": (lambda: ply_odd("\r\n", "binary_little_endian"), {}),
    "odd.obj": (obj_odd, {}),
    "odd.sampled.obj": (obj_odd, {"samples": 50}),
    "plain.off": (lambda: off("OFF", ""), {}),
    "sampled.off": (lambda: off("NOFF", "0 0 1"), {"samples": 50}),
    "coloured.off": (lambda: off("STCNOFF", "0 0 1 0.5 0 1 1 0.2 0.3"), {}),
    "scene.glb": (glb, {}),
    "sampled.glb": (glb, {"samples": 50}),
    "scene.gltf": (gltf, {}),
    "sampled.gltf": (gltf, {"samples": 50}),
}
