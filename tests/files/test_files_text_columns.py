"""Text files: which columns are the coordinates, what is left out, and what is refused."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import read
from surfsig.point_cloud import PointCloud

POINTS = [[1.5, -2.25, 3.0], [4.125, 5.0, -6.5], [7.0, 8.5, 9.25]]


def save(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def table(header: str, order: str, delimiter: str = ",") -> str:
    """Return the points under a header; `order` says what each column is: x y z, i (a number), n (counts)."""
    rows = []
    for number, point in enumerate(POINTS):
        values = dict(zip("xyz", map(str, point), strict=True)) | {
            "i": str(20 + number),
            "n": str(number + 1),
        }
        rows.append(delimiter.join(values[letter] for letter in order))
    return "\n".join([header, *rows]) + "\n"


def quietly(path: Path, **options: Any) -> PointCloud:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(path, **options)


@pytest.mark.parametrize(
    ("header", "order", "fields"),
    [
        ("ID,Easting,Northing,Elevation", "nxyz", ["ID"]),
        ("n,NORTHING,EASTING,HEIGHT", "nyxz", ["n"]),
        ("E,N,H,i", "xyzi", ["i"]),
        ("East,North,Up", "xyz", []),
        ("id,easting,northing,z", "nxyz", ["id"]),
        ("time [s],X [m],Y [m],Z [m]", "nxyz", ["time [s]"]),
        ("t,x(m),y(m),z(m)", "nxyz", ["t"]),
        ("t,X/m,Y/m,Z/m", "nxyz", ["t"]),
        ("t,x_m,y_m,z_m", "nxyz", ["t"]),
        ("Points:0,Points:1,Points:2,Intensity", "xyzi", ["Intensity"]),
        ("Intensity,Points_0,Points_1,Points_2", "ixyz", ["Intensity"]),
        ("frame,pos_x,pos_y,pos_z", "nxyz", ["frame"]),
        ("frame,position.x,position.y,position.z", "nxyz", ["frame"]),
        ("frame,coord_x,coord_y,coord_z", "nxyz", ["frame"]),
        ("frame,x_coord,y_coord,z_coord", "nxyz", ["frame"]),
        ("frame,XCoord,YCoord,ZCoord", "nxyz", ["frame"]),
        ("frame,px,py,pz", "nxyz", ["frame"]),
        ("frame,POINT_X,POINT_Y,POINT_Z", "nxyz", ["frame"]),
        ("i,Coord. X,Coord. Y,Coord. Z", "ixyz", ["i"]),
        ("class,X,Y,Elevation", "ixyz", ["class"]),
        ("Easting,x,y,z", "nxyz", ["Easting"]),
        ("height,z,y,x", "izyx", ["height"]),
    ],
)
def test_the_header_says_which_columns_are_the_coordinates(
    tmp_path: Path, header: str, order: str, fields: list[str]
) -> None:
    for mark in (",", ";", "\t"):
        cloud = quietly(save(tmp_path, "a.csv", table(header.replace(",", mark), order, mark)))
        assert cloud.points.tolist() == POINTS
        assert list(cloud.fields) == fields
    # A comment names them too.
    for comment in ("//", "# ", "%"):
        cloud = quietly(save(tmp_path, "a.txt", table(comment + header, order)))
        assert cloud.points.tolist() == POINTS


@pytest.mark.parametrize(
    ("header", "unit"),
    [("X [mm],Y [mm],Z [mm]", "mm"), ("x(ft),y(ft),z(ft)", "ft"), ("X_cm,Y_cm,Z_cm", "cm")],
)
def test_a_unit_in_the_header_is_named(tmp_path: Path, header: str, unit: str) -> None:
    path = save(tmp_path, "a.csv", table(header, "xyz"))
    with pytest.warns(UserWarning, match=f'are in {unit} by their names.*unit="{unit}" gives metres'):
        assert read(path).points.tolist() == POINTS
    factor = {"mm": 0.001, "ft": 0.3048, "cm": 0.01}[unit]
    np.testing.assert_allclose(quietly(path, unit=unit).points, np.array(POINTS) * factor)
    with pytest.warns(UserWarning, match="taken as km"):
        read(path, unit="km")


def test_a_unit_below_the_header_is_named(tmp_path: Path) -> None:
    path = save(tmp_path, "a.csv", table("id,X,Y,Z\n,mm,mm,mm", "nxyz"))
    with pytest.warns(UserWarning, match="are in mm by their names"):
        assert list(read(path).fields) == ["id"]
    np.testing.assert_allclose(quietly(path, unit="mm").points, np.array(POINTS) / 1000)


def test_degrees_are_no_lengths(tmp_path: Path) -> None:
    path = save(tmp_path, "a.csv", table("id,Latitude,Longitude,Elevation", "nyxz"))
    with pytest.warns(UserWarning, match="'Longitude' and 'Latitude' in degrees, which are no lengths"):
        assert read(path).points.tolist() == POINTS


@pytest.mark.parametrize(
    ("header", "order", "message"),
    [
        ("a,b,c,d", "ixyz", r"its header \(a, b, c, d\) names no coordinates; columns=\"x,y,z,_\""),
        (
            "pos_x,pos_y,pos_z,map_x,map_y,map_z",
            "xyzxyz",
            r"several columns may be the coordinates \(pos_x, pos_y",
        ),
        ("easting,northing,height,altitude", "xyzz", "several columns may be the coordinates"),
        ("nx,ny,nz,i", "xyzi", "names no coordinates"),
        ("X [mm],Y [m],Z [m]", "xyz", "several units"),
        (",0,1,2", "nxyz", "names no coordinates"),
        (
            "ncols 3\nnrows 3\nxllcorner 0\ncellsize 2",
            "xyz",
            "4 lines of words begin it .'ncols 3'., and none names",
        ),
    ],
)
def test_a_header_without_coordinates_is_refused(
    tmp_path: Path, header: str, order: str, message: str
) -> None:
    path = save(tmp_path, "a.csv", table(header, order))
    with pytest.raises(FileFormatError, match=message):
        read(path)
    names = ",".join(
        letter if order.index(letter) == i and letter in "xyz" else "_" for i, letter in enumerate(order)
    )
    assert quietly(path, columns=names).points.tolist() == POINTS


def test_columns_name_what_nobody_did(tmp_path: Path) -> None:
    path = save(tmp_path, "a.txt", table("# a remark", "nxyzi", " "))
    cloud = quietly(path, columns="_,x,y,z,intensity")
    assert cloud.points.tolist() == POINTS
    assert {name: values.tolist() for name, values in cloud.fields.items()} == {"intensity": [20, 21, 22]}
    for columns in (["-", "Z", "Y", "X", "i"], "_, z, y, x, i"):
        assert quietly(path, columns=columns).points.tolist() == [point[::-1] for point in POINTS]
    # They count more than a header.
    named = save(tmp_path, "b.csv", table("x,y,z,i", "xyzi"))
    assert list(quietly(named, columns="y,x,z,w").fields) == ["w"]
    assert quietly(named, columns="y,x,z,w").points[:, 0].tolist() == [-2.25, 5.0, 8.5]
    with pytest.raises(InvalidInputError, match="has 4 columns, and 'columns' names 3"):
        read(named, columns="x,y,z")
    with pytest.raises(FileFormatError, match="column 'x': 'ground' is not a number"):
        read(save(tmp_path, "c.csv", "a,b,c,d\n1,2,3,ground\n4,5,6,ground\n"), columns="_,y,z,x")


@pytest.mark.parametrize("columns", ["x,y", "x,y,z,x", "x,y,z,X", "x,,y,z", "a,b,c", "", 5, [1, 2, 3]])
def test_columns_that_name_no_coordinates(tmp_path: Path, columns: Any) -> None:
    with pytest.raises(InvalidInputError, match="columns must be"):
        read(save(tmp_path, "a.txt", "1 2 3\n"), columns=columns)


def test_columns_of_arrays_and_of_what_has_names(tmp_path: Path) -> None:
    values = np.arange(8, dtype=np.float32).reshape(2, 4)
    np.save(tmp_path / "a.npy", values)
    cloud = quietly(tmp_path / "a.npy", columns="time,x,y,z")
    np.testing.assert_array_equal(cloud.points, values[:, 1:])
    assert cloud.fields["time"].tolist() == [0, 4]
    with pytest.raises(InvalidInputError, match="has 4 columns, and 'columns' names 3"):
        read(tmp_path / "a.npy", columns="x,y,z")
    np.save(tmp_path / "b.npy", values.view([(name, "<f4") for name in "xyzi"])[:, 0])
    with pytest.raises(InvalidInputError, match="'columns' means nothing"):
        read(tmp_path / "b.npy", columns="x,y,z,i")
    np.savez(tmp_path / "a.npz", values)
    with pytest.raises(InvalidInputError, match="holds NPZ data, for which 'columns' means nothing"):
        read(tmp_path / "a.npz", columns="x,y,z,i")


def test_other_formats_know_the_names_too(tmp_path: Path) -> None:
    rows = np.zeros(3, [("id", "i4"), ("Easting", "f8"), ("Northing", "f8"), ("Elevation", "f4")])
    rows["Easting"], rows["Northing"], rows["Elevation"] = np.transpose(POINTS)
    np.save(tmp_path / "a.npy", rows)
    cloud = quietly(tmp_path / "a.npy")
    assert cloud.points.tolist() == POINTS
    assert list(cloud.fields) == ["id"]
    frame = pytest.importorskip("pandas").DataFrame(
        {"pos_x": [1.0], "pos_y": [2.0], "pos_z": [3.0], "i": [4]}
    )
    assert PointCloud.of(frame).points.tolist() == [[1, 2, 3]]
    with pytest.raises(InvalidInputError, match="the DataFrame: several columns may be the coordinates"):
        PointCloud.of(frame.assign(map_x=1.0, map_y=2.0, map_z=3.0))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("".join(f"{i} {i}.5 2.5 {i}.25\n" for i in range(20)), "the first column counts the rows"),
        ("".join(f"{i + 1},{i}.5,2.5,{i}.25\n" for i in range(3)), "the first column counts the rows"),
        ("".join(f"{1.7e9 + i / 10:.3f} {i}.5 2.5 {i}.25\n" for i in range(20)), "looks like a time"),
        ("".join(f"{1700000000000000000 + i * 10} {i}.5 2.5 7\n" for i in range(20)), "looks like a time"),
        (
            "".join(f"P{i} {i}.5 2.5 {i}.25 7\n" for i in range(20)),
            "the first three columns are not all numbers",
        ),
    ],
)
def test_first_columns_that_are_no_coordinates(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message + ".*columns="):
        read(save(tmp_path, "a.txt", content))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("".join(f"{i} {i % 3} 2 {i}\n" for i in range(20)), "the first counts the rows"),
        ("".join(f"{i * i} 40{i}.5 2.5 {i}.25\n" for i in range(20)), "the first holds whole numbers"),
        ("".join(f"5 7 {i} {i}.5 {i}.25 {i}.75\n" for i in range(20)), "two of them never change"),
        ("".join(f"{i * i} {i} 3 {i}.5 {i}.25 {i}.75\n" for i in range(20)), "they hold whole numbers"),
    ],
)
def test_first_columns_that_may_be_no_coordinates(tmp_path: Path, content: str, message: str) -> None:
    with pytest.warns(UserWarning, match=f"although .*{message}.*columns="):
        assert len(read(save(tmp_path, "a.txt", content))) == 20


@pytest.mark.parametrize(
    "content",
    [
        "".join(f"{i} {i * i % 7} 2\n" for i in range(20)),
        "".join(f"{i * 3} {i * i} 1200 0.1 0.2 0.9\n" for i in range(20)),
        "".join(f"{400000 + i / 10:.3f} 5600001.2 {i}.25 7\n" for i in range(20)),
    ],
    ids=["three columns", "millimetres and normals", "a line in UTM"],
)
def test_first_columns_that_are_coordinates(tmp_path: Path, content: str) -> None:
    assert len(quietly(save(tmp_path, "a.txt", content))) == 20


def test_words_are_left_out_with_one_warning(tmp_path: Path) -> None:
    content = (
        "Export of scan 12\n\nname,x,y,z,time,valid,intensity\n,[m],[m],[m],[s],,\n"
        '"T, 1",1.5,-2.25,3.0,2024-05-01T12:00:00,true,20\n'
        'T2,"4.125",5.0,-6.5,2024-05-01T12:00:01,false,\n'
        "T3,7.0,8.5,9.25,2024-05-01T12:00:02,true,NULL\n"
    )
    with pytest.warns(
        UserWarning, match="left out what holds words and no numbers: 'name', 'time', 'valid'"
    ) as told:
        cloud = read(save(tmp_path, "a.csv", content))
    assert len(told) == 1
    assert cloud.points.tolist() == POINTS
    assert list(cloud.fields) == ["intensity"]
    np.testing.assert_array_equal(cloud.fields["intensity"], [20, np.nan, np.nan])
    names = "_,x,y,z,_,_,i"
    assert quietly(save(tmp_path, "b.csv", content), columns=names).points.tolist() == POINTS


@pytest.mark.parametrize(
    "content",
    [
        "sep=;\nx;y;z\n1.5;-2.25;3\n4.125;5;-6.5\n7;8.5;9.25\n",
        "sep=,\r\nx,y,z,\r\n1.5,-2.25,3,\r\n4.125,5,-6.5,\r\n7,8.5,9.25,\r\n",
        '"","x","y","z"\n"1",1.5,-2.25,3\n"2",4.125,5,-6.5\n"3",7,8.5,9.25\n',
        '"x" "y" "z" "row"\n1.5 -2.25 3 4\n4.125 5 -6.5 4\n7 8.5 9.25 4\n',
        '"x" "y" "z"\n"1" 1.5 -2.25 3\n"2" 4.125 5 -6.5\n"3" 7 8.5 9.25\n',
        "Station A\n1.5 -2.25 3\n4.125 5 -6.5\n7 8.5 9.25\n",
        "P1 1.5 -2.25 3\nP2 4.125 5 -6.5\nP3 7 8.5 9.25\n",
        "# columns: z y x\n3 -2.25 1.5\n-6.5 5 4.125\n9.25 8.5 7\n",
    ],
    ids=["excel", "empty last", "R csv", "quoted", "R table", "title", "names first", "comment"],
)
def test_what_programs_write_around_the_numbers(tmp_path: Path, content: str) -> None:
    for encoded in (content.encode(), content.encode("utf-16")):
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "(?s).*left out what holds words")
            cloud = read(save(tmp_path, "a.csv", encoded))
        assert cloud.points.tolist() == POINTS


def test_words_in_a_column_of_numbers_are_damage(tmp_path: Path) -> None:
    rows = [f"{i},{i + 1},{i * i}.5,7" for i in range(9)]
    rows[5] = "5,6,25.5,seven"
    with pytest.raises(FileFormatError, match="line 7: 'seven' is not a number"):
        read(save(tmp_path, "a.csv", "x,y,z,i\n" + "\n".join(rows) + "\n"))
    rows[5] = "5,6,25.5,7,8"
    with pytest.raises(FileFormatError, match="line 7: 5 values where 4 are expected"):
        read(save(tmp_path, "a.csv", "x,y,z,i\n" + "\n".join(rows) + "\n"))


def test_a_row_with_another_width_is_found_beside_columns_of_words(tmp_path: Path) -> None:
    rows = [f"a,{i},{i + 1},{i * i}.5" for i in range(9)]
    rows[5] = "a,5,6,25.5,8"
    with (
        pytest.raises(FileFormatError, match="line 7: 5 values where 4 are expected"),
        pytest.warns(UserWarning, match="'name'"),
    ):
        read(save(tmp_path, "a.csv", "name,x,y,z\n" + "\n".join(rows) + "\n"))


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("csv_east_north.csv", [400000, 5600001, 0], [400000.9, 5600002.8, 4.05]),
        ("csv_pos_xyz.csv", [0, 1, 0], [0.9, 2.8, 4.05]),
        ("csv_units_header.csv", [0, 1, 0], [0.9, 2.8, 4.05]),
    ],
)
def test_odd_headers(shared_data: Path, name: str, low: list[float], high: list[float]) -> None:
    cloud = quietly(shared_data / "odd_files" / "text_header_columns" / name)
    assert len(cloud) == 10
    assert cloud.points[0].tolist() == low
    assert cloud.points[-1].tolist() == high
    assert len(cloud.fields) == 1


@pytest.mark.parametrize(
    ("name", "left_out", "fields"),
    [
        ("csv_cc2136_empty.csv", None, {"intensity": [5, np.nan] * 5, "ring": [3] * 10}),
        ("csv_cc380_name.csv", "'name'", {}),
        ("csv_datetime.csv", "'time'", {}),
        ("csv_empty_last.csv", None, {"intensity": [5, np.nan] * 5}),
        ("csv_label_text.csv", "'label'", {}),
        ("txt_none_values.csv", None, {"i": [1, 1, 1, np.nan, 1, 1, 1, 1, 1, 1]}),
        ("txt_percent_comment.txt", None, {}),
        ("txt_title_then_header.csv", None, {}),
    ],
)
def test_odd_columns(
    shared_data: Path, name: str, left_out: str | None, fields: dict[str, list[float]]
) -> None:
    path = shared_data / "odd_files" / "text_columns_no_numbers" / name
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        cloud = read(path)
    assert len(told) == (left_out is not None)
    assert all(left_out in str(warning.message) for warning in told if left_out)
    assert cloud.points[[0, -1]].tolist() == [[0, 1, 0], [0.9, 2.8, 4.05]]
    assert list(cloud.fields) == list(fields)
    for field, values in fields.items():
        np.testing.assert_array_equal(cloud.fields[field], values)
