/**
 * @file
 * Registration of scans, and odometry, in C++: included by surfsig.hpp.
 */

#ifndef SURFSIG_REGISTRATION_HPP
#define SURFSIG_REGISTRATION_HPP

#include <surfsig.hpp>

namespace surfsig {

/** How scans are registered; by default with a radius by their size and 1,000 keypoints, on all cores. */
class RegistrationOptions {
public:
  RegistrationOptions &radius(double radius) {
    return checked(surfsig_registration_options_set_radius(handle_.get(), radius));
  }
  RegistrationOptions &keypoints(std::uint32_t keypoints) {
    return checked(surfsig_registration_options_set_keypoints(handle_.get(), keypoints));
  }
  RegistrationOptions &threads(std::uint32_t threads) {
    return checked(surfsig_registration_options_set_threads(handle_.get(), threads));
  }
  /** Called by the thread that registers; what it throws stops the registration and is thrown by that. */
  RegistrationOptions &progress(Progress progress) {
    watch_->progress = std::move(progress);
    const auto call = watch_->progress ? &detail::Watch::call : nullptr;
    return checked(surfsig_registration_options_set_progress(handle_.get(), call, watch_.get()));
  }
  const surfsig_registration_options *get() const { return handle_.get(); }
  /** Throws where a call with these options failed. */
  void check(surfsig_code code) const { watch_->check(code); }

private:
  RegistrationOptions &checked(surfsig_code code) {
    surfsig::check(code);
    return *this;
  }
  detail::Handle<surfsig_registration_options, surfsig_registration_options_free> handle_{
      surfsig_registration_options_new()};
  std::unique_ptr<detail::Watch> watch_{std::make_unique<detail::Watch>()};
};

/** A cloud, and what is known of where it was seen from; it refers to the cloud and to the directions. */
class Scan {
public:
  /** Nobody knows from where. */
  explicit Scan(const Cloud &cloud) : cloud_(&cloud) {}
  /** From one viewpoint, in the cloud's coordinates. */
  Scan(const Cloud &cloud, const Vector &viewpoint) : cloud_(&cloud), viewpoint_(viewpoint), seen_(true) {}
  /** Each point has a vector to its side, such as its normal: (count, 3) floats, packed. */
  Scan(const Cloud &cloud, const float *directions) : cloud_(&cloud), directions_(directions) {}
  /** Both, for models and for scenes in which they are looked for. */
  Scan(const Cloud &cloud, const Vector &viewpoint, const float *directions)
      : cloud_(&cloud), viewpoint_(viewpoint), seen_(true), directions_(directions) {}
  surfsig_scan get() const { return {cloud_->get(), seen_ ? viewpoint_.data() : nullptr, directions_}; }

private:
  const Cloud *cloud_;
  Vector viewpoint_{};
  bool seen_ = false;
  const float *directions_ = nullptr;
};

/** How a source lies in a target; surfsig_registration says what its numbers mean. */
struct Registration : surfsig_registration {
  /** Takes the source's points to the target; throws where nothing was found. */
  Isometry transform() const { return Isometry(T_target_source); }
  /** Other transforms that explain as much. */
  std::vector<Isometry> other_transforms() const {
    return std::vector<Isometry>(alternatives, alternatives + alternative_count);
  }
};

namespace detail {
inline Registration registered(const Scan &source, const Scan &target, const surfsig_transform *start,
                               const RegistrationOptions &options) {
  const surfsig_scan scans[] = {source.get(), target.get()};
  Registration found;
  options.check(surfsig_register(&scans[0], &scans[1], start, options.get(), &found));
  return found;
}
} // namespace detail

/** Finds how a scan lies in another, from any start. */
inline Registration register_scans(const Scan &source, const Scan &target,
                                   const RegistrationOptions &options = RegistrationOptions()) {
  return detail::registered(source, target, nullptr, options);
}

/** Refines a transform that is roughly known. */
inline Registration register_scans(const Scan &source, const Scan &target, const Isometry &start,
                                   const RegistrationOptions &options = RegistrationOptions()) {
  return detail::registered(source, target, &start.get(), options);
}

/** A scan's pose in the map; surfsig_scan_pose says what its numbers mean. */
struct ScanPose : surfsig_scan_pose {
  /** Takes the scan's points to the map; throws where the scan has no pose. */
  Isometry transform() const { return Isometry(T_map_scan); }
};

/** Follows a sensor from scan to scan. */
class Odometry {
public:
  /** Lengths are in the scans' unit; 0 to take one from the scans. */
  explicit Odometry(double voxel = 0.0, double max_correspondence_distance = 0.0, double map_range = 0.0,
                    std::uint32_t threads = 0) {
    surfsig_odometry *made = nullptr;
    check(surfsig_odometry_new(voxel, max_correspondence_distance, map_range, threads, &made));
    handle_.reset(made);
  }
  /** Takes the next scan, in its own frame, in which the sensor is at the viewpoint, or at 0 where none is given. */
  ScanPose push(const Scan &scan) {
    const surfsig_scan given = scan.get();
    ScanPose pose;
    check(surfsig_odometry_push(handle_.get(), &given, &pose));
    return pose;
  }
  /**
   * Takes the next scan of a sensor that moves while it scans. `times` has one for each point, from the time of the pose
   * on, in intervals from this scan to the next one.
   */
  ScanPose push(const Scan &scan, const std::vector<double> &times) {
    const surfsig_scan given = scan.get();
    if (times.size() != surfsig_cloud_size(given.cloud)) {
      throw std::invalid_argument("there must be one time for each point");
    }
    ScanPose pose;
    check(surfsig_odometry_push_timed(handle_.get(), &given, times.data(), &pose));
    return pose;
  }
  /** By which the sensor moves from a scan to the next one, in its axes; NaN where no times of points were given. */
  Twist twist(std::size_t index) const {
    Twist twist;
    check(surfsig_odometry_twist(handle_.get(), index, twist.data()));
    return twist;
  }
  /** Number of the map that a scan's pose is in; -1 where it has none. */
  std::int64_t segment(std::size_t index) const { return surfsig_odometry_segment(handle_.get(), index); }
  /** Number of scans so far. */
  std::size_t size() const { return surfsig_odometry_size(handle_.get()); }
  /** What is known now of a scan, which may have got a pose by later ones. */
  ScanPose pose(std::size_t index) const {
    ScanPose pose;
    check(surfsig_odometry_pose(handle_.get(), index, &pose));
    return pose;
  }
  double voxel() const { return surfsig_odometry_voxel(handle_.get()); }

private:
  detail::Handle<surfsig_odometry, surfsig_odometry_free> handle_;
};

/**
 * Takes the points of a scan to where they would have been measured at the time of its pose, by the sensor's twist in a
 * unit of time, and the time of each point from that of the pose on, in that unit. Offsets from the cloud's origin.
 */
inline std::vector<Vector> deskew(const Cloud &cloud, const std::vector<double> &times, const Twist &twist) {
  if (times.size() != cloud.size()) throw std::invalid_argument("there must be one time for each point");
  std::vector<Vector> points(times.size());
  if (points.empty()) return points;
  check(surfsig_deskew(cloud.get(), times.data(), twist.data(), points.front().data()));
  return points;
}

} // namespace surfsig

#endif // SURFSIG_REGISTRATION_HPP
