"""Coordinate systems: what a text or GeoTIFF keys say about name and unit, and that they are kept."""

import builtins
import io
import struct
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest

import surfsig
from surfsig.cloud_transforms import transform_cloud
from surfsig.coordinate_system import CoordinateSystem, GeoKeys
from surfsig.files import read, write
from surfsig.point_cloud import PointCloud

GEOGCS = (
    'GEOGCS["NAD83",DATUM["North_American_Datum_1983",SPHEROID["GRS 1980",6378137,298.257222101]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]'
)
AXES = 'AXIS["Easting",EAST],AXIS["Northing",NORTH]'
UTM = f'PROJCS["NAD83 / UTM zone 18N",{GEOGCS},PROJECTION["Transverse_Mercator"],UNIT["metre",1],{AXES}]'
NEW_YORK = UTM.replace("NAD83 / UTM zone 18N", "NAD83 / New York (ftUS)").replace(
    'UNIT["metre",1]', 'UNIT["US survey foot",0.304800609601219]'
)
ROUND_BRACKETS = NEW_YORK.replace("[", "(").replace("]", ")")
HEIGHT = (
    'VERT_CS["NAVD88 height (ftUS)",VERT_DATUM["NAVD88",2005],UNIT["Foot_US",0.304800609601219],AXIS["H",UP]]'
)
FEET_OF_HEIGHT = f'COMPD_CS["NAD83 / UTM 18N + NAVD88 (ftUS)",{UTM},{HEIGHT}]'
WKT2 = """PROJCRS["ETRS89 / UTM zone 32N",
  BASEGEOGCRS["ETRS89",DATUM["ETRS89",ELLIPSOID["GRS 1980",6378137,298.257,LENGTHUNIT["metre",1]]],
    PRIMEM["Greenwich",0,ANGLEUNIT["degree",0.0174532925199433]]],
  CONVERSION["UTM zone 32N",METHOD["Transverse Mercator"],
    PARAMETER["Latitude of natural origin",0,ANGLEUNIT["degree",0.0174532925199433]]],
  CS[Cartesian,2],AXIS["(E)",east,ORDER[1],LENGTHUNIT["foot",0.3048]],
  AXIS["(N)",north,ORDER[2],LENGTHUNIT["foot",0.3048]],ID["EPSG",25832]]"""
GEODETIC = (
    'GEODCRS["WGS 84",DATUM["WGS84",ELLIPSOID["WGS 84",6378137,298.257,LENGTHUNIT["metre",1]]],CS[{}],{}]'
)
LATITUDE = 'AXIS["latitude",north,ANGLEUNIT["degree",0.0174532925199433]]'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (UTM, ("NAD83 / UTM zone 18N", "metre", None, False)),
        (NEW_YORK, ("NAD83 / New York (ftUS)", "US survey foot", None, False)),
        (ROUND_BRACKETS, ("NAD83 / New York (ftUS)", "US survey foot", None, False)),
        (FEET_OF_HEIGHT, ("NAD83 / UTM 18N + NAVD88 (ftUS)", "metre", "US survey foot", False)),
        (f"{UTM},{HEIGHT}", ("NAD83 / UTM zone 18N", "metre", "US survey foot", False)),
        (GEOGCS, ("NAD83", "degree", None, True)),
        (GEOGCS.replace("0.0174532925199433", "0.0174532925"), ("NAD83", "degree", None, True)),
        (WKT2, ("ETRS89 / UTM zone 32N", "foot", None, False)),
        (GEODETIC.format("ellipsoidal,2", LATITUDE), ("WGS 84", "degree", None, True)),
        (GEODETIC.format("Cartesian,3", 'LENGTHUNIT["metre",1]'), ("WGS 84", "metre", None, False)),
        (f'BOUNDCRS[SOURCECRS[{UTM}],TARGETCRS[{GEOGCS}]]', ("NAD83 / UTM zone 18N", "metre", None, False)),
        ('LOCAL_CS["site ""A""",UNIT["millimetre",0.001]]', ('site "A"', "millimetre", None, False)),
        ('PROJCS["no unit",AXIS["x",EAST]]', ("no unit", None, None, False)),
        ('PROJCS["odd unit",UNIT["metre","one"]]', ("odd unit", None, None, False)),
        (UTM[:-1], (None, None, None, False)),
        (UTM + "]", (None, None, None, False)),
        ("[" * 5000, (None, None, None, False)),
        ("A[" * 5000 + "]" * 5000, (None, None, None, False)),
        ('PROJCS["cut off', (None, None, None, False)),
        ("", (None, None, None, False)),
    ],
)  # fmt: skip
def test_what_a_text_says(text: str, expected: tuple[Any, ...]) -> None:
    system = CoordinateSystem.from_wkt(text)
    assert (system.name, system.unit, system.vertical_unit, system.is_geographic) == expected
    assert system.wkt == text


def test_every_kind_of_text_as_pyproj_reads_it() -> None:
    pyproj = pytest.importorskip("pyproj")
    for code in (2263, 32618, 25832, 4326, 4979, 4978, 5972, 8360, 2225, 6360, 3857, 27700, 21781):
        crs = pyproj.CRS.from_epsg(code)
        for version in ("WKT1_GDAL", "WKT2_2019", "WKT2_2015"):
            try:
                text = crs.to_wkt(version)
            except pyproj.exceptions.CRSError:
                continue
            system = CoordinateSystem.from_wkt(text)
            if len(crs.axis_info) == 1:
                assert (system.unit, system.vertical_unit) == (None, "US survey foot")
                continue
            assert (system.unit, system.is_geographic) == (crs.axis_info[0].unit_name, crs.is_geographic), (
                code
            )
            if len(crs.axis_info) > 2 and not crs.is_geocentric:
                assert system.vertical_unit == crs.axis_info[2].unit_name, code


def keys(*entries: tuple[int, int, int, int], doubles: bytes = b"", text: bytes = b"") -> GeoKeys:
    head = struct.pack("<4H", 1, 1, 0, len(entries))
    return GeoKeys(head + b"".join(struct.pack("<4H", *entry) for entry in entries), doubles, text)


def number(key: int, value: int) -> tuple[int, int, int, int]:
    return (key, 0, 1, value)


PROJECTED, GEOGRAPHIC = number(1024, 1), number(1024, 2)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (keys(PROJECTED, number(3072, 32618)), ("EPSG:32618", "metre", None, False)),
        (keys(PROJECTED, number(3072, 26918), number(3076, 9001)), ("EPSG:26918", "metre", None, False)),
        (keys(PROJECTED, number(3076, 9003), number(4099, 9001)), (None, "US survey foot", "metre", False)),
        (keys(PROJECTED, number(3076, 9002)), (None, "foot", None, False)),
        (
            keys(PROJECTED, (3076, 0, 1, 32767), (3077, 34736, 1, 1), doubles=struct.pack("<2d", 7, 0.001)),
            (None, "0.001 metres", None, False),
        ),
        (keys(PROJECTED, number(3076, 9500)), (None, None, None, False)),
        (
            keys(PROJECTED, number(3072, 32767), (3073, 34737, 9, 5), text=b"rest|site B  |x|\0"),
            ("site B", None, None, False),
        ),
        (keys(GEOGRAPHIC, number(2048, 4326)), ("EPSG:4326", "degree", None, True)),
        (keys(number(2048, 4326)), ("EPSG:4326", "degree", None, True)),
        (keys(GEOGRAPHIC, number(2054, 9101)), (None, "radian", None, True)),
        (GeoKeys(struct.pack("<8H", 1, 1, 0, 9999, *GEOGRAPHIC)), (None, "degree", None, True)),
    ],
)  # fmt: skip
def test_what_geotiff_keys_say(given: GeoKeys, expected: tuple[Any, ...]) -> None:
    system = CoordinateSystem.from_geo_keys(given)
    assert (system.name, system.unit, system.vertical_unit, system.is_geographic) == expected
    assert CoordinateSystem.from_text(system.to_text()) == system


@pytest.mark.parametrize("broken", [b"", b"\1", bytes(7), bytes(8), struct.pack("<4H", 1, 1, 0, 3)])
def test_keys_that_are_none(broken: bytes) -> None:
    assert GeoKeys(broken).is_empty


def test_a_unit_that_only_the_number_of_the_system_says(monkeypatch: pytest.MonkeyPatch) -> None:
    given = keys(PROJECTED, number(3072, 2263))
    with monkeypatch.context() as patch:
        without_pyproj(patch)
        assert CoordinateSystem.from_geo_keys(given).unit is None
    pytest.importorskip("pyproj")
    assert CoordinateSystem.from_geo_keys(given).unit == "US survey foot"


def without_pyproj(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def refuses(name: str, *rest: Any, **more: Any) -> Any:
        if name.partition(".")[0] == "pyproj":
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", refuses)


@pytest.mark.parametrize("text", ["", "no system", "GeoTIFF:", "GeoTIFF:*:*:*", "GeoTIFF:AAAA"])
def test_text_that_is_no_system(text: str) -> None:
    assert CoordinateSystem.from_text(text) is None


# Files.

WKT_RECORD, KEY_RECORDS = 2112, (34735, 34736, 34737)
GIVEN_KEYS = keys(
    PROJECTED, number(3072, 26918), (3073, 34737, 21, 0), number(3076, 9001),
    doubles=struct.pack("<d", 0.5), text=b"NAD83 / UTM zone 18N|\0",
)  # fmt: skip


def las_with(*records: laspy.VLR, point_format: int = 3, version: str = "1.2", wkt: bool = False) -> bytes:
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.global_encoding.wkt = wkt
    header.vlrs.extend(records)
    data = laspy.LasData(header)
    data.xyz = np.array([[500_000.25, 4_500_000.5, 10.75], [500_001.0, 4_500_002.0, 11.0]])
    file = io.BytesIO()
    data.write(file)
    return file.getvalue()


def projection(record: int, data: bytes) -> laspy.VLR:
    return laspy.VLR("LASF_Projection", record, "", data)


def key_records(given: GeoKeys = GIVEN_KEYS) -> list[laspy.VLR]:
    return [
        projection(record, data)
        for record, data in zip(KEY_RECORDS, (given.directory, given.doubles, given.text), strict=True)
    ]


def read_quietly(path: Path, **options: Any) -> PointCloud:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(path, **options)


def projection_records(path: Path) -> dict[int, bytes]:
    with laspy.open(path) as file:
        return {
            record.record_id: bytes(record.record_data_bytes())
            for record in file.header.vlrs
            if record.user_id == "LASF_Projection"
        }


@pytest.mark.parametrize("extension", ["las", "laz"])
@pytest.mark.parametrize("text", [UTM, WKT2, f"{UTM},{HEIGHT}"])
def test_wkt_goes_from_las_to_las(tmp_path: Path, extension: str, text: str) -> None:
    (tmp_path / "in.las").write_bytes(
        las_with(projection(WKT_RECORD, text.encode() + b"\0"), point_format=7, version="1.4", wkt=True)
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cloud = read(tmp_path / "in.las")
        assert cloud.coordinate_system is not None
        assert cloud.coordinate_system.wkt == text
        write(tmp_path / f"out.{extension}", cloud)
        assert read(tmp_path / f"out.{extension}").coordinate_system == cloud.coordinate_system
    assert projection_records(tmp_path / f"out.{extension}")[WKT_RECORD].rstrip(b"\0") == text.encode()
    with laspy.open(tmp_path / f"out.{extension}") as file:
        assert file.header.global_encoding.wkt


def test_wkt_behind_the_points(tmp_path: Path) -> None:
    content = bytearray(las_with(point_format=6, version="1.4", wkt=True))
    struct.pack_into("<QI", content, 235, len(content), 2)
    head = struct.Struct("<2x16sHQ32x")
    content += head.pack(b"somebody", 1, 5) + b"hello"
    content += head.pack(b"LASF_Projection", WKT_RECORD, len(UTM)) + UTM.encode()
    (tmp_path / "a.las").write_bytes(content)
    system = read_quietly(tmp_path / "a.las").coordinate_system
    assert system == CoordinateSystem.from_wkt(UTM)
    # Records of absurd sizes are passed over.
    for place, kind, value in ((239 + 4, "I", 10**9), (len(content) - len(UTM) - 40, "Q", 2**63)):
        broken = bytearray(content)
        struct.pack_into("<" + kind, broken, place, value)
        (tmp_path / "a.las").write_bytes(broken)
        assert len(read_quietly(tmp_path / "a.las")) == 2


@pytest.mark.parametrize("name", ["formats/1_4_w_evlr.laz", "formats/simple.copc.laz"])
def test_real_files_keep_their_system(shared_data: Path, tmp_path: Path, name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cloud = read(shared_data / name)
        write(tmp_path / "a.laz", cloud)
        again = read(tmp_path / "a.laz")
    assert cloud.coordinate_system is not None
    assert cloud.coordinate_system.name is not None
    assert again.coordinate_system == cloud.coordinate_system


def test_the_bit_of_the_header_says_which_system_counts(tmp_path: Path) -> None:
    records = [projection(WKT_RECORD, NEW_YORK.encode()), *key_records()]
    for wkt, unit in ((True, "US survey foot"), (False, "metre")):
        (tmp_path / "a.las").write_bytes(las_with(*records, point_format=1, version="1.4", wkt=wkt))
        system = read_quietly(tmp_path / "a.las").coordinate_system
        assert system is not None
        assert system.unit == unit


def test_text_that_is_broken_beside_keys_that_are_not(tmp_path: Path) -> None:
    broken = projection(WKT_RECORD, b"PROJCS[")
    for records, name in (([broken, *key_records()], "NAD83 / UTM zone 18N"), ([broken], None)):
        (tmp_path / "a.las").write_bytes(las_with(*records, point_format=6, version="1.4", wkt=True))
        system = read_quietly(tmp_path / "a.las").coordinate_system
        assert system is not None
        assert system.name == name


def test_geotiff_keys_become_wkt(tmp_path: Path) -> None:
    pyproj = pytest.importorskip("pyproj")
    (tmp_path / "in.las").write_bytes(las_with(*key_records()))
    cloud = read_quietly(tmp_path / "in.las")
    assert cloud.coordinate_system is not None
    assert cloud.coordinate_system.name == "NAD83 / UTM zone 18N"
    assert cloud.coordinate_system.geo_keys == GIVEN_KEYS
    write(tmp_path / "out.las", cloud)
    assert list(projection_records(tmp_path / "out.las")) == [WKT_RECORD]
    with laspy.open(tmp_path / "out.las") as file:
        assert file.header.parse_crs() == pyproj.CRS.from_epsg(26918)


@pytest.mark.parametrize("unknown", [False, True])
def test_geotiff_keys_that_cannot_become_wkt_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, unknown: bool
) -> None:
    # A unit other than that of the number says that the number is not the whole truth.
    given = keys(PROJECTED, number(3072, 26918), number(3076, 9003)) if unknown else GIVEN_KEYS
    (tmp_path / "in.las").write_bytes(las_with(*key_records(given)))
    if not unknown:
        without_pyproj(monkeypatch)
    cloud = read_quietly(tmp_path / "in.las")
    with pytest.warns(UserWarning, match="is written as GeoTIFF keys, as it was read"):
        write(tmp_path / "out.laz", cloud)
    assert read_quietly(tmp_path / "out.laz").coordinate_system == cloud.coordinate_system
    with laspy.open(tmp_path / "out.laz") as file:
        assert not file.header.global_encoding.wkt


@pytest.mark.parametrize("extension", ["pcd", "npz", "parquet"])
@pytest.mark.parametrize("text", [UTM, WKT2, None])
def test_other_formats_keep_it_on_the_way(tmp_path: Path, extension: str, text: str | None) -> None:
    if extension == "parquet":
        pytest.importorskip("pyarrow")
    system = CoordinateSystem.from_geo_keys(GIVEN_KEYS) if text is None else CoordinateSystem.from_wkt(text)
    path = tmp_path / f"a.{extension}"
    write(path, PointCloud(np.eye(3), coordinate_system=system))
    again = read_quietly(path).coordinate_system
    assert again is not None
    assert (again.name, again.unit, again.geo_keys) == (system.name, system.unit, system.geo_keys)
    write(tmp_path / "b.las", replace(read_quietly(path), offsets=np.eye(3)))
    last = read_quietly(tmp_path / "b.las").coordinate_system
    assert last is not None
    assert (last.name, last.unit) == (system.name, system.unit)


def test_it_goes_with_the_points_and_not_with_points_that_are_moved() -> None:
    system = CoordinateSystem.from_wkt(UTM)
    cloud = PointCloud(np.random.default_rng(3).normal(size=(500, 3)), coordinate_system=system)
    assert cloud.at([1, 2]).coordinate_system == system
    assert surfsig.crop(cloud, [[-1] * 3, [1] * 3]).coordinate_system == system
    assert surfsig.files.options.in_metres(cloud, 0.3048).coordinate_system is None
    assert transform_cloud(np.eye(4), cloud).coordinate_system is None
    assert surfsig.downsample(cloud, 0.5).coordinate_system == system


# What is told.


def with_text(folder: Path, text: str) -> Path:
    path = folder / "a.las"
    record = projection(WKT_RECORD, text.encode())
    path.write_bytes(las_with(record, point_format=6, version="1.4", wkt=True))
    return path


def test_degrees_are_no_lengths(tmp_path: Path) -> None:
    path = with_text(tmp_path, GEOGCS)
    with pytest.warns(
        UserWarning, match="are in degrees, which are no lengths: radius and curvature have no"
    ):
        read(path)
    with pytest.warns(UserWarning, match="were taken for m, but its coordinate system says degree"):
        read(path, unit="m")


def test_a_unit_that_contradicts_the_file(tmp_path: Path) -> None:
    path = with_text(tmp_path, NEW_YORK)
    for unit in ("m", "ft", "mm"):
        with pytest.warns(
            UserWarning, match=f"taken for {unit}, but its coordinate system says US survey foot"
        ):
            read(path, unit=unit)
    cloud = read_quietly(path, unit="us-ft")
    np.testing.assert_allclose(cloud.points[0], np.array([500_000.25, 4_500_000.5, 10.75]) * 1200 / 3937)
    assert cloud.coordinate_system is None
    assert read_quietly(with_text(tmp_path, UTM), unit="m").coordinate_system is not None


def test_heights_in_another_unit(tmp_path: Path) -> None:
    with pytest.warns(
        UserWarning, match="its x and y are in the unit metre, its z in the unit US survey foot"
    ):
        read(with_text(tmp_path, FEET_OF_HEIGHT))


def test_info_shows_the_system(shell: Callable[..., Any], tmp_path: Path) -> None:
    path = with_text(tmp_path, UTM)
    finished = shell("info", path)
    assert (finished.code, finished.err) == (0, "")
    assert "coordinate system  NAD83 / UTM zone 18N, unit: metre\n" in finished.out
    finished = shell("info", with_text(tmp_path, FEET_OF_HEIGHT), "--json")
    assert '"unit": "metre", "vertical_unit": "US survey foot", "is_geographic": false}' in finished.out
    assert "its z in the unit US survey foot" in finished.err
    finished = shell("info", with_text(tmp_path, NEW_YORK))
    assert "are in feet (US survey foot); --unit us-ft reads it as metres" in finished.err
    finished = shell("info", with_text(tmp_path, NEW_YORK), "--unit", "us-ft")
    assert (finished.err, "coordinate system  not known" in finished.out) == ("", True)
    finished = shell("info", with_text(tmp_path, GEOGCS))
    assert "are in degrees, which are no lengths" in finished.err
