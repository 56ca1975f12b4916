"""LAS, LAZ and COPC: what laspy reads, we read; what we write comes back, and laspy reads it."""

import errno
import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.files import format_name, read, write
from surfsig.files.laz_chunks import copc_chunks, laz_chunks
from surfsig.files.options import cropped
from surfsig.point_cloud import PointCloud

RNG = np.random.default_rng(17)
EXTENSIONS = ["las", "laz"]
EVERYTHING = [[-np.inf] * 3, [np.inf] * 3]


@pytest.fixture(params=EXTENSIONS)
def extension(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def utm_millimetres(count: int = 1000) -> NDArray[np.int64]:
    corner = np.array([500_123_456, 4_501_234_567, 98_765])
    return corner + RNG.integers(0, 80_000, (count, 3))


def assert_as_laspy_reads_it(path: Path) -> None:
    cloud, expected = read(path), laspy.read(path)
    np.testing.assert_array_equal(cloud.points, expected.xyz)
    names = [name for name in expected.point_format.dimension_names if name not in "XYZ"]
    assert list(cloud.fields) == names
    for name in names:
        np.testing.assert_array_equal(cloud.fields[name], np.asarray(expected[name]), err_msg=name)


def test_shared_files_are_as_laspy_reads_them(shared_data: Path) -> None:
    # What laspy refuses or reads otherwise is in a folder of its own.
    paths = [
        path
        for path in sorted(shared_data.rglob("*"))
        if path.suffix in (".las", ".laz") and "odd_files" not in path.parts
    ]
    assert len(paths) >= 7
    for path in paths:
        assert_as_laspy_reads_it(path)


@pytest.mark.parametrize("kind", range(11))
def test_every_point_format_and_extra_bytes(tmp_path: Path, extension: str, kind: int) -> None:
    header = laspy.LasHeader(point_format=kind, version="1.4")
    header.scales, header.offsets = np.array([0.001, 0.01, 0.25]), np.array([500_000.5, 4_500_000.0, -1.0])
    header.add_extra_dims(
        [
            laspy.ExtraBytesParams("scaled", "3i2", scales=[0.1, 0.2, 0.3], offsets=[1, 2, 3]),
            laspy.ExtraBytesParams("one scaled", "u1", scales=[0.5], offsets=[-7]),
            laspy.ExtraBytesParams("vector", "2f4"),
            laspy.ExtraBytesParams("raw", "5u1"),
            laspy.ExtraBytesParams("return_num", "i8"),
        ]
    )
    data = laspy.LasData(header)
    record = laspy.PackedPointRecord.zeros(700, header.point_format)
    record.array[:] = np.frombuffer(RNG.bytes(record.array.nbytes), record.array.dtype)
    record.array["vector"] = RNG.normal(size=(700, 2))
    for name in ("gps_time", "x_t", "y_t", "z_t", "return_point_wave_location"):
        if name in (record.array.dtype.names or ()):
            record.array[name] = RNG.normal(size=700)
    data.points = laspy.ScaleAwarePointRecord(
        record.array, header.point_format, header.scales, header.offsets
    )
    path = tmp_path / f"a.{extension}"
    data.write(path)
    cloud, expected = read(path), laspy.read(path)
    assert format_name(path) == extension.upper()
    assert cloud.origin.tolist() == [500_000.5, 4_500_000.0, -1.0]
    np.testing.assert_array_equal(cloud.points, expected.xyz)
    for name in set(expected.point_format.dimension_names) - {*"XYZ", "return_num"}:
        np.testing.assert_array_equal(cloud.fields[name], np.asarray(expected[name]), err_msg=name)
    # laspy takes this name for another one of its own.
    np.testing.assert_array_equal(cloud.fields["return_num"], record.array["return_num"])
    assert cloud.fields["scaled"].shape == (700, 3)


def test_points_compressed_without_chunks(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    data = laspy.LasData(header)
    data.xyz = RNG.normal(size=(500, 3))
    data.write(tmp_path / "chunks.laz")
    content = bytearray((tmp_path / "chunks.laz").read_bytes())
    with (tmp_path / "chunks.laz").open("rb") as file:
        start = laspy.LasHeader.read_from(file).offset_to_point_data
    table = int.from_bytes(content[start : start + 8], "little")
    record = content.index(b"laszip encoded") + 52
    assert content[record : record + 2] == b"\x02\x00"
    content[record] = 1
    old = tmp_path / "old.laz"
    old.write_bytes(content[:start] + content[start + 8 : table])
    np.testing.assert_array_equal(read(old).points, laspy.read(tmp_path / "chunks.laz").xyz)


def test_millimetres_at_utm(tmp_path: Path, extension: str) -> None:
    millimetres = utm_millimetres()
    cloud = PointCloud(millimetres / 1000)
    path = tmp_path / f"a.{extension}"
    write(path, cloud)
    again = read(path)
    with laspy.open(path) as file:
        assert file.header.scales.tolist() == [0.001] * 3
        assert (file.header.offsets == np.rint(file.header.offsets)).all()
    np.testing.assert_array_equal(np.rint(again.points * 1000), millimetres)
    np.testing.assert_allclose(again.points, cloud.points, rtol=0, atol=1e-9)
    assert np.abs(again.offsets).max() < 100


def test_what_came_from_las_stays_the_same_to_the_last_bit(tmp_path: Path, extension: str) -> None:
    header = laspy.LasHeader(point_format=6)
    header.scales, header.offsets = np.array([0.01, 0.001, 0.0001]), np.array([500_000.125, 4_500_000.0, 7.0])
    data = laspy.LasData(header)
    data.X, data.Y, data.Z = RNG.integers(-(10**6), 10**6, (3, 1000))
    data.write(tmp_path / "in.laz")
    cloud = read(tmp_path / "in.laz")
    write(tmp_path / f"out.{extension}", cloud)
    again = read(tmp_path / f"out.{extension}")
    np.testing.assert_allclose(again.points, cloud.points, rtol=0, atol=1e-9)
    write(tmp_path / f"third.{extension}", again)
    np.testing.assert_array_equal(read(tmp_path / f"third.{extension}").points, again.points)


@pytest.mark.parametrize(
    ("size", "step"), [(1e-6, 1e-9), (0.3, 1e-9), (20.0, 1e-8), (2e3, 1e-6), (2e6, 1e-3)]
)
def test_points_move_by_half_a_step_at_most(tmp_path: Path, size: float, step: float) -> None:
    points = np.array([100.0, 0, 0]) + RNG.uniform(-size, size, (500, 3))
    write(tmp_path / "a.laz", PointCloud(points))
    with laspy.open(tmp_path / "a.laz") as file:
        np.testing.assert_allclose(file.header.scales, step, rtol=1e-12)
    moved = np.abs(read(tmp_path / "a.laz").points - points).max()
    assert moved <= step / 2 * (1 + 1e-6) + 1e-9 * step + 1e-15 * size


def test_an_extent_that_does_not_fit(tmp_path: Path, extension: str) -> None:
    with pytest.raises(InvalidInputError, match=r"are 5e\+06 wide, LAS holds at most 4\.29e\+06"):
        write(tmp_path / f"a.{extension}", PointCloud(np.array([[0, 0, 0], [5e6, 0, 0]])))
    assert os.listdir(tmp_path) == []


def example() -> tuple[PointCloud, dict[str, NDArray[Any]]]:
    count = 300
    fields: dict[str, NDArray[Any]] = {
        "intensity": RNG.integers(0, 65_536, count).astype(np.uint16),
        "classification": RNG.integers(0, 256, count).astype(np.uint8),
        "return_number": RNG.integers(0, 16, count).astype(np.int64),
        "scan_angle": RNG.integers(-30_000, 30_000, count).astype(np.int16),
        "gps_time": RNG.normal(size=count) * 1e9,
        "withheld": RNG.random(count) > 0.5,
        **{name: RNG.integers(0, 256, count).astype(np.uint8) for name in ("red", "green", "blue")},
        "label": RNG.integers(-(2**62), 2**62, count),
        "a name that is longer than LAS allows 1": np.arange(count, dtype=np.uint32),
        "a name that is longer than LAS allows 2": np.arange(count, dtype=np.int8) % 7,
        # No class of LAS, which are whole numbers up to 255.
        "user_data": RNG.normal(size=count).astype(np.float32),
        "Größe der Fläche in Quadratmeterü": RNG.normal(size=count),
    }
    columns: dict[str, NDArray[Any]] = {
        "k1": np.where(RNG.random(count) > 0.9, np.nan, RNG.normal(size=count)).astype(np.float32),
        "normals": RNG.normal(size=(count, 3)).astype(np.float32),
        "direction": RNG.normal(size=(count, 3)),
        "good": RNG.random(count) > 0.5,
    }
    points = utm_millimetres(count) / 1000
    return PointCloud(points, viewpoint=np.array([1.5, 2.0, 3.0]), fields=fields), columns


def test_fields_and_columns_come_back(tmp_path: Path, extension: str) -> None:
    cloud, columns = example()
    path = tmp_path / f"a.{extension}"
    write(path, cloud, columns, notes={"radius": "0.02"})
    again = read(path)
    assert again.viewpoint is not None
    assert again.viewpoint.tolist() == [1.5, 2.0, 3.0]
    expected = {name.replace(" ", "_"): values for name, values in cloud.fields.items()}
    expected["a_name_that_is_longer_than_LAS_a"] = expected.pop("a_name_that_is_longer_than_LAS_allows_1")
    expected["a_name_that_is_longer_than_LAS_2"] = expected.pop("a_name_that_is_longer_than_LAS_allows_2")
    expected["Größe_der_Fläche_in_Quadratme"] = expected.pop("Größe_der_Fläche_in_Quadratmeterü")
    expected["user_data_2"] = expected.pop("user_data")
    expected.update(k1=columns["k1"], good=columns["good"])
    expected.update(zip(("nx", "ny", "nz"), columns["normals"].T, strict=True))
    expected.update({f"direction_{i}": values for i, values in enumerate(columns["direction"].T)})
    assert set(again.fields) == set(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(again.fields[name], values, err_msg=name)
    assert again.fields["red"].dtype == np.uint8
    assert again.fields["label"].dtype == np.int64
    assert again.fields["good"].dtype == np.uint8


def test_laspy_reads_what_we_write(tmp_path: Path, extension: str) -> None:
    cloud, columns = example()
    path = tmp_path / f"a.{extension}"
    write(path, cloud, columns)
    data = laspy.read(path)
    assert (str(data.header.version), data.header.point_format.id) == ("1.4", 7)
    assert data.header.are_points_compressed == (extension == "laz")
    np.testing.assert_allclose(data.xyz, cloud.points, rtol=0, atol=1e-9)
    np.testing.assert_allclose(data.header.mins, cloud.points.min(axis=0), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(data.classification, cloud.fields["classification"])
    np.testing.assert_array_equal(data.return_number, cloud.fields["return_number"])
    np.testing.assert_array_equal(data.number_of_returns, np.ones(300))
    np.testing.assert_array_equal(data["k1"], columns["k1"])


@pytest.mark.parametrize(
    ("names", "kind"), [((), 6), (("red", "green"), 6), (("red", "green", "blue", "nir"), 8)]
)
def test_the_point_format_is_that_of_the_colours(tmp_path: Path, names: tuple[str, ...], kind: int) -> None:
    fields: dict[str, NDArray[Any]] = {name: np.array([300, 65_535], np.uint16) for name in names}
    write(tmp_path / "a.laz", PointCloud(np.eye(3)[:2], fields=fields))
    assert laspy.read(tmp_path / "a.laz").header.point_format.id == kind
    again = read(tmp_path / "a.laz").fields
    assert {name: values.tolist() for name, values in again.items()} == {
        name: [300, 65_535] for name in names
    }
    assert all(values.dtype == np.uint16 for values in again.values())


def test_points_that_are_not_finite_are_left_out(tmp_path: Path, extension: str) -> None:
    points = utm_millimetres(6) / 1000
    points[[1, 4], [0, 2]] = np.nan, np.inf
    cloud = PointCloud(points, fields={"label": np.arange(6)}, grid=(2, 3))
    path = tmp_path / f"a.{extension}"
    blocks = iter([np.arange(8).reshape(4, 2), np.arange(8, 12).reshape(2, 2)])
    with pytest.warns(UserWarning, match="2 points that are not finite are left out") as caught:
        write(path, cloud, chunks=("w", 2, np.int16, blocks))
    assert caught[0].filename == __file__
    again = read(path)
    assert again.grid is None
    np.testing.assert_allclose(again.points, points[[0, 2, 3, 5]], rtol=0, atol=1e-9)
    assert again.fields["label"].tolist() == [0, 2, 3, 5]
    assert again.fields["w_1"].tolist() == [1, 5, 7, 11]


@pytest.mark.parametrize("count", [0, 6])
def test_grids_and_empty_clouds(tmp_path: Path, extension: str, count: int) -> None:
    cloud = PointCloud(np.zeros((count, 3)), fields={"label": np.arange(count)}, grid=(2, count // 2))
    path = tmp_path / f"a.{extension}"
    write(path, cloud)
    again = read(path)
    assert len(again) == count
    assert again.grid == (2, count // 2)
    assert again.fields["label"].tolist() == list(range(count))
    assert len(read(path, box=EVERYTHING)) == count


def test_chunks_block_by_block(tmp_path: Path, extension: str) -> None:
    signatures = RNG.normal(size=(120_000, 3)).astype(np.float32)
    points = RNG.integers(0, 10_000, (120_000, 3)) / 1000
    status = np.zeros(120_000, np.uint8)

    def blocks() -> Iterator[NDArray[Any]]:
        for start in range(0, 120_000, 50_000):
            rows = slice(start, start + 50_000)
            status[rows] = 5
            yield signatures[rows]

    seen: list[tuple[int, int]] = []
    path = tmp_path / f"a.{extension}"
    write(
        path,
        PointCloud(points),
        {"status": status},
        chunks=("signature", 3, np.float32, blocks()),
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen == [(50_000, 120_000), (100_000, 120_000), (120_000, 120_000)]
    again = read(path)
    np.testing.assert_allclose(again.points, points, rtol=0, atol=1e-12)
    assert (again.fields["status"] == 5).all()
    for i in range(3):
        np.testing.assert_array_equal(again.fields[f"signature_{i}"], signatures[:, i])


def test_too_many_columns(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="at most 341 further columns, not 342"):
        write(tmp_path / "a.laz", PointCloud(np.zeros((1, 3))), {"w": np.zeros((1, 342))})
    write(tmp_path / "a.laz", PointCloud(np.zeros((1, 3))), {"w": np.ones((1, 341))})
    assert len(read(tmp_path / "a.laz").fields) == 341


def test_the_same_input_gives_the_same_file(tmp_path: Path, extension: str) -> None:
    cloud, columns = example()
    for name in "ab":
        write(tmp_path / f"{name}.{extension}", cloud, columns)
    assert (tmp_path / f"a.{extension}").read_bytes() == (tmp_path / f"b.{extension}").read_bytes()


@pytest.mark.parametrize("room", [0, 1000, 300_000])
def test_a_full_disk_is_named_though_lazrs_forgets_it(
    tmp_path: Path, extension: str, room: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a.{extension}"
    path.write_bytes(b"old")
    real = os.fdopen

    class FullDisk:
        def __init__(self, *arguments: Any) -> None:
            self.file, self.left = real(*arguments), room

        def write(self, data: Any) -> int:
            self.left -= memoryview(data).nbytes
            if self.left < 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            return int(self.file.write(data))

        def __getattr__(self, name: str) -> Any:
            return getattr(self.file, name)

        def __enter__(self) -> "FullDisk":
            return self

        def __exit__(self, *_: object) -> None:
            self.file.close()

    monkeypatch.setattr(os, "fdopen", FullDisk)
    cloud = PointCloud(RNG.normal(size=(40_000, 3)))
    with pytest.raises(OSError, match=rf"No space left on device: .*a\.{extension}"):
        write(path, cloud)
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == [path.name]


def test_a_box_is_the_whole_cropped(tmp_path: Path, extension: str) -> None:
    millimetres = utm_millimetres(20_000)
    cloud = PointCloud(millimetres / 1000, fields={"label": np.arange(20_000)})
    path = tmp_path / f"a.{extension}"
    write(path, cloud)
    whole = read(path)
    box = np.stack([whole.points[0], whole.points[0] + [30, 20, 40]])
    part, expected = read(path, box=box), cropped(whole, box)
    assert 0 < len(part) < 20_000
    assert 0 in part.fields["label"]
    np.testing.assert_array_equal(part.points, expected.points)
    np.testing.assert_array_equal(part.fields["label"], expected.fields["label"])
    assert len(read(path, box=EVERYTHING)) == 20_000
    assert len(read(path, box=[[0, 0, 0], [1, 1, 1]])) == 0


@pytest.mark.parametrize("name", ["formats/simple.copc.laz", "survey/lion_takanawa.copc.laz"])
def test_a_copc_box_is_the_whole_cropped(shared_data: Path, name: str) -> None:
    path = shared_data / name
    whole = read(path)
    low, high = whole.points.min(axis=0), whole.points.max(axis=0)
    with path.open("rb") as file:
        header = laspy.LasHeader.read_from(file)
        size = path.stat().st_size
        every = laz_chunks(file, header, "", size)
        fewest = len(every)
        for share in RNG.random((8, 2, 3)):
            box = np.sort(low + share * (high - low), axis=0)
            expected, part = cropped(whole, box), read(path, box=box)
            np.testing.assert_array_equal(part.points, expected.points)
            for field, values in expected.fields.items():
                np.testing.assert_array_equal(part.fields[field], values)
            chunks = copc_chunks(file, header, box, "", size)
            assert chunks is not None
            assert set(chunks) <= set(every)
            fewest = min(fewest, len(chunks))
        assert fewest < len(every)
        assert copc_chunks(file, header, np.array(EVERYTHING), "", size) == every


def test_progress(tmp_path: Path, extension: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / f"a.{extension}"
    write(path, PointCloud(RNG.normal(size=(200_000, 3))))
    monkeypatch.setattr("surfsig.files.las.PIECE_BYTES", 1 << 20)
    monkeypatch.setattr("surfsig.files.laz_chunks.PIECE_BYTES", 1 << 20)
    seen: list[tuple[int, int]] = []
    read(path, progress=lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen)
    assert len(seen) > 3
    assert {total for _, total in seen} == {path.stat().st_size}
    assert seen[-1][0] == path.stat().st_size

    def stop(*_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        read(path, progress=stop)


def test_reading_warns_of_nothing(tmp_path: Path, extension: str) -> None:
    cloud, columns = example()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write(tmp_path / f"a.{extension}", cloud, columns)
        read(tmp_path / f"a.{extension}")
