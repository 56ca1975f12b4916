"""Scans whose points all have one z, and other clouds without volume: every function has an answer."""

import contextlib
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig


def flat(count: int = 2500) -> Any:
    return np.column_stack([np.random.default_rng(13).uniform(0, 1, (count, 2)), np.full(count, 1.5)])


def outline(count: int = 1500) -> Any:
    """Give what a 2D lidar sees of a room, about itself."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    distance = np.minimum(
        3 / np.maximum(np.abs(np.cos(angle)), 1e-9), 2 / np.maximum(np.abs(np.sin(angle)), 1e-9)
    )
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle), np.zeros(count)])


FUNCTIONS: dict[str, Callable[[Any], Any]] = {
    "extract": lambda cloud: surfsig.extract(cloud, 0.1),
    "extract_auto": lambda cloud: surfsig.extract(cloud, "auto"),
    "extract_neighbors": lambda cloud: surfsig.extract(cloud, neighbors=20, robust=True),
    "surfaces": surfsig.find_surfaces,
    "recurrences": lambda cloud: surfsig.find_recurrences(surfsig.find_surfaces(cloud)),
    "keypoints": lambda cloud: surfsig.find_keypoints(cloud, 0.2),
    "register": lambda cloud: surfsig.register(cloud, cloud),
    "register_init": lambda cloud: surfsig.register(cloud, cloud, init=np.eye(4)),
    "find": lambda cloud: surfsig.find_instances(cloud, cloud),
    "odometry": lambda cloud: surfsig.estimate_odometry([cloud, cloud]),
    "fit_plane": surfsig.fit_plane,
    "remove_outliers": surfsig.remove_outliers,
    "downsample": lambda cloud: surfsig.downsample(cloud, 0.05),
}


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("scan", [flat, outline])
def test_2d_scans_have_an_answer_and_no_numpy_warning(name: str, scan: Callable[[], Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        assert FUNCTIONS[name](scan()) is not None


def test_a_flat_scan_has_no_curvature_and_is_one_plane() -> None:
    found = surfsig.extract(flat(), 0.1)
    assert found.ok.mean() > 0.9
    np.testing.assert_allclose(found.k1[found.ok], 0.0, atol=1e-5)
    surfaces = surfsig.find_surfaces(flat())
    assert [surface.kind for surface in surfaces] == ["plane"]
    slides = surfsig.register(flat(), flat(), init=np.eye(4))
    assert len(slides.free_directions) == 3
    assert not slides.trusted


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.zeros((1, 3)),
        np.ones((300, 3)),
        np.zeros((300, 3)),
        np.full((300, 3), np.nan),
        np.column_stack([np.arange(300.0), np.zeros((300, 2))]),
    ],
    ids=["empty", "one", "equal", "zeros", "nan", "line"],
)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_clouds_without_surface_have_an_answer_or_a_reason(name: str, points: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        warnings.simplefilter("ignore", UserWarning)
        with contextlib.suppress(surfsig.InvalidInputError):
            assert FUNCTIONS[name](points) is not None


@pytest.mark.slow
def test_nothing_but_our_own_lines_reaches_stderr(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from surfsig.cli import run

    for name, points in (("flat", flat()), ("line", np.column_stack([np.arange(300.0), np.zeros((300, 2))]))):
        file = tmp_path / f"{name}.ply"
        surfsig.write(file, points)
        capfd.readouterr()
        for arguments in (
            ["extract", file, "--radius", 0.1, "-o", tmp_path / "out.ply", "-q"],
            ["surfaces", file, "-q"],
            ["register", file, file, "-q"],
            ["find", file, file, "-q"],
            ["odometry", file, file, "-o", tmp_path / "poses.txt", "-q"],
            ["clean", file, tmp_path / "out.ply", "--outliers", "-q"],
        ):
            assert run([str(argument) for argument in arguments]) in (0, 2)
            lines = capfd.readouterr().err.splitlines()
            assert [line for line in lines if not line.startswith("surfsig: ")] == []


def test_what_libraries_log_and_warn_stays_away(
    shell: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import logging

    file = tmp_path / "flat.ply"
    surfsig.write(file, flat())
    real = surfsig.extract

    def noisy(*arguments: Any, **more: Any) -> Any:
        logging.getLogger("laspy").error("a library speaks")
        np.log(np.zeros(1))
        warnings.warn("old", DeprecationWarning, stacklevel=1)
        return real(*arguments, **more)

    monkeypatch.setattr(surfsig, "extract", noisy)
    finished = shell("extract", file, "--radius", 0.1, "-o", tmp_path / "out.ply", "-q")
    assert (finished.code, finished.err) == (0, "")
