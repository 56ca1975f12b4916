"""Pages with data inside: what they hold, and that they need no network."""

import html
import http.client
import json
import re
import threading
from pathlib import Path
from urllib.parse import urlparse

import numpy as np
import pytest
from page_data import report_of
from surface_points import UTM

import surfsig
from surfsig.finding import Instance, Instances
from surfsig.page import Layer, page_html, serve_cloud
from surfsig.page.document import viewer
from surfsig.page.packing import STEPS
from surfsig.registration import Registration

RNG = np.random.default_rng(7)
POSE = np.array([[0.0, -1.0, 0.0, 5.0], [1.0, 0.0, 0.0, 6.0], [0.0, 0.0, 1.0, 7.0], [0.0, 0.0, 0.0, 1.0]])


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


def same_points(shown: np.ndarray, points: np.ndarray) -> bool:
    """Whether each point is shown, within a step of its coordinates, and no other."""
    step = np.ptp(points, axis=0).max() / STEPS
    distances = np.abs(shown[:, None] - points[None]).max(axis=2)
    return bool(len(shown) == len(points) and distances.min(axis=0).max() <= step)


def test_a_registration_s_page_moves_the_source(tmp_path: Path) -> None:
    points = RNG.uniform(size=(50, 3))
    source, target = surfsig.PointCloud(points), surfsig.PointCloud(points + 3.0)
    registration().write_report(tmp_path / "page.html", source, target, title="a < b")
    still, moving = report_of(tmp_path / "page.html")["layers"]
    assert same_points(still["points"], points + 3.0)
    assert same_points(moving["points"], points)
    assert still["transform"] is None
    np.testing.assert_array_equal(np.reshape(moving["transform"], (4, 4)), POSE)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<title>a &lt; b</title>" in text
    assert "25 of 30 agree" in text


def test_a_page_of_instances_shows_models_in_their_poses(tmp_path: Path) -> None:
    model = surfsig.PointCloud(RNG.uniform(size=(20, 3)))
    scene = surfsig.PointCloud(RNG.uniform(size=(30, 3)))
    numbers = np.arange(10, 20)
    one = Instance(
        "cup", POSE, np.eye(6), np.zeros(3), 0.5, {}, 0.7, 0.4, 0.001, [], [], 1.0, 0.01, [], [], numbers
    )
    found = Instances([one], scene, {"cup": model})
    found.write_report(tmp_path / "page.html")
    drawn, placed = report_of(tmp_path / "page.html")["layers"]
    assert [layer["stage"] for layer in (drawn, placed)] == [None, "after"]
    assert same_points(drawn["points"][drawn["labels"] == 0], scene.points[10:20])
    assert same_points(drawn["points"], scene.points)
    expected = model.points @ POSE[:3, :3].T + POSE[:3, 3]
    assert same_points(placed["points"], expected)
    np.testing.assert_allclose(found.placed(0).points, expected, rtol=1e-6)
    assert "<iframe " in found._repr_html_()


def test_a_page_without_instances(tmp_path: Path) -> None:
    Instances([], surfsig.PointCloud(RNG.uniform(size=(30, 3))), {}).write_report(tmp_path / "page.html")
    report = report_of(tmp_path / "page.html")
    assert [layer["name"] for layer in report["layers"]] == ["scene"]
    assert "not there" in report["text"]


def test_a_page_far_from_0_keeps_its_digits() -> None:
    points = RNG.uniform(size=(40, 3)) + UTM
    points[3] = np.nan
    (layer,) = report_of(page_html("t", "", [Layer("all", points, color=(1, 2, 3))]))["layers"]
    assert same_points(layer["points"], np.delete(points, 3, axis=0))
    assert layer["total"] == 40
    assert layer["colour"] == [1, 2, 3]


def test_columns_come_back_as_precise_as_they_are_looked_at() -> None:
    points = RNG.uniform(size=(500, 3))
    k1, error = RNG.normal(0, 40, 500), RNG.uniform(0.1, 9, 500)
    k1[0], k1[1], k1[2], error[3], error[4] = np.nan, 1e5, 1e-3, np.nan, 0.0
    normals = RNG.normal(size=(500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    layer = Layer(
        "all", points, normals=normals, columns={"k1": k1, "k1_std": error}, labels=np.arange(500) - 1
    )
    (shown,) = report_of(page_html("t", "", [layer]))["layers"]
    order = shown["labels"] + 1
    np.testing.assert_array_equal(np.sort(order), np.arange(500))
    # Half precision, and steps of 2 % on a logarithmic scale.
    assert np.isnan(shown["columns"]["k1"][order == 0]).all()
    whole = order > 1
    np.testing.assert_allclose(shown["columns"]["k1"][whole], k1[order][whole], rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(shown["columns"]["k1_std"], error[order], rtol=0.02)
    u, v = shown["normals"].T
    z = 1 - np.abs(u) - np.abs(v)
    fold = z < 0
    x, y = np.where(fold, (1 - np.abs(v)) * np.sign(u), u), np.where(fold, (1 - np.abs(u)) * np.sign(v), v)
    back = np.column_stack([x, y, z]) / np.sqrt(x * x + y * y + z * z)[:, None]
    assert (back * normals[order]).sum(axis=1).min() > np.cos(np.radians(1.0))


def test_of_too_many_points_an_even_choice_is_kept() -> None:
    points = RNG.uniform(size=(2000, 3))
    report = report_of(
        page_html("t", "", [Layer("a", points[:1500]), Layer("b", points[1500:])], most_points=200)
    )
    assert [layer["count"] for layer in report["layers"]] == [150, 50]
    assert [layer["total"] for layer in report["layers"]] == [1500, 500]


def test_an_extraction_s_page_holds_its_curvature(tmp_path: Path) -> None:
    x, y = RNG.uniform(-1, 1, (2, 800))
    cloud = surfsig.PointCloud(np.column_stack([x, y, 0.5 * x * x]), viewpoint=np.array([0.0, 0.0, 9.0]))
    found = surfsig.extract(cloud, 0.4)
    found.write_report(tmp_path / "page.html", title="</script> & more", columns={"zeta": np.ones(800)})
    report = report_of(tmp_path / "page.html")
    (layer,) = report["layers"]
    assert report["title"] == "</script> & more"
    assert set(layer["columns"]) == {"k1", "k2", "k1_std", "k2_std", "mean_curvature_std", "zeta"}
    assert np.nanmedian(layer["columns"]["k1"]) == pytest.approx(np.nanmedian(found.k1), rel=2e-3, abs=1e-3)


def test_an_odometry_s_page_holds_the_trajectory_and_the_map(tmp_path: Path) -> None:
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3] = [0.0, 1.0, np.nan]
    poses[1, :3, :3] = POSE[:3, :3]
    poses[2] = np.nan
    covariances = np.tile(np.diag([0, 0, 0, 4.0, 1.0, 0.25]), (3, 1, 1))
    status = np.array([0, 0, 2], np.uint8)
    found = surfsig.Odometry(
        poses,
        covariances,
        status,
        np.ones(3),
        [[], [], []],
        np.arange(3.0),
        0.1,
        np.where(status == 2, -1, 0),
        np.full((3, 6), np.nan),
        [],
    )
    scans = [surfsig.PointCloud(RNG.uniform(size=(60, 3))) for _ in range(3)]
    found.write_report(tmp_path / "page.html", scans)
    report = report_of(tmp_path / "page.html")
    (layer,) = report["layers"]
    moved = scans[1].points @ POSE[:3, :3].T + [1.0, 0, 0]
    assert same_points(layer["points"], np.concatenate([scans[0].points, moved]))
    assert report["trajectory"]["positions"] == [[0, 0, 0], [1, 0, 0]]
    # Along the scan's x, which is the world's y.
    matrix = np.reshape(report["trajectory"]["covariances"][1]["matrix"], (3, 3))
    np.testing.assert_allclose(matrix, np.diag([1.0, 4.0, 0.25]), atol=1e-12)


def test_a_page_needs_no_network_and_stays_small() -> None:
    text = page_html("t", "", [Layer("all", RNG.uniform(size=(3000, 3)))])
    assert not re.findall(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?!data:)', text)
    assert len(text) < 2_000_000
    assert len(text) - len(viewer()) < 3000 * 10


def test_a_cloud_is_served_to_who_knows_the_address_only() -> None:
    cloud = surfsig.PointCloud(
        RNG.uniform(size=(30, 3)).astype(np.float32), viewpoint=np.array([1.0, 2.0, 3.0])
    )
    server = serve_cloud(cloud, "a </script> name.ply")
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        address = urlparse(server.url)
        assert address.hostname == "127.0.0.1"

        def get(path: str, host: str | None = None) -> tuple[int, bytes]:
            connection = http.client.HTTPConnection("127.0.0.1", address.port, timeout=30)
            connection.request("GET", path, headers={} if host is None else {"Host": host})
            answer = connection.getresponse()
            return answer.status, answer.read()

        status, page = get(address.path)
        (source,) = re.findall(r'id="source-data">(.*?)</script>', page.decode())
        assert (status, json.loads(source)["name"]) == (200, "a </script> name.ply")
        status, content = get(address.path + json.loads(source)["url"])
        assert status == 200
        assert b"comment surfsig viewpoint 1.0 2.0 3.0" in content
        assert content.endswith(cloud.offsets.astype("<f4").tobytes())
        for path, host in (("/", None), ("/cloud.ply", None), (address.path, "example.org")):
            assert get(path, host)[0] == 404
    finally:
        server.shutdown()
        server.server_close()


def test_a_notebook_shows_a_cloud_with_its_colours_normals_and_fields() -> None:
    points = RNG.uniform(size=(50, 3))
    fields = {
        "red": np.arange(50, dtype=np.uint16) << 8,
        "green": np.full(50, 0.5, np.float32),
        "blue": np.arange(50, dtype=np.uint8),
        **dict.fromkeys(("nx", "ny"), np.zeros(50)),
        "nz": np.ones(50),
        "intensity": np.linspace(0.0, 1.0, 50),
        "descriptor": np.zeros((50, 4)),
    }
    frame = surfsig.PointCloud(points, fields=fields)._repr_html_()
    assert frame.startswith('<iframe title="Cloud"')
    (layer,) = report_of(html.unescape(frame.split('srcdoc="', 1)[1].rsplit('"', 1)[0]))["layers"]
    assert same_points(layer["points"], points)
    order = np.argsort(layer["colours"][:, 0])
    np.testing.assert_array_equal(layer["colours"][order], [[k, 127, k] for k in range(50)])
    np.testing.assert_allclose(layer["columns"]["intensity"][order], fields["intensity"], atol=1e-3)
    assert list(layer["columns"]) == ["intensity"]
    assert layer["normals"] is not None
    assert surfsig.PointCloud(points)._repr_html_().startswith("<iframe")


def test_show_gives_the_address_of_a_page() -> None:
    address = surfsig.show(RNG.uniform(size=(30, 3)), browser=False)
    assert address.startswith("http://127.0.0.1:")
    x, y = RNG.uniform(-1, 1, (2, 300))
    found = surfsig.extract(np.column_stack([x, y, x * y]), 0.5)
    address = surfsig.show(found, title="saddle", browser=False)
    assert report_of(Path(urlparse(address).path))["title"] == "saddle"
    assert found._repr_html_().startswith('<iframe title="Curvature"')
    with pytest.raises(surfsig.InvalidInputError):
        surfsig.show("nothing", browser=False)
