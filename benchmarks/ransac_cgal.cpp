// Finds planes, cylinders, spheres, cones and tori in one cloud with CGAL's Efficient RANSAC, prints one line of JSON,
// and writes the index of each point's shape (int32, -1 for none).
//
// A length below 0, and a share of 0, stand for CGAL's own default. The processor time holds the spacing, the normals
// and the search, as a user who has only points must pay for all three.
#include <CGAL/Random.h>
#include <CGAL/Shape_detection/Efficient_RANSAC.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/bounding_box.h>
#include <CGAL/compute_average_spacing.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>
#include <CGAL/version.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
// The search sorts its input in place, so each point keeps the index that it had.
using Entry = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::size_t>;
using Cloud = std::vector<Entry>;
using PointMap = CGAL::Nth_of_tuple_property_map<0, Entry>;
using NormalMap = CGAL::Nth_of_tuple_property_map<1, Entry>;
using Traits = CGAL::Shape_detection::Efficient_RANSAC_traits<Kernel, Cloud, PointMap, NormalMap>;
using Ransac = CGAL::Shape_detection::Efficient_RANSAC<Traits>;
using Shape = CGAL::Shape_detection::Shape_base<Traits>;
using Plane = CGAL::Shape_detection::Plane<Traits>;
using Cylinder = CGAL::Shape_detection::Cylinder<Traits>;
using Sphere = CGAL::Shape_detection::Sphere<Traits>;
using Cone = CGAL::Shape_detection::Cone<Traits>;
using Torus = CGAL::Shape_detection::Torus<Traits>;

constexpr unsigned NORMAL_NEIGHBOURS = 12;
constexpr unsigned SPACING_NEIGHBOURS = 6;

struct Settings {
  double epsilon;          // share of the diagonal
  double cluster_epsilon;  // point spacings
  double min_points;       // share of the points
  double normal_threshold;
  double probability;
  bool cones_and_tori;
};

Cloud read_cloud(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<double> values(static_cast<std::size_t>(file.tellg()) / sizeof(double));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(double)));
  Cloud cloud;
  cloud.reserve(values.size() / 3);
  for (std::size_t i = 0; i + 2 < values.size(); i += 3)
    cloud.emplace_back(Kernel::Point_3(values[i], values[i + 1], values[i + 2]), Kernel::Vector_3(), i / 3);
  return cloud;
}

double diagonal_of(const Cloud& cloud) {
  std::vector<Kernel::Point_3> points;
  points.reserve(cloud.size());
  for (const Entry& each : cloud) points.push_back(std::get<0>(each));
  const auto box = CGAL::bounding_box(points.begin(), points.end());
  return std::sqrt(CGAL::squared_distance((box.min)(), (box.max)()));
}

Ransac::Parameters parameters_of(const Settings& settings, const Cloud& cloud) {
  Ransac::Parameters parameters;
  parameters.probability = settings.probability;
  parameters.normal_threshold = settings.normal_threshold;
  if (settings.epsilon > 0) parameters.epsilon = settings.epsilon * diagonal_of(cloud);
  if (settings.cluster_epsilon > 0)
    parameters.cluster_epsilon =
        settings.cluster_epsilon * CGAL::compute_average_spacing<CGAL::Sequential_tag>(
                                       cloud, SPACING_NEIGHBOURS, CGAL::parameters::point_map(PointMap()));
  if (settings.min_points > 0)
    parameters.min_points = static_cast<std::size_t>(settings.min_points * static_cast<double>(cloud.size()));
  return parameters;
}

// The kind, and the radius where the kind has one; a torus has two, so it gets none.
std::pair<std::string, double> describe(const Shape* shape) {
  if (dynamic_cast<const Plane*>(shape)) return {"plane", 0};
  if (const auto* cylinder = dynamic_cast<const Cylinder*>(shape)) return {"cylinder", cylinder->radius()};
  if (const auto* sphere = dynamic_cast<const Sphere*>(shape)) return {"sphere", sphere->radius()};
  if (dynamic_cast<const Cone*>(shape)) return {"cone", 0};
  return {"torus", 0};
}

// std::to_string keeps six decimals, whatever the unit of length.
std::string decimal(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}

void find_shapes(const std::string& path, const std::string& labels_path, const Settings& settings, unsigned seed) {
  Cloud cloud = read_cloud(path);
  const std::clock_t start = std::clock();
  CGAL::get_default_random() = CGAL::Random(seed);
  CGAL::pca_estimate_normals<CGAL::Sequential_tag>(
      cloud, NORMAL_NEIGHBOURS, CGAL::parameters::point_map(PointMap()).normal_map(NormalMap()));
  const Ransac::Parameters parameters = parameters_of(settings, cloud);
  Ransac ransac;
  ransac.set_input(cloud);
  ransac.add_shape_factory<Plane>();
  ransac.add_shape_factory<Cylinder>();
  ransac.add_shape_factory<Sphere>();
  if (settings.cones_and_tori) {
    ransac.add_shape_factory<Cone>();
    ransac.add_shape_factory<Torus>();
  }
  ransac.detect(parameters);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;

  std::vector<std::int32_t> labels(cloud.size(), -1);
  std::string kinds, radii;
  std::int32_t index = 0;
  for (const auto& shape : ransac.shapes()) {
    const auto [kind, radius] = describe(shape.get());
    const std::string separator = index == 0 ? "" : ", ";
    kinds += separator + '"' + kind + '"';
    radii += separator + (radius > 0 ? decimal(radius) : "null");
    for (const std::size_t point : shape->indices_of_assigned_points()) labels[std::get<2>(cloud[point])] = index;
    ++index;
  }
  std::ofstream file(labels_path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(labels.data()),
             static_cast<std::streamsize>(labels.size() * sizeof(std::int32_t)));
  if (!file.flush()) throw std::runtime_error("cannot write " + labels_path);
  std::cout << R"({"seconds": )" << seconds << R"(, "kinds": [)" << kinds << R"(], "radii": [)" << radii << "]}\n";
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 2 && std::string(argv[1]) == "versions") {
    std::cout << R"({"CGAL": ")" << CGAL_VERSION_STR << R"(", "C++ compiler": ")" << __VERSION__ << "\"}\n";
    return EXIT_SUCCESS;
  }
  if (argc != 10)
    throw std::runtime_error(
        "usage: ransac_cgal CLOUD.f64 LABELS.i32 EPSILON CLUSTER MIN_POINTS NORMAL PROBABILITY CONES_AND_TORI SEED");
  const Settings settings{std::stod(argv[3]), std::stod(argv[4]), std::stod(argv[5]),
                          std::stod(argv[6]), std::stod(argv[7]), std::stoi(argv[8]) != 0};
  find_shapes(argv[1], argv[2], settings, static_cast<unsigned>(std::stoul(argv[9])));
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
