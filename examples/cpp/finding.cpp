// Takes a depth image of a floor with three objects over it, and finds the two that are the model, with their errors.

#include <surfsig.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <random>
#include <vector>

struct Point {
  double x, y, z;
};

struct Ellipsoid {
  double axes[3], center[3]; // half axes
};

using Object = std::vector<Ellipsoid>;

struct Placed {
  Object object;
  surfsig::Isometry camera_from_object;
};

constexpr double noise = 0.0005; // metres, of each distance
constexpr double depth = 1.2;    // metres, from the camera to the floor
constexpr double never = std::numeric_limits<double>::infinity();
constexpr double tau = 6.283185307179586;

const Object figure = {{{0.050, 0.065, 0.080}, {0.0, 0.0, 0.0}}, {{0.035, 0.025, 0.045}, {0.025, 0.045, 0.050}}};
const Object egg = {{{0.050, 0.050, 0.075}, {0.0, 0.0, 0.0}}};

// Where a ray first meets an ellipsoid: |s + distance r| = 1 with all lengths in units of the half axes.
double meet(const Ellipsoid &ellipsoid, const surfsig::Vector &from, const surfsig::Vector &ray) {
  double rr = 0.0, rs = 0.0, ss = -1.0;
  for (int k = 0; k < 3; ++k) {
    const double r = ray[k] / ellipsoid.axes[k], s = (from[k] - ellipsoid.center[k]) / ellipsoid.axes[k];
    rr += r * r;
    rs += r * s;
    ss += s * s;
  }
  const double root = rs * rs - rr * ss;
  return root < 0 ? never : (-rs - std::sqrt(root)) / rr;
}

double meet(const Object &object, const surfsig::Vector &from, const surfsig::Vector &ray) {
  double distance = never;
  for (const Ellipsoid &part : object) distance = std::min(distance, meet(part, from, ray));
  return distance;
}

// An object's whole surface: what rays from all around meet first.
std::vector<Point> whole(const Object &object) {
  std::mt19937 random(1);
  const auto uniform = [&random] { return random() / 4294967296.0; };
  std::vector<Point> points;
  while (points.size() < 8000) {
    const double z = 2 * uniform() - 1, angle = tau * uniform(), across = std::sqrt(1 - z * z);
    const surfsig::Vector ray{{across * std::cos(angle), across * std::sin(angle), z}};
    surfsig::Vector from;
    for (int k = 0; k < 3; ++k) from[k] = 0.3 * uniform() - 0.15 - ray[k];
    const double distance = meet(object, from, ray);
    if (distance < never)
      points.push_back({from[0] + distance * ray[0], from[1] + distance * ray[1], from[2] + distance * ray[2]});
  }
  return points;
}

// What a camera at 0 measures, which looks along z.
std::vector<Point> image(const std::vector<Placed> &placed) {
  std::mt19937 random(2);
  std::vector<Point> points;
  for (int row = -160; row < 160; ++row) {
    for (int column = -220; column < 220; ++column) {
      const surfsig::Vector ray{{column / 500.0, row / 500.0, 1.0}};
      double distance = depth;
      for (const Placed &one : placed) {
        const auto object_from_camera = one.camera_from_object.inverse();
        distance = std::min(distance, meet(one.object, object_from_camera.transform_point({{0.0, 0.0, 0.0}}),
                                           object_from_camera.transform_vector(ray)));
      }
      double error = -6.0; // of twelve uniform numbers: nearly normal, of deviation 1
      for (int i = 0; i < 12; ++i) error += random() / 4294967296.0;
      distance += noise * error;
      points.push_back({distance * ray[0], distance * ray[1], distance * ray[2]});
    }
  }
  return points;
}

int main() try {
  const std::vector<Placed> placed = {
      {figure, surfsig::Isometry::from_rotation_vector({{0.4, -1.0, 0.7}}, {{-0.25, 0.05, depth - 0.09}})},
      {figure, surfsig::Isometry::from_rotation_vector({{1.9, 0.6, -0.8}}, {{0.25, -0.05, depth - 0.09}})},
      {egg, surfsig::Isometry::from_rotation_vector({{0.9, 0.3, 0.2}}, {{0.0, 0.1, depth - 0.08}})},
  };
  const std::vector<Point> model_points = whole(figure), scene_points = image(placed);
  const surfsig::Cloud model_cloud(model_points), scene_cloud(scene_points);

  const auto watch = [](std::size_t done, std::size_t total) {
    std::fprintf(stderr, "%zu of %zu steps\n", done, total);
    return true;
  };
  const surfsig::Model model{surfsig::Scan(model_cloud)};
  const surfsig::Scan scene(scene_cloud, {{0.0, 0.0, 0.0}});
  const auto found = surfsig::find_instances(model, scene, surfsig::FindOptions().progress(watch));

  std::printf("a model of %zu points, %.1f mm apart, patches of %.1f mm\n", model.size(), 1000 * model.spacing(),
              1000 * model.radius());
  bool is_right = found.size() == 2;
  for (const surfsig::Instance &instance : found) {
    double nearest = never, turned = never;
    for (const Placed &one : placed) {
      const auto off = (one.camera_from_object.inverse() * instance.transform()).log();
      const double distance = std::sqrt(off[3] * off[3] + off[4] * off[4] + off[5] * off[5]);
      if (distance < nearest) {
        nearest = distance;
        turned = std::sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]);
      }
    }
    std::printf("score %.2f, %.0f %% visible, %zu points, rms %.2f mm; %.2f mm and %.2f degrees from where it is\n",
                instance.score, 100 * instance.visible, instance.indices.size(), 1000 * instance.rms, 1000 * nearest,
                turned * 360 / tau);
    is_right = is_right && nearest < 0.001 && turned * 360 / tau < 1;
  }
  return is_right ? 0 : 1;
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
