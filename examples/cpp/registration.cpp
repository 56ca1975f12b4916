// Scans a hilly terrain from two places, each scan in the axes of its own sensor, and finds how one lies in the other.

#include <surfsig.hpp>

#include <cmath>
#include <cstdio>
#include <exception>
#include <random>
#include <vector>

struct Point {
  double x, y, z;
};

constexpr double noise = 0.002; // metres, of each point's height
constexpr double tau = 6.283185307179586;

double hill(double x, double y, double width, double height) {
  return height * std::exp(-(x * x + 2 * y * y) / (width * width));
}

double height(double x, double y) {
  return hill(x + 0.3, y - 0.2, 0.35, 0.3) - hill(y + 0.4, x - 0.3, 0.25, 0.2) + hill(x - 0.7, y + 0.5, 0.3, 0.25) +
         hill(y - 0.7, x + 0.1, 0.2, 0.15) + hill(x + 0.9, y + 0.6, 0.25, 0.2) - hill(x - 0.9, y - 0.6, 0.3, 0.25);
}

// The terrain from x = left on, two metres wide, in the axes of a sensor.
std::vector<Point> scan(double left, const surfsig::Isometry &sensor_from_world, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&random] { return random() / 4294967296.0; };
  std::vector<Point> points;
  for (int i = 0; i < 30000; ++i) {
    const double x = left + 2 * uniform(), y = 2 * uniform() - 1;
    double error = -6.0; // of twelve uniform numbers: nearly normal, of deviation 1
    for (int k = 0; k < 12; ++k) error += uniform();
    const auto seen = sensor_from_world.transform_point({{x, y, height(x, y) + noise * error}});
    points.push_back({seen[0], seen[1], seen[2]});
  }
  return points;
}

int main() try {
  const surfsig::Vector above{{0.2, 0.1, 4.0}};
  const auto source_from_world = surfsig::Isometry::from_rotation_vector({{0.3, -0.5, tau / 3}}, {{2.0, -1.0, 0.5}});
  const std::vector<Point> source_points = scan(-1.4, source_from_world, 1);
  const std::vector<Point> target_points = scan(-0.6, surfsig::Isometry(), 2);
  const surfsig::Cloud source(source_points), target(target_points);

  const auto found = surfsig::register_scans(surfsig::Scan(source, source_from_world.transform_point(above)),
                                             surfsig::Scan(target, above));

  std::printf("%s, overlap %.2f, rms %.4f\n", found.trusted ? "trusted" : "not trusted", found.overlap, found.rms);
  for (int row = 0; row < 4; ++row) {
    const double *const entry = found.T_target_source.matrix + 4 * row;
    std::printf("%10.5f%10.5f%10.5f%10.5f\n", entry[0], entry[1], entry[2], entry[3]);
  }
  // The twist that is missing to the true transform, about the middle of the overlap, beside its standard errors.
  const auto center = surfsig::Isometry::from_rotation_vector(
      {{0.0, 0.0, 0.0}}, {{found.center[0], found.center[1], found.center[2]}});
  const auto missing =
      (center.inverse() * source_from_world.inverse() * found.transform().inverse() * center).log();
  double squares = 0.0;
  for (int k = 0; k < 6; ++k) {
    const double error = std::sqrt(found.covariance[7 * k]);
    std::printf("%10.2e +- %.2e\n", missing[k], error);
    squares += missing[k] * missing[k] / (error * error) / 6;
  }
  return found.trusted && squares < 6 ? 0 : 1;
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
