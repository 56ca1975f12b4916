"""What uses what: a room uses only rooms on lower floors, so a task uses no other task."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

Uses = dict[tuple[str, str], set[str]]
"""Pairs of rooms of which the first uses the second, and the files that do."""

PYTHON_FLOORS = (
    ("_surfsig",),
    ("errors", "defaults", "digits", "colors", "wkt", "progress", "status"),
    ("arguments", "threads"),
    ("geometry", "coordinate_system", "signature_similarity", "flat_atom", "plot"),
    ("point_cloud",),
    ("orientation", "spacing", "units", "missing_returns", "cloud_transforms"),
    ("resolution",),
    ("places", "visibility", "simulate"),
    ("files",),
    ("convert",),
    ("page", "clean"),
    ("extraction_report", "browser"),
    ("extraction",),
    ("curvature", "field"),
    ("one_sided_normals", "alignment", "fusion"),
    ("shapes",),
    ("surfaces",),
    ("registration", "odometry", "finding", "recurrences", "tiles"),
    ("paper",),
    ("surfsig",),
    ("cli",),
)
"""Modules and packages of python/surfsig, the lowest floor first; `surfsig` is the package's own `__init__`.
Imports for type checkers only do not count."""

PYTHON_EXCEPTIONS = {
    ("point_cloud", "convert"): "PointCloud.of takes the objects of other libraries, imported when they come",
    ("point_cloud", "page"): "a notebook shows a cloud as a page, imported when it does",
    ("files", "convert"): "convert.libraries, which names a library that is missing, should lie lower",
}

RUST_FLOORS = (
    ("error", "extremes", "multiply_add"),
    (
        "statistics",
        "geometry",
        "similarity",
        "point_cloud",
        "random",
        "threads",
        "moments",
        "monitor",
        "status",
    ),
    ("lattice", "resolution", "depth_image", "kd_tree", "voxels"),
    ("simd",),
    ("cell_index", "tensor", "scan", "neighbor_distances", "visibility"),
    ("ball", "curvature", "spacing", "fused_map"),
    ("block_sums", "fit", "frame"),
    ("members", "shells", "hierarchy"),
    ("extract",),
    ("field", "primitive", "orientation"),
    ("surfaces", "alignment"),
    ("registration", "finding", "odometry", "recurrences"),
)
"""Modules of the core, the lowest floor first."""

RUST_EXCEPTIONS: dict[tuple[str, str], str] = {}


def python_uses() -> Uses:
    """Read the imports of the Python package, those within functions included."""
    package = ROOT / "python" / "surfsig"
    rooms = python_rooms()
    uses: Uses = {}
    for file in sorted(package.rglob("*.py")):
        inside = file.relative_to(package)
        own = "surfsig" if inside == Path("__init__.py") else inside.parts[0].removesuffix(".py")
        for module in imported(ast.parse(file.read_text()), ["surfsig", *inside.parts[:-1]]):
            used = module.split(".")[1] if "." in module else "surfsig"
            # What is no room is a name that the package's `__init__` gives.
            used = used if used in rooms else "surfsig"
            if used != own:
                uses.setdefault((own, used), set()).add(str(inside))
    return uses


def python_rooms() -> set[str]:
    """Give the names of the modules and packages of python/surfsig."""
    package = ROOT / "python" / "surfsig"
    modules = {file.stem for file in package.glob("*.py")} - {"__init__"}
    return modules | {file.parent.name for file in package.glob("*/__init__.py")} | {"_surfsig", "surfsig"}


def imported(tree: ast.AST, package: list[str]) -> Iterator[str]:
    """Give the full names of the modules of surfsig that a syntax tree imports."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names if name.name.partition(".")[0] == "surfsig")
        elif isinstance(node, ast.ImportFrom):
            parents = package[: len(package) - node.level + 1] if node.level else []
            base = ".".join([*parents, *([node.module] if node.module else [])])
            if base == "surfsig":
                yield from (f"surfsig.{name.name}" for name in node.names)
            elif base.startswith("surfsig."):
                yield base
        else:
            yield from imported(node, package)


def rust_uses() -> Uses:
    """Read the paths that begin with `crate::` in the core; its tests may use everything."""
    source = ROOT / "crates" / "surfsig" / "src"
    rooms = rust_rooms()
    given = rust_reexports((source / "lib.rs").read_text())
    uses: Uses = {}
    for file in sorted(source.rglob("*.rs")):
        inside = file.relative_to(source)
        own = inside.parts[0].removesuffix(".rs")
        if own == "lib" or inside.name in ("tests.rs", "samples.rs"):
            continue
        text = re.sub(r"//.*", "", file.read_text()).partition("#[cfg(test)]\nmod tests")[0]
        for name in crate_paths(text):
            used = given.get(name, name)
            assert used in rooms, f"{inside}: crate::{name} is neither a module nor given by lib.rs"
            if used != own:
                uses.setdefault((own, used), set()).add(str(inside))
    return uses


def rust_rooms() -> set[str]:
    """Give the names of the core's modules."""
    source = ROOT / "crates" / "surfsig" / "src"
    files = {file.stem for file in source.glob("*.rs")} - {"lib"}
    return files | {folder.name for folder in source.iterdir() if folder.is_dir()}


def rust_reexports(text: str) -> dict[str, str]:
    """Give the module of each name that lib.rs gives on."""
    given: dict[str, str] = {}
    for room, names in re.findall(r"pub use (\w+)::(\{[^}]*\}|\w+);", text):
        given |= dict.fromkeys(re.findall(r"\w+", names), room)
    return given


def crate_paths(text: str) -> Iterator[str]:
    """Give the first names after `crate::`, of a group in braces all."""
    for found in re.finditer(r"(?<![\w$])crate::(\w+|\{)", text):
        if found[1] != "{":
            yield found[1]
            continue
        depth, name_may_start = 1, True
        for word in re.finditer(r"\w+|[{},]|::", text[found.end() :]):
            if word[0] == "{":
                depth += 1
            elif word[0] == "}":
                depth -= 1
                if depth == 0:
                    break
            elif depth == 1 and name_may_start and word[0].isidentifier():
                yield word[0]
            name_may_start = word[0] == ","


CASES = {
    "python": (python_rooms, python_uses, PYTHON_FLOORS, PYTHON_EXCEPTIONS),
    "rust": (rust_rooms, rust_uses, RUST_FLOORS, RUST_EXCEPTIONS),
}


@pytest.mark.parametrize("language", CASES)
def test_each_room_is_on_one_floor(language: str) -> None:
    rooms, _, floors, _ = CASES[language]
    listed = [room for floor in floors for room in floor]
    assert sorted(listed) == sorted(rooms())


@pytest.mark.parametrize("language", CASES)
def test_a_room_uses_only_lower_floors(language: str) -> None:
    _, uses, floors, exceptions = CASES[language]
    floor_of = {room: number for number, floor in enumerate(floors) for room in floor}
    wrong = {
        f"{own} uses {used}, which is not on a lower floor: {', '.join(sorted(files))}"
        for (own, used), files in uses().items()
        if floor_of[used] >= floor_of[own] and (own, used) not in exceptions
    }
    assert not wrong, "\n".join(sorted(wrong))


@pytest.mark.parametrize("language", CASES)
def test_the_list_of_exceptions_only_shrinks(language: str) -> None:
    """An exception that is no longer one is taken out of the list."""
    _, uses, floors, exceptions = CASES[language]
    floor_of = {room: number for number, floor in enumerate(floors) for room in floor}
    needed = {pair for pair in uses() if floor_of[pair[1]] >= floor_of[pair[0]]}
    assert exceptions.keys() <= needed
    assert all(reason for reason in exceptions.values())


def test_paths_and_imports_are_read_as_compilers_read_them() -> None:
    text = "use crate::{a::{B, c}, D, e::f}; fn g() { crate::h::i(); $crate::j!() }"
    assert list(crate_paths(text)) == ["a", "D", "e", "h"]
    module = ast.parse(
        "from . import a\nfrom ..b.c import d\nimport surfsig.e\n"
        "def f():\n    from surfsig import g\nif TYPE_CHECKING:\n    from surfsig.h import i\n"
    )
    assert list(imported(module, ["surfsig", "own"])) == [
        "surfsig.own",
        "surfsig.b.c",
        "surfsig.e",
        "surfsig.g",
    ]
