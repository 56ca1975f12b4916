"""Numbers in text as programs write them: NaN and infinity, comments, decimal commas."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from surfsig.errors import FileFormatError
from surfsig.files import read
from surfsig.point_cloud import PointCloud

NANS = [
    "nan", "NaN", "NAN", "-nan", "+nan", "nan(ind)", "-nan(ind)", "nan(snan)", "nan(0x8000000000000)", "NaNQ",
    "qNaN", "1.#QNAN", "-1.#QNAN", "1.#QNAN0", "1.#SNAN", "1.#IND", "-1.#IND", "-1.#IND00", "1.#QNB",
    "-1.#IO", "1.#J", "1.$",
    "NULL", "null", "None", "N/A", "#N/A", "NA", "<NA>", r"\N",
]  # fmt: skip
INFINITIES = {"inf": 1, "-inf": -1, "+Inf": 1, "Infinity": 1, "-INFINITY": -1, "1.#INF": 1, "-1.#INF00": -1}


def save(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def quietly(path: Path) -> PointCloud:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(path)


@pytest.mark.parametrize("mark", [" ", "\t", ",", ";", ", "])
def test_nan_and_infinity_in_every_spelling(tmp_path: Path, mark: str) -> None:
    rows = [[str(i), word, "0.5", str(i)] for i, word in enumerate([*NANS, *INFINITIES])]
    expected = [np.nan] * len(NANS) + [np.inf * sign for sign in INFINITIES.values()]
    content = "x y z w\n".replace(" ", mark) + "".join(mark.join(row) + "\n" for row in rows)
    cloud = quietly(save(tmp_path, "a.txt", content))
    np.testing.assert_array_equal(cloud.points[:, 1], expected)
    np.testing.assert_array_equal(cloud.fields["w"], np.arange(len(rows)))


@pytest.mark.parametrize(
    "word", ["nano", "1.#5", "nu", "NaN7", "inf2", "1.$5", "--", "-", "1_000", "0x10", "1,000,000"]
)
def test_other_words_are_no_numbers(tmp_path: Path, word: str) -> None:
    with pytest.raises(FileFormatError, match=r"line 4: .* is not a number"):
        read(save(tmp_path, "a.xyz", f"0 0 0\n1 2 3\n4 5 6\n7 {word} 9\n1 1 1\n2 2 2\n"))


def test_missing_values_beyond_the_first_block(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).normal(size=(200_000, 3))
    lines = [f"{x!r} {y!r} {z!r}" for x, y, z in rows.tolist()]
    lines[150_000] = "1 nan(ind) 3 # the only one"
    lines.insert(150_001, "// between blocks of lines")
    cloud = quietly(save(tmp_path, "a.xyz", "\n".join(lines) + "\n"))
    rows[150_000] = [1, np.nan, 3]
    np.testing.assert_array_equal(cloud.points, rows)


def test_ascii_pcd_and_ply_have_the_same_spellings(tmp_path: Path) -> None:
    words = [*NANS, *INFINITIES]
    count = len(words)
    body = "".join(f"{i} {word} 1.5\n" for i, word in enumerate(words))
    pcd = (
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA ascii\n"
    )
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    ply = f"ply\nformat ascii 1.0\nelement vertex {count}\n{axes}end_header\n"
    expected = [np.nan] * len(NANS) + [np.inf * sign for sign in INFINITIES.values()]
    for name, head in (("a.pcd", pcd), ("a.ply", ply)):
        np.testing.assert_array_equal(quietly(save(tmp_path, name, head + body)).points[:, 1], expected)


def test_comments_begin_where_no_number_is(tmp_path: Path) -> None:
    content = "% MATLAB\n  # x\n0 0 1\n//CloudCompare\n 1 1 1.#IND # note\n2 2 2 // note\n\n% end\n"
    np.testing.assert_array_equal(
        quietly(save(tmp_path, "a.xyz", content)).points, [[0, 0, 1], [1, 1, np.nan], [2, 2, 2]]
    )
    labels = "x,y,z,label,i\n0,0,1,part #4,5\n1,1,2,part #5,6\n"
    with pytest.warns(UserWarning, match="left out what holds words and no numbers: 'label'"):
        cloud = read(save(tmp_path, "a.csv", labels))
    assert cloud.fields["i"].tolist() == [5, 6]


@pytest.mark.parametrize(
    "content",
    [
        "0,5 -1,25 7\n1,5 2 -0,125\n",
        "0,5\t-1,25\t7\n1,5\t2\t-0,125\n",
        "0,5;-1,25;7\n1,5;2;-0,125\n",
        "x;y;z;\n0,5;-1,25;7;\n1,5;2,0;-1,25e-1;\n",
        '"x","y","z"\n"0,5","-1,25","7"\n"1,5","2","-0,125"\n',
        "x y z\n 0,5   -1,25 7 \n1,5 2 -,125\n",
    ],
    ids=["blanks", "tabs", "semicolons", "header", "quoted commas", "aligned"],
)
def test_decimal_commas(tmp_path: Path, content: str) -> None:
    for encoded in (content.encode(), content.replace("\n", "\r\n").encode("utf-16")):
        cloud = quietly(save(tmp_path, "a.txt", encoded))
        assert cloud.points.tolist() == [[0.5, -1.25, 7], [1.5, 2, -0.125]]


def test_decimal_commas_beside_words_and_missing_values(tmp_path: Path) -> None:
    content = "Nr;x;y;z;i;date\nA 1;0,5;-1,25;7;;01.05.2024\nA 2;1,5;1,#QNAN;-0,125;0,5;02.05.2024\n"
    with pytest.warns(UserWarning, match="'Nr', 'date'"):
        cloud = read(save(tmp_path, "a.csv", content))
    np.testing.assert_array_equal(cloud.points, [[0.5, -1.25, 7], [1.5, np.nan, -0.125]])
    np.testing.assert_array_equal(cloud.fields["i"], [np.nan, 0.5])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("1,2,3 4,5,6\n7,8,9 1,2,3\n", "both commas .* and blanks stand between numbers"),
        ("1,5, 2,5, 3,5\n4,5, 5,5, 6,5\n", "commas with and without a blank stand between numbers"),
        ("1,5 2.5 3,5\n1,5 2,5 3,5\n", "decimal comma .*'1,5'.* point .*'2.5'"),
        (
            "100,000 200,000 300,000\n400,000 500,500 600,000\n",
            "'100,000' may be 100000, by thousands, or 100.000",
        ),
        ("1,234,567 2,345,678 3,456,789\n", "both commas|is not a number"),
        ("1,234.5 2,345.6 3,456.7\n", "without commas between thousands"),
        ("x;y;z\n1,234.5;2,345.6;3,456.7\n", "without commas between thousands"),
    ],
)
def test_commas_that_may_mean_something_else(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message) as error:
        read(save(tmp_path, "a.txt", content))
    assert "\n" not in str(error.value)


def test_a_point_far_below_decimal_commas_is_refused(tmp_path: Path) -> None:
    lines = [f"{i},5 {i},25 7" for i in range(20_000)]
    lines[19_000] = "1,5 2.5 3,5"
    with pytest.raises(FileFormatError, match=r"line 19001: '2\.5' is not a number with a decimal comma"):
        read(save(tmp_path, "a.txt", "\n".join(lines) + "\n"))
    lines = [f"{i} {i} 7" for i in range(20_000)]
    lines[19_000] = "1,5 2 3,5"
    with pytest.raises(FileFormatError, match=r"line 19001: '1,5' is not a number \(write a decimal point"):
        read(save(tmp_path, "a.txt", "\n".join(lines) + "\n"))


def test_odd_nan_of_old_windows_programs(shared_data: Path) -> None:
    cloud = quietly(shared_data / "odd_files" / "text_qnan" / "txt_qnan_last.xyz")
    np.testing.assert_array_equal(
        cloud.points, [[0, 0, 1.5], [1, 0, np.nan], [2, 0, 1.7], [3, 0, np.nan], [4, 0, 1.8]]
    )


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [
        ("txt_dec_comma_int_z.txt", [1.1, 2.3, 7], [10.1, 20.3, 7]),
        ("txt_dec_comma_space.txt", [0, 1, 0], [0.9, 2.8, 4.05]),
    ],
)
def test_odd_decimal_commas(shared_data: Path, name: str, first: list[float], last: list[float]) -> None:
    cloud = quietly(shared_data / "odd_files" / "text_decimal_comma" / name)
    assert len(cloud) == 10
    assert cloud.points[[0, -1]].tolist() == [first, last]
