"""The small whole files that mutations start from: a few for each format that can be read.

Formats that surfsig writes get theirs from `surfsig.write`, in the variants of `clouds`; what it does not
write is made by hand in `HAND_MADE`. A format of which neither makes a file is covered by a folder given with
--also.
"""

from __future__ import annotations

import io
import struct
import tempfile
import warnings
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import laspy
import lzf
import meshes
import numpy as np

import surfsig
from surfsig.coordinate_system import CoordinateSystem
from surfsig.files.formats import FORMATS
from surfsig.point_cloud import PointCloud

LARGEST = 100_000
"""Bytes of a file of another folder that is still small: mutations of a larger one seldom meet a header."""

POINTS = np.random.default_rng(1).normal(size=(96, 3)).astype(np.float32)
PCD_FIELDS = "FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
PCD_REST = "WIDTH 12\nHEIGHT 8\nVIEWPOINT 0 0 2 1 0 0 0\nPOINTS 96\nDATA "
ROWS = np.column_stack([POINTS, np.arange(96, dtype=np.float32)])


@dataclass(frozen=True)
class Seed:
    """A whole file: its name, bytes and format, and the options to read it with."""

    name: str
    content: bytes
    format: str
    options: dict[str, Any] = field(default_factory=dict)


def table(delimiter: str = " ", head: str = "") -> bytes:
    """Return the rows as text."""
    text = io.StringIO()
    np.savetxt(text, ROWS, fmt="%.6g", delimiter=delimiter, header=head, comments="")
    return text.getvalue().encode()


def words() -> bytes:
    """Return a table with a title, units, quotes, missing values, and columns of words."""
    head = 'Scan 12,,,,,\nname,X [m],Y [m],Z [m],"class, as text",i\n,[m],[m],[m],,\n'
    rows = [
        f'P{i},{x:.6g},"{y:.6g}",{z:.6g},"a, {i}",{i if i % 3 else "NULL"}\n' for x, y, z, i in ROWS.tolist()
    ]
    return (head + "".join(rows)).encode()


def ptx(columns: int, rows: int) -> bytes:
    """Return a scan of PTX with a pose, and a point that is missing."""
    head = f"{columns}\n{rows}\n1 2 3\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n1 2 3 1\n"
    return head.encode() + table().replace(table().splitlines()[5], b"0 0 0 0.5")


def binary_rows(*more: np.ndarray[Any, Any]) -> bytes:
    """Return rows of float32 without a header: the points and further columns."""
    return np.column_stack([POINTS, *more]).astype("<f4").tobytes()


def ply(data: str) -> bytes:
    """Return a PLY mesh: a list property, and a comment."""
    axes = "".join(f"property float {name}\n" for name in ("x", "y", "z", "intensity"))
    faces = "element face 2\nproperty list uchar int vertex_indices\nproperty uchar flags\n"
    head = (
        f"ply\nformat {data} 1.0\ncomment made by hand\nelement vertex 96\n{axes}{faces}end_header\n".encode()
    )
    if data == "ascii":
        return head + table() + b"3 0 1 2 7\n4 0 1 2 3 9\n"
    order = "<" if "little" in data else ">"
    return (
        head
        + ROWS.astype(order + "f4").tobytes()
        + struct.pack(order + "B3iBB4iB", 3, 0, 1, 2, 7, 4, 0, 1, 2, 3, 9)
    )


def pcd(data: str) -> bytes:
    """Return an organised PCD file with a viewpoint."""
    head = ("# .PCD v0.7\nVERSION 0.7\n" + PCD_FIELDS + PCD_REST + data + "\n").encode()
    if data == "ascii":
        return head + table()
    if data == "binary":
        return head + ROWS.tobytes()
    planes = np.ascontiguousarray(np.round(ROWS.T)).tobytes()
    short: bytes | None = lzf.compress(planes)
    assert short is not None
    return head + struct.pack("<II", len(short), len(planes)) + short


def npy(array: np.ndarray[Any, Any]) -> bytes:
    """Return an array as an NPY file."""
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def npz() -> bytes:
    """Return a compressed archive with a second array."""
    file = io.BytesIO()
    np.savez_compressed(file, points=POINTS, intensity=ROWS[:, 3], colors=np.zeros((96, 3), np.uint8))
    return file.getvalue()


def las(point_format: int, version: str, compressed: bool) -> bytes:
    """Return an LAS or LAZ file of laspy's, with extra bytes."""
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.add_extra_dim(laspy.ExtraBytesParams("raw", "5u1"))
    data = laspy.LasData(header)
    data.xyz = POINTS
    file = io.BytesIO()
    data.write(file, do_compress=compressed)
    return file.getvalue()


def las_of_two_descriptions(compressed: bool) -> bytes:
    """Return a file of point format 6 with its coordinate system as WKT and as GeoTIFF keys.

    Two records describe its extra bytes, and another one behind the points repeats the WKT.
    """
    head, wkt = (
        struct.Struct("<2x16sHQ32x"),
        b'PROJCS["utm",GEOGCS["geo",UNIT["degree",0.01745]],UNIT["m",1]]\0',
    )
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.add_extra_dim(laspy.ExtraBytesParams("first", "u2"))
    second = laspy.LasHeader(point_format=6, version="1.4")
    second.add_extra_dim(laspy.ExtraBytesParams("second", "i4", scales=[0.5], offsets=[1.0]))
    described = second.vlrs[0].record_data_bytes()
    header.add_extra_dim(laspy.ExtraBytesParams("second", "i4"))
    record = header.vlrs[0]
    record.extra_bytes_structs = record.extra_bytes_structs[:1]
    keys = struct.pack("<12H", 1, 1, 0, 2, 1024, 0, 1, 1, 3073, 34737, 4, 0)
    header.vlrs.extend(
        [
            laspy.VLR("LASF_Spec", 4, "", described),
            laspy.VLR("LASF_Projection", 2112, "", wkt),
            laspy.VLR("LASF_Projection", 34735, "", keys),
            laspy.VLR("LASF_Projection", 34737, "", b"utm|\0"),
        ]
    )
    data = laspy.LasData(header)
    data.xyz = POINTS
    file = io.BytesIO()
    data.write(file, do_compress=compressed)
    content = bytearray(file.getvalue())
    struct.pack_into("<QI", content, 235, len(content), 1)
    return bytes(content) + head.pack(b"LASF_Projection", 2112, len(wkt)) + wkt


def pcd_of_others(data: str) -> bytes:
    """Return a PCD file with a header that other programs write: names twice, a COUNT of 0, commas."""
    head = (
        b"# .PCD v.5\nversion .5\ncolumns x, y, z, i, none, i, rgb\nsize 4 4 4 4 8 4 4\ntype f f f f f f i\n"
        b"count 1 1 1 1 0 1 1\nviewpoint 0 0 2 1\npoints 96\n# surfsig origin 1e5 2e6 3\ndata "
    )
    rows = np.column_stack([ROWS, ROWS[:, 3]])
    if data == "ascii":
        lines = (" ".join(f"{value:.6g}" for value in row) + " 4278850810\n" for row in rows)
        return head + b"ascii\n" + "".join(lines).encode()
    return head + b"binary\n" + np.column_stack([rows, rows[:, 0]]).astype("<f4").tobytes()


def obj() -> bytes:
    """Return an OBJ mesh with colours, normals and faces that count from the end."""
    vertices = "".join(f"v {x:.6g} {y:.6g} {z:.6g} 0.5 0 1\n" for x, y, z in POINTS)
    return ("# mesh\no part\n" + vertices + "vn 0 0 1\nvt 0 1\nf 1/1/1 2/1/1 3//1 4\nf -1 -2 -3\n").encode()


def stl_binary() -> bytes:
    """Return a binary STL file of 32 triangles."""
    corners = POINTS.reshape(32, 9)
    rows = b"".join(struct.pack("<12fH", 0, 0, 1, *corner, 0) for corner in corners)
    return b"made by hand".ljust(80, b"\0") + struct.pack("<I", 32) + rows


def stl_ascii() -> bytes:
    """Return an ASCII STL file of 8 triangles."""
    facets = []
    for triangle in POINTS[:24].reshape(8, 3, 3):
        corners = "".join(f"      vertex {x:.6g} {y:.6g} {z:.6g}\n" for x, y, z in triangle)
        facets.append(f"  facet normal 0 0 1\n    outer loop\n{corners}    endloop\n  endfacet\n")
    return ("solid part\n" + "".join(facets) + "endsolid part\n").encode()


def depth_png() -> bytes:
    """Return a PNG image of 12 x 8 depths of 16 bits, in millimetres."""
    depths = np.arange(500, 596, dtype=">u2").reshape(8, 12)
    rows = b"".join(b"\0" + row.tobytes() for row in depths)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", 12, 8, 16, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows)),
        (b"IEND", b""),
    )
    parts = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


HAND_MADE: dict[str, tuple[Callable[[], bytes], dict[str, Any]]] = {
    "ascii.ply": (lambda: ply("ascii"), {}),
    "little.ply": (lambda: ply("binary_little_endian"), {}),
    "big.ply": (lambda: ply("binary_big_endian"), {}),
    "ascii.pcd": (lambda: pcd("ascii"), {}),
    "binary.pcd": (lambda: pcd("binary"), {}),
    "compressed.pcd": (lambda: pcd("binary_compressed"), {}),
    "others ascii.pcd": (lambda: pcd_of_others("ascii"), {}),
    "others binary.pcd": (lambda: pcd_of_others("binary"), {}),
    "space.xyz": (table, {}),
    "head.csv": (lambda: table(",", "x,y,z,intensity"), {}),
    "semicolon.txt": (lambda: table(";").replace(b".", b","), {}),
    "utf16.txt": (lambda: table("\t").decode().encode("utf-16"), {}),
    "float.npy": (lambda: npy(POINTS), {}),
    "fortran.npy": (lambda: npy(np.asfortranarray(POINTS.astype(">f8"))), {}),
    "record.npy": (lambda: npy(ROWS.view([(name, "<f4") for name in ("x", "y", "z", "i")])[:, 0]), {}),
    "compressed.npz": (npz, {}),
    "0.las": (lambda: las(0, "1.2", False), {}),
    "7.las": (lambda: las(7, "1.4", False), {}),
    "3.laz": (lambda: las(3, "1.2", True), {}),
    "8.laz": (lambda: las(8, "1.4", True), {"box": [[-1e9] * 3, [1e9] * 3]}),
    "described.las": (lambda: las_of_two_descriptions(False), {}),
    "described.laz": (lambda: las_of_two_descriptions(True), {}),
    "mesh.obj": (obj, {}),
    "sampled.obj": (obj, {"samples": 50}),
    "binary.stl": (stl_binary, {}),
    "ascii.stl": (stl_ascii, {}),
    **meshes.MADE,
    "depth.png": (depth_png, {"intrinsics": (10.0, 10.0, 6.0, 4.0)}),
    "words.csv": (words, {}),
    "columns.csv": (words, {"columns": "_,x,y,z,_,i"}),
    "comma.txt": (lambda: table().replace(b".", b","), {}),
    "windows.xyz": (lambda: b"% made by hand\n" + table().replace(b"95\n", b"1.#QNAN\n"), {}),
    "one.pts": (lambda: b"96\n" + table(), {}),
    "two.pts": (lambda: b"96\n" + table() + b"96\n" + table(), {"scan": 1}),
    "named.pts": (lambda: b"//X;Y;Z;Scalar field\n96\n" + table(";"), {}),
    "one.ptx": (lambda: ptx(8, 12), {}),
    "two.ptx": (lambda: ptx(8, 12) + ptx(96, 1), {}),
    "chosen.ptx": (lambda: ptx(8, 12) + ptx(96, 1), {"scan": 1}),
    "kitti.bin": (lambda: np.abs(ROWS).tobytes(), {}),
    "three.bin": (lambda: (POINTS * np.array([30, 10, 0.1], np.float32)).tobytes(), {}),
    "five.bin": (lambda: binary_rows(ROWS[:, 3] % 7, ROWS[:, 3] % 16), {}),
    "six.bin": (lambda: binary_rows(*3 * [ROWS[:, 3]]), {}),
    "named.bin": (lambda: ROWS.tobytes(), {"columns": "x,y,z,_"}),
    "named.npy": (lambda: npy(ROWS), {"columns": "x,y,z,i"}),
}  # fmt: skip


def clouds() -> dict[str, PointCloud]:
    """Return the clouds that are written in every format: bare, far away with fields, organised."""
    fields: dict[str, Any] = {
        "intensity": np.arange(96, dtype=np.uint16),
        **{color: np.arange(96, dtype=np.uint8) for color in ("red", "green", "blue")},
        "wide": POINTS.astype(np.float64),
    }
    origin = np.array([4e5, 5e6, 100.0])
    system = CoordinateSystem.from_wkt('PROJCS["utm",UNIT["metre",1]]')
    return {
        "bare": PointCloud(POINTS),
        "far": PointCloud(
            POINTS.astype(np.float64),
            origin=origin,
            fields=fields,
            viewpoint=origin,
            coordinate_system=system,
        ),
        "grid": PointCloud(POINTS, grid=(8, 12), viewpoint=np.zeros(3)),
    }


def contents(also: Path | None) -> Iterator[tuple[str, bytes, dict[str, Any], bool]]:
    """Give name, bytes, options, and whether today's surfsig must be able to read it."""
    with tempfile.TemporaryDirectory() as folder:
        for kind in FORMATS:
            for extension in kind.extensions if kind.write is not None else ():
                for name, cloud in clouds().items():
                    path = Path(folder) / f"{name}{extension}"
                    with warnings.catch_warnings():
                        warnings.simplefilter("ignore")
                        surfsig.write(path, cloud, {"scores": ROWS}, notes={"made": "for fuzzing"})
                    yield path.name, path.read_bytes(), {}, True
    for name, (make, options) in HAND_MADE.items():
        yield name, make(), options, False
    for path in sorted(also.rglob("*")) if also is not None else ():
        if path.is_file() and 0 < path.stat().st_size <= LARGEST:
            yield path.name, path.read_bytes(), {}, False


def seeds(also: Path | None = None) -> list[Seed]:
    """Return all whole files that `surfsig.read` reads, each with the format that it recognises.

    Parameters
    ----------
    also
        A folder whose small files are added; those that are no point clouds are passed over.
    """
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for name, content, options, must in contents(also):
            path = Path(folder) / name
            path.write_bytes(content)
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    surfsig.read(path, **options)
            except surfsig.SurfsigError:
                # A format made by hand that this version does not read yet.
                if must:
                    raise
                continue
            found.append(Seed(name, content, surfsig.files.format_name(path), options))
    return found


def without_seeds(corpus: list[Seed]) -> list[str]:
    """Return the readable formats of which the corpus has no file."""
    covered = {seed.format for seed in corpus}
    return [kind.name for kind in FORMATS if kind.read is not None and kind.name not in covered]
