"""Which meshes a glTF file's scene shows, and where: the tree of its nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.gltf_accessors import item


def shown_meshes(
    document: Mapping[str, Any], source: str
) -> Iterator[tuple[object, NDArray[np.float64], bool]]:
    """Give mesh by mesh its number, its transformation (4, 4), and whether a skeleton moves it.

    The scene is that which the file names, or its first; without scenes all nodes are shown, and without
    nodes all meshes.

    Raises
    ------
    FileFormatError
        If a node is missing, in two places, or moved by what is no transformation.
    """
    roots = _roots(document, source)
    if roots is None:
        for mesh in range(len(_list(document, "meshes"))):
            yield mesh, np.eye(4), False
        return
    waiting: list[tuple[object, NDArray[np.float64]]] = [(root, np.eye(4)) for root in reversed(roots)]
    seen: set[object] = set()
    while waiting:
        number, above = waiting.pop()
        node = item(document, "nodes", number, source)
        if number in seen:
            raise FileFormatError(f"{source}: broken: node {number} is in two places of the scene")
        seen.add(number)
        with np.errstate(over="ignore", invalid="ignore"):
            matrix = above @ _matrix(node, source)
        if "mesh" in node:
            yield node["mesh"], matrix, "skin" in node
        waiting += [(child, matrix) for child in reversed(_list(node, "children"))]


def _roots(document: Mapping[str, Any], source: str) -> list[object] | None:
    """Give the nodes at the top of the scene; None if there are neither scenes nor nodes."""
    if _list(document, "scenes"):
        return _list(item(document, "scenes", document.get("scene", 0), source), "nodes")
    nodes = _list(document, "nodes")
    if not nodes:
        return None
    children = {
        child
        for node in nodes
        for child in (_list(node, "children") if isinstance(node, dict) else [])
        if isinstance(child, int)
    }
    return [number for number in range(len(nodes)) if number not in children]


def _matrix(node: Mapping[str, Any], source: str) -> NDArray[np.float64]:
    """Give a node's transformation, which is a matrix column by column, or three parts."""
    if "matrix" in node:
        return _numbers(node, "matrix", np.eye(4).ravel(), source).reshape(4, 4).T
    x, y, z, w = _numbers(node, "rotation", np.array([0.0, 0.0, 0.0, 1.0]), source)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * _numbers(node, "scale", np.ones(3), source)
    matrix[:3, 3] = _numbers(node, "translation", np.zeros(3), source)
    return matrix


def _numbers(
    node: Mapping[str, Any], name: str, default: NDArray[np.float64], source: str
) -> NDArray[np.float64]:
    try:
        values = np.array(node.get(name, default), np.float64)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(0)
    # Far from where squares and products overflow.
    if values.shape != default.shape or not (np.abs(values) < 1e100).all():
        raise FileFormatError(f"{source}: broken: a node's {name} is not {default.size} numbers")
    return values


def _list(owner: Mapping[str, Any], name: str) -> list[Any]:
    found = owner.get(name)
    return found if isinstance(found, list) else []
