"""`surfsig library`: models in a file; finding them is in `tests/test_library.py`."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from finding_scene import whole

import surfsig


def test_a_model_is_added_listed_and_removed(shell: Callable[..., Any], tmp_path: Path) -> None:
    model, store = tmp_path / "figure.ply", tmp_path / "things.db"
    surfsig.write(model, whole("figure", 3000))
    assert shell("library", "add", store, "figure", model).code == 0
    again = shell("library", "add", store, "figure", model)
    assert (again.code, again.err.count("\n")) == (2, 1)
    assert "figure" in shell("library", "list", store).out
    assert surfsig.Library(store).names() == ("figure",)
    assert shell("library", "remove", store, "figure").code == 0
    assert surfsig.Library(store).names() == ()
