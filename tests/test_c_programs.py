"""Programs in C and C++ against the installed interface: they compile without a warning, and are right."""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import surfsig

ROOT = Path(__file__).parents[1]
STRICT = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]

IN_C = """
#include <surfsig.h>
#include <stdio.h>
#define COUNT(type, name, width) +1
int main(void) {
  surfsig_cloud *cloud = NULL;
  surfsig_extraction *extraction = NULL;
  surfsig_cloud_new_f32(NULL, 0, 12, NULL, &cloud);
  surfsig_code code = surfsig_extract(cloud, 0.0, NULL, &extraction);
  printf("%s\\n%d\\n%s\\n%d\\n", surfsig_version(), code == SURFSIG_CODE_INVALID_INPUT, surfsig_last_error(),
         extraction == NULL && surfsig_extraction_status(extraction) == NULL);
  printf("%d\\n", (0 SURFSIG_EXTRACTION_COLUMNS(COUNT) SURFSIG_SURFACES_COLUMNS(COUNT)) > 20);
  surfsig_cloud_free(cloud);
  return 0;
}
"""

IN_CPP = """
#include <surfsig.hpp>
#include <cstdio>
struct Wide { float intensity; double x, y, z; };
// As much of Eigen::Matrix<double, 4, 4, Eigen::RowMajor> as is asked for.
struct Matrix {
  enum { IsRowMajor = 1, SizeAtCompileTime = 16 };
  double values[16];
  const double *data() const { return values; }
};
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

  const surfsig::Cloud cloud(wide);
  const auto radii = surfsig::extract_radii(cloud, {0.25, 0.45});
  const auto nearest = surfsig::extract_nearest(cloud, 9, surfsig::Options().voxel(0.3));
  const auto own = surfsig::extract_auto_radius(
      cloud, surfsig::Options().positions({{{1.5, 1.5, 3.0}}}).normals({{{0.0f, 0.0f, -1.0f}}}));
  std::printf("%u %u %u %d %zu %zu\\n", radii[0].count()[464], radii[1].count()[464], nearest.count()[0],
              nearest.indices().size() == nearest.size(), own.indices().size(), own.radii().size());
  std::printf("%.1f %d %d %zu\\n", own.normals()[2], own.oriented(), nearest.oriented(),
              own.fit_used().size());
  const auto all = surfsig::extract(cloud, 0.55, surfsig::Options().all());
  const auto alike = all.similarities(464, all.flat_atom_length());
  std::printf("%.3f %d %zu %.3f %.3f\\n", cloud.spacing(), all.flat_atom_length() > 0.0, alike.size(),
              alike[464], alike[435]);

  surfsig::SurfaceOptions stopping;
  stopping.progress([](std::size_t, std::size_t) -> bool { throw std::logic_error("thrown by the caller"); });
  try {
    surfsig::find_surfaces(cloud, stopping);
  } catch (const std::logic_error &error) {
    std::printf("%s\\n", error.what());
  }
  const std::vector<surfsig_surface_kind> kinds{SURFSIG_SURFACE_KIND_PLANE};
  const auto floor = surfsig::find_surfaces(cloud, surfsig::SurfaceOptions().kinds(kinds));
  const auto plane = surfsig::fit_primitive(cloud, floor.kind()[0]);
  const auto again = surfsig::fit_primitive(cloud, SURFSIG_SURFACE_KIND_PLANE, &plane);
  std::printf("%zu %zu %.1f %zu %.1f %zu\\n", floor.size(), floor.covariance(0).size(), again.axis()[2],
              plane.uncertainty(cloud).covariance.size(), plane.distances(cloud)[7],
              floor.covariance(1).size());
  surfsig::PrimitiveOptions known;
  known.axis({{0.0, 0.0, 3.0}}).start(plane).weights(std::vector<double>(cloud.size(), 2.0)).radius(0.0);
  const auto kept = surfsig::fit_primitive(cloud, SURFSIG_SURFACE_KIND_PLANE, known);
  std::printf("%.1f %.1f\\n", kept.axis()[2], kept.uncertainty(cloud, known).covariance[4]);
  surfsig::Moments moments(cloud, {{1.5, 1.5, 3.0}});
  try {
    (moments += moments).sphere();
  } catch (const surfsig::Error &error) {
    std::printf("%d %s\\n", error.code == SURFSIG_CODE_UNDETERMINED, error.what());
  }

  const surfsig::Isometry quarter(Matrix{{0, -1, 0, 1, 1, 0, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1}});
  const auto half = quarter * quarter;
  const auto moved = half.transform_point({{1.0, 0.0, 0.0}});
  const auto back = half.inverse().transform_points({moved})[0];
  const auto rotated = quarter.transform_vector({{1.0, 0.0, 0.0}});
  std::printf("%g %g %g, %g %g %g, %g\\n", moved[0], moved[1], moved[2], back[0], back[1], back[2],
              rotated[1]);
  std::printf("%.3f %.3f\\n", surfsig::Isometry::exp(quarter.log()).data()[1], quarter.adjoint()[6]);

  const std::vector<double> times(cloud.size(), 2.0);
  const auto straight = surfsig::deskew(cloud, times, {{0.0, 0.0, 0.0, 0.25, 0.0, 0.0}});
  std::printf("%zu %.2f %.2f\\n", straight.size(), straight[1][0], straight[1][2]);
}
"""


def run(*command: object) -> str:
    finished = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert finished.returncode == 0, finished.stdout + finished.stderr
    return finished.stdout


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
    version, refused, message, nothing, listed = output_of(tmp_path / "main.c", IN_C, installed, "cc", "c11")
    assert version == surfsig.__version__
    assert message == "a radius or voxel must be a finite number from 1e-18 to 1e18, not 0e0"
    assert (refused, nothing, listed) == ("1", "1", "1")


def lattice_points_within(steps: float) -> int:
    """The points of a square lattice that are so near to one of them."""
    return sum(i * i + j * j < steps**2 for i in range(-5, 6) for j in range(-5, 6))


@pytest.mark.parametrize("standard", ["c++14", "c++20"])
def test_a_program_in_cpp(installed: Path, tmp_path: Path, standard: str) -> None:
    one, none, refused, counts, own, alike, thrown, plane, kept, flat, moved, back, straight = output_of(
        tmp_path / "main.cpp", IN_CPP, installed, "c++", standard
    )
    assert one == f"1 {lattice_points_within(5.5)} 1.000"
    assert none == "0 0 0"
    assert refused == "1 query 1 is outside an extraction of 1 queries"
    assert counts == f"{lattice_points_within(2.5)} {lattice_points_within(4.5)} 9 1 0 1"
    assert own == "-1.0 1 0 0"
    assert alike == "0.100 1 900 1.000 1.000"
    assert thrown == "thrown by the caller"
    assert plane == "1 9 1.0 9 0.0 0"
    assert kept == "1.0 0.0"
    assert flat == "1 the points determine no sphere"
    # A quarter turn about z and a translation, twice.
    assert moved == "-2 3 6, 1 0 0, 1"
    assert back == "-1.000 1.000"
    assert straight == "900 0.60 3.00"


def built(installed: Path, folder: Path, target: str) -> Path:
    """Build the examples, without a warning, against the shared or the static library."""
    shutil.copytree(ROOT / "examples" / "cpp", folder / "cpp")
    listing = folder / "cpp" / "CMakeLists.txt"
    listing.write_text(listing.read_text().replace("surfsig::surfsig", f"surfsig::{target}"))
    build = folder / "build"
    flags = " ".join(STRICT)
    run(
        *("cmake", "-S", folder / "cpp", "-B", build),
        *(f"-DCMAKE_PREFIX_PATH={installed}", f"-DCMAKE_CXX_FLAGS={flags}"),
    )
    run("cmake", "--build", build)
    return build


@pytest.mark.parametrize("target", ["surfsig", "static"])
def test_the_examples(installed: Path, tmp_path: Path, target: str) -> None:
    build = built(installed, tmp_path, target)
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

    _, *found, seen = [line.split() for line in run(build / "surfaces").splitlines()]
    # Ball and pipe have about as many points.
    plane, ball, pipe = sorted(found, key=lambda row: ["plane", "sphere", "cylinder"].index(row[0]))
    assert [row[0] for row in (plane, ball, pipe)] == ["plane", "sphere", "cylinder"]
    assert [int(row[1]) for row in (plane, ball, pipe)] == pytest.approx([12_000, 6000, 6000], rel=0.01)
    assert [float(row[2]) for row in (ball, pipe)] == pytest.approx([0.3, 0.1], abs=1e-4)
    # 0; 1 / r; 1 / 2 r, where a ball of half the pipe's radius gives 3 % too much.
    assert [float(row[4]) for row in (plane, ball, pipe)] == pytest.approx([0, 1 / 0.3, 5], abs=0.4)
    # Seen from (1, 0, 0) against x: 1 - 0.6 in front.
    assert [float(number) for number in seen[2:]] == pytest.approx([0.4, 0, 0.2], abs=1e-3)

    said, *_ = run(build / "registration").splitlines()
    assert said.startswith("trusted, overlap 0.")

    # That scans lie within a centimetre of where they were is the program's own condition.
    scans = run(build / "odometry").splitlines()
    assert len(scans) == 12
    assert all(": tracked, " in scan for scan in scans)

    # That both lie within a millimetre and a degree of where they are is the program's own condition.
    model, *instances = run(build / "finding").splitlines()
    assert model.startswith("a model of 8000 points, ")
    assert len(instances) == 2


def test_the_makefile_installs_where_it_is_told(tmp_path: Path, installed: Path) -> None:
    run("make", "-C", ROOT, "install-c", f"PREFIX={tmp_path}")
    files = {os.path.relpath(path, tmp_path) for path in tmp_path.rglob("*") if path.is_file()}
    assert files == {os.path.relpath(path, installed) for path in installed.rglob("*") if path.is_file()}
