"""The C interface: the values are Python's, bit for bit; nothing that C can do wrong is a crash."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from ctypes import byref, c_size_t, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from c_interface import COLUMNS, SIGNATURE, CInterface, Failed, Options, address
from numpy.typing import NDArray
from surface_points import UTM, rough_surface

import surfsig

ROOT = Path(__file__).parents[1]
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
RADIUS = 0.3
INVALID_INPUT = 1

IN_C = """
#include <surfsig.h>
#include <stdio.h>
int main(void) {
  surfsig_extraction *extraction = NULL;
  surfsig_code code = surfsig_extract_f32(NULL, 0, 12, NULL, 0.0, NULL, &extraction);
  printf("%s\\n%d\\n%s\\n%d\\n", surfsig_version(), code == SURFSIG_CODE_INVALID_INPUT, surfsig_last_error(),
         extraction == NULL && surfsig_extraction_status(extraction) == NULL);
  return 0;
}
"""

IN_CPP = """
#include <surfsig.hpp>
#include <cstdio>
struct Wide { float intensity; double x, y, z; };
int main() {
  const double origin[3] = {500000.0, 4500000.0, 0.0};
  std::vector<Wide> wide;
  for (int i = 0; i < 900; ++i) wide.push_back({0.0f, i % 30 * 0.1, i / 30 * 0.1, 3.0});
  const auto found = surfsig::extract(wide, 0.55, surfsig::Options().indices({464}).threads(1), origin);
  std::printf("%zu %u %.3f\\n", found.size(), found.count()[0], found.normals()[2]);
  std::vector<surfsig_status> statuses;
  const auto none = surfsig::extract(std::vector<Wide>(), 0.5);
  std::printf("%zu %zu %zu\\n", none.size(), none.k1().size(), none.signatures({}, &statuses).size());
  try {
    found.signatures({1}, &statuses);
  } catch (const surfsig::Error &error) {
    std::printf("%d %s\\n", error.code == SURFSIG_CODE_INVALID_INPUT, error.what());
  }
}
"""


def run(*command: object) -> str:
    finished = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stdout + finished.stderr
    return finished.stdout


@pytest.fixture(scope="session")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that the C interface was installed into."""
    if sys.platform == "win32":
        pytest.skip("these tests call compilers in the way of Unix")
    for tool in ("cargo", "cmake", "cc", "c++"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    build, prefix = tmp_path_factory.mktemp("build"), tmp_path_factory.mktemp("prefix")
    run("cmake", "-S", ROOT / "crates" / "surfsig-c", "-B", build)
    run("cmake", "--build", build)
    run("cmake", "--install", build, "--prefix", prefix)
    return prefix


@pytest.fixture(scope="session")
def c(installed: Path) -> CInterface:
    return CInterface(installed / "lib" / f"libsurfsig_c.{'dylib' if sys.platform == 'darwin' else 'so'}")


@contextmanager
def extracted(c: CInterface, points: NDArray[Any], radius: float = RADIUS, **how: Any) -> Iterator[c_void_p]:
    """Extract from the rows of an array, whatever their distance."""
    precision = "f64" if points.dtype == np.float64 else "f32"
    made = c.extract(address(points), len(points), points.strides[0], radius, precision=precision, **how)
    try:
        yield made
    finally:
        c.functions.surfsig_extraction_free(made)


def assert_equal_columns(columns: dict[str, NDArray[Any]], expected: surfsig.Extraction) -> None:
    for name in COLUMNS:
        np.testing.assert_array_equal(columns[name], getattr(expected, name), err_msg=name)


@pytest.fixture(scope="module")
def points() -> NDArray[np.float32]:
    """A rough surface with a point that is none."""
    array = rough_surface(61).astype(np.float32)
    array[17, 1] = np.nan
    return array


def output_of(source: Path, text: str, installed: Path, compiler: str, standard: str) -> list[str]:
    """Compile a program without a warning, run it, and return its lines."""
    source.write_text(text)
    program, library = source.with_suffix(""), installed / "lib"
    run(
        *(compiler, f"-std={standard}", *STRICT, f"-I{installed / 'include'}", source, "-o", program),
        *(f"-L{library}", "-lsurfsig_c", f"-Wl,-rpath,{library}"),
    )
    return run(program).splitlines()


def test_a_program_in_c11(installed: Path, tmp_path: Path) -> None:
    version, refused, message, nothing = output_of(tmp_path / "main.c", IN_C, installed, "cc", "c11")
    assert version == surfsig.__version__
    assert message == "a radius or voxel must be a finite number from 1e-18 to 1e18, not 0e0"
    assert (refused, nothing) == ("1", "1")


@pytest.mark.parametrize("standard", ["c++14", "c++20"])
def test_a_program_in_cpp(installed: Path, tmp_path: Path, standard: str) -> None:
    one, none, refused = output_of(tmp_path / "main.cpp", IN_CPP, installed, "c++", standard)
    # The points of a square lattice within 5.5 steps.
    within = sum(i * i + j * j < 5.5**2 for i in range(-5, 6) for j in range(-5, 6))
    assert one == f"1 {within} 1.000"
    assert none == "0 0 0"
    assert refused == "1 place 1 is outside an extraction of 1 places"


@pytest.mark.parametrize("target", ["surfsig", "static"])
def test_the_example(installed: Path, tmp_path: Path, target: str) -> None:
    shutil.copytree(ROOT / "examples" / "cpp", tmp_path / "cpp")
    listing = tmp_path / "cpp" / "CMakeLists.txt"
    listing.write_text(listing.read_text().replace("surfsig::surfsig", f"surfsig::{target}"))
    build = tmp_path / "build"
    flags = " ".join(STRICT)
    run(
        *("cmake", "-S", tmp_path / "cpp", "-B", build),
        *(f"-DCMAKE_PREFIX_PATH={installed}", f"-DCMAKE_CXX_FLAGS={flags}"),
    )
    run("cmake", "--build", build)
    first, _, *rows = [line.split() for line in run(build / "sphere").splitlines()]
    assert first == ["surfsig", surfsig.__version__]
    k1, k2, zeta = ([float(row[i]) for row in rows] for i in (1, 2, 5))
    # Radius 0.1: 10 per metre, and a ball of a twelfth of that gives 0.2 % too much.
    assert k1 == pytest.approx([10, 10, 10], rel=0.003)
    assert k2 == pytest.approx([10, 10, -10], rel=0.003)
    sphere, saddle = (
        surfsig.Frame.default().signatures_of_curvatures(
            np.array([10], np.float32), np.array([other], np.float32), side=2 * 0.008
        )[0][0]
        for other in (10, -10)
    )
    assert zeta == pytest.approx([1, 1, surfsig.similarity(sphere, saddle)], abs=0.005)


@pytest.mark.parametrize("stride", [12, 16, 48, 13])
def test_values_at_any_stride(c: CInterface, points: NDArray[np.float32], stride: int) -> None:
    # Behind one byte that belongs to nobody, so that a stride of 13 is misaligned from the start.
    shift = 1 if stride == 13 else 0
    memory = np.full(shift + stride * len(points), 0xA5, np.uint8)
    rows = np.ndarray((len(points), 12), np.uint8, memory, shift, (stride, 1))
    rows[:] = points.view(np.uint8)
    made = c.extract(address(rows), len(points), stride, RADIUS)
    assert_equal_columns(c.columns(made), surfsig.extract(points, RADIUS))
    c.functions.surfsig_extraction_free(made)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_values_with_an_origin(c: CInterface, points: NDArray[np.float32], dtype: Any) -> None:
    offsets = points.astype(dtype)
    expected = surfsig.extract(surfsig.PointCloud(offsets, origin=UTM), RADIUS)
    with extracted(c, offsets, origin=UTM) as made:
        assert_equal_columns(c.columns(made), expected)


@pytest.mark.parametrize(("number", "axes"), [(0, "surface"), (1, "sensor")])
def test_values_with_all_options(c: CInterface, points: NDArray[np.float32], number: int, axes: Any) -> None:
    at = np.array([5, 17, 900, 5], np.uint32)
    viewpoint = [0.5, -0.25, -3.0]
    options = Options(axes=number, viewpoint=viewpoint, threads=2, indices=at)
    expected = surfsig.extract(points, RADIUS, axes=axes, viewpoint=viewpoint, at=at)
    with extracted(c, points, options=options) as made:
        assert_equal_columns(c.columns(made), expected)
        rows, statuses = c.signatures(made, None, 4)
        expected_rows, expected_statuses = expected.signatures(return_status=True)
        np.testing.assert_array_equal(rows, expected_rows)
        np.testing.assert_array_equal(statuses, expected_statuses)


def test_signatures_of_chosen_places(c: CInterface, points: NDArray[np.float32]) -> None:
    # A tip of radius 1/24, which is outside the vocabulary.
    x, y = np.meshgrid(*[np.linspace(-0.1, 0.1, 15)] * 2)
    tip = np.column_stack([x.ravel() + 5, y.ravel(), -12 * (x**2 + y**2).ravel()])
    cloud = np.vstack([points, tip]).astype(np.float32)
    places = np.array([len(points) + 112, 17, 3, 3], np.uint32)
    expected, expected_statuses = surfsig.extract(cloud, RADIUS).signatures(places, return_status=True)
    with extracted(c, cloud) as made:
        rows, statuses = c.signatures(made, places, 4)
        # Statuses need not be asked for.
        again = np.zeros((4, SIGNATURE), np.float32)
        f = c.functions
        c.check(f.surfsig_signatures(made, address(places), c_size_t(4), address(again), c_void_p()))
    np.testing.assert_array_equal(rows, expected)
    np.testing.assert_array_equal(again, expected)
    np.testing.assert_array_equal(statuses, expected_statuses)
    assert [surfsig.Status(s).name for s in statuses] == ["OUTSIDE_VOCABULARY", "NOT_FINITE", "OK", "OK"]
    zeta = f.surfsig_similarity(address(rows[2]), address(rows[3]))
    assert zeta == 1.0
    assert np.isnan(f.surfsig_similarity(address(rows[1]), address(rows[2])))


def test_no_point_and_no_place(c: CInterface, points: NDArray[np.float32]) -> None:
    empty = c.extract(c_void_p(), 0, 0, RADIUS)
    assert all(len(column) == 0 for column in c.columns(empty).values())
    assert len(c.signatures(empty, None, 0)[0]) == 0
    c.functions.surfsig_extraction_free(empty)
    with extracted(c, points, options=Options(indices=np.zeros(0, np.uint32))) as made:
        assert c.functions.surfsig_extraction_size(made) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 0.0}, "radius"),
        ({"radius": -1.0}, "radius"),
        ({"radius": float("nan")}, "radius"),
        ({"first": c_void_p()}, "points must not be null"),
        ({"stride": 11}, "stride must be at least 12 bytes, not 11"),
        ({"stride": 0}, "stride must be at least 12 bytes, not 0"),
        ({"stride": 2**62}, "more than memory can hold"),
        ({"count": 2**63}, "more than memory can hold"),
        ({"precision": "f64"}, "stride must be at least 24 bytes, not 12"),
        ({"origin": [0.0, np.inf, 0.0]}, "origin must be finite"),
        ({"options": Options(viewpoint=[np.nan, 0.0, 0.0])}, "viewpoint must be finite"),
        ({"options": Options(axes=2)}, "axes must be a surfsig_axes, not 2"),
        ({"options": Options(axes=-1)}, "axes must be a surfsig_axes, not -1"),
        ({"options": Options(threads=1025)}, "threads must be 0 to 1024, not 1025"),
        ({"options": Options(indices=np.array([1200], np.uint32))}, "index 1200 is outside a cloud of 1200"),
    ],
    ids=str,
)
def test_bad_arguments(
    c: CInterface, points: NDArray[np.float32], change: dict[str, Any], message: str
) -> None:
    arguments = {"first": address(points), "count": len(points), "stride": 12, "radius": RADIUS, **change}
    with pytest.raises(Failed, match=message) as caught:
        c.extract(**arguments)
    assert str(caught.value).startswith(f"{INVALID_INPUT}: ")
    assert "\n" not in str(caught.value)


def test_null_everywhere(c: CInterface, points: NDArray[np.float32]) -> None:
    f, null = c.functions, c_void_p()
    assert f.surfsig_extraction_size(null) == 0
    assert not any(getattr(f, f"surfsig_extraction_{name}")(null) for name in COLUMNS)
    f.surfsig_extraction_free(null)
    f.surfsig_options_free(null)
    assert f.surfsig_options_set_axes(null, 0) == INVALID_INPUT
    assert f.surfsig_options_set_threads(null, 0) == INVALID_INPUT
    assert f.surfsig_options_set_viewpoint(null, null) == INVALID_INPUT
    assert f.surfsig_options_set_indices(null, null, c_size_t(3)) == INVALID_INPUT
    assert np.isnan(f.surfsig_similarity(null, null))
    assert f.surfsig_signatures(null, null, c_size_t(1), null, null) == INVALID_INPUT
    with extracted(c, points) as made:
        assert f.surfsig_signatures(made, null, c_size_t(1), null, null) == INVALID_INPUT
        assert f.surfsig_last_error() == b"signatures must not be null"


def test_places_outside(c: CInterface, points: NDArray[np.float32]) -> None:
    with extracted(c, points) as made:
        with pytest.raises(Failed, match="place 1200 is outside an extraction of 1200 places"):
            c.signatures(made, np.array([0, 1200], np.uint32), 2)
        with pytest.raises(Failed, match="place 1200 is outside an extraction of 1200 places"):
            c.signatures(made, None, 1201)
        far = c.functions.surfsig_signatures(made, c_void_p(), c_size_t(2**63), byref(made), c_void_p())
        assert far == INVALID_INPUT


def test_many_threads_at_once(c: CInterface, points: NDArray[np.float32]) -> None:
    expected = surfsig.extract(points, RADIUS).signatures()

    def one(number: int) -> None:
        # Each thread reads its own error, whatever the others do.
        for stride in range(number + 1):
            with pytest.raises(Failed, match=f"not {stride}$"):
                c.extract(address(points), len(points), stride, RADIUS)
        with extracted(c, points) as made:
            np.testing.assert_array_equal(c.signatures(made, None, len(points))[0], expected)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(one, range(8)))


def test_names(c: CInterface) -> None:
    names = [c.functions.surfsig_status_name(status) for status in surfsig.Status]
    assert names == [status.name.lower().encode() for status in surfsig.Status]
    assert c.functions.surfsig_status_name(len(surfsig.Status)) is None


def test_the_makefile_installs_where_it_is_told(tmp_path: Path, installed: Path) -> None:
    run("make", "-C", ROOT, "install-c", f"PREFIX={tmp_path}")
    files = {os.path.relpath(path, tmp_path) for path in tmp_path.rglob("*") if path.is_file()}
    assert files == {os.path.relpath(path, installed) for path in installed.rglob("*") if path.is_file()}
