"""Models in a file."""

import shutil
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from finding import errors
from finding_scene import finding_scene, whole

import surfsig
from surfsig import Library
from surfsig.finding.library import stored_model


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library with one model, of which each test has a copy."""
    path = tmp_path_factory.mktemp("library") / "things.db"
    Library(path).add("figure", whole("figure"), unit="m")
    return path


@pytest.fixture
def path(made: Path, tmp_path: Path) -> Path:
    """A library with one model."""
    return Path(shutil.copy(made, tmp_path / "things.db"))


def test_what_is_added_comes_back(path: Path) -> None:
    library = Library(path)
    (entry,) = library.list()
    assert (entry.name, entry.unit, entry.points) == ("figure", "m", 12_000)
    model, prepared = whole("figure"), stored_model(library, "figure")
    np.testing.assert_allclose(library.get("figure").points, model.points, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(prepared.signatures.vectors, axis=1), 1.0, atol=1e-5)
    assert prepared.radius == entry.radius
    library.add("again", model)
    assert library.names() == ("again", "figure")
    library.remove("figure")
    assert library.names() == ("again",)


def test_names_are_taken_once_unless_replaced(path: Path) -> None:
    library = Library(path)
    with pytest.raises(surfsig.InvalidInputError, match="there is a model 'figure' already"):
        library.add("figure", whole("bracket with pin"))
    library.add("figure", whole("bracket with pin", 5000), replace=True)
    assert [entry.points for entry in library.list()] == [5000]


def test_a_failed_addition_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(surfsig.InvalidInputError):
        Library(tmp_path / "none.db").add("few", np.zeros((3, 3)))
    assert not (tmp_path / "none.db").exists()


def test_files_that_are_no_library_are_said(path: Path, tmp_path: Path) -> None:
    (tmp_path / "text").write_text("no database at all, but long enough to look at" * 9)
    with pytest.raises(surfsig.FileFormatError, match="not a library"):
        Library(tmp_path / "text")
    with sqlite3.connect(tmp_path / "other.db") as other:
        other.execute("CREATE TABLE things (x)")
    with pytest.raises(surfsig.FileFormatError, match="not a library"):
        Library(tmp_path / "other.db")
    with sqlite3.connect(path) as store:
        store.execute("PRAGMA user_version = 4")
    with pytest.raises(surfsig.FileFormatError, match="version 4"):
        Library(path)


@pytest.mark.parametrize("change", ["arrays = x'00'", "size = 99", "arrays = substr(arrays, 1, 1000)"])
def test_a_damaged_model_is_said(path: Path, change: str) -> None:
    with sqlite3.connect(path) as store:
        store.execute(f"UPDATE models SET {change}")
    with pytest.raises(surfsig.FileFormatError, match="damaged"):
        Library(path).get("figure")


@pytest.mark.slow
def test_the_commands_do_all_of_it(tmp_path: Path, shell: Any) -> None:
    scene = finding_scene("figure", 2, copies=1, others=1)
    model, scan, store = (tmp_path / name for name in ("figure.ply", "scene.ply", "things.db"))
    surfsig.write(model, whole("figure"))
    surfsig.write(scan, scene.cloud)
    assert shell("library", "add", store, "figure", model).code == 0
    again = shell("library", "add", store, "figure", model)
    assert (again.code, again.err.count("\n")) == (2, 1)
    assert "figure" in shell("library", "list", store).out
    labelled, values, page = (tmp_path / name for name in ("labelled.ply", "found.json", "page.html"))
    found = shell("find", "--library", store, scan, "--json", values, "-o", labelled, "--report", page)
    assert found.code == 0
    assert "1 instance (1 of figure)" in found.out
    assert "1 instance (1 of figure) in scene.ply" in page.read_text(encoding="utf-8")
    import json

    (instance,) = json.loads(values.read_text())["instances"]
    assert errors(np.array(instance["T_scene_model"]), scene.poses[0])[0] < 0.001
    assert (surfsig.read(labelled).fields["instance"] == 0).sum() == instance["points"]
    assert shell("library", "remove", store, "figure").code == 0
    nothing = shell("find", "--library", store, scan)
    assert (nothing.code, nothing.out) == (0, f"{scan}: not there among 0 models\n")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("find", "only.ply"), "MODEL and SCENE"),
        (("find", "--library", "none.db", "a.ply", "b.ply"), "SCENE alone"),
        (("find", "--library", "none.db", "a.ply"), "no such file"),
        (("library", "list", "none.db"), "no such file"),
        (("library", "remove", "none.db", "x"), "no such file"),
    ],
)
def test_mistakes_are_one_line(arguments: tuple[str, ...], said: str, shell: Any) -> None:
    finished = shell(*arguments)
    assert finished.code == 2
    assert said in finished.err
    assert finished.err.count("\n") == 1
