"""Clouds in units that cannot go together: the message names the ratio and the units."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from finding_scene import finding_scene, whole
from register_scenes import terrain

import surfsig
from surfsig import PointCloud

RATIOS = [
    (1000.0, "millimetres and metres"),
    (100.0, "centimetres and metres"),
    (25.4, "millimetres and inches"),
    (12.0, "inches and feet"),
    (3.2808, "feet and metres"),
]


def scans() -> tuple[Any, Any]:
    rng = np.random.default_rng(12)
    return terrain(rng, 2500, -1.1, 0.9), terrain(rng, 2500, -0.9, 1.1)


@pytest.mark.parametrize(("ratio", "units"), RATIOS)
@pytest.mark.parametrize("near", [0.85, 1.0, 1.15])
def test_a_ratio_of_two_units_is_named(ratio: float, units: str, near: float) -> None:
    source, target = scans()
    told = surfsig.unit_mismatch(source * ratio * near, target, ("this", "that"))
    assert told is not None
    assert told.startswith("this is ")
    assert units in told
    assert surfsig.unit_mismatch(source, target * ratio * near, ("this", "that")) is not None


@pytest.mark.parametrize(("ratio", "units"), [RATIOS[0], RATIOS[2]])
def test_registration_names_the_units(ratio: float, units: str) -> None:
    source, target = scans()
    with pytest.warns(UserWarning, match=f"source is .* times as large as target.*{units}"):
        assert not surfsig.register(source * ratio, target).trusted


def test_registration_names_them_the_other_way_round() -> None:
    source, target = scans()
    with pytest.warns(UserWarning, match="target is .* times as large as source.*millimetres and metres"):
        assert not surfsig.register(source, target * 1000.0).trusted


def test_scans_of_one_unit_are_not_said_to_differ() -> None:
    source, target = scans()
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        assert surfsig.register(source, target).trusted
    assert surfsig.unit_mismatch(source, target) is None
    assert surfsig.unit_mismatch(source, np.zeros((0, 3))) is None
    assert surfsig.unit_mismatch(source, np.zeros((5, 3))) is None


@pytest.mark.slow
def test_finding_names_the_units() -> None:
    scene, model = finding_scene("figure", 2, copies=1, others=1).cloud, whole("figure")
    larger = PointCloud(model.points * 1000.0)
    with pytest.warns(UserWarning, match="nothing was found, and the model 'model' has points .* apart"):
        assert not len(surfsig.find_instances(larger, scene))


@pytest.mark.slow
def test_each_model_of_a_library_gave_a_warning_of_its_units() -> None:
    scene, model = finding_scene("figure", 2, copies=1, others=1).cloud, whole("figure", 3000)
    larger = {name: PointCloud(model.points * 1000.0) for name in ("a", "b", "c")}
    with pytest.warns(UserWarning, match="nothing was found") as told:
        assert not len(surfsig.find_instances(larger, scene))
    (text,) = [str(one.message) for one in told]
    assert text.startswith("nothing was found, and the model 'a' has points")
    assert text.endswith("; 2 other models differ alike")


def test_comparing_places_names_the_units(shell: Callable[..., Any], tmp_path: Path) -> None:
    points = scans()[0]
    metres, millimetres = tmp_path / "m.ply", tmp_path / "mm.ply"
    surfsig.write(metres, points)
    surfsig.write(millimetres, points * 1000.0)
    finished = shell("compare", metres, millimetres, "--at", "0,0,0", "--at", "0,0,0", "--radius", 0.2)
    assert finished.code == 2
    assert "1000 is that of millimetres and metres" in finished.err
