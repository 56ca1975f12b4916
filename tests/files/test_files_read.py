"""Every format that is read, by value."""

import struct
import warnings
from pathlib import Path

import lzf
import numpy as np
import pytest

from surfsig.errors import FileFormatError
from surfsig.files import read

POINTS = [[1.5, -2.25, 3.0], [4.125, 5.0, -6.5]]


def save(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


MESH = """ply
format {format} 1.0
comment a mesh with an element and a list before and after what counts
element camera 2
property uchar id
property list uchar short views
element vertex 2
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
property ushort quality
element face 2
property list uchar int vertex_indices
end_header
"""


def mesh(order: str) -> bytes:
    camera = struct.pack(order + "BBhh", 7, 2, 10, 11) + struct.pack(order + "BB", 8, 0)
    vertices = b"".join(struct.pack(order + "3f3BH", *p, 1, 2, 255, 60000 + i) for i, p in enumerate(POINTS))
    faces = struct.pack(order + "B3i", 3, 0, 1, 0) + struct.pack(order + "B4i", 4, 0, 1, 0, 1)
    return camera + vertices + faces


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply(tmp_path: Path, kind: str) -> None:
    body = {
        "ascii": b"7 2 10 11\n8 0\n"
        b"1.5 -2.25 3 1 2 255 60000\n4.125 5 -6.5 1 2 255 60001\n"
        b"3 0 1 0\n4 0 1 0 1\n",
        "binary_little_endian": mesh("<"),
        "binary_big_endian": mesh(">"),
    }[kind]
    cloud = read(save(tmp_path, "mesh.ply", MESH.format(format=kind).encode() + body))
    assert cloud.points.dtype == np.float32
    assert cloud.points.tolist() == POINTS
    assert list(cloud.fields) == ["red", "green", "blue", "quality"]
    assert cloud.fields["blue"].dtype == np.uint8
    assert cloud.fields["blue"].tolist() == [255, 255]
    assert cloud.fields["quality"].tolist() == [60000, 60001]
    assert cloud.viewpoint is None
    assert cloud.grid is None


LISTS = """ply
format {format} 1.0
element vertex 2
property list uchar float weights
property double x
property double y
property double z
property list ushort uchar more
property int label
end_header
"""


@pytest.mark.parametrize("lengths", [(2, 2), (3, 1)])
def test_ply_lists_within_vertices(tmp_path: Path, lengths: tuple[int, int]) -> None:
    binary, ascii_ = b"", ""
    for point, length in zip(POINTS, lengths, strict=True):
        binary += struct.pack(
            f">B{length}f3dH{length}Bi", length, *[0.5] * length, *point, length, *[9] * length, -3
        )
        ascii_ += f"{length} {'0.5 ' * length} {' '.join(map(str, point))} {length} {'9 ' * length} -3\n"
    for kind, body in (("binary_big_endian", binary), ("ascii", ascii_.encode())):
        cloud = read(save(tmp_path, "lists.ply", LISTS.format(format=kind).encode() + body))
        assert cloud.points.dtype == np.float64
        assert cloud.points.tolist() == POINTS
        assert cloud.fields["label"].tolist() == [-3, -3]


def test_ascii_ply_keeps_millimetres_at_utm(tmp_path: Path) -> None:
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex 2\n{axes}end_header\n"
    far = read(save(tmp_path, "far.ply", head + "500000.001 4500000.002 100.003\n500001 4500001 101\n"))
    assert far.points.dtype == np.float64
    assert far.points[0].tolist() == [500000.001, 4500000.002, 100.003]
    near = read(save(tmp_path, "near.ply", head + "0.001 0.002 0.003\n1 1 1\n"))
    assert near.points.dtype == np.float32


def pcd(
    data: str, body: bytes, *, fields: str, size: str, kind: str, count: str = "", height: int = 1
) -> bytes:
    lines = ["# .PCD v0.7 - Point Cloud Data file format", "VERSION 0.7", f"FIELDS {fields}", f"SIZE {size}"]
    lines += [f"TYPE {kind}"] + ([f"COUNT {count}"] if count else [])
    lines += [
        f"WIDTH {2 // height}",
        f"HEIGHT {height}",
        "VIEWPOINT 1 2 3 1 0 0 0",
        "POINTS 2",
        f"DATA {data}\n",
    ]
    return "\n".join(lines).encode() + body


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_pcd(tmp_path: Path, kind: str) -> None:
    packed = 0xFF0A0B0C
    dtype = [("xyz", "<f4", 3), ("_", "u1", 4), ("histogram", "<f8", 2), ("rgba", "<u4")]
    rows = np.zeros(2, dtype)
    rows["xyz"] = POINTS
    rows["xyz"][1, 2] = np.nan
    rows["histogram"] = [[1, 2], [3, 4]]
    rows["rgba"] = packed
    if kind == "ascii":
        body = f"1.5 -2.25 3 0 0 0 0 1 2 {packed}\n4.125 5 nan 0 0 0 0 3 4 {packed}\n".encode()
    elif kind == "binary":
        body = rows.tobytes()
    else:
        planes = b"".join(np.ascontiguousarray(rows["xyz"][:, i]).tobytes() for i in range(3))
        planes += b"".join(np.ascontiguousarray(rows[name]).tobytes() for name in ("_", "histogram", "rgba"))
        short: bytes | None = lzf.compress(planes)
        assert short is not None
        body = struct.pack("<II", len(short), len(planes)) + short
    content = pcd(
        kind,
        body,
        fields="x y z _ histogram rgba",
        size="4 4 4 1 8 4",
        kind="F F F U F U",
        count="1 1 1 4 2 1",
        height=2,
    )
    cloud = read(save(tmp_path, "scan.pcd", content))
    assert cloud.points.dtype == np.float32
    np.testing.assert_array_equal(cloud.points, [POINTS[0], [4.125, 5.0, np.nan]])
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [1, 2, 3]
    assert cloud.grid == (2, 1)
    assert list(cloud.fields) == ["histogram", "red", "green", "blue", "alpha"]
    assert cloud.fields["histogram"].tolist() == [[1, 2], [3, 4]]
    assert [int(cloud.fields[name][1]) for name in ("red", "green", "blue", "alpha")] == [10, 11, 12, 255]
    assert cloud.fields["red"].dtype == np.uint8


@pytest.mark.parametrize("kind", ["ascii", "binary"])
def test_pcd_colour_packed_into_a_float(tmp_path: Path, kind: str) -> None:
    value = np.array([0x00FF8001], np.uint32).view(np.float32)[0]
    if kind == "ascii":
        body = f"0 0 0 {value!s}\n0 0 1 {value!s}\n".encode()
    else:
        body = np.array([[0, 0, 0, value], [0, 0, 1, value]], "<f4").tobytes()
    cloud = read(save(tmp_path, "c.pcd", pcd(kind, body, fields="x y z rgb", size="4 4 4 4", kind="F F F F")))
    assert [int(cloud.fields[name][0]) for name in ("red", "green", "blue")] == [255, 128, 1]
    assert "alpha" not in cloud.fields
    assert cloud.grid is None


@pytest.mark.parametrize(
    ("content", "fields"),
    [
        ("1.5 -2.25 3\n4.125 5 -6.5\n", {}),
        ("1.5\t-2.25\t3\r\n4.125\t5\t-6.5\r\n", {}),
        ("# made by hand\n\n  1.5   -2.25 3 \n\n4.125 5 -6.5 # note\n// end\n", {}),
        ("1.5,-2.25,3,7\n4.125,5,-6.5,8\n", {"column_4": [7, 8]}),
        ("1.5;-2.25;3;7;\n4.125;5;-6.5;8;\n", {"column_4": [7, 8]}),
        ("x,y,z,intensity\n1.5, -2.25, 3, 7\n4.125, 5, -6.5, 8\n", {"intensity": [7, 8]}),
        ('"t","X","Y","Z"\n7,1.5,-2.25,3\n8,4.125,5,-6.5\n', {"t": [7, 8]}),
        (
            "//X Y Z R G B\n1.5 -2.25 3 255 0 1\n4.125 5 -6.5 2 3 4\n",
            {"red": [255, 2], "green": [0, 3], "blue": [1, 4]},
        ),
        ("easting northing height class\n1.5 -2.25 3 7\n4.125 5 -6.5 8\n", {"class": [7, 8]}),
        ("# from scan.PCD\n1.5 -2.25 3\n4.125 5 -6.5\n", {}),
        ("Points:=[\n[1.5, -2.25, 3.0], \n[4.125, 5.0, -6.5] \n ];\n", {}),
    ],
)
def test_text(tmp_path: Path, content: str, fields: dict[str, list[float]]) -> None:
    for encoded in (content.encode(), b"\xef\xbb\xbf" + content.encode(), content.encode("utf-16")):
        cloud = read(save(tmp_path, "scan.xyz", encoded))
        assert cloud.points.dtype == np.float64
        assert cloud.points.tolist() == POINTS
        assert {name: values.tolist() for name, values in cloud.fields.items()} == fields
        if "red" in fields:
            assert cloud.fields["red"].dtype == np.uint8


def test_text_longer_than_a_block(tmp_path: Path) -> None:
    table = np.random.default_rng(1).normal(size=(150_000, 4))
    path = tmp_path / "long.csv"
    np.savetxt(path, table, delimiter=",", header="x,y,z,w", comments="", fmt="%.17g")
    seen: list[tuple[int, int]] = []
    cloud = read(path, progress=lambda done, total: seen.append((done, total)))
    np.testing.assert_array_equal(cloud.points, table[:, :3])
    np.testing.assert_array_equal(cloud.fields["w"], table[:, 3])
    size = path.stat().st_size
    assert len(seen) > 2
    assert seen[-1] == (size, size)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_text_with_nan_and_infinity(tmp_path: Path) -> None:
    cloud = read(save(tmp_path, "a.xyz", "nan NaN nan\n0 inf -inf\n1 2 3\n"))
    np.testing.assert_array_equal(cloud.points, [[np.nan] * 3, [0, np.inf, -np.inf], [1, 2, 3]])
    assert cloud.finite.tolist() == [False, False, True]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("0 0 0\n1 2\n1 2 3\n", "line 2: 2 values where 3 are expected"),
        ("0 0 0\n1 2 3 4\n1 2 3\n", "line 2: 4 values where 3 are expected"),
        ("# c\n0 0 0\n\n1 two 3\n1 2 3\n", "line 4: 'two' is not a number"),
        ("0 0 0.5\n1 2 3\n1,5 2 3\n", "with a decimal comma .'1,5'. and with a point .'0.5'."),
        ("0 0 0\n1 2 3 4\n", "line 2: 4 values"),
        ("0 0 0\n1 x 3\n", "line 2: 'x' is not a number"),
        ("0 0\n1 2\n", "2 values where a point needs three"),
        ("hello\nworld\n", "'world' is not a number"),
        ("x y z\n", "line 1: 'x y z' and no numbers"),
        ("# nothing\n", "holds no points"),
        ("A:=[1 2 3];\n", "not a table of points"),
    ],
)
def test_text_that_is_no_table(tmp_path: Path, content: str, line: str) -> None:
    with pytest.raises(FileFormatError, match=line):
        read(save(tmp_path, "a.xyz", content))


def test_text_cut_off_in_its_last_line(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"the last line \(3\) is cut off and was dropped"):
        cloud = read(save(tmp_path, "a.xyz", "0 0 0\n1 2 3\n4 5"))
    assert cloud.points.tolist() == [[0, 0, 0], [1, 2, 3]]
    with pytest.warns(UserWarning, match="cut off and was dropped"):
        assert len(read(save(tmp_path, "b.xyz", "0 0 0\n1 2 3\n4 5 -"))) == 2
    with pytest.warns(UserWarning, match=r"the last line \(2\) has no line end"):
        assert len(read(save(tmp_path, "c.xyz", "0 0 0\n1 2 3"))) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(save(tmp_path, "d.xyz", "0 0 0\n1 2 3\n"))


@pytest.mark.parametrize("kind", ["f4", ">f4", "f8", "i2"])
def test_npy(tmp_path: Path, kind: str) -> None:
    table = np.array([[1, 2, 3, 9], [4, 5, 6, 8]], kind)
    for order in ("C", "F"):
        np.save(tmp_path / "a.npy", np.asarray(table, order=order))
        cloud = read(tmp_path / "a.npy")
        assert cloud.points.tolist() == [[1, 2, 3], [4, 5, 6]]
        assert cloud.points.dtype == (np.float64 if kind == "f8" else np.float32)
        assert cloud.fields["column_4"].tolist() == [9, 8]


def test_structured_npy(tmp_path: Path) -> None:
    rows = np.zeros(2, [("t", "i8"), ("x", "f8"), ("y", "f8"), ("z", "f4"), ("tag", "U3"), ("n", "f4", 3)])
    rows["x"], rows["t"] = [1e-9, 2], [2**62, 1]
    np.save(tmp_path / "a.npy", rows)
    with pytest.warns(UserWarning, match="left out the field 'tag'"):
        cloud = read(tmp_path / "a.npy")
    assert cloud.points.tolist() == [[1e-9, 0, 0], [2, 0, 0]]
    assert cloud.fields["t"].tolist() == [2**62, 1]
    assert cloud.fields["n"].shape == (2, 3)


def test_npz(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, points=np.eye(3)[:2], label=[7, 8], viewpoint=[0, 0, 9], other=np.zeros(5))
    with pytest.warns(UserWarning, match="left out the array 'other'"):
        cloud = read(path)
    assert cloud.points.tolist() == [[1, 0, 0], [0, 1, 0]]
    assert cloud.fields["label"].tolist() == [7, 8]
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [0, 0, 9]
    np.savez(path, x=[1.0], y=[2.0], z=[3.0], label=[4])
    assert read(path).points.tolist() == [[1, 2, 3]]
    np.savez(path, np.eye(3))
    assert read(path).points.tolist() == np.eye(3).tolist()
    np.savez(path, points=np.zeros((1, 3), np.float32), origin=[5e5, 4e6, 0.25])
    assert read(path).points.tolist() == [[5e5, 4e6, 0.25]]


def test_real_scans(shared_data: Path) -> None:
    expected = {
        "surfaces/table_scene_mug.pcd": (307200, 209280),
        "surfaces/lidar_sphere_1.xyz": (19232, 19232),
        "registration/bunny/bun000.ply": (40256, 40256),
        "registration/redkitchen/cloud_bin_0.ply": (258342, 258342),
        "registration/lidar_pair/source.ply": (69792, 69792),
        "labelled_tables/learn0.pcd": (307200, 182292),
        "objects/milk/milk.pcd": (12575, 12575),
        "primitives/fit4cad/PC120.txt": (1500, 1500),
        "survey/samp11-utm.pcd": (38010, 38010),
    }
    for name, (count, finite) in expected.items():
        cloud = read(shared_data / name)
        assert (len(cloud), int(cloud.finite.sum())) == (count, finite), name
    mug = read(shared_data / "surfaces/table_scene_mug.pcd")
    assert mug.grid == (480, 640)
    assert list(mug.fields) == ["red", "green", "blue"]
    ball = shared_data / "surfaces/gym_ball.xyz"
    with pytest.warns(UserWarning, match=r"the last line \(35936\) is cut off"):
        assert len(read(ball)) == 35935
    with pytest.raises(FileFormatError, match="not a table of points"):
        read(shared_data / "primitives/fit4cad/PC120_primitives.txt")


def test_every_cloud_of_the_shared_folder_is_read(shared_data: Path) -> None:
    suffixes = {".ply", ".pcd", ".xyz", ".txt"}
    for path in sorted(path for path in shared_data.rglob("*") if path.suffix in suffixes):
        if path.stem.endswith(("_primitives", "_parametric", "_implicit", "README")):
            with pytest.raises(FileFormatError):
                read(path)
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            cloud = read(path)
        assert cloud.finite.any(), path
