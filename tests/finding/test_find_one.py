"""One half hidden instance of a model; `tests/test_find.py` has the scenes that take longer."""

import numpy as np
from finding import errors
from finding_scene import finding_scene, whole

import surfsig


def test_a_half_hidden_copy_is_found_where_it_is() -> None:
    scene = finding_scene("figure", 2, copies=1, others=0)
    assert scene.hidden[0] > 0.45
    around = np.linalg.norm(scene.cloud.points - scene.poses[0][:3, 3], axis=1) < 0.06
    found = surfsig.find_instances(whole("figure", 6000), scene.cloud.at(np.flatnonzero(around)))
    assert found.summary() == "1 instance (1 of model)"
    distance, degrees = errors(found[0].T_scene_model, scene.poses[0])
    assert distance < 0.001
    assert degrees < 1.0
