"""`surfsig extract` into a folder."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tile_scenes import RADIUS, check_equal, town, town_files

import surfsig


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return town_files(tmp_path_factory.mktemp("town"), 3000)


def test_files_into_a_folder_and_again(shell: Callable[..., Any], paths: list[Path], tmp_path: Path) -> None:
    command = [
        "extract",
        *paths,
        "--radius",
        RADIUS,
        "-o",
        f"{tmp_path}/out/",
        "--tiles",
        "4",
        "--numbers",
        "--json",
    ]
    finished = shell(*command)
    assert (finished.code, finished.err) == (0, "")
    told = json.loads(finished.out)
    assert (told["points"], told["tiles"]) == (3000, 4)
    assert 1 < told["read_per_point"] < 2
    whole = surfsig.read(paths)
    dataset = surfsig.open(tmp_path / "out")
    assert isinstance(dataset, surfsig.TileDataset)
    check_equal(dataset.read(), whole, surfsig.extract(whole, RADIUS))
    again = shell(*command)
    assert again.code == 0
    assert json.loads(again.out)["points"] == 3000


@pytest.mark.parametrize(
    "more", [["--robust"], ["--fit", "auto"], ["--axes", "sensor"], ["--neighbors", "20"]], ids=str
)
def test_options_reach_the_tiles(
    shell: Callable[..., Any], paths: list[Path], tmp_path: Path, more: list[str]
) -> None:
    file = tmp_path / "one.npz"
    command = ["extract", *paths, "--radius", RADIUS, *more, "-o"]
    assert shell(*command, file).code == 0
    finished = shell(
        *command, tmp_path / "out", "--tiles", 3, "--numbers", "--format", "npz", "--memory", "1GB"
    )
    assert finished.code == 0, finished.err
    dataset = surfsig.open(tmp_path / "out")
    assert isinstance(dataset, surfsig.TileDataset)
    parts, one = dataset.read(), surfsig.read(file)
    for name, values in one.fields.items():
        np.testing.assert_array_equal(
            parts.fields[name][np.argsort(parts.fields["point_number"])], values, name
        )


def client_for_a_second(client: Callable[..., Any], address: str, timeout: str) -> Any:
    """Connect to a scheduler for a second, not for as long as a user would wait."""
    assert timeout == "20s"
    return client(address, timeout="1s")


def test_errors_are_one_line(
    shell: Callable[..., Any], paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    assert shell("extract", *paths, "--radius", RADIUS, "-o", out).code == 0
    for arguments, words in (
        (["--radius", 2], "was begun with radius 0.9, not 2.0"),
        (["--radius", RADIUS, "--memory", "a lot"], "memory must be a size"),
        (["--radius", RADIUS, "--signatures"], "--signatures is not for work in tiles"),
        (["--radius", RADIUS, "--voxel", 3], "--voxel is not for work in tiles"),
        (["--radius", RADIUS, "--scheduler", "tcp://127.0.0.1:9"], "no Dask scheduler answers"),
    ):
        if "--scheduler" in arguments:
            distributed = pytest.importorskip("distributed")
            impatient = partial(client_for_a_second, distributed.Client)
            monkeypatch.setattr(distributed, "Client", impatient)
        finished = shell("extract", *paths, *arguments, "-o", out)
        assert finished.code == 2
        assert words in finished.err
        assert finished.err.count("\n") == 1
    finished = shell("extract", *paths, "--radius", 1, "--tiles", 3, "-o", tmp_path / "one.ply")
    assert finished.code == 2
    assert "--tiles needs a folder" in finished.err
    assert shell("extract", *paths, "--radius", 2, "-o", out, "--restart").code == 0


def test_a_tile_that_cannot_be_read_is_said_at_the_end(shell: Callable[..., Any], tmp_path: Path) -> None:
    cloud = town(4000)
    files = [tmp_path / f"{i}.laz" for i in range(2)]
    for i, path in enumerate(files):
        surfsig.write(path, cloud.at(cloud.offsets[:, 0] // 20 == i))
    files[1].write_bytes(files[1].read_bytes()[:20_000])
    finished = shell("extract", *files, "--radius", RADIUS, "-o", tmp_path / "out", "--tiles", 5)
    assert finished.code == 2
    assert "tiles could not be read, the others are done" in finished.err
    assert "1.laz" in finished.err
    assert list((tmp_path / "out").glob("tile_*.laz"))


def test_an_input_beyond_the_memory_needs_a_folder(
    shell: Callable[..., Any], paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("surfsig.tiles.memory.total_bytes", lambda: 300_000)
    finished = shell("extract", *paths, "--radius", RADIUS, "-o", tmp_path / "one.ply")
    assert finished.code == 2
    assert "give a folder (-o out/) to work in tiles" in finished.err


def test_info_of_a_folder_is_from_headers_alone(
    shell: Callable[..., Any], paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("surfsig.files.read", None)
    values = json.loads(shell("info", paths[0].parent, "--json").out)
    assert (values["files"], values["points"]) == (3, 3000)
    np.testing.assert_allclose(values["minimum"], [389_000, 5_819_000, 39], atol=1)
    text = shell("info", paths[0].parent).out
    assert "3,000" in text
    assert "3 files" in text


def test_info_of_a_folder_of_tiles(shell: Callable[..., Any], paths: list[Path], tmp_path: Path) -> None:
    assert shell("extract", *paths, "--radius", RADIUS, "-o", tmp_path / "out", "--tiles", 3).code == 0
    values = json.loads(shell("info", tmp_path / "out", "--json").out)
    assert (values["tiles"], values["points"], values["missing_tiles"]) == (3, 3000, 0)
    assert values["arguments"]["radius"] == RADIUS
    assert "3 tiles" in shell("info", tmp_path / "out").out
