// Carries a lidar of 32 rings through a room with a pillar and a cupboard, and follows it by its scans alone.

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

struct Box {
  double low[3], high[3];
};

constexpr double noise = 0.005; // metres, of each distance
constexpr double tau = 6.283185307179586;
constexpr Box room{{-4, -3, -1.5}, {4, 3, 1.5}};
constexpr Box things[] = {{{1.5, 0.5, -1.5}, {2.0, 1.0, 1.5}}, {{-3.5, -2.9, -1.5}, {-2.0, -2.3, 0.6}}};

// Where a ray from a point enters and leaves a box.
void meet(const Box &box, const double *from, const double *ray, double &enter, double &leave) {
  enter = -std::numeric_limits<double>::infinity();
  leave = -enter;
  for (int k = 0; k < 3; ++k) {
    const double a = (box.low[k] - from[k]) / ray[k], b = (box.high[k] - from[k]) / ray[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
}

// What the sensor measures at a pose, in its own axes.
std::vector<Point> scan(const surfsig::Isometry &room_from_sensor, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Point> points;
  const surfsig::Vector from = room_from_sensor.transform_point({{0.0, 0.0, 0.0}});
  for (int ring = 0; ring < 32; ++ring) {
    const double elevation = (ring - 15.5) * tau / 180;
    for (int step = 0; step < 400; ++step) {
      const double azimuth = (step + 0.5) * tau / 400;
      const surfsig::Vector own{{std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                 std::sin(elevation)}};
      const surfsig::Vector ray = room_from_sensor.transform_vector(own);
      double enter, range;
      meet(room, from.data(), ray.data(), enter, range);
      for (const Box &thing : things) {
        double leave;
        meet(thing, from.data(), ray.data(), enter, leave);
        if (enter > 0 && enter < leave) range = std::min(range, enter);
      }
      double error = -6.0; // of twelve uniform numbers: nearly normal, of deviation 1
      for (int i = 0; i < 12; ++i) error += random() / 4294967296.0;
      range += noise * error;
      points.push_back({range * own[0], range * own[1], range * own[2]});
    }
  }
  return points;
}

int main() try {
  surfsig::Odometry odometry;
  surfsig::Isometry first;
  double farthest = 0.0;
  for (unsigned number = 0; number < 12; ++number) {
    const double along = 0.15 * number;
    const auto pose = surfsig::Isometry::from_rotation_vector({{0.0, 0.0, 0.05 * number}}, {{-1.5 + along, -0.5, 0.1}});
    if (number == 0) first = pose;
    const std::vector<Point> points = scan(pose, number);
    const surfsig::Cloud cloud(points);
    const surfsig::ScanPose found = odometry.push(surfsig::Scan(cloud));
    const auto off = (pose.inverse() * first * found.transform()).log();
    const double distance = std::sqrt(off[3] * off[3] + off[4] * off[4] + off[5] * off[5]);
    farthest = std::max(farthest, distance);
    std::printf("scan %2u: %s, overlap %.2f, %.1f mm from where it was\n", number,
                surfsig_scan_status_name(found.status), found.overlap, 1000 * distance);
  }
  return odometry.size() == 12 && farthest < 0.01 ? 0 : 1;
} catch (const std::exception &error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
