// Scans a floor, a ball and a pipe, finds them again with their errors, and extracts their curvature.

#include <surfsig.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <random>
#include <vector>

struct Point {
  double x, y, z;
};

constexpr double noise = 0.001; // metres, of each point along the surface's normal
constexpr double radius = 0.05; // metres, of the balls that curvature is read from
constexpr double ball = 0.3, pipe = 0.1;
constexpr double tau = 6.283185307179586;

// What is seen from above of a ball at (0.6, 0, 0.2), of a pipe along y at x = -0.6, and of a floor below.
std::vector<Point> scan() {
  std::mt19937 random(7);
  const auto uniform = [&random] { return random() / 4294967296.0; };
  const auto error = [&uniform] {
    double sum = -6.0; // of twelve uniform numbers: nearly normal, of deviation 1
    for (int i = 0; i < 12; ++i) sum += uniform();
    return noise * sum;
  };
  std::vector<Point> points;
  for (int i = 0; i < 6000; ++i) {
    const double z = uniform(), angle = tau * uniform(), r = ball + error();
    const double across = r * std::sqrt(1 - z * z);
    points.push_back({0.6 + across * std::cos(angle), across * std::sin(angle), 0.2 + r * z});
  }
  for (int i = 0; i < 6000; ++i) {
    const double angle = tau / 2 * uniform(), r = pipe + error();
    points.push_back({-0.6 + r * std::cos(angle), uniform() - 0.5, 0.3 + r * std::sin(angle)});
  }
  for (int i = 0; i < 12000; ++i) points.push_back({3 * uniform() - 1.5, 2 * uniform() - 1, error()});
  return points;
}

int main() try {
  const std::vector<Point> points = scan();
  const surfsig::Cloud cloud(points);

  const auto watch = [](std::size_t done, std::size_t total) {
    std::fprintf(stderr, "%zu of %zu points have a surface\n", done, total);
    return true;
  };
  const auto found = surfsig::find_surfaces(cloud, surfsig::SurfaceOptions().progress(watch));

  // Curvature at one point of each voxel, seen from above.
  surfsig::Options options;
  options.voxel(0.05).viewpoint({{0.0, 0.0, 5.0}});
  const auto curvature = surfsig::extract(cloud, radius, options);

  std::printf("%10s%8s%10s%10s%12s%12s\n", "kind", "points", "radius", "+-", "H [1/m]", "queries");
  for (std::size_t i = 0; i < found.size(); ++i) {
    double sum = 0.0;
    int queries = 0;
    for (std::size_t query = 0; query < curvature.size(); ++query) {
      const bool here = found.labels()[curvature.indices()[query]] == std::int32_t(i);
      if (!here || curvature.status()[query] != SURFSIG_STATUS_OK) continue;
      sum += 0.5 * (curvature.k1()[query] + curvature.k2()[query]);
      ++queries;
    }
    std::printf("%10s%8u%10.5f%10.5f%12.3f%12d\n", surfsig_surface_kind_name(found.kind()[i]),
                found.count()[i], found.radius()[i], found.radius_std()[i], sum / queries, queries);
  }

  // Where the ball is for somebody who stands at (1, 0, 0) and looks back along x.
  const auto world_from_viewer =
      surfsig::Isometry::from_rotation_vector({{0.0, 0.0, tau / 2}}, {{1.0, 0.0, 0.0}});
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found.kind()[i] != SURFSIG_SURFACE_KIND_SPHERE) continue;
    const double *const centre = &found.point()[3 * i];
    const auto seen = world_from_viewer.inverse().transform_point({{centre[0], centre[1], centre[2]}});
    std::printf("ball at %.3f %.3f %.3f\n", seen[0], seen[1] + 0.0, seen[2]);
  }
  return found.size() == 3 ? 0 : 1;
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
