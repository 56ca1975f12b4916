"""The code of docs/surfaces.md runs as it stands, and prints what the page says."""

import re
import runpy
from pathlib import Path
from typing import Any

import pytest

for needed in ("matplotlib", "xlsxwriter", "trimesh"):
    pytest.importorskip(needed)

ROOT = Path(__file__).parents[1]
TOUR = runpy.run_path(str(ROOT / "examples" / "tour.py"))
PAGE = (ROOT / "docs" / "surfaces.md").read_text(encoding="utf-8")
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-\d+)?(?![\w.])")


@pytest.mark.slow
def test_the_code_prints_what_the_page_quotes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    values: dict[str, Any] = {}
    for block in TOUR["BLOCK"].finditer(PAGE):
        printed, quoted = TOUR["run"](block["code"], values), block["output"] or ""
        assert NUMBER.sub("#", printed) == NUMBER.sub("#", quoted)
        for ours, theirs in zip(NUMBER.findall(printed), NUMBER.findall(quoted), strict=True):
            last_digit = 10.0 ** -len(theirs.partition(".")[2]) if "e" not in theirs else 0.0
            assert float(ours) == pytest.approx(float(theirs), rel=0.03, abs=1.01 * last_digit)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"labelled.ply", "report.html", "table.csv", "table.xlsx", "model.glb"}
