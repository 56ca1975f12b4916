"""Pages of registered scans and of found instances: before and after."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from surface_points import UTM

import surfsig
from surfsig.finding import Instance, Instances
from surfsig.page import Group, write_page
from surfsig.registration import Registration

pytest.importorskip("plotly")

RNG = np.random.default_rng(7)
POSE = np.array([[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0], [0.0, 0.0, 0.0, 1.0]])


def figure(page: Path) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Give the traces and the layout that the page hands to Plotly."""
    text = page.read_text(encoding="utf-8")
    decoder, start = json.JSONDecoder(), text.rindex("Plotly.newPlot(")
    traces, end = decoder.raw_decode(text, text.index("[", start))
    layout, _ = decoder.raw_decode(text, text.index("{", end))
    return traces, layout


def places(trace: dict[str, Any]) -> np.ndarray:
    """Give the points of a trace, (n, 3)."""
    import base64

    columns = [np.frombuffer(base64.b64decode(trace[axis]["bdata"]), trace[axis]["dtype"]) for axis in "xyz"]
    return np.column_stack(columns)


def registration() -> Registration:
    """Give a registration by `POSE`."""
    return Registration(
        T_target_source=POSE,
        covariance=1e-4 * np.eye(6),
        information=1e4 * np.eye(6),
        center=np.zeros(3),
        free_directions=[],
        matches=30,
        inliers=25,
        overlap=0.5,
        rms=0.001,
        radius=0.1,
        trusted=True,
        doubts=[],
        reasons=[],
        alternatives=[],
        explained=0.5,
        free_space=float("nan"),
        scale=1.0,
        scale_standard_error=0.01,
    )


def test_a_registration_s_page_moves_the_source(tmp_path: Path) -> None:
    points = RNG.uniform(size=(50, 3))
    source, target = surfsig.PointCloud(points), surfsig.PointCloud(points + 3.0)
    registration().write_report(tmp_path / "page.html", source, target, title="a < b")
    traces, layout = figure(tmp_path / "page.html")
    assert [trace["visible"] for trace in traces] == [True, False, True]
    still, before, after = map(places, traces)
    np.testing.assert_allclose(still, points + 3.0, rtol=1e-6)
    np.testing.assert_allclose(before, points, rtol=1e-6)
    turned = np.column_stack([-points[:, 1], points[:, 0], points[:, 2]])
    np.testing.assert_allclose(after, turned + np.array([5.0, 6.0, 7.0]), rtol=1e-6)
    (menu,) = layout["updatemenus"]
    assert [button["label"] for button in menu["buttons"]] == ["before", "after"]
    shown = [button["args"][0]["visible"] for button in menu["buttons"]]
    assert shown == [[True, True, False], [True, False, True]]
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<title>a &lt; b</title>" in text
    assert "25 of 30 agree" in text


def test_a_page_of_instances_shows_models_in_their_places(tmp_path: Path) -> None:
    model = surfsig.PointCloud(RNG.uniform(size=(20, 3)))
    scene = surfsig.PointCloud(RNG.uniform(size=(30, 3)))
    numbers = np.arange(10, 20)
    one = Instance(
        "cup", POSE, np.eye(6), np.zeros(3), 0.5, 0.7, 0.4, 0.001, [], [], 1.0, 0.01, [], [], numbers
    )
    found = Instances([one], scene, {"cup": model})
    found.write_report(tmp_path / "page.html")
    traces, _ = figure(tmp_path / "page.html")
    assert [trace["name"] for trace in traces] == ["scene", "what is found", "0 cup"]
    assert [trace["visible"] for trace in traces] == [True, False, True]
    rest, own, after = map(places, traces)
    np.testing.assert_allclose(np.concatenate([rest[:10], own, rest[10:]]), scene.points, rtol=1e-6)
    placed = model.points @ POSE[:3, :3].T + POSE[:3, 3]
    np.testing.assert_allclose(after, np.concatenate([own, placed]), rtol=1e-6)
    np.testing.assert_allclose(found.placed(0).points, placed, rtol=1e-6)


def test_a_page_without_instances(tmp_path: Path) -> None:
    Instances([], surfsig.PointCloud(RNG.uniform(size=(30, 3))), {}).write_report(tmp_path / "page.html")
    traces, layout = figure(tmp_path / "page.html")
    assert [trace["name"] for trace in traces] == ["scene"]
    assert not layout.get("updatemenus")
    assert "not there" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_a_page_far_from_0_keeps_its_digits(tmp_path: Path) -> None:
    points = RNG.uniform(size=(40, 3)) + UTM
    points[3] = np.nan
    write_page(tmp_path / "page.html", "t", "", [Group("all", points, (1, 2, 3))], ("a",), [("b",)])
    (trace,), layout = figure(tmp_path / "page.html")
    titles = [layout["scene"][f"{axis}axis"]["title"]["text"] for axis in "xyz"]
    offset = [float(number) if number else 0.0 for number in (re.sub("^.( - )?", "", t) for t in titles)]
    np.testing.assert_allclose(places(trace) + np.array(offset), np.delete(points, 3, axis=0), atol=1e-6)
