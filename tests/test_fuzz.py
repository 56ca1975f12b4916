"""A short campaign of damaged files; `make fuzz` runs a long one."""

import subprocess
import sys
from pathlib import Path

import pytest

from surfsig.files.formats import FORMATS

MUTATE = Path(__file__).parents[1] / "fuzz" / "mutate.py"
SEED = 7


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the console's encoding has no table lines")
def test_two_thousand_damaged_files_are_read_or_refused() -> None:
    pytest.importorskip("pyarrow")
    command = [sys.executable, str(MUTATE), "--count", "2000", "--seed", str(SEED)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, f"{' '.join(command)}\n{run.stdout}{run.stderr}"
    assert f"seed {SEED}" in run.stdout
    rows = [line.split("│") for line in run.stdout.splitlines() if line.startswith("│")]
    counts = {row[1].strip(): [int(cell.replace(",", "")) for cell in row[2:6]] for row in rows}
    assert counts["all"][0] == 2000
    assert counts["all"][3] == 0
    for kind in FORMATS:
        if kind.read is not None and kind.write is not None:
            assert min(counts[kind.name][1:3]) > 0, "some are read, and some are refused"
