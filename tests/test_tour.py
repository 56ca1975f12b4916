"""The tour's code runs as it stands, and prints what the tour says."""

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pandas")
pytest.importorskip("pyarrow")

ROOT = Path(__file__).parents[1]
SCRIPT = runpy.run_path(str(ROOT / "examples" / "tour.py"))
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
KIBIBYTES_150 = 150 * 1024


@pytest.mark.slow
def test_the_code_prints_what_the_tour_quotes_and_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    values: dict[str, Any] = {}
    for (code, quoted), draw in zip(SCRIPT["code_blocks"](), SCRIPT["STEPS"], strict=True):
        printed = SCRIPT["run"](code, values)
        assert NUMBER.sub("#", printed) == NUMBER.sub("#", quoted)
        for ours, theirs in zip(NUMBER.findall(printed), NUMBER.findall(quoted), strict=True):
            last_digit = 10.0 ** -len(theirs.partition(".")[2])
            assert float(ours) == pytest.approx(float(theirs), rel=0.02, abs=1.01 * last_digit)
        picture = tmp_path / "picture.png"
        SCRIPT["save"](draw(values), picture)
        assert 5_000 < picture.stat().st_size < KIBIBYTES_150


def test_every_step_has_code_output_and_picture() -> None:
    tour = (ROOT / "docs" / "tour.md").read_text(encoding="utf-8")
    steps = [int(number) for number in re.findall(r"^## (\d+)\. ", tour, re.MULTILINE)]
    blocks = SCRIPT["code_blocks"]()
    assert steps == list(range(1, len(SCRIPT["STEPS"]) + 1))
    assert len(blocks) == tour.count("```python") == len(steps)
    assert all(quoted for _, quoted in blocks)
    shown = re.findall(r"^!\[.+\]\((pictures/.+)\)$", tour, re.MULTILINE)
    named = [f"pictures/tour_{i}_{step.__name__}.png" for i, step in enumerate(SCRIPT["STEPS"], start=1)]
    assert shown == named
    for picture in shown:
        assert (ROOT / "docs" / picture).stat().st_size < KIBIBYTES_150
