"""LAS and LAZ files whose header contradicts the file: read with a warning, or refused with the reason."""

import io
import struct
from pathlib import Path

import laspy
import numpy as np
import pytest
from las_files import COUNT, START, assert_whole, cloud_of, las, no_warning, patched, points, refused

from surfsig.files import read

LEGACY, NEW, POINTS_BY_RETURN, SCALES = (107, "I"), (247, "Q"), 255, 131
"""Where these stand in a header."""
BYTES = (np.arange(4 * COUNT) % 200).astype(np.uint8).reshape(COUNT, 4)


# The files of the shared folder.


def test_las14_legacy_only(shared_data: Path) -> None:
    with pytest.warns(UserWarning, match="promises 0 points, but it holds 20; all of them were read"):
        assert_whole(read(shared_data / "odd_files/las_counts/las14_legacy_only.las"), 20)


def test_las_count0_but_points(shared_data: Path) -> None:
    with pytest.warns(UserWarning, match="promises 0 points, but it holds 20; all of them were read"):
        assert_whole(read(shared_data / "odd_files/las_counts/las_count0_but_points.las"), 20)


# Numbers of points.


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize(("point_format", "version"), [(6, "1.4"), (3, "1.4"), (7, "1.4")])
def test_only_the_legacy_count_is_filled(
    tmp_path: Path, point_format: int, version: str, compressed: bool
) -> None:
    content = las(point_format, version, compressed=compressed)
    with no_warning():
        assert_whole(cloud_of(tmp_path, patched(content, (*NEW, 0), (*LEGACY, COUNT))))


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize(("legacy", "new"), [(COUNT, 690), (690, COUNT), (COUNT, 10**12), (2**32 - 1, COUNT)])
def test_legacy_and_new_counts_disagree(tmp_path: Path, legacy: int, new: int, compressed: bool) -> None:
    content = patched(las(compressed=compressed), (*NEW, new), (*LEGACY, legacy))
    with pytest.warns(UserWarning, match=f"{new} points in one place and {legacy} in another; 700 were read"):
        assert_whole(cloud_of(tmp_path, content))


@pytest.mark.parametrize(("point_format", "version"), [(3, "1.2"), (6, "1.4"), (1, "1.4")])
def test_a_count_of_0_with_points_behind_it(tmp_path: Path, point_format: int, version: str) -> None:
    content = las(point_format, version)
    zeros = [(*LEGACY, 0), *([(*NEW, 0)] if version == "1.4" else [])]
    with pytest.warns(UserWarning, match="promises 0 points, but it holds 700; all of them were read$"):
        assert_whole(cloud_of(tmp_path, patched(content, *zeros)))
    with pytest.warns(UserWarning, match="it holds 699; all of them were read, and what follows them is no"):
        assert_whole(cloud_of(tmp_path, patched(content, *zeros)[:-5]), 699)


def test_a_count_of_0_in_laz(tmp_path: Path) -> None:
    content = patched(las(compressed=True), (*NEW, 0), (*LEGACY, 0))
    with pytest.warns(UserWarning, match="promises 0 points, but it holds 700"):
        assert_whole(cloud_of(tmp_path, content))
    # Before point format 6 no chunk says how many points it holds.
    content = patched(las(3, "1.2", compressed=True), (*LEGACY, 0))
    refused(tmp_path, content, "promises 0 points, but points follow, of which the number is not known")
    record = content.index(b"laszip encoded") + 52
    refused(tmp_path, patched(content, (record, "H", 1)), "of which the number is not known")


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("point_format", [3, 6])
def test_a_file_without_points_is_empty(tmp_path: Path, point_format: int, compressed: bool) -> None:
    data = laspy.LasData(laspy.LasHeader(point_format=point_format))
    file = io.BytesIO()
    data.write(file, do_compress=compressed)
    with no_warning():
        assert len(cloud_of(tmp_path, file.getvalue())) == 0


@pytest.mark.parametrize(("point_format", "version", "place"), [(3, "1.2", LEGACY), (6, "1.4", NEW)])
def test_a_count_that_is_too_small(
    tmp_path: Path, point_format: int, version: str, place: tuple[int, str]
) -> None:
    content = las(point_format, version)
    with pytest.warns(UserWarning, match="promises 690 points, but it holds 700; all of them were read"):
        assert_whole(cloud_of(tmp_path, patched(content, (*place, 690), (LEGACY[0], "I", 690))))
    # Where the numbers by return confirm the count, what follows is something else.
    by_return = (POINTS_BY_RETURN, "Q", 690) if version == "1.4" else (111, "I", 690)
    changes = [(*place, 690), (LEGACY[0], "I", 690), by_return]
    with pytest.warns(UserWarning, match="promises 690 points, and no more were read, but there are more"):
        assert_whole(cloud_of(tmp_path, patched(content, *changes)), 690)
    with pytest.warns(UserWarning, match="no more were read"):
        assert_whole(cloud_of(tmp_path, content + bytes(1000)))


def test_a_count_that_is_too_small_in_laz(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="promises 690 points, but it holds 700; all of them were read"):
        assert_whole(cloud_of(tmp_path, patched(las(compressed=True), (*NEW, 690), (*LEGACY, 690))))


def test_chunks_beyond_the_count_of_an_old_laz(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    data = laspy.LasData(header)
    data.xyz = np.arange(360_000).reshape(-1, 3) % 1000
    file = io.BytesIO()
    data.write(file, do_compress=True)
    with pytest.warns(UserWarning, match=r"promises 60000 points, and no more .* 40001 points or more"):
        cloud = cloud_of(tmp_path, patched(file.getvalue(), (*LEGACY, 60_000)))
    np.testing.assert_allclose(cloud.points, data.xyz[:60_000])


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("point_format", [3, 6])
def test_a_count_that_is_too_large_is_refused(tmp_path: Path, point_format: int, compressed: bool) -> None:
    content = las(point_format, "1.4", compressed=compressed)
    changes = [(*place, 60_000) for place in (LEGACY, NEW)]
    refused(tmp_path, patched(content, *changes), "cut off.*its header promises 60000 points")


def test_records_behind_the_points_are_no_points(tmp_path: Path) -> None:
    content = las()
    record = struct.pack("<2x16sHQ32x", b"somebody", 7, 3000) + bytes(3000)
    changes = [(235, "Q", len(content)), (243, "I", 1)]
    with no_warning():
        assert_whole(cloud_of(tmp_path, patched(content, *changes) + record))
    with pytest.warns(UserWarning, match="promises 0 points, but it holds 700; all of them were read$"):
        assert_whole(cloud_of(tmp_path, patched(content, *changes, (*NEW, 0), (*LEGACY, 0)) + record))


# Scale, offset, start of the points.


@pytest.mark.parametrize("value", [0.0, 1e-200, -0.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("compressed", [False, True])
def test_a_scale_of_0(tmp_path: Path, axis: int, value: float, compressed: bool) -> None:
    content = patched(las(compressed=compressed), (SCALES + 8 * axis, "d", value))
    refused(tmp_path, content, f"the scale of {'xyz'[axis]} in its header is .*: the header is broken")


def test_a_scale_that_vanishes_beside_the_offset(tmp_path: Path) -> None:
    content = patched(las(), (SCALES, "d", 1e-25), (SCALES + 24, "d", 5e5))
    refused(tmp_path, content, "the scale of x in its header is 1e-25, so that all points")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300, 1e100])
def test_a_scale_that_makes_no_sense(tmp_path: Path, value: float) -> None:
    refused(tmp_path, patched(las(), (SCALES + 8, "d", value)), "the scale or offset in its header makes no")


@pytest.mark.parametrize("start", [0, 375, 400, 1000])
def test_a_start_of_the_points_that_is_wrong(tmp_path: Path, start: int) -> None:
    content = las(extra={"label": BYTES})
    (true,) = struct.unpack_from("<I", content, 96)
    with pytest.warns(UserWarning, match=f"start at byte {start}; they were read from byte {true}, where"):
        cloud = cloud_of(tmp_path, patched(content, (*START, start)))
    assert_whole(cloud)
    np.testing.assert_array_equal(cloud.fields["label"], BYTES)


def test_a_start_inside_the_records_without_a_repair(tmp_path: Path) -> None:
    content = las(extra={"label": BYTES})
    message = "the points start at byte 400, its records end at byte 621"
    refused(tmp_path, patched(content, (*START, 400)) + bytes(7), message)
    compressed = las(compressed=True)
    refused(tmp_path, patched(compressed, (*START, 400)), "the points start at byte 400, its records end at")


# Compression.


def laszip_record(content: bytes | bytearray) -> int:
    return content.index(b"laszip encoded") + 52


@pytest.mark.parametrize("point_format", [3, 6])
@pytest.mark.parametrize("compressor", [0, 4, 9])
def test_a_compressor_that_nobody_knows(tmp_path: Path, point_format: int, compressor: int) -> None:
    content = las(point_format, compressed=True)
    message = rf"by LASzip 2\.2\.0 with compressor {compressor}, which cannot be decoded \(only 1, 2, 3 can"
    refused(tmp_path, patched(content, (laszip_record(content), "H", compressor)), message)


@pytest.mark.parametrize(
    ("point_format", "name", "known"), [(3, "Point10", "1 and 2"), (6, "Point14", "3 and 4")]
)
def test_an_item_version_that_nobody_knows(tmp_path: Path, point_format: int, name: str, known: str) -> None:
    content = las(point_format, compressed=True)
    message = rf"with version 7 of {name}, which cannot be decoded \(only {known} can"
    refused(tmp_path, patched(content, (laszip_record(content) + 38, "H", 7)), message)


def test_a_chunk_table_of_another_version(tmp_path: Path) -> None:
    content = las(compressed=True)
    (start,) = struct.unpack_from("<I", content, 96)
    (table,) = struct.unpack_from("<q", content, start)
    message = r"the table of its LAZ chunks has version 5, which cannot be read \(only 0 can"
    refused(tmp_path, patched(content, (table, "I", 5)), message)


@pytest.mark.parametrize("kind", range(6))
@pytest.mark.parametrize("compressed", [False, True])
def test_legacy_point_formats_in_las_14(tmp_path: Path, kind: int, compressed: bool) -> None:
    with no_warning():
        cloud = cloud_of(tmp_path, las(kind, "1.4", compressed=compressed))
    assert_whole(cloud)
    assert {"synthetic", "withheld"} <= cloud.fields.keys()
    assert ("wavepacket_index" in cloud.fields) == (kind in (4, 5))


def test_fewer_points_than_the_returns_of_a_laz_file_say(tmp_path: Path) -> None:
    content = patched(las(3, "1.2", compressed=True), (107, "I", COUNT - 2))
    with pytest.warns(UserWarning, match=f"promises {COUNT - 2} points, and {COUNT} by their returns"):
        cloud = cloud_of(tmp_path, content)
    np.testing.assert_allclose(cloud.points, points()[: COUNT - 2], atol=5e-4)


def test_an_offset_beside_which_the_steps_are_lost(tmp_path: Path) -> None:
    refused(tmp_path, patched(las(), (155, "d", 1e20)), r"the offset of x in its header is 1e\+20")


def test_a_point_format_that_does_not_exist(tmp_path: Path) -> None:
    refused(tmp_path, patched(las(), (104, "B", 35)), "names point format 35, of which LAS has none")
