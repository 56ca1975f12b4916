"""Folders, patterns and lists of files as one cloud."""

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest

import surfsig
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import format_name, read, write
from surfsig.point_cloud import PointCloud

POINTS = np.random.default_rng(3).normal(size=(6, 3)).astype(np.float32)


def cloud(number: int, **fields: Any) -> PointCloud:
    return PointCloud(POINTS + np.float32(number), fields=fields)


def quiet(paths: Any, **options: Any) -> PointCloud:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(paths, **options)


def las(path: Path, points: Any, colours: Any, offsets: Any = (0, 0, 0)) -> Path:
    header = laspy.LasHeader(point_format=2, version="1.2")
    header.scales, header.offsets = np.full(3, 0.001), np.array(offsets)
    data = laspy.LasData(header)
    data.xyz = np.array(points)
    data.red, data.green, data.blue = np.array(colours, np.uint16).T
    data.write(path)
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Scans 2, 10 and 1, whose points are POINTS + 2, + 10 and + 1."""
    (tmp_path / "scans").mkdir()
    for number in (2, 10, 1):
        label = np.full(6, number, np.uint8)
        write(tmp_path / "scans" / f"scan_{number}.ply", cloud(number, label=label))
    return tmp_path / "scans"


def test_files_are_joined_in_the_natural_order_of_their_names(folder: Path) -> None:
    for paths in (
        folder,
        str(folder),
        folder / "scan_*.ply",
        f"{folder}/scan_*",
        f"{folder.parent}/**/*.ply",
    ):
        joined = quiet(paths)
        assert joined.points.dtype == np.float32
        np.testing.assert_array_equal(
            joined.points, np.concatenate([POINTS + np.float32(number) for number in (1, 2, 10)])
        )
        assert list(joined.fields) == ["file", "label"]
        assert joined.fields["file"].dtype == np.uint16
        assert joined.fields["file"].tolist() == [0] * 6 + [1] * 6 + [2] * 6
        assert joined.fields["label"].tolist() == [1] * 6 + [2] * 6 + [10] * 6
        assert joined.fields["label"].dtype == np.uint8
        assert joined.viewpoint is joined.viewpoints is None
    assert format_name(folder) == "PLY"


def test_a_list_keeps_its_order(folder: Path) -> None:
    names = (folder / "scan_10.ply", str(folder / "scan_1.ply"))
    np.testing.assert_array_equal(quiet(names).points[::6], [POINTS[0] + np.float32(10), POINTS[0] + 1])
    np.testing.assert_array_equal(quiet(iter(names)).points, quiet(list(names)).points)
    assert quiet([folder / "scan_10.ply", folder / "scan_[12].ply"]).fields["label"][::6].tolist() == [
        10,
        1,
        2,
    ]


def test_one_file_is_as_it_is(folder: Path) -> None:
    for paths in ([folder / "scan_2.ply"], folder / "scan_2*"):
        one = quiet(paths)
        np.testing.assert_array_equal(one.points, POINTS + np.float32(2))
        assert list(one.fields) == ["label"]


def test_an_existing_file_is_no_pattern(tmp_path: Path) -> None:
    write(tmp_path / "scan[1].ply", cloud(5))
    write(tmp_path / "scan1.ply", cloud(1))
    np.testing.assert_array_equal(quiet(tmp_path / "scan[1].ply").points, POINTS + np.float32(5))
    (tmp_path / "scan[1].ply").unlink()
    np.testing.assert_array_equal(quiet(tmp_path / "scan[1].ply").points, POINTS + np.float32(1))


def test_nothing_to_read(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no file matches") as error:
        read(tmp_path / "a*.ply")
    assert error.value.filename == str(tmp_path / "a*.ply")
    with pytest.raises(FileFormatError, match="holds no files"):
        read(tmp_path)
    with pytest.raises(InvalidInputError, match="there are no files"):
        read([])
    with pytest.raises(FileNotFoundError):
        read([tmp_path / "a.ply"])


def test_hidden_and_other_files_of_a_folder_are_left_out(folder: Path) -> None:
    (folder / ".hidden.ply").write_bytes(b"nothing")
    (folder / "poses.txt").write_text("1 2 3")
    (folder / "more").mkdir()
    with pytest.warns(UserWarning, match=r"1 files that are not '\.ply' are left out"):
        assert len(read(folder)) == 18
    assert len(quiet(folder / "*.ply")) == 18


def test_a_file_that_cannot_be_read_is_named(folder: Path) -> None:
    (folder / "scan_3.ply").write_bytes(b"ply\nnonsense\n")
    with pytest.raises(FileFormatError, match=r"scan_3\.ply: line 2"):
        read(folder)


def test_fields_that_not_all_have_are_left_out_with_one_warning(tmp_path: Path) -> None:
    wide = np.zeros((6, 2), np.float32)
    write(tmp_path / "1.npz", cloud(1, a=np.arange(6, dtype=np.uint8), b=wide, c=wide, q=np.arange(6)))
    write(tmp_path / "2.npz", cloud(2, q=np.full(6, 0.5), c=np.zeros((6, 3)), a=np.full(6, -300, np.int16)))
    write(tmp_path / "3.npz", cloud(3, a=np.ones(6, np.int8), q=np.ones(6, np.float32), d=wide))
    with pytest.warns(UserWarning) as warned:  # noqa: PT030
        joined = read(tmp_path)
    assert [str(warning.message) for warning in warned] == [
        f"{tmp_path / '1.npz'} and 2 more: the fields b, c, d are left out: not all of the 3 files have "
        "them, or not of one kind"
    ]
    assert joined.fields["a"].tolist() == [*range(6), *[-300] * 6, *[1] * 6]
    assert joined.fields["a"].dtype == np.int16
    assert joined.fields["q"].tolist() == [*range(6), *[0.5] * 6, *[1.0] * 6]


def test_whole_numbers_that_no_type_holds_together_are_left_out(tmp_path: Path) -> None:
    write(tmp_path / "1.npz", cloud(1, stamp=np.full(6, 2**63, np.uint64)))
    write(tmp_path / "2.npz", cloud(1, stamp=np.full(6, -1, np.int64)))
    with pytest.warns(UserWarning, match="the fields stamp are left out"):
        assert list(read(tmp_path).fields) == ["file"]


def test_formats_may_differ(tmp_path: Path) -> None:
    write(tmp_path / "1.ply", cloud(1))
    write(tmp_path / "2.npz", cloud(2))
    (tmp_path / "3.xyz").write_text("".join(f"{x} {y} {z}\n" for x, y, z in POINTS.tolist()))
    joined = quiet([tmp_path / "1.ply", tmp_path / "2.npz", tmp_path / "3.xyz"])
    assert joined.points.dtype == np.float64
    np.testing.assert_array_equal(
        joined.points, np.concatenate([POINTS + np.float32(1), POINTS + np.float32(2), POINTS])
    )
    assert format_name(tmp_path / "[123].*") == "PLY, NPZ, text"


def test_tiles_with_other_offsets_keep_every_digit(tmp_path: Path) -> None:
    near = las(tmp_path / "1.las", [[500000.001, 4500000.002, 100.003]], [[1, 2, 3]], (500000, 4500000, 0))
    far = las(tmp_path / "2.las", [[501000.004, 4501000.005, 100.006]], [[4, 5, 6]], (501000, 4501000, 50))
    joined = quiet([near, far])
    expected = np.concatenate([laspy.read(path).xyz for path in (near, far)])
    assert joined.points.tobytes() == expected.tobytes()
    same = las(tmp_path / "3.las", [[500100, 4500100, 7.5]], [[4, 5, 6]], (500000, 4500000, 0))
    joined = quiet([near, same])
    assert joined.origin.tolist() == [500000, 4500000, 0]
    assert (
        joined.points.tobytes() == np.concatenate([laspy.read(path).xyz for path in (near, same)]).tobytes()
    )


def test_colours_of_8_and_16_bits(tmp_path: Path) -> None:
    names = ("red", "green", "blue")
    dark = las(tmp_path / "dark.las", [[1, 2, 3]], [[0, 255, 7]])
    bright = las(tmp_path / "bright.las", [[1, 2, 3]], [[0, 256, 65535]])
    # Both are 16 bits in their files.
    joined = read([dark, bright])
    assert [joined.fields[name].tolist() for name in names] == [[0, 0], [255, 256], [7, 65535]]
    assert joined.fields["red"].dtype == np.uint16
    eight = tmp_path / "eight.ply"
    write(
        eight, PointCloud(np.array([[1.0, 2, 3]]), fields={name: np.array([255], np.uint8) for name in names})
    )
    with pytest.warns(UserWarning, match="are left out"):
        joined = read([eight, bright])
    assert [joined.fields[name].tolist() for name in names] == [[65535, 0], [65535, 256], [65535, 65535]]
    with pytest.warns(UserWarning, match="are left out"):
        assert read([eight, dark]).fields["red"].dtype == np.uint8
    missing = tmp_path / "missing.npz"
    write(missing, PointCloud(np.array([[1.0, 2, 3]]), fields={name: np.array([np.nan]) for name in names}))
    with pytest.warns(UserWarning, match="the fields red, green, blue are left out"):
        read([eight, missing])


def with_viewpoint(folder: Path, name: str, place: Any, **fields: Any) -> Path:
    write(folder / name, PointCloud(POINTS, viewpoint=place, fields=fields))
    return folder / name


def test_each_file_keeps_its_viewpoint(tmp_path: Path) -> None:
    paths = [with_viewpoint(tmp_path, f"{i}.ply", np.array([i, 2, 3], np.float64)) for i in (0, 1)]
    joined = quiet(paths)
    assert joined.viewpoint is None
    assert joined.viewpoints is not None
    assert joined.viewpoints.tolist() == [[0, 2, 3], [1, 2, 3]]
    assert joined.fields["scan"].tolist() == joined.fields["file"].tolist() == [0] * 6 + [1] * 6
    alike = quiet([paths[0], paths[0]])
    assert alike.viewpoint is not None
    assert alike.viewpoint.tolist() == [0, 2, 3]
    assert (alike.viewpoints, list(alike.fields)) == (None, ["file"])


def test_a_field_called_scan_or_file_is_kept(tmp_path: Path) -> None:
    number = np.arange(6, dtype=np.uint8)
    paths = [with_viewpoint(tmp_path, f"{i}.npz", [i, 2.0, 3], scan=number, file=number) for i in (0, 1)]
    joined = quiet(paths)
    assert joined.fields["scan"].tolist() == [0] * 6 + [1] * 6
    assert joined.fields["input_scan"].tolist() == joined.fields["input_file"].tolist() == [*range(6)] * 2
    for i in (0, 1):
        write(paths[i], PointCloud(POINTS, fields={"scan": number}))
    joined = quiet(paths)
    assert list(joined.fields) == ["file", "scan"]
    assert joined.fields["scan"].tolist() == [*range(6)] * 2


def test_scans_of_several_e57_files_are_numbered_through(tmp_path: Path) -> None:
    many = PointCloud(
        POINTS,
        fields={"scan": np.array([0, 0, 0, 1, 1, 1])},
        viewpoints=np.array([[0.0, 0, 9], [1, 0, 9]]),
    )
    write(tmp_path / "1.e57", many)
    write(tmp_path / "2.e57", PointCloud(POINTS, viewpoint=np.array([2.0, 0, 9])))
    joined = quiet(tmp_path / "*.e57")
    assert joined.viewpoints is not None
    assert joined.viewpoints.tolist() == [[0, 0, 9], [1, 0, 9], [2, 0, 9]]
    assert joined.fields["scan"].tolist() == [0, 0, 0, 1, 1, 1] + [2] * 6
    assert joined.fields["file"].tolist() == [0] * 6 + [1] * 6
    np.testing.assert_allclose(joined.points, np.tile(POINTS, (2, 1)), atol=1e-6)


def test_a_viewpoint_that_not_all_have_is_left_out(tmp_path: Path) -> None:
    paths = [with_viewpoint(tmp_path, "1.ply", [1.0, 2, 3]), tmp_path / "2.ply"]
    write(paths[1], PointCloud(POINTS))
    with pytest.warns(UserWarning, match="the viewpoints are left out: not all of the 2 files have them"):
        joined = read(paths)
    assert joined.viewpoint is joined.viewpoints is None


def test_options_and_progress_are_those_of_all_files(folder: Path) -> None:
    told: list[tuple[int, int]] = []
    joined = quiet(
        folder, unit="mm", box=[[-100] * 3, [5] * 3], progress=lambda done, of: told.append((done, of))
    )
    assert set(joined.fields["label"].tolist()) == {1, 2}
    assert np.abs(joined.points).max() <= 0.005
    total = sum(path.stat().st_size for path in folder.iterdir())
    assert told[-1] == (total, total)
    assert told == sorted(told)
    with pytest.raises(InvalidInputError, match="holds PLY data, for which 'scan' means nothing"):
        read(folder, scan=0)


def test_a_sequence_takes_patterns_and_stays_one(folder: Path) -> None:
    scans = list(surfsig.open_scan_sequence(str(folder / "scan_*.ply")))
    assert [int(scan.cloud.fields["label"][0]) for scan in scans] == [1, 2, 10]
    with pytest.raises(FileNotFoundError, match="no file matches"):
        surfsig.open_scan_sequence(folder / "a*.ply")


def test_the_command_line_takes_patterns_and_folders(shell: Callable[..., Any], folder: Path) -> None:
    for path in (folder, folder / "scan_*.ply"):
        told = json.loads(shell("info", path, "--json").out)
        assert (told["points"], told["format"]) == (18, "PLY")
        assert told["fields"] == {"file": "uint16", "label": "uint8"}
    output = folder.parent / "out.npz"
    assert shell("convert", folder / "*_?.ply", output, "-q").code == 0
    assert read(output).fields["label"].tolist() == [1] * 6 + [2] * 6
    assert shell("clean", folder, output, "--voxel", "100", "-q").code == 0
    assert shell("extract", folder, "--radius", "2", "-o", output, "-q").code == 0
    assert len(read(output)) == 18


def test_a_file_without_points_takes_no_fields_away(tmp_path: Path) -> None:
    write(tmp_path / "a.ply", PointCloud(np.eye(3), fields={"ring": np.arange(3)}))
    write(tmp_path / "b.ply", PointCloud(np.zeros((0, 3))))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = read([tmp_path / "b.ply", tmp_path / "a.ply"])
    np.testing.assert_array_equal(cloud.fields["ring"], [0, 1, 2])
    np.testing.assert_array_equal(cloud.fields["file"], [1, 1, 1])


def test_an_empty_path_is_not_the_current_folder() -> None:
    for paths in ("", [""]):
        with pytest.raises(InvalidInputError, match="the path is empty"):
            read(paths)
