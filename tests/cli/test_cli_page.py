"""`surfsig view`, and the pages that `--report` writes."""

from __future__ import annotations

import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_data import report_of

import surfsig


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-1, 1, (2, 500))
    path = tmp_path / "scan.ply"
    surfsig.write(path, np.column_stack([x, y, 0.3 * x * x]).astype(np.float32))
    return path


def test_extract_writes_a_page(shell: Callable[..., Any], scan: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    how = ("--radius", "0.4", "--like", "0,0,0", "-o", tmp_path / "out.ply", "--report", page)
    assert shell("extract", scan, *how).code == 0
    report = report_of(page)
    (layer,) = report["layers"]
    assert report["title"].endswith("scan.ply")
    assert layer["count"] == 500
    assert np.nanmax(layer["columns"]["zeta"]) > 0.9
    nowhere = ("--radius", "0.4", "-o", tmp_path / "out.ply", "--report", "nowhere/p.html")
    refused = shell("extract", scan, *nowhere)
    assert refused.code == 2
    assert "nowhere/p.html: No such file or directory" in refused.err


def test_odometry_writes_a_page(shell: Callable[..., Any], tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    floor = np.column_stack([rng.uniform(-4, 4, (3000, 2)), np.full(3000, -1.0)])
    wall = np.column_stack([np.full(3000, 4.0), rng.uniform(-4, 4, 3000), rng.uniform(-1, 2, 3000)])
    side = np.column_stack([rng.uniform(-4, 4, 3000), np.full(3000, 4.0), rng.uniform(-1, 2, 3000)])
    room = np.concatenate([floor, wall, side])
    for number in range(3):
        surfsig.write(tmp_path / f"scan_{number}.ply", (room - [0.05 * number, 0, 0]).astype(np.float32))
    page = tmp_path / "page.html"
    scans = [tmp_path / f"scan_{number}.ply" for number in range(3)]
    assert shell("odometry", *scans, "-o", tmp_path / "trajectory.txt", "--report", page).code == 0
    report = report_of(page)
    assert len(report["trajectory"]["positions"]) == 3
    assert report["layers"][0]["name"] == "map"


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C is sent by a signal")
def test_view_serves_a_file_until_ctrl_c(scan: Path) -> None:
    command = [sys.executable, "-m", "surfsig.cli", "view", str(scan), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, bufsize=1) as process:
        try:
            assert process.stdout is not None
            told = process.stdout.readline()
            address = told.split()[-3]
            with urllib.request.urlopen(address, timeout=60) as answer:
                assert b'id="source-data"' in answer.read()
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0
        finally:
            process.kill()
