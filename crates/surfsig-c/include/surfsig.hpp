/**
 * @file
 * surfsig in C++ (14 or later): the C interface with owners, containers and exceptions. See surfsig.h for
 * what the numbers mean.
 */

#ifndef SURFSIG_HPP
#define SURFSIG_HPP

#include <surfsig.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

namespace surfsig {

using Signature = std::array<float, SURFSIG_SIGNATURE>;
using Vector = std::array<double, 3>;
using Twist = std::array<double, 6>;
/** Told how much is done, and of how much; false stops the work. */
using Progress = std::function<bool(std::size_t done, std::size_t total)>;

/** What went wrong; what() says it in one line. */
class Error : public std::runtime_error {
public:
  explicit Error(surfsig_code code) : std::runtime_error(surfsig_last_error()), code(code) {}
  surfsig_code code;
};

inline void check(surfsig_code code) {
  if (code != SURFSIG_CODE_OK) throw Error(code);
}

namespace detail {

/** Frees what C made. */
template <class T, void (*free)(T *)> struct Free {
  void operator()(T *object) const { free(object); }
};
template <class T, void (*free)(T *)> using Handle = std::unique_ptr<T, Free<T, free>>;

/** A progress function whose exceptions do not pass through C: they are kept, and thrown afterwards. */
class Watch {
public:
  static int call(void *watch, std::size_t done, std::size_t total) noexcept {
    Watch &self = *static_cast<Watch *>(watch);
    try {
      return self.progress(done, total) ? 0 : 1;
    } catch (...) {
      self.thrown = std::current_exception();
      return 1;
    }
  }
  void check(surfsig_code code) {
    if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
    surfsig::check(code);
  }
  Progress progress;

private:
  std::exception_ptr thrown;
};

} // namespace detail

/**
 * Points whose x, y, z stand `stride` bytes apart; `origin`, three numbers, is added to each. Packed points
 * are used where they are: they must neither change nor go as long as the cloud is used.
 */
class Cloud {
public:
  Cloud(const float *points, std::size_t count, std::size_t stride, const double *origin = nullptr) {
    surfsig_cloud *made = nullptr;
    check(surfsig_cloud_new_f32(points, count, stride, origin, &made));
    handle_.reset(made);
  }
  Cloud(const double *points, std::size_t count, std::size_t stride, const double *origin = nullptr) {
    surfsig_cloud *made = nullptr;
    check(surfsig_cloud_new_f64(points, count, stride, origin, &made));
    handle_.reset(made);
  }
  /** A container of points with members x, y, z in a row, such as pcl::PointCloud<pcl::PointXYZ>::points. */
  template <class Points>
  explicit Cloud(const Points &points, const double *origin = nullptr)
      : Cloud(points.size() == 0 ? nullptr : &points.data()->x, points.size(), sizeof(*points.data()),
              origin) {}
  std::size_t size() const { return surfsig_cloud_size(get()); }
  /** Median distance of a point to its nearest other one; a radius of 5 to 10 times that is a start. */
  double spacing() const { return surfsig_cloud_spacing(get()); }
  const surfsig_cloud *get() const { return handle_.get(); }

private:
  detail::Handle<surfsig_cloud, surfsig_cloud_free> handle_;
};

/** How an extraction is done; by default in the surface's axes, on all cores, at every point. */
class Options {
public:
  Options &axes(surfsig_axes axes) { return checked(surfsig_options_set_axes(handle_.get(), axes)); }
  Options &fit(surfsig_fit fit) { return checked(surfsig_options_set_fit(handle_.get(), fit)); }
  Options &viewpoint(const Vector &viewpoint) {
    return checked(surfsig_options_set_viewpoint(handle_.get(), viewpoint.data()));
  }
  /** Of each point of the cloud, or of each position. */
  Options &normals(const std::vector<std::array<float, 3>> &normals) {
    static const float none = 0.0f; // null would mean that no normals are known
    const float *const first = normals.empty() ? &none : normals.front().data();
    return checked(surfsig_options_set_normals(handle_.get(), first, normals.size()));
  }
  Options &threads(std::uint32_t threads) {
    return checked(surfsig_options_set_threads(handle_.get(), threads));
  }
  Options &neighbors(std::uint32_t most) {
    return checked(surfsig_options_set_neighbors(handle_.get(), most));
  }
  Options &robust(bool robust) { return checked(surfsig_options_set_robust(handle_.get(), robust ? 1 : 0)); }
  Options &all() { return checked(surfsig_options_set_all(handle_.get())); }
  Options &indices(const std::vector<std::uint32_t> &indices) {
    return checked(surfsig_options_set_indices(handle_.get(), indices.data(), indices.size()));
  }
  Options &positions(const std::vector<Vector> &positions) {
    const double *const first = positions.empty() ? nullptr : positions.front().data();
    return checked(surfsig_options_set_positions(handle_.get(), first, positions.size()));
  }
  Options &voxel(double edge) { return checked(surfsig_options_set_voxel(handle_.get(), edge)); }
  /** Called by the thread that extracts; what it throws stops the extraction and is thrown by that. */
  Options &progress(Progress progress) {
    watch_->progress = std::move(progress);
    const auto call = watch_->progress ? &detail::Watch::call : nullptr;
    return checked(surfsig_options_set_progress(handle_.get(), call, watch_.get()));
  }
  const surfsig_options *get() const { return handle_.get(); }
  /** Throws where a call with these options failed. */
  void check(surfsig_code code) const { watch_->check(code); }

private:
  Options &checked(surfsig_code code) {
    surfsig::check(code);
    return *this;
  }
  detail::Handle<surfsig_options, surfsig_options_free> handle_{surfsig_options_new()};
  std::unique_ptr<detail::Watch> watch_{std::make_unique<detail::Watch>()};
};

/** A column of a result; it lives as long as that. Empty where the result does not have it. */
template <class T> class Column {
public:
  Column(const T *first, std::size_t size) : first_(first), size_(first == nullptr ? 0 : size) {}
  const T *data() const { return first_; }
  std::size_t size() const { return size_; }
  const T *begin() const { return first_; }
  const T *end() const { return first_ + size_; }
  const T &operator[](std::size_t i) const { return first_[i]; }

private:
  const T *first_;
  std::size_t size_;
};

/**
 * Columns of one length: k1(), k2(), normals(), ..., one for each function surfsig_extraction_...() of
 * SURFSIG_EXTRACTION_COLUMNS. Those of vectors hold several numbers for each query, row by row.
 */
class Extraction {
public:
  explicit Extraction(surfsig_extraction *owned) : handle_(owned) {}
  std::size_t size() const { return surfsig_extraction_size(get()); }
  double radius() const { return surfsig_extraction_radius(get()); }
  bool oriented() const { return surfsig_extraction_oriented(get()) != 0; }
#define SURFSIG_COLUMN(type, name, width)                                                                  \
  Column<type> name() const { return {surfsig_extraction_##name(get()), width * size()}; }
  SURFSIG_EXTRACTION_COLUMNS(SURFSIG_COLUMN)
#undef SURFSIG_COLUMN

  /** Signatures of queries, and, where asked for, why one is missing. */
  std::vector<Signature> signatures(const std::vector<std::uint32_t> &queries,
                                    std::vector<surfsig_status> *statuses = nullptr) const {
    std::vector<Signature> rows(queries.size());
    if (statuses != nullptr) statuses->resize(queries.size());
    if (queries.empty()) return rows;
    surfsig_status *const why = statuses != nullptr ? statuses->data() : nullptr;
    check(surfsig_signatures(get(), queries.data(), queries.size(), rows.front().data(), why));
    return rows;
  }
  /** A length for similarities(), by which what is flat within its error differs from the slightly curved. */
  double flat_atom_length() const { return surfsig_flat_atom_length(get()); }
  /** zeta of all queries with one of them: where else its surface is; NaN where there is no signature. */
  std::vector<float> similarities(std::uint32_t query, double flat_atom = 0.0) const {
    std::vector<float> zeta(size());
    check(surfsig_similarities(get(), query, flat_atom, zeta.data()));
    return zeta;
  }
  const surfsig_extraction *get() const { return handle_.get(); }

private:
  detail::Handle<surfsig_extraction, surfsig_extraction_free> handle_;
};

/** From the points within a radius of each query. */
inline Extraction extract(const Cloud &cloud, double radius, const Options &options = Options()) {
  surfsig_extraction *made = nullptr;
  options.check(surfsig_extract(cloud.get(), radius, options.get(), &made));
  return Extraction(made);
}

inline Extraction extract(const float *points, std::size_t count, std::size_t stride, double radius,
                          const Options &options = Options(), const double *origin = nullptr) {
  return extract(Cloud(points, count, stride, origin), radius, options);
}

inline Extraction extract(const double *points, std::size_t count, std::size_t stride, double radius,
                          const Options &options = Options(), const double *origin = nullptr) {
  return extract(Cloud(points, count, stride, origin), radius, options);
}

/** A container of points with neighbouring members x, y, z. */
template <class Points>
Extraction extract(const Points &points, double radius, const Options &options = Options(),
                   const double *origin = nullptr) {
  return extract(Cloud(points, origin), radius, options);
}

/** From the nearest points of each query. */
inline Extraction extract_nearest(const Cloud &cloud, std::uint32_t neighbors,
                                  const Options &options = Options()) {
  surfsig_extraction *made = nullptr;
  options.check(surfsig_extract_nearest(cloud.get(), neighbors, options.get(), &made));
  return Extraction(made);
}

/** From balls whose radius each query chooses. */
inline Extraction extract_auto_radius(const Cloud &cloud, const Options &options = Options()) {
  surfsig_extraction *made = nullptr;
  options.check(surfsig_extract_auto_radius(cloud.get(), options.get(), &made));
  return Extraction(made);
}

/** From balls of several radii, one extraction for each. */
inline std::vector<Extraction> extract_radii(const Cloud &cloud, const std::vector<double> &radii,
                                             const Options &options = Options()) {
  std::vector<surfsig_extraction *> made(radii.size(), nullptr);
  options.check(surfsig_extract_radii(cloud.get(), radii.data(), radii.size(), options.get(), made.data()));
  return std::vector<Extraction>(made.begin(), made.end());
}

inline double similarity(const Signature &a, const Signature &b) {
  return surfsig_similarity(a.data(), b.data());
}

/** Sums over points, about a centre near them, off which surfaces are read. Those of two sets add. */
class Moments {
public:
  explicit Moments(const Cloud &cloud, const Vector &centre = {{0.0, 0.0, 0.0}}) {
    check(surfsig_moments(cloud.get(), centre.data(), sums_.data()));
  }
  Moments &operator+=(const Moments &other) {
    for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += other.sums_[i];
    return *this;
  }
  surfsig_sphere sphere() const { return fitted<surfsig_sphere>(surfsig_fit_sphere); }
  surfsig_cylinder cylinder() const { return fitted<surfsig_cylinder>(surfsig_fit_cylinder); }
  surfsig_quadric quadric() const { return fitted<surfsig_quadric>(surfsig_fit_quadric); }
  const double *data() const { return sums_.data(); }

private:
  template <class T> T fitted(surfsig_code (*fit)(const double *, T *)) const {
    T found;
    check(fit(data(), &found));
    return found;
  }
  std::array<double, SURFSIG_MOMENTS> sums_;
};

/**
 * A rotation and a translation: a point p of the source is at R p + t of the target. Written T_target_source,
 * so that T_a_b * T_b_c = T_a_c.
 *
 * With Eigen: `Isometry(matrix)` of an Eigen::Matrix<double, 4, 4, Eigen::RowMajor>, and back
 * `Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(isometry.data())`.
 */
class Isometry {
public:
  Isometry() : transform_(surfsig_transform_identity()) {}
  explicit Isometry(const surfsig_transform &transform) : Isometry(transform.matrix) {}
  /** 16 doubles, row by row; the rotation may be off by 1e-4, as a printed one is. */
  explicit Isometry(const double *matrix) { check(surfsig_transform_from_matrix(matrix, &transform_)); }
  /** A row-major matrix of doubles, such as Eigen's. */
  template <class Matrix, int row_major = Matrix::IsRowMajor>
  explicit Isometry(const Matrix &matrix) : Isometry(matrix.data()) {
    static_assert(row_major == 1 && Matrix::SizeAtCompileTime == 16, "a 4 x 4 matrix, row by row");
  }
  static Isometry from_rotation_vector(const Vector &rotation, const Vector &translation) {
    Isometry made;
    check(surfsig_transform_from_rotation_vector(rotation.data(), translation.data(), &made.transform_));
    return made;
  }
  static Isometry exp(const Twist &twist) {
    Isometry made;
    check(surfsig_transform_exp(twist.data(), &made.transform_));
    return made;
  }
  Twist log() const {
    Twist twist;
    check(surfsig_transform_log(&transform_, twist.data()));
    return twist;
  }
  /** 6 x 6, row by row. */
  std::array<double, 36> adjoint() const {
    std::array<double, 36> matrix;
    check(surfsig_transform_adjoint(&transform_, matrix.data()));
    return matrix;
  }
  Isometry inverse() const {
    Isometry made;
    check(surfsig_transform_inverse(&transform_, &made.transform_));
    return made;
  }
  Isometry operator*(const Isometry &first) const {
    Isometry made;
    check(surfsig_transform_compose(&transform_, &first.transform_, &made.transform_));
    return made;
  }
  /** Where a point is in the target. */
  Vector transform_point(const Vector &point) const {
    Vector moved;
    check(surfsig_transform_points(&transform_, point.data(), 1, sizeof point, moved.data()));
    return moved;
  }
  std::vector<Vector> transform_points(const std::vector<Vector> &points) const {
    std::vector<Vector> moved(points.size());
    if (points.empty()) return moved;
    check(surfsig_transform_points(&transform_, points.front().data(), points.size(), sizeof(Vector),
                                   moved.front().data()));
    return moved;
  }
  /** What a vector, such as a normal, is in the target: not translated. */
  Vector transform_vector(const Vector &vector) const {
    Vector rotated;
    check(surfsig_transform_vectors(&transform_, vector.data(), 1, sizeof vector, rotated.data()));
    return rotated;
  }
  const double *data() const { return transform_.matrix; }
  const surfsig_transform &get() const { return transform_; }

private:
  surfsig_transform transform_;
};

} // namespace surfsig

#include <surfsig_finding.hpp>
#include <surfsig_registration.hpp>
#include <surfsig_surfaces.hpp>

#endif // SURFSIG_HPP
