"""Text as various programs write it, with points that are known."""

import io
import warnings
from pathlib import Path

import numpy as np
import pytest

from surfsig.errors import FileFormatError
from surfsig.files import lines, read
from surfsig.progress import Progress

POINTS = np.array([[-1.5, 2.25, 3.0625], [4.125, -5.5, 6.75], [7.5, 8.5, -9.25], [0.5, 1.25, -0.75]] * 3)


def rows(*columns: object, sep: str = ",") -> str:
    """Return a line for each point, with `columns` (one value or a list of them) around x, y, z."""
    cells = [value if isinstance(value, (list, np.ndarray)) else [value] * len(POINTS) for value in columns]
    return "".join(sep.join(map(str, row)) + "\n" for row in zip(*cells, strict=True))


X, Y, Z = POINTS.T
STAMPS = [1_600_000_000_000_000_000 + 1000 * i for i in range(len(POINTS))]


def read_text(folder: Path, content: str | bytes, name: str = "scan.txt") -> np.ndarray:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return np.asarray(read(path).points)


@pytest.mark.parametrize(
    "content",
    [
        "%time,field.x,field.y,field.z\n" + rows(STAMPS, X, Y, Z),
        "%time,field.pose.position.x,field.pose.position.y,field.pose.position.z,field.pose.orientation.x\n"
        + rows(STAMPS, X, Y, Z, 0),
        "time,/odom/pose/pose/position/x,/odom/pose/pose/position/y,/odom/pose/pose/position/z\n".replace(
            "/odom", ""
        )
        + rows(STAMPS, X, Y, Z),
        '"Points_m_XYZ:0","Points_m_XYZ:1","Points_m_XYZ:2","intensity"\n' + rows(X, Y, Z, 7),
        "TIMESTAMP (ns), ROW, RANGE (mm), X1 (m), Y1 (m), Z1 (m)\n" + rows(STAMPS, 3, 900, X, Y, Z),
    ],
    ids=["rostopic", "rostopic-pose", "plotjuggler", "veloview", "ouster"],
)
def test_names_that_programs_give_coordinates(tmp_path: Path, content: str) -> None:
    np.testing.assert_array_equal(read_text(tmp_path, content), POINTS)


def test_components_of_a_field_are_no_coordinates(tmp_path: Path) -> None:
    path = tmp_path / "scan.csv"
    path.write_text("lat,lon,alt,field_x,field_y,field_z\n" + rows(X, Y, Z, 0.5, 0.25, 0.125))
    with pytest.warns(UserWarning, match="in degrees"):
        cloud = read(path)
    np.testing.assert_array_equal(cloud.points, POINTS[:, [1, 0, 2]])


def test_coordinates_of_two_returns_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="several columns may be the coordinates"):
        read_text(tmp_path, "X1,Y1,Z1,X2,Y2,Z2\n" + rows(X, Y, Z, X, Y, Z))


def test_names_in_the_code_page_of_windows(tmp_path: Path) -> None:
    header = "Rechtswert;Hochwert;Höhe\r\n"
    content = header + rows(X, Y, Z, sep=";").replace(".", ",")
    for encoding in ("cp1252", "utf-8", "utf-8-sig", "utf-16", "utf-32"):
        np.testing.assert_array_equal(read_text(tmp_path, content.encode(encoding)), POINTS)


def test_normals_of_cloudcompare_are_normals(tmp_path: Path) -> None:
    path = tmp_path / "scan.asc"
    path.write_text("//X Y Z Nx Ny Nz\n" + rows(X, Y, Z, 0, 0, 1, sep=" "))
    assert list(read(path).fields) == ["nx", "ny", "nz"]


def test_exponents_of_fortran(tmp_path: Path) -> None:
    content = "  0.15D+01 -2.5D-01  .5d3\n  1.D0      0.25D0    3\n"
    np.testing.assert_array_equal(read_text(tmp_path, content), [[1.5, -0.25, 500], [1, 0.25, 3]])


@pytest.mark.parametrize("cell", ["#N/A", "#NV", "#NUM!", "#DIV/0!", "#WERT!", "#NAME?", "(null)", "n.a."])
def test_formulas_without_a_value_are_nan(tmp_path: Path, cell: str) -> None:
    content = "x,y,z\n" + rows(X, Y, Z) + f"{cell},1.5,2\n3,{cell},2\n4.5,2,{cell}\n"
    more = [[np.nan, 1.5, 2], [3, np.nan, 2], [4.5, 2, np.nan]]
    np.testing.assert_array_equal(read_text(tmp_path, content), np.vstack([POINTS, more]))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("1_000,2,3\n4,5,6\n7,8,9\n", "line 1: '1_000' is not a number"),
        ("1.5,2.5,abc\n4,5,6\n7,8,9\n", "line 1: 'abc' is not a number"),
        ("x y z\n1.5 2_5 3\n4 5 6\n7 8 9\n", "line 2: '2_5' is not a number"),
        ("1.5 2.5\n4 5 6\n7 8 9\n", "line 1: 2 values where 3 are expected"),
        ("1.5 2.5 3 \x10\n" + "4 5 6\n7 8 9\n" * 30, "line 1: 4 values where 3 are expected"),
    ],
)
def test_a_broken_first_row_is_no_title(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message):
        read_text(tmp_path, content)


@pytest.mark.parametrize("title", ["10 4", "Scan 12 of 2024", "Level 1.5", "12"])
def test_numbers_in_a_title_are_no_row(tmp_path: Path, title: str) -> None:
    np.testing.assert_array_equal(
        read_text(tmp_path, f"{title}\n" + rows(X, Y, Z, sep=" "), "scan.xyz"), POINTS
    )


@pytest.mark.parametrize("header", ["", "X,Y,Z\n"])
def test_numbers_that_their_decimal_commas_cut_are_refused(tmp_path: Path, header: str) -> None:
    with pytest.raises(FileFormatError, match="commas stand between numbers and, as it seems, within them"):
        read_text(tmp_path, header + rows(X, Y, Z).replace(".", ","))


@pytest.mark.parametrize("header", ["", "x,y,z,r,g,b\n"])
def test_whole_numbers_with_colours_are_whole_numbers(tmp_path: Path, header: str) -> None:
    points = np.array([[-100, 20, 305], [7, -80, 9], [1, 20, 3]])
    content = header + "".join(",".join(map(str, [*point, 0, 10, 255])) + "\n" for point in points)
    np.testing.assert_array_equal(read_text(tmp_path, content), points)


def test_rows_of_r_that_were_chosen_keep_their_numbers(tmp_path: Path) -> None:
    numbers = [f'"{7 * i + 3}"' for i in range(len(POINTS))]
    whole = rows(numbers, X, Y, Z, sep=" ")
    np.testing.assert_array_equal(read_text(tmp_path, '"x" "y" "z"\n' + whole), POINTS)


def test_whole_numbers_under_a_header_that_is_too_short_are_refused(tmp_path: Path) -> None:
    content = "x;y;z\n" + "3;10;20;30\n10;11;21;31\n17;12;22;32\n"
    with pytest.raises(FileFormatError, match="its header names 3 columns, its rows hold 4 values"):
        read_text(tmp_path, content)


def test_rows_and_columns_of_faro_are_doubted(tmp_path: Path) -> None:
    scan_rows = [i // 4 for i in range(len(POINTS))]
    content = rows(scan_rows, scan_rows[::-1], X + 0.125, Y + 0.125, Z + 0.125, 200, sep=" ")
    with pytest.raises(UserWarning, match="the first two hold whole numbers and the next three do not"):
        read_text(tmp_path, content)


@pytest.mark.parametrize("end", ["\r", "\r\n", "\n"])
@pytest.mark.parametrize("size", [2, 7, 16, 32])
def test_blocks_of_lines_with_any_end(monkeypatch: pytest.MonkeyPatch, end: str, size: int) -> None:
    monkeypatch.setattr("surfsig.files.lines.BLOCK_BYTES", size)
    words = ["first", "", "a line that is longer than most blocks of it", "1 2 3", "last"]
    content = "".join(word + end for word in words).encode()
    blocks = list(lines.line_blocks(io.BytesIO(content), 1, Progress(None, len(content))))
    assert [line for block in blocks for line in block.lines] == words
    assert [block.first for block in blocks] == [
        1 + sum(len(earlier.lines) for earlier in blocks[:i]) for i in range(len(blocks))
    ]
    assert len(blocks) > 1
    assert not any(block.unterminated for block in blocks)


def test_a_letter_that_is_none_is_shown_as_it_is(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="line 401: '−4' is not a number"):
        read_text(tmp_path, "1 2 3\n" * 400 + "−4 5 6\n7 8 9\n")
