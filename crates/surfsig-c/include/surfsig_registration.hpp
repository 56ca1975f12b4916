/**
 * @file
 * Registration of scans in C++: included by surfsig.hpp.
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

} // namespace surfsig

#endif // SURFSIG_REGISTRATION_HPP
