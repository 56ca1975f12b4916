/**
 * @file
 * Surfaces that are found in a cloud, and those that are fitted, in C++: included by surfsig.hpp.
 */

#ifndef SURFSIG_SURFACES_HPP
#define SURFSIG_SURFACES_HPP

#include <surfsig.hpp>

namespace surfsig {

/** How surfaces are found; by default all kinds, with noise estimated around each point, on all cores. */
class SurfaceOptions {
public:
  SurfaceOptions &min_points(std::uint32_t points) {
    return checked(surfsig_surface_options_set_min_points(handle_.get(), points));
  }
  SurfaceOptions &noise(double noise) {
    return checked(surfsig_surface_options_set_noise(handle_.get(), noise));
  }
  SurfaceOptions &kinds(const std::vector<surfsig_surface_kind> &kinds) {
    const std::vector<std::uint8_t> numbers(kinds.begin(), kinds.end());
    return checked(surfsig_surface_options_set_kinds(handle_.get(), numbers.data(), numbers.size()));
  }
  SurfaceOptions &threads(std::uint32_t threads) {
    return checked(surfsig_surface_options_set_threads(handle_.get(), threads));
  }
  /** Called by the thread that searches; what it throws stops the search and is thrown by that. */
  SurfaceOptions &progress(Progress progress) {
    watch_->progress = std::move(progress);
    const auto call = watch_->progress ? &detail::Watch::call : nullptr;
    return checked(surfsig_surface_options_set_progress(handle_.get(), call, watch_.get()));
  }
  const surfsig_surface_options *get() const { return handle_.get(); }
  /** Throws where a call with these options failed. */
  void check(surfsig_code code) const { watch_->check(code); }

private:
  SurfaceOptions &checked(surfsig_code code) {
    surfsig::check(code);
    return *this;
  }
  detail::Handle<surfsig_surface_options, surfsig_surface_options_free> handle_{
      surfsig_surface_options_new()};
  std::unique_ptr<detail::Watch> watch_{std::make_unique<detail::Watch>()};
};

/**
 * The surfaces of a scan, the largest first. Columns of one length: kind(), point(), axis(), radius(), ...,
 * one for each function surfsig_surfaces_...() of SURFSIG_SURFACES_COLUMNS.
 */
class Surfaces {
public:
  explicit Surfaces(surfsig_surfaces *owned) : handle_(owned) {}
  std::size_t size() const { return surfsig_surfaces_size(get()); }
  /** Of each point the number of its surface, or -1. */
  Column<std::int32_t> labels() const {
    return {surfsig_surfaces_labels(get()), surfsig_surfaces_label_count(get())};
  }
  /** Of a surface's parameters, row by row; empty where the points do not determine it. */
  Column<double> covariance(std::size_t index) const {
    const double *const first = surfsig_surfaces_covariance(get(), index);
    const std::size_t parameters = first == nullptr ? 0 : surfsig_surface_kind_parameters(kind()[index]);
    return {first, parameters * parameters};
  }
#define SURFSIG_COLUMN(type, name, width)                                                                  \
  Column<type> name() const { return {surfsig_surfaces_##name(get()), width * size()}; }
  SURFSIG_SURFACES_COLUMNS(SURFSIG_COLUMN)
#undef SURFSIG_COLUMN
  const surfsig_surfaces *get() const { return handle_.get(); }

private:
  detail::Handle<surfsig_surfaces, surfsig_surfaces_free> handle_;
};

inline Surfaces find_surfaces(const Cloud &cloud, const SurfaceOptions &options = SurfaceOptions()) {
  surfsig_surfaces *made = nullptr;
  options.check(surfsig_find_surfaces(cloud.get(), options.get(), &made));
  return Surfaces(made);
}

class Primitive;

/** What is known of a surface before fit_primitive() fits it; everything is fitted unless it is set. */
class PrimitiveOptions {
public:
  /** A surface of the same kind near the points, from which the fit begins. */
  PrimitiveOptions &start(const Primitive &start);
  /** By how much the squared distance of each point counts. */
  PrimitiveOptions &weights(const std::vector<double> &weights) {
    return checked(surfsig_primitive_options_set_weights(handle_.get(), weights.data(), weights.size()));
  }
  /** Of a sphere, cylinder or circle. */
  PrimitiveOptions &radius(double radius) {
    return checked(surfsig_primitive_options_set_radius(handle_.get(), radius));
  }
  /** Of the axis or normal, of any length. */
  PrimitiveOptions &axis(const Vector &axis) {
    return checked(surfsig_primitive_options_set_axis(handle_.get(), axis.data()));
  }
  const surfsig_primitive_options *get() const { return handle_.get(); }

private:
  PrimitiveOptions &checked(surfsig_code code) {
    check(code);
    return *this;
  }
  detail::Handle<surfsig_primitive_options, surfsig_primitive_options_free> handle_{
      surfsig_primitive_options_new()};
};

/** How sure a surface's parameters are. */
struct Uncertainty {
  /** p x p, row by row, with p and the parameters as surfsig_surface_kind_parameters() says. */
  std::vector<double> covariance;
  /** Two unit vectors across the axis. */
  std::array<Vector, 2> across;
  /** Degrees of freedom of the radius's variance (a plane's: of the offset's). */
  double freedom;
};

/** A plane, sphere, cylinder, cone or torus without a boundary, a circle or a line. */
class Primitive {
public:
  explicit Primitive(surfsig_primitive *owned) : handle_(owned) {}
  surfsig_surface_kind kind() const { return surfsig_primitive_kind(get()); }
  Vector point() const { return vector(surfsig_primitive_point(get())); }
  Vector axis() const { return vector(surfsig_primitive_axis(get())); }
  double radius() const { return surfsig_primitive_radius(get()); }
  double major_radius() const { return surfsig_primitive_major_radius(get()); }
  double half_angle() const { return surfsig_primitive_half_angle(get()); }
  std::vector<double> distances(const Cloud &cloud) const {
    std::vector<double> distances(cloud.size());
    check(surfsig_primitive_distances(get(), cloud.get(), distances.data()));
    return distances;
  }
  /** With the options of the fit. */
  Uncertainty uncertainty(const Cloud &cloud, const PrimitiveOptions &options = PrimitiveOptions()) const {
    const std::size_t parameters = surfsig_surface_kind_parameters(kind());
    Uncertainty found{std::vector<double>(parameters * parameters), {}, 0.0};
    check(surfsig_primitive_uncertainty_with(get(), cloud.get(), options.get(), found.covariance.data(),
                                             found.across[0].data(), &found.freedom));
    return found;
  }
  double independent_error(const Cloud &cloud) const {
    return surfsig_primitive_independent_error(get(), cloud.get());
  }
  const surfsig_primitive *get() const { return handle_.get(); }

private:
  static Vector vector(const double *first) { return {{first[0], first[1], first[2]}}; }
  detail::Handle<surfsig_primitive, surfsig_primitive_free> handle_;
};

/** By orthogonal distance; from `start` on, if one is given. */
inline Primitive fit_primitive(const Cloud &cloud, surfsig_surface_kind kind,
                               const Primitive *start = nullptr) {
  surfsig_primitive *made = nullptr;
  check(surfsig_fit_primitive(cloud.get(), kind, start != nullptr ? start->get() : nullptr, &made));
  return Primitive(made);
}

/** The same where something is known, or points do not count alike. */
inline Primitive fit_primitive(const Cloud &cloud, surfsig_surface_kind kind,
                               const PrimitiveOptions &options) {
  surfsig_primitive *made = nullptr;
  check(surfsig_fit_primitive_with(cloud.get(), kind, options.get(), &made));
  return Primitive(made);
}

inline PrimitiveOptions &PrimitiveOptions::start(const Primitive &start) {
  return checked(surfsig_primitive_options_set_start(handle_.get(), start.get()));
}

} // namespace surfsig

#endif // SURFSIG_SURFACES_HPP
