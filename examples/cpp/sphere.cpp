// Extracts two spheres and a saddle, compares their signatures, and prints a small table.

#include <surfsig.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <vector>

// Laid out like pcl::PointXYZ: four floats, the last of them without a meaning.
struct Point {
  float x, y, z, padding;
};

constexpr int side = 60;       // points along each side of a patch
constexpr double step = 0.001; // metres between them
constexpr double radius = 0.008;

// A patch of a sphere of radius r at x0, or of a saddle of curvatures 1/r and -1/r; seen from above.
void add_patch(std::vector<Point> &cloud, double x0, double r, bool saddle) {
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const double x = step * (i - side / 2), y = step * (j - side / 2);
      const double z = saddle ? (y * y - x * x) / (2 * r) : std::sqrt(r * r - x * x - y * y);
      cloud.push_back({float(x0 + x), float(y), float(z), NAN});
    }
  }
}

int main() try {
  std::vector<Point> cloud;
  add_patch(cloud, 0.0, 0.1, false);
  add_patch(cloud, 1.0, 0.1, false);
  add_patch(cloud, 2.0, 0.1, true);

  const auto found = surfsig::extract(cloud, radius, surfsig::Options().viewpoint({0.0, 0.0, 2.0}));

  const std::uint32_t patch = side * side, middle = side * (side / 2) + side / 2;
  const std::vector<std::uint32_t> chosen{middle, patch + middle, 2 * patch + middle};
  const auto signatures = found.signatures(chosen);

  std::printf("surfsig %s\n%8s%10s%10s%8s%12s%8s\n", surfsig_version(), "point", "k1 [1/m]", "k2 [1/m]",
              "count", "status", "zeta");
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const auto point = chosen[i];
    const double zeta = surfsig::similarity(signatures[0], signatures[i]);
    std::printf("%8u%10.3f%10.3f%8u%12s%8.3f\n", point, found.k1()[point], found.k2()[point],
                found.count()[point], surfsig_status_name(found.status()[point]), zeta);
  }

  // A sphere's curvature is 1/r in every direction.
  const auto is_right = [](float k) { return std::abs(k * 0.1 - 1) < 0.01; };
  return is_right(found.k1()[middle]) && is_right(found.k2()[middle]) ? 0 : 1;
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
