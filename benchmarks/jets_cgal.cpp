// Fits CGAL's jets to patches that somebody else has drawn, and writes their curvatures.
//
//     jets_cgal DEGREE PATCHES.f64 POINTS ANSWERS.f64
//     jets_cgal versions
//
// PATCHES.f64 holds x y z as raw float64, POINTS points for each patch; a jet is fitted about the first of them, as
// CGAL does. ANSWERS.f64 gets k1 and k2 of each patch, k1 >= k2, positive where the patch bulges towards +z.
// A line of JSON says how many patches there were.
#include <CGAL/Monge_via_jet_fitting.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>

#include <cstdlib>
#include <exception>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Fit = CGAL::Monge_via_jet_fitting<Kernel>;

// How far the Monge form is worked out: 2 ends at the curvatures, which higher ones leave as they are.
constexpr std::size_t MONGE_DEGREE = 2;

std::vector<double> read_numbers(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<double> values(static_cast<std::size_t>(file.tellg()) / sizeof(double));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(double)));
  return values;
}

std::vector<double> fit_all(const std::vector<double>& patches, std::size_t degree, std::size_t points) {
  const std::size_t count = patches.size() / (3 * points);
  std::vector<double> answers(2 * count);
#pragma omp parallel for schedule(dynamic, 16)
  for (std::size_t patch = 0; patch < count; ++patch) {
    std::vector<Kernel::Point_3> members;
    for (std::size_t i = patch * points; i < (patch + 1) * points; ++i)
      members.emplace_back(patches[3 * i], patches[3 * i + 1], patches[3 * i + 2]);
    Fit fit;
    auto form = fit(members.begin(), members.end(), degree, MONGE_DEGREE);
    form.comply_wrt_given_normal(Kernel::Vector_3(0, 0, 1));
    // CGAL's curvature is positive where the surface rises along the normal: in a hollow.
    answers[2 * patch] = -form.principal_curvatures(1);
    answers[2 * patch + 1] = -form.principal_curvatures(0);
  }
  return answers;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 2 && std::string(argv[1]) == "versions") {
    std::cout << R"({"CGAL": ")" << CGAL_VERSION_STR << R"(", "Eigen": ")" << EIGEN_WORLD_VERSION << '.'
              << EIGEN_MAJOR_VERSION << '.' << EIGEN_MINOR_VERSION << "\"}\n";
    return EXIT_SUCCESS;
  }
  if (argc != 5) throw std::runtime_error("usage: jets_cgal DEGREE PATCHES.f64 POINTS ANSWERS.f64");
  const std::vector<double> answers = fit_all(read_numbers(argv[2]), std::stoul(argv[1]), std::stoul(argv[3]));
  std::ofstream file(argv[4], std::ios::binary);
  file.write(reinterpret_cast<const char*>(answers.data()),
             static_cast<std::streamsize>(answers.size() * sizeof(double)));
  if (!file) throw std::runtime_error(std::string("cannot write ") + argv[4]);
  std::cout << R"({"patches": )" << answers.size() / 2 << "}\n";
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
