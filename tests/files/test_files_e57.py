"""E57: values against formulas and against libE57 (through pye57), poses, broken files."""

from pathlib import Path

import numpy as np
import pytest
from e57_files import Scan, made_of, pose_xml, root, scan_xml, section, with_xml
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import Chunks, read, write
from surfsig.point_cloud import PointCloud

RNG = np.random.default_rng(57)
UTM = np.array([512345.678, 4512345.678, 123.456])
XYZ = "".join(f'<cartesian{axis} type="Float"/>' for axis in "XYZ")
READABLE = ["bunnyDouble", "bunnyInt24", "read_error", "tinyCartesianFloatRgb", "tiny_spherical"]


def cartesian(points: NDArray[np.generic], **more: NDArray[np.generic]) -> dict[str, NDArray[np.generic]]:
    return {**{f"cartesian{axis}": points[:, i].copy() for i, axis in enumerate("XYZ")}, **more}


def saved(tmp_path: Path, content: bytes) -> Path:
    path = tmp_path / "a.e57"
    path.write_bytes(content)
    return path


@pytest.mark.parametrize("name", [*(f"formats/{name}.e57" for name in READABLE), "survey/pump.e57"])
def test_the_same_values_as_libe57(shared_data: Path, name: str) -> None:
    pye57 = pytest.importorskip("pye57")
    raw = pye57.E57(str(shared_data / name)).read_scan_raw(0)
    cloud = read(shared_data / name)
    state = next(
        (raw[key] for key in raw if key.endswith("lInvalidState") or key.endswith("nInvalidState")), 0
    )
    good = np.broadcast_to(np.asarray(state) == 0, len(cloud))
    assert np.array_equal(cloud.finite, good)
    if "cartesianX" in raw:
        points = np.column_stack([raw[f"cartesian{axis}"] for axis in "XYZ"])
        np.testing.assert_array_equal(cloud.points[good], points[good])
    else:
        reach, azimuth, elevation = (raw[f"spherical{part}"] for part in ("Range", "Azimuth", "Elevation"))
        x, y = (reach * np.cos(elevation) * turn(azimuth) for turn in (np.cos, np.sin))
        points = np.column_stack([x, y, reach * np.sin(elevation)])
        np.testing.assert_allclose(cloud.points[good], points[good], rtol=1e-15, atol=1e-15)
    names = {
        "intensity": "intensity", "colorRed": "red", "colorGreen": "green", "colorBlue": "blue",
        "rowIndex": "row_index", "columnIndex": "column_index",
    }  # fmt: skip
    assert set(cloud.fields) == {names[key] for key in raw if key in names}
    for key, field in names.items():
        if key in raw:
            # pye57 keeps intensity as float32, whatever the file has.
            np.testing.assert_array_equal(cloud.fields[field].astype(raw[key].dtype), raw[key])
    assert cloud.viewpoint is None


def test_an_empty_cloud_and_a_file_without_scans(shared_data: Path) -> None:
    assert read(shared_data / "formats" / "empty_pc.e57").points.shape == (0, 3)
    with pytest.raises(FileFormatError, match="holds no scan"):
        read(shared_data / "formats" / "empty.e57")
    with pytest.raises(FileFormatError, match="invalid checksum"):
        read(shared_data / "formats" / "corrupt_crc.e57")


def test_scans_are_joined_in_the_common_frame(tmp_path: Path) -> None:
    first, second = RNG.normal(size=(5, 3)), RNG.normal(size=(4, 3)).astype(np.float32)
    third_turn = (0.5, 0.5, 0.5, 0.5)  # x to y, y to z, z to x
    normals = np.eye(3)[[0, 1, 2, 0, 1]]
    more = {f"nor:normal{axis}": normals[:, i].copy() for i, axis in enumerate("XYZ")}
    more["intensity"] = np.arange(5.0)
    content = made_of(
        Scan(cartesian(first, **more), pose_xml(third_turn, (10, 20, 30))),
        Scan(cartesian(second, colorRed=np.arange(4, dtype=np.uint8)), pose_xml((1, 0, 0, 0), (0, 0, 0))),
        names='xmlns:nor="http://www.libe57.org/E57_NOR_surface_normals.txt"',
    )
    cloud = read(saved(tmp_path, content))
    np.testing.assert_allclose(cloud.points[:5], first[:, [2, 0, 1]] + [10, 20, 30], rtol=1e-15)
    np.testing.assert_array_equal(cloud.points[5:], second)
    assert cloud.fields["scan"].dtype == np.uint8
    assert cloud.fields["scan"].tolist() == [0] * 5 + [1] * 4
    assert cloud.viewpoints is not None
    assert cloud.viewpoints.tolist() == [[10, 20, 30], [0, 0, 0]]
    turned = np.column_stack([cloud.fields[name] for name in ("nx", "ny", "nz")])
    np.testing.assert_allclose(turned[:5], normals[:, [2, 0, 1]], atol=1e-15)
    # What one scan lacks is NaN, or 0 where the numbers are whole.
    np.testing.assert_array_equal(cloud.fields["intensity"], [0, 1, 2, 3, 4] + [np.nan] * 4)
    assert cloud.fields["red"].tolist() == [0] * 5 + [0, 1, 2, 3]
    only = read(saved(tmp_path, content), scan=1)
    assert only.offsets.dtype == np.float32
    assert only.viewpoint is not None
    assert (only.viewpoint.tolist(), only.viewpoints, list(only.fields)) == ([0, 0, 0], None, ["red"])
    for scan in (2, -1, 10**30):
        with pytest.raises(InvalidInputError, match="holds 2, numbered from 0"):
            read(saved(tmp_path, content), scan=scan)


def test_a_pose_that_is_not_quite_a_unit_quaternion(tmp_path: Path) -> None:
    points = RNG.normal(size=(3, 3))
    content = made_of(Scan(cartesian(points), pose_xml((0, 0, 0, 3), (0, 0, 0))))
    np.testing.assert_allclose(read(saved(tmp_path, content)).points, points * [-1, -1, 1], rtol=1e-15)
    for turn, shift in (((0, 0, 0, 0), (0, 0, 0)), ((1, 0, 0, 0), (0, np.nan, 0))):
        content = made_of(Scan(cartesian(points), pose_xml(turn, shift).replace("nan", "NaN")))
        with pytest.raises(FileFormatError, match="pose"):
            read(saved(tmp_path, content))


def test_without_a_pose_nobody_knows_the_viewpoint(tmp_path: Path) -> None:
    scan = Scan(cartesian(np.zeros((2, 3))))
    cloud = read(saved(tmp_path, made_of(scan, Scan(scan.columns, pose_xml((1, 0, 0, 0), (1, 2, 3))))))
    assert cloud.viewpoint is None
    assert cloud.viewpoints is None


def test_points_called_invalid_are_nan_in_their_place(tmp_path: Path) -> None:
    state = np.array([0, 1, 2, 0], np.uint8)
    points = np.arange(12, dtype=np.float32).reshape(4, 3)
    cloud = read(saved(tmp_path, made_of(Scan(cartesian(points, cartesianInvalidState=state)))))
    assert cloud.finite.tolist() == [True, False, False, True]
    np.testing.assert_array_equal(cloud.points[[0, 3]], points[[0, 3]])
    # Spherical coordinates stand in where they are there.
    sphere = {
        "sphericalRange": np.array([9.0, 2, 2, 9]),
        "sphericalAzimuth": np.array([0, np.pi / 2, 0, 0]),
        "sphericalElevation": np.array([0, 0, np.pi / 6, 0]),
        "sphericalInvalidState": np.array([0, 0, 1, 0], np.uint8),
    }
    both = Scan({**cartesian(points, cartesianInvalidState=state), **sphere})
    cloud = read(saved(tmp_path, made_of(both)))
    np.testing.assert_allclose(cloud.points[[0, 1, 3]], [points[0], [0, 2, 0], points[3]], atol=1e-15)
    assert cloud.finite.tolist() == [True, True, False, True]


def test_a_grid_is_one_only_row_by_row(tmp_path: Path) -> None:
    rows, columns = (index.ravel().astype(np.uint8) for index in np.mgrid[:3, :4])
    points = np.zeros((12, 3))
    cloud = read(saved(tmp_path, made_of(Scan(cartesian(points, rowIndex=rows, columnIndex=columns)))))
    assert cloud.grid == (3, 4)
    write(tmp_path / "b.e57", PointCloud(points, grid=(3, 4)))
    assert read(tmp_path / "b.e57").grid == (3, 4)
    cloud = read(saved(tmp_path, made_of(Scan(cartesian(points, rowIndex=columns, columnIndex=rows)))))
    assert cloud.grid is None


def every_type() -> dict[str, NDArray[np.generic]]:
    whole = {
        f"of_{kind}": np.array([np.iinfo(kind).min, np.iinfo(kind).max, 1, 0], kind)
        for kind in ("i1", "u1", "i2", "u2", "i4", "u4", "i8")
    }
    return {
        **whole,
        "intensity": np.array([0.25, np.nan, 1, -1], np.float32),
        **{colour: np.array([0, 255, 7, 8], np.uint8) for colour in ("red", "green", "blue")},
        "color_invalid": np.array([0, 1, 0, 1], np.uint8),
        "row_index": np.array([0, 300, 1, 2], np.uint16),
        "return_index": np.array([0, 1, 0, 1], np.uint8),
        "return_count": np.array([1, 2, 1, 2], np.uint8),
        "time_stamp": np.array([0.5, 1e9, 2, 3]),
        "nx": np.ones(4, np.float32),
        "ny": np.ones(4, np.float32),
        "nz": np.ones(4, np.float32),
        "double": np.array([np.pi, 1e300, np.inf, -0.0]),
    }


def test_every_field_comes_back(tmp_path: Path) -> None:
    fields = every_type()
    write(
        tmp_path / "a.e57", PointCloud(np.zeros((4, 3)), fields=fields), {"wide": np.arange(8).reshape(4, 2)}
    )
    again = read(tmp_path / "a.e57").fields
    assert list(again) == [*fields, "wide_0", "wide_1"]
    for name, values in fields.items():
        assert again[name].dtype == values.dtype, name
        np.testing.assert_array_equal(again[name], values)
    assert again["wide_1"].tolist() == [1, 3, 5, 7]


def test_names_that_xml_or_the_standard_do_not_allow(tmp_path: Path) -> None:
    names = [
        "9lives",
        "größe",
        "xml",
        "cartesianX",
        "a b",
        "nx",
        "red",
        "intensity_invalid",
        "spherical_range",
    ]
    fields = {name: np.arange(3) + i for i, name in enumerate(names)}
    write(tmp_path / "a.e57", PointCloud(np.full((3, 3), 0.5), fields=fields))
    again = read(tmp_path / "a.e57")
    assert again.points.tolist() == [[0.5] * 3] * 3
    assert [values.tolist() for values in again.fields.values()] == [v.tolist() for v in fields.values()]


def test_millimetres_at_utm_with_viewpoints(tmp_path: Path) -> None:
    points = UTM + RNG.uniform(-50, 50, (2000, 3)).round(3)
    points[7] = np.nan
    places = UTM + np.array([[0, 0, 2], [30.001, -12.5, 1.75], [0, 0, 5]])
    scan = np.repeat(np.array([0, 1], np.uint8), [1500, 500])
    cloud = PointCloud(points, fields={"scan": scan}, viewpoints=places)
    write(tmp_path / "a.e57", cloud, {"k1": np.arange(2000)})
    again = read(tmp_path / "a.e57")
    np.testing.assert_allclose(again.points, points, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(again.viewpoints, places)
    np.testing.assert_array_equal(again.fields["scan"], scan)
    np.testing.assert_array_equal(again.fields["k1"], np.arange(2000))
    pye57 = pytest.importorskip("pye57")
    file = pye57.E57(str(tmp_path / "a.e57"))
    assert [file.get_header(i).point_count for i in range(3)] == [1500, 500, 0]
    theirs = file.read_scan(1, ignore_missing_fields=True)
    np.testing.assert_allclose(
        np.column_stack([theirs[f"cartesian{axis}"] for axis in "XYZ"]), points[1500:], rtol=0, atol=2e-9
    )


def test_mixed_scans_lose_their_viewpoints_with_a_warning(tmp_path: Path) -> None:
    cloud = PointCloud(np.eye(3), fields={"scan": np.array([0, 1, 0])}, viewpoints=np.eye(3)[:2])
    with pytest.warns(UserWarning, match="viewpoints are left out"):
        write(tmp_path / "a.e57", cloud)
    again = read(tmp_path / "a.e57")
    np.testing.assert_array_equal(again.points, np.eye(3))
    assert again.fields["scan"].tolist() == [0, 1, 0]


def test_single_precision_where_it_is_exact(tmp_path: Path) -> None:
    points = RNG.normal(size=(100, 3)).astype(np.float32)
    for viewpoint in (None, np.zeros(3)):
        write(tmp_path / "a.e57", PointCloud(points, viewpoint=viewpoint))
        again = read(tmp_path / "a.e57")
        assert again.offsets.dtype == np.float32
        np.testing.assert_array_equal(again.points, points)
        np.testing.assert_array_equal(again.viewpoint is None, viewpoint is None)


def test_signatures_block_by_block_across_scans(tmp_path: Path) -> None:
    numbers = RNG.normal(size=(900, 242)).astype(np.float32)
    cloud = PointCloud(
        np.zeros((900, 3)), fields={"scan": np.repeat([0, 1], [333, 567])}, viewpoints=np.eye(3)[:2]
    )
    done: list[int] = []
    blocks = (numbers[start : start + 250] for start in range(0, 900, 250))
    write(
        tmp_path / "a.e57", cloud,
        chunks=Chunks("w", 242, np.float32, blocks), notes={"words": "a > b ]]> \x07"},
        progress=lambda now, total: done.append(now),
    )  # fmt: skip
    fields = read(tmp_path / "a.e57").fields
    np.testing.assert_array_equal(np.column_stack([fields[f"w_{i}"] for i in range(242)]), numbers)
    assert done == [250, 333, 500, 750, 900]
    for rows in (899, 901):
        short = Chunks("w", 1, np.float32, [np.zeros((rows, 1), np.float32)])
        with pytest.raises(InvalidInputError, match="blocks of 'w' hold"):
            write(tmp_path / "b.e57", cloud, chunks=short)
    assert [path.name for path in tmp_path.iterdir()] == ["a.e57"]


def test_what_e57_has_no_room_for(tmp_path: Path) -> None:
    cloud = PointCloud(np.zeros((2, 3)))
    with pytest.raises(InvalidInputError, match="whole numbers above"):
        write(tmp_path / "a.e57", cloud, {"id": np.array([0, 2**63], np.uint64)})
    with pytest.raises(InvalidInputError, match="E57 holds at most"):
        write(tmp_path / "a.e57", cloud, {"w": np.zeros((2, 6000))})


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_an_exception_while_writing_is_the_callers(tmp_path: Path, failure: BaseException) -> None:
    def stop(done: int, total: int) -> None:
        raise failure

    with pytest.raises(type(failure)):
        write(tmp_path / "a.e57", PointCloud(np.zeros((2, 3))), progress=stop)
    assert not list(tmp_path.iterdir())


def test_progress_while_reading(tmp_path: Path) -> None:
    write(tmp_path / "a.e57", PointCloud(RNG.normal(size=(100_000, 3))))
    size = (tmp_path / "a.e57").stat().st_size
    told: list[tuple[int, int]] = []
    read(tmp_path / "a.e57", progress=lambda done, total: told.append((done, total)))
    assert len(told) >= 3
    assert told[-1] == (size, size)
    with pytest.raises(KeyboardInterrupt):
        read(tmp_path / "a.e57", progress=lambda done, total: (_ for _ in ()).throw(KeyboardInterrupt()))


def constants(count: int) -> str:
    return "".join(f'<c{i} type="Integer" minimum="3" maximum="3"/>' for i in range(count))


def nested(count: int) -> str:
    return "".join(f'<a xmlns:n{i}="u{i}">' for i in range(count)) + "</a>" * count


BROKEN = {
    # The library would fill its queues until the memory is full.
    "only_constant_columns": (scan_xml(constants(3), 7), section([b""] * 3), "0 bits"),
    # 60 columns without a bit made 500 MB of a file of 70 kB.
    "constants_blown_up": (
        scan_xml('<cartesianX type="Integer" minimum="0" maximum="1"/>' + constants(60), 1000),
        section([b"\1" * 65000] + [b""] * 60),
        "60 of them the same everywhere",
    ),
    "count_beyond_the_file": (scan_xml(XYZ, 10**15), section([b"\0" * 80] * 3), "promises 10{15} points"),
    "count_beyond_the_section": (scan_xml(XYZ, 11), section([b"\0" * 80] * 3), "unknown packet"),
    # Such XML kept its parser busy for minutes.
    "namespaces_in_namespaces": (nested(4000), b"", "too many namespaces"),
    "attributes": ("<a " + " ".join(f'a{i}="1"' for i in range(50_000)) + "/>", b"", "or attributes"),
    "two_of_a_name": (
        scan_xml(XYZ + '<cartesianX type="Float"/>', 10), section([b"\0" * 80] * 4), "are called"
    ),
    "no_coordinates": (scan_xml('<intensity type="Float"/>', 10), section([b"\0" * 80]), "no coordinates"),
    "a_message_of_many_lines": (
        '<vectorChild type="Structure"><guid type="String"/><points type="CompressedVector" fileOffset="48" '
        f'recordCount="1"><prototype type="Structure"><a type="b&#10;{"c" * 9999}"/></prototype></points>'
        "</vectorChild>",
        b"",
        "Unsupported type",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_files_are_refused(tmp_path: Path, name: str) -> None:
    scans, body, words = BROKEN[name]
    path = saved(tmp_path, with_xml(root(scans), body))
    with pytest.raises(FileFormatError, match=words) as caught:
        read(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < len(str(path)) + 300


def test_every_cut_is_noticed(tmp_path: Path) -> None:
    whole = made_of(Scan(cartesian(RNG.normal(size=(300, 3)))))
    for size in (8, 47, 48, 1023, 1024, len(whole) - 1024, len(whole) - 1):
        with pytest.raises(FileFormatError, match="E57"):
            read(saved(tmp_path, whole[:size]))


def test_scans_with_colours_of_8_and_16_bits(tmp_path: Path) -> None:
    colours = np.array([1, 2, 3, 255, 300, 65535])
    fields = {"scan": np.repeat([0, 1], 3), **dict.fromkeys(("red", "green", "blue"), colours)}
    cloud = PointCloud(np.arange(18.0).reshape(6, 3), viewpoints=np.eye(2, 3), fields=fields)
    path = tmp_path / "a.e57"
    write(path, cloud)
    with pytest.warns(UserWarning, match="may be on different scales"):
        back = read(path)
    np.testing.assert_array_equal(back.fields["red"], colours)
