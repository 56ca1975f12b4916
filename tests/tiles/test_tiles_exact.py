"""Tiles have the bits of the whole cloud, however they are cut."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tile_scenes import RADIUS, check_equal, town, town_files

import surfsig
from surfsig import PointCloud
from surfsig.tiles import job as module
from surfsig.tiles.plan import Plan

SIZES: tuple[dict[str, Any], ...] = ({"radius": 0.25}, {"neighbors": 40}, {"radius": "auto"})


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return town_files(tmp_path_factory.mktemp("town"), 9000)


@pytest.fixture(scope="module")
def whole(paths: list[Path]) -> PointCloud:
    return surfsig.read(paths)


def parts_of(paths: Any, out: Path, tiles: int, **how: Any) -> PointCloud:
    found = surfsig.extract_tiles(paths, out, tiles=tiles, suffix=".npz", numbers=True, **how)
    assert found.is_finished
    return found.read()


@pytest.mark.parametrize(
    "how",
    [
        {"radius": RADIUS},
        {"radius": 0.31},
        {"radius": 3.7},
        {"radius": RADIUS, "fit": "quadric"},
        {"radius": RADIUS, "fit": "auto"},
        {"radius": RADIUS, "robust": True},
        {"radius": RADIUS, "axes": "sensor"},
        {"radius": RADIUS, "neighbors": 20},
        {"radius": RADIUS, "viewpoint": (389_000.0, 5_819_010.0, -30.0)},
        {"neighbors": 24},
        {"neighbors": 24, "robust": True},
        {"radius": "auto"},
    ],
    ids=str,
)
def test_tiles_have_the_bits_of_the_whole(
    paths: list[Path], whole: PointCloud, tmp_path: Path, how: dict[str, Any]
) -> None:
    found = surfsig.extract(whole, **how)
    check_equal(parts_of(paths, tmp_path / "out", 16, **how), whole, found)


@pytest.mark.parametrize("how", [{}, {"robust": True}, {"neighbors": 20}], ids=str)
def test_an_extraction_at_all_points_has_the_same_bits(
    paths: list[Path], whole: PointCloud, tmp_path: Path, how: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    # As where halos are small beside tiles.
    monkeypatch.setattr("surfsig.tiles.task.MOSTLY_OWN", 0.0)
    found = surfsig.extract(whole, RADIUS, **how)
    check_equal(parts_of(paths, tmp_path / "out", 6, radius=RADIUS, **how), whole, found)


@pytest.mark.parametrize("tiles", [1, 4, 37])
def test_any_number_of_tiles(paths: list[Path], whole: PointCloud, tmp_path: Path, tiles: int) -> None:
    found = surfsig.extract(whole, RADIUS)
    check_equal(parts_of(paths, tmp_path / "out", tiles, radius=RADIUS), whole, found)


@pytest.mark.parametrize("shift", [0.0, 2.5, 3.999])
def test_tiles_that_are_shifted(
    paths: list[Path], whole: PointCloud, tmp_path: Path, shift: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Columns of 5 m along x and rows of 8 m along y, moved along both.
    columns, rows = (
        np.arange(389_000, 389_040, 5.0)[1:] + shift,
        np.arange(5_819_000, 5_819_024, 8.0)[1:] + shift,
    )
    numbers = iter(range(1000))
    node = _columns_of_tiles(columns.tolist(), rows.tolist(), numbers)
    monkeypatch.setattr(module, "cut_by_count", lambda *_: lambda survey: Plan(node))
    found = surfsig.extract(whole, RADIUS)
    check_equal(parts_of(paths, tmp_path / "out", 8 * 3, radius=RADIUS), whole, found)


def _columns_of_tiles(columns: list[float], rows: list[float], numbers: Any) -> Any:
    if not columns:
        return _row_of_tiles(rows, numbers)
    return 0, columns[0], _row_of_tiles(rows, numbers), _columns_of_tiles(columns[1:], rows, numbers)


def _row_of_tiles(rows: list[float], numbers: Any) -> Any:
    return next(numbers) if not rows else (1, rows[0], next(numbers), _row_of_tiles(rows[1:], numbers))


@pytest.mark.parametrize("suffix", [".laz", ".ply", ".parquet", ".las"])
def test_parts_of_any_format(paths: list[Path], whole: PointCloud, tmp_path: Path, suffix: str) -> None:
    found = surfsig.extract_tiles(
        paths, tmp_path / "out", RADIUS, tiles=5, suffix=suffix, numbers=True, memory="1GB"
    )
    parts = [part.name for part in found.paths]
    assert parts == [f"tile_{tile:06d}{suffix}" for tile in range(5)]
    check_equal(found.read(), whole, surfsig.extract(whole, RADIUS))


def test_points_that_are_not_finite_are_kept(tmp_path: Path) -> None:
    cloud = town(3000)
    cloud.offsets[[5, 1200, 2999]] = np.nan
    cloud.offsets[77, 1] = np.inf
    surfsig.write(tmp_path / "in.npz", cloud)
    whole = surfsig.read(tmp_path / "in.npz")
    found = surfsig.extract(whole, RADIUS)
    assert (found.status == surfsig.Status.NOT_FINITE).sum() == 4
    check_equal(parts_of(tmp_path / "in.npz", tmp_path / "out", 6, radius=RADIUS), whole, found)


@pytest.mark.parametrize("step", [0.5, 0.02])
def test_coarse_coordinates_are_told_by_all_points(tmp_path: Path, step: float) -> None:
    cloud = town(6000)
    cloud.offsets[:, 2] = np.round(cloud.offsets[:, 2] / step) * step
    surfsig.write(tmp_path / "in.ply", cloud)
    whole = surfsig.read(tmp_path / "in.ply")
    with pytest.warns(UserWarning, match="too coarse") if step == 0.5 else _no_warning():
        found = surfsig.extract(whole, RADIUS)
    with pytest.warns(UserWarning, match="too coarse") if step == 0.5 else _no_warning():
        parts = parts_of(tmp_path / "in.ply", tmp_path / "out", 9, radius=RADIUS)
    assert (found.status == surfsig.Status.TOO_COARSE).any() == (step == 0.5)
    check_equal(parts, whole, found)


def _no_warning() -> Any:
    import contextlib

    return contextlib.nullcontext()


def test_few_points_and_clouds_of_one_place(tmp_path: Path) -> None:
    for name, points in {
        "few": np.random.default_rng(9).normal(size=(7, 3)),
        "one place": np.repeat(np.array([[1.0, 2.0, 3.0]]), 300, axis=0),
        "two places": np.repeat(np.array([[1.0, 2, 3], [4, 5, 6]]), 40, axis=0),
    }.items():
        surfsig.write(tmp_path / f"{name}.ply", points)
        whole = surfsig.read(tmp_path / f"{name}.ply")
        for number, how in enumerate(SIZES):
            found = surfsig.extract(whole, **how)
            out = tmp_path / f"{name} {number}"
            check_equal(parts_of(tmp_path / f"{name}.ply", out, 4, **how), whole, found)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [101])
def test_dense_and_sparse_places(tmp_path: Path, seed: int) -> None:
    """Points as a standing scanner measures them: ten thousand times as dense near to it."""
    rng, count = np.random.default_rng(seed), 10_000
    distance, angle = np.exp(rng.uniform(np.log(0.3), np.log(30), count)), rng.uniform(0, 2 * np.pi, count)
    x, y = distance * np.cos(angle), distance * np.sin(angle)
    z = 0.2 * np.sin(x) + 0.1 * np.cos(1.7 * y) + rng.normal(0, 0.003, count)
    points = np.column_stack([x, y, z]).astype(np.float32)
    surfsig.write(tmp_path / "in.ply", PointCloud(points, viewpoint=np.array([0.0, 0, 2])))
    whole = surfsig.read(tmp_path / "in.ply")
    for number, how in enumerate(SIZES):
        found = surfsig.extract(whole, **how)
        check_equal(parts_of(tmp_path / "in.ply", tmp_path / f"{number}", 16, **how), whole, found)
