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


def briefs(path: Path) -> list[str]:
    with sqlite3.connect(path) as store:
        return [name for (name,) in store.execute("SELECT name FROM briefs ORDER BY name")]


def test_the_brief_part_comes_and_goes_with_the_model(path: Path) -> None:
    library = Library(path)
    library.add("again", whole("figure", 3000))
    assert briefs(path) == ["again", "figure"]
    brief, model = stored_model(library, "again", True), stored_model(library, "again")
    largest = brief.larger_signatures[-1]
    np.testing.assert_array_equal(largest.vectors, model.larger_signatures[-1].vectors)
    assert len(brief.points) == len(model.samples)
    assert len(brief.signatures) == 0 < len(model.signatures)
    library.add("again", whole("bracket with pin", 3000), replace=True)
    assert len(stored_model(library, "again", True).larger_signatures[-1]) != len(largest)
    library.remove("again")
    assert briefs(path) == ["figure"]


def test_libraries_of_version_2_have_no_brief_parts(path: Path) -> None:
    with sqlite3.connect(path) as store:
        store.execute("DROP TABLE briefs")
        store.execute("PRAGMA user_version = 2")
    library = Library(path)
    assert len(stored_model(library, "figure", True).signatures) > 0
    library.add("again", whole("figure", 3000))
    assert briefs(path) == ["again"]
    library.remove("figure")
    assert library.names() == ("again",)


@pytest.mark.slow
def test_only_models_that_may_be_there_are_read_as_a_whole(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = Library(path)
    for name in ("bracket with pin", "frustum with fin"):
        library.add(name, whole(name))
    scene = finding_scene("figure", 2, copies=1, others=1)
    read: list[tuple[str, bool]] = []

    def reading(library: Library, name: str, is_brief: bool) -> Any:
        read.append((name, is_brief))
        return stored_model(library, name, is_brief)

    monkeypatch.setattr("surfsig.finding.search.stored_model", reading)
    (instance,) = surfsig.find_instances(library, scene.cloud).instances
    assert errors(instance.T_scene_model, scene.poses[0])[0] < 0.001
    assert [name for name, is_brief in read if is_brief] == list(library.names())
    assert ("figure", False) in read
    assert ("frustum with fin", False) not in read
    # The same models in memory are the same models.
    (same,) = surfsig.find_instances({name: library.get(name) for name in library.names()}, scene.cloud)
    assert same.name == "figure"
    np.testing.assert_allclose(same.T_scene_model, instance.T_scene_model, atol=1e-3)


def test_a_damaged_brief_part_is_said(path: Path) -> None:
    library = Library(path)
    library.add("again", whole("figure", 3000))
    with sqlite3.connect(path) as store:
        store.execute("UPDATE briefs SET arrays = x'00'")
    scene = finding_scene("figure", 2, copies=1, others=1)
    with pytest.raises(surfsig.FileFormatError, match="damaged"):
        surfsig.find_instances(library, scene.cloud)


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
