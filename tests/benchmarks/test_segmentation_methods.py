"""How the segmentation benchmark runs its methods and prints what they found."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from peers import PeerUnavailable
from segmentation import MODEL_COLUMNS, TABLE_COLUMNS, rows
from segmentation_methods import CGAL_SETTINGS, cgal_ransac, find_outside, surfsig_surfaces

import surfsig

PROGRAM = """
import json, sys
import numpy as np
points = np.fromfile(sys.argv[1]).reshape(-1, 3)
(points[:, 0] - 1).astype(np.int32).tofile(sys.argv[2])
print(json.dumps({"seconds": 0.5, "kinds": ["plane", "sphere"], "radii": [None, float(sys.argv[3])]}))
"""


def test_labels_of_a_program_stand_at_the_finite_points(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    points = np.array([[np.nan, 0, 0], [2, 0, 0], [1, 0, 0], [0, np.inf, 0], [0, 0, 0]])
    found, seconds = find_outside([sys.executable, program], surfsig.PointCloud(points), ["0.25"])
    assert found.labels.tolist() == [-1, 1, 0, -1, -1]
    assert (found.kinds, found.radii, seconds) == (["plane", "sphere"], [None, 0.25], 0.5)


def test_what_surfsig_finds_is_taken_over(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass
    class Surface:
        kind: str
        radius: float | None

    @dataclass
    class Surfaces:
        labels: np.ndarray
        surfaces: list[Surface]

    answer = Surfaces(np.array([1, -1, 0], np.int32), [Surface("plane", None), Surface("cylinder", 2.0)])
    monkeypatch.setattr(surfsig, "find_surfaces", lambda cloud: answer)
    found, _ = surfsig_surfaces(surfsig.PointCloud(np.zeros((3, 3))))
    assert found.labels.tolist() == [1, -1, 0]
    assert (found.kinds, found.radii) == (["plane", "cylinder"], [None, 2.0])


def test_cgal_labels_follow_the_order_of_the_points() -> None:
    """Efficient RANSAC sorts its input in place: its indices are not those of the points given."""
    across = np.stack(np.meshgrid(np.arange(40), np.arange(40)), -1).reshape(-1, 2) / 40
    low, high = (np.column_stack([across, np.full(len(across), height)]) for height in (0.0, 0.5))
    points = np.random.default_rng(3).permutation(np.concatenate([low, high]))
    try:
        found, _ = cgal_ransac(CGAL_SETTINGS["tuned"])(surfsig.PointCloud(points))
    except PeerUnavailable as reason:
        pytest.skip(f"CGAL's program: {reason}")
    assert list(found.kinds) == ["plane", "plane"]
    for height in (0.0, 0.5):
        assert len(np.unique(found.labels[points[:, 2] == height])) == 1


def test_rows_hold_the_scores_or_the_reason() -> None:
    model = {
        "known": 4, "found": 4, "matched": 3, "typed": 2, "points": 10, "points_of_right_kind": 9,
        "with_radius": 2, "radius_errors": (0.01,),
    }  # fmt: skip
    table = {
        "labelled": 10, "unmixed": 9, "on_table": 4, "on_table_unmixed": 3, "objects": 2, "segments": 5,
    }  # fmt: skip
    done = {"method": "m", "skipped": None, "clouds": {"PC1": {"seconds": 0.25, "score": model}}}
    cells = ("0.750", "0.500", "0.900", "1.000%", "1 of 2", "4 / 4", "0.2")
    assert rows([done], MODEL_COLUMNS, detail=True) == [("m", *cells), ("PC1", *cells)]
    done = {"method": "m", "skipped": None, "clouds": {"t": {"seconds": 0.25, "score": table}}}
    assert rows([done], TABLE_COLUMNS, detail=False) == [("m", "0.900", "0.750", "2.5", "0.2")]
    failed = {"method": "m", "skipped": "no compiler", "clouds": {}}
    assert rows([failed], TABLE_COLUMNS, detail=True) == [("m", "not measured: no compiler", "", "", "")]
