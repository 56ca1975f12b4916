"""LAS and LAZ files with extra bytes that their records describe in an odd way, or not."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from las_files import COUNT, START, assert_whole, cloud_of, las, no_warning, patched
from laspy.vlrs.known import ExtraBytesStruct
from numpy.typing import NDArray

from surfsig.files import read

ROWS = np.column_stack([np.arange(COUNT), 1000 + np.arange(COUNT)]).astype("<u2")


def described(name: bytes, kind: int, options: int = 0, **more: Any) -> bytes:
    struct_ = ExtraBytesStruct(name=name, data_type=(kind, options))
    struct_.data_type, struct_.options = kind, options
    for key, value in more.items():
        getattr(struct_, key)[:] = [value] * 3
    return bytes(struct_)


def with_extra(rows: NDArray[Any], *records: bytes, compressed: bool = False) -> bytes:
    """Make a file of point format 6 with these extra bytes and the records that describe them."""
    raw = rows.view(np.uint8).reshape(COUNT, -1)
    content = las(compressed=compressed, extra={"raw": raw})
    start, end = struct.unpack_from("<I", content, 96)[0], len(content)
    place = content.index(b"LASF_Spec") - 2
    blocks = b"".join(struct.pack("<2x16sHH32x", b"LASF_Spec", 4, len(data)) + data for data in records)
    shift = len(blocks) - (54 + 192)
    changed = content[:place] + blocks + content[place + 54 + 192 :]
    assert len(changed) == end + shift
    others = struct.unpack_from("<I", content, 100)[0] - 1
    struct.pack_into("<II", changed, 96, start + shift, others + len(records))
    if compressed:
        (table,) = struct.unpack_from("<q", changed, start + shift)
        struct.pack_into("<q", changed, start + shift, table + shift)
    return bytes(changed)


def test_las_asprs150_two_ebvlr(shared_data: Path) -> None:
    with no_warning():
        cloud = read(shared_data / "odd_files/las_extra_bytes/las_asprs150_two_ebvlr.las")
    assert_whole(cloud, 20)
    assert list(cloud.fields)[-2:] == ["amp", "ref"]
    np.testing.assert_allclose(cloud.fields["amp"], 0.5 * np.arange(20))
    np.testing.assert_allclose(cloud.fields["ref"], 10 + 0.01 * np.arange(20))


def test_las_pdal4078_eb_exceeds(shared_data: Path) -> None:
    with pytest.warns(UserWarning, match=r"do not have, or of an unknown type: b; they are left out"):
        cloud = read(shared_data / "odd_files/las_extra_bytes/las_pdal4078_eb_exceeds.las")
    assert_whole(cloud, 20)
    assert list(cloud.fields)[-1] == "a"


@pytest.mark.parametrize("compressed", [False, True])
def test_several_records_are_one_description(tmp_path: Path, compressed: bool) -> None:
    scaled = described(b"ref", 3, 0b11000, _scale=0.01, _offset=5.0)
    content = with_extra(ROWS, described(b"amp", 3), scaled, compressed=compressed)
    with no_warning():
        cloud = cloud_of(tmp_path, content)
    assert_whole(cloud)
    assert list(cloud.fields)[-2:] == ["amp", "ref"]
    np.testing.assert_array_equal(cloud.fields["amp"], ROWS[:, 0])
    np.testing.assert_allclose(cloud.fields["ref"], 5 + 0.01 * ROWS[:, 1])


@pytest.mark.parametrize("compressed", [False, True])
def test_more_bytes_are_described_than_points_have(tmp_path: Path, compressed: bool) -> None:
    record = described(b"a", 3) + described(b"b", 10) + described(b"c", 1)
    with pytest.warns(UserWarning, match="2 extra bytes of each point are not described") as told:
        cloud = cloud_of(tmp_path, with_extra(ROWS, record, compressed=compressed))
    assert any("an unknown type: b, c; they are left out" in str(one.message) for one in told)
    assert_whole(cloud)
    np.testing.assert_array_equal(cloud.fields["a"], ROWS[:, 0])
    np.testing.assert_array_equal(cloud.fields["ExtraBytes"], ROWS[:, 1:].copy().view(np.uint8))
    assert "c" not in cloud.fields


def test_extra_bytes_are_described_that_points_do_not_have(tmp_path: Path) -> None:
    record = struct.pack("<2x16sHH32x", b"LASF_Spec", 4, 192) + described(b"a", 3)
    content = las()
    (start,) = struct.unpack_from("<I", content, 96)
    changed = patched(
        content[:start] + record + content[start:], (*START, start + len(record)), (100, "I", 1)
    )
    with pytest.warns(UserWarning, match="describe extra bytes that its points do not have.*: a;"):
        cloud = cloud_of(tmp_path, changed)
    assert_whole(cloud)
    assert "a" not in cloud.fields


def test_fewer_bytes_are_described_than_there_are(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="2 extra bytes of each point are not described; they are the field"):
        cloud = cloud_of(tmp_path, with_extra(ROWS, described(b"a", 3)))
    np.testing.assert_array_equal(cloud.fields["a"], ROWS[:, 0])
    np.testing.assert_array_equal(cloud.fields["ExtraBytes"], ROWS[:, 1:].copy().view(np.uint8))


def test_extra_bytes_that_no_record_describes(tmp_path: Path) -> None:
    with no_warning():
        cloud = cloud_of(tmp_path, with_extra(ROWS))
    assert_whole(cloud)
    np.testing.assert_array_equal(cloud.fields["ExtraBytes"], ROWS.view(np.uint8))


def test_raw_bytes_of_type_0_and_types_that_nobody_knows(tmp_path: Path) -> None:
    # Of raw bytes the options are their number, which has the bits of a scale and an offset here.
    wide = np.zeros((COUNT, 26), np.uint8)
    wide[:, 24] = np.arange(COUNT) % 250
    with no_warning():
        cloud = cloud_of(tmp_path, with_extra(wide, described(b"raw", 0, 24) + described(b"label", 3)))
    assert cloud.fields["raw"].shape == (COUNT, 24)
    np.testing.assert_array_equal(cloud.fields["label"], np.arange(COUNT) % 250)
    with pytest.warns(UserWarning, match=r"of an unknown type: odd, label; they are left out"):
        cloud = cloud_of(tmp_path, with_extra(wide, described(b"odd", 77) + described(b"label", 3)))
    assert_whole(cloud)
    np.testing.assert_array_equal(cloud.fields["ExtraBytes"], wide)


def test_names_that_are_taken_and_names_that_are_no_text(tmp_path: Path) -> None:
    four = np.column_stack([ROWS, ROWS + 7])
    record = b"".join(described(name, 3) for name in (b"amp", b"amp", b"intensity", b"\xff\xfe"))
    with pytest.warns(
        UserWarning, match="dimensions are called 'amp'; the second is the field 'amp_2'"
    ) as told:
        cloud = cloud_of(tmp_path, with_extra(four, record))
    words = [str(one.message) for one in told]
    assert any("the second is the field 'intensity_2'" in text for text in words)
    names = ["amp", "amp_2", "intensity_2", "\ufffd\ufffd"]
    assert list(cloud.fields)[-4:] == names
    for name, values in zip(names, four.T, strict=True):
        np.testing.assert_array_equal(cloud.fields[name], values)


def test_a_scale_of_0_of_extra_bytes_does_not_make_zeros(tmp_path: Path) -> None:
    record = described(b"a", 3, 0b01000, _scale=0.0) + described(b"b", 3)
    with pytest.warns(UserWarning, match="the scale of its dimension 'a' is 0; the field holds the stored"):
        cloud = cloud_of(tmp_path, with_extra(ROWS, record))
    np.testing.assert_array_equal(cloud.fields["a"], ROWS[:, 0])


def test_a_record_of_extra_bytes_that_is_cut_off(tmp_path: Path) -> None:
    record = described(b"a", 3) + described(b"b", 3)[:-10]
    with pytest.warns(
        UserWarning, match="a record of extra bytes has 374 bytes, which is no multiple of 192"
    ):
        cloud = cloud_of(tmp_path, with_extra(ROWS, record))
    np.testing.assert_array_equal(cloud.fields["a"], ROWS[:, 0])
