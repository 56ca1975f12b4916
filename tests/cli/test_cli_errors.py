"""One line and exit code 2 for whatever is wrong; help, version, completion."""

import errno
import os
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

import surfsig

COMMANDS = ("info", "extract", "fit", "surfaces", "compare", "convert", "completion")


def one_line(finished: Any) -> str:
    assert finished.code == 2
    assert finished.out == ""
    assert finished.err.startswith("surfsig: error: ")
    assert finished.err.count("\n") == 1
    return str(finished.err)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "No such file or directory"),
        (b"", "the file is empty"),
        (b"\x89PNG\r\n\x1a\n", "PNG image"),
        (b"0 0 0\n1 two 3\n4 5 6\n", "line 2: 'two' is not a number"),
        (b"ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\n", "cut off"),
    ],
)
def test_inputs(shell: Callable[..., Any], tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "scan.ply"
    if content is not None:
        path.write_bytes(content)
    for command in (
        ("info", path),
        ("extract", path, "--radius", 1, "-o", tmp_path / "o.ply"),
        ("compare", path, path, "--at", "0,0,0", "--at", "0,0,0"),
        ("convert", path, tmp_path / "o.ply"),
        ("fit", "sphere", path),
    ):
        assert message in one_line(shell(*command))
    assert not (tmp_path / "o.ply").exists()


def test_an_empty_folder(shell: Callable[..., Any], tmp_path: Path) -> None:
    assert f"{tmp_path}: holds no files" in one_line(shell("info", tmp_path))


def test_a_pattern_that_matches_nothing(shell: Callable[..., Any], tmp_path: Path) -> None:
    for command in (("info",), ("odometry", "-o", tmp_path / "a.txt")):
        told = one_line(shell(*command, tmp_path / "scan_*.ply"))
        assert f"{tmp_path / 'scan_*.ply'}: no file matches" in told


@pytest.mark.parametrize("radius", ["0", "-1", "nan", "inf"])
def test_radii(shell: Callable[..., Any], ball: Path, tmp_path: Path, radius: str) -> None:
    assert "radius" in one_line(shell("extract", ball, "--radius", radius, "-o", tmp_path / "o.ply"))
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--radius", "wide"), "must be a number, or auto, not 'wide'"),
        ((), "give a radius, or neighbors, or both"),
        (("--radius", 1, "--at", "1;2;3"), "not three numbers"),
        (("--radius", 1, "--at", "1,2,3", "--voxel", 1), "exclude each other"),
        (("--radius", 1, "--axes", "moon"), "'moon' is not one of"),
        (("--radius", 1, "--viewpoint", "1,2,nan"), "viewpoint"),
        (("--radius", 1, "--voxel", 0), "voxel"),
        (("--radius", 1, "--threads", 0), "threads"),
        (("--radius", 1, "--unit", "parsec"), "'parsec' is not one of 'mm', 'cm'"),
        (("--radius", 1, "--box", "0,0,0,1,1"), "'0,0,0,1,1' is not six numbers"),
        (("--radius", 1, "--box", "0,0,0,1,-1,1"), "box must be two corners"),
        (("--radius", 1, "--intrinsics", "1,2,3"), "'1,2,3' is not four numbers"),
        (("--radius", 1, "--scan", 0), "holds PLY data, for which 'scan' means nothing"),
        (("--radius", 1, "--samples", 9), "has no faces, over which samples could be spread"),
        (("--radius", 1, "--intrinsics", "1,2,3,4"), "for which 'intrinsics' means nothing"),
        (("--radius", 1, "--depth-scale", 500), "for which 'depth_scale' means nothing"),
        (("--radius", 1, "--frobnicate"), "No such option"),
    ],
)
def test_options(shell: Callable[..., Any], ball: Path, tmp_path: Path, options: Any, message: str) -> None:
    assert message in one_line(shell("extract", ball, *options, "-o", tmp_path / "o.ply"))
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ("missing/o.ply", "No such file or directory"),
        ("o.obj", "the extension must be one of"),
        ("folder.ply", "is a folder"),
    ],
)
def test_outputs_are_checked_before_the_work(
    shell: Callable[..., Any],
    ball: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    output: str,
    message: str,
) -> None:
    (tmp_path / "folder.ply").mkdir()
    monkeypatch.setattr(surfsig, "read", lambda *_, **__: pytest.fail("the input was read first"))
    assert message in one_line(shell("extract", ball, "--radius", 1, "-o", tmp_path / output))


def test_a_full_disk(
    shell: Callable[..., Any], ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "o.ply"
    out.write_bytes(b"old")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert "o.ply: No space left on device" in one_line(shell("extract", ball, "--radius", 0.05, "-o", out))
    assert out.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["o.ply"]


def test_a_warning_is_one_line_too(shell: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("0 0 0\n1 2 3\n4 5")
    finished = shell("info", tmp_path / "a.xyz", "--json")
    assert finished.code == 0
    assert (
        finished.err
        == f"surfsig: warning: {tmp_path / 'a.xyz'}: the last line (3) is cut off and was dropped\n"
    )


def test_ctrl_c(
    shell: Callable[..., Any], ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(surfsig, "extract", interrupted)
    finished = shell("extract", ball, "--radius", 1, "-o", tmp_path / "o.ply")
    assert (finished.code, finished.out, finished.err.strip()) == (130, "", "")


def test_a_bug_keeps_its_traceback(
    shell: Callable[..., Any], ball: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise KeyError("bug")

    monkeypatch.setattr("surfsig.files.read", broken)
    with pytest.raises(KeyError):
        shell("info", ball)


def test_a_reader_that_leaves(ball: Path) -> None:
    command = [sys.executable, "-m", "surfsig.cli", "info", str(ball), "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    assert process.stderr.read() == b""
    process.wait()


def test_help_and_version(shell: Callable[..., Any]) -> None:
    top = shell("--help")
    assert top.code == 0
    for name in COMMANDS:
        assert name in top.out
        command = shell(name, "--help")
        assert command.code == 0
        assert "Examples:" in command.out
    assert shell("--version").out == f"surfsig {version('surfsig')}\n"
    assert shell("frobnicate").err == "surfsig: error: No such command 'frobnicate'.\n"
    nothing = shell()
    assert nothing.code == 2
    assert "Usage: surfsig" in nothing.err


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_completion(shell: Callable[..., Any], name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    script = shell("completion", name)
    assert script.code == 0
    assert f"_SURFSIG_COMPLETE={name}_complete" in script.out
    monkeypatch.setenv("SHELL", f"/bin/{name}")
    assert shell("completion").out == script.out
    monkeypatch.setenv("SHELL", "/bin/unknown")
    assert "name a shell: bash, zsh, fish" in one_line(shell("completion"))


def test_completion_completes() -> None:
    environment = {
        **os.environ,
        "_SURFSIG_COMPLETE": "bash_complete",
        "COMP_WORDS": "surfsig ex",
        "COMP_CWORD": "1",
    }
    finished = subprocess.run(
        [sys.executable, "-m", "surfsig.cli"], env=environment, capture_output=True, text=True, check=False
    )
    assert "plain,extract" in finished.stdout


def test_neighbors_of_points_that_are_not_finite(shell: Callable[..., Any], tmp_path: Path) -> None:
    scan, output = tmp_path / "scan.xyz", tmp_path / "out.csv"
    scan.write_text("nan nan nan\n" * 5)
    finished = shell("extract", scan, "--neighbors", 12, "-o", output, "-q")
    assert finished.code == 0
    assert (
        finished.err
        == f"surfsig: warning: {output}: no point has a curvature; is the number of neighbors 12 right?\n"
    )
