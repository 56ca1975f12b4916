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
#include <memory>
#include <stdexcept>
#include <vector>

namespace surfsig {

using Signature = std::array<float, SURFSIG_SIGNATURE>;

/** What went wrong; what() says it in one line. */
class Error : public std::runtime_error {
public:
  explicit Error(surfsig_code code) : std::runtime_error(surfsig_last_error()), code(code) {}
  surfsig_code code;
};

inline void check(surfsig_code code) {
  if (code != SURFSIG_CODE_OK) throw Error(code);
}

/** How an extraction is done; by default in the surface's axes, on all cores, at every point. */
class Options {
public:
  Options &axes(surfsig_axes axes) { return checked(surfsig_options_set_axes(handle_.get(), axes)); }
  Options &viewpoint(const std::array<double, 3> &viewpoint) {
    return checked(surfsig_options_set_viewpoint(handle_.get(), viewpoint.data()));
  }
  Options &threads(std::uint32_t threads) {
    return checked(surfsig_options_set_threads(handle_.get(), threads));
  }
  Options &indices(const std::vector<std::uint32_t> &indices) {
    return checked(surfsig_options_set_indices(handle_.get(), indices.data(), indices.size()));
  }
  const surfsig_options *get() const { return handle_.get(); }

private:
  struct Free {
    void operator()(surfsig_options *options) const { surfsig_options_free(options); }
  };
  Options &checked(surfsig_code code) {
    check(code);
    return *this;
  }
  std::unique_ptr<surfsig_options, Free> handle_{surfsig_options_new()};
};

/** A column of an extraction; it lives as long as that. */
template <class T> class Column {
public:
  Column(const T *first, std::size_t size) : first_(first), size_(size) {}
  const T *data() const { return first_; }
  std::size_t size() const { return size_; }
  const T *begin() const { return first_; }
  const T *end() const { return first_ + size_; }
  const T &operator[](std::size_t i) const { return first_[i]; }

private:
  const T *first_;
  std::size_t size_;
};

/** Columns of one length; those of vectors hold three numbers for each place, row by row. */
class Extraction {
public:
  explicit Extraction(surfsig_extraction *owned) : handle_(owned) {}
  std::size_t size() const { return surfsig_extraction_size(get()); }
  Column<float> k1() const { return {surfsig_extraction_k1(get()), size()}; }
  Column<float> k2() const { return {surfsig_extraction_k2(get()), size()}; }
  Column<float> normals() const { return {surfsig_extraction_normals(get()), 3 * size()}; }
  Column<float> directions() const { return {surfsig_extraction_directions(get()), 3 * size()}; }
  Column<float> residual() const { return {surfsig_extraction_residual(get()), size()}; }
  Column<float> condition() const { return {surfsig_extraction_condition(get()), size()}; }
  Column<std::uint32_t> count() const { return {surfsig_extraction_count(get()), size()}; }
  Column<surfsig_status> status() const { return {surfsig_extraction_status(get()), size()}; }
  Column<float> linearity() const { return {surfsig_extraction_linearity(get()), size()}; }
  Column<float> planarity() const { return {surfsig_extraction_planarity(get()), size()}; }
  Column<float> scattering() const { return {surfsig_extraction_scattering(get()), size()}; }

  /** Signatures of places, and, where asked for, why one is missing. */
  std::vector<Signature> signatures(const std::vector<std::uint32_t> &places,
                                    std::vector<surfsig_status> *statuses = nullptr) const {
    std::vector<Signature> rows(places.size());
    if (statuses != nullptr) statuses->resize(places.size());
    if (places.empty()) return rows;
    surfsig_status *const why = statuses != nullptr ? statuses->data() : nullptr;
    check(surfsig_signatures(get(), places.data(), places.size(), rows.front().data(), why));
    return rows;
  }
  const surfsig_extraction *get() const { return handle_.get(); }

private:
  struct Free {
    void operator()(surfsig_extraction *extraction) const { surfsig_extraction_free(extraction); }
  };
  std::unique_ptr<surfsig_extraction, Free> handle_;
};

/** Points whose x, y, z stand `stride` bytes apart; `origin`, three numbers, is added to each. */
inline Extraction extract(const float *points, std::size_t count, std::size_t stride, double radius,
                          const Options &options = Options(), const double *origin = nullptr) {
  surfsig_extraction *made = nullptr;
  check(surfsig_extract_f32(points, count, stride, origin, radius, options.get(), &made));
  return Extraction(made);
}

inline Extraction extract(const double *points, std::size_t count, std::size_t stride, double radius,
                          const Options &options = Options(), const double *origin = nullptr) {
  surfsig_extraction *made = nullptr;
  check(surfsig_extract_f64(points, count, stride, origin, radius, options.get(), &made));
  return Extraction(made);
}

/** A container of points with neighbouring members x, y, z, such as pcl::PointCloud<pcl::PointXYZ>::points. */
template <class Points>
Extraction extract(const Points &points, double radius, const Options &options = Options(),
                   const double *origin = nullptr) {
  const auto *const x = points.size() == 0 ? nullptr : &points.data()->x;
  return extract(x, points.size(), sizeof(*points.data()), radius, options, origin);
}

inline double similarity(const Signature &a, const Signature &b) {
  return surfsig_similarity(a.data(), b.data());
}

} // namespace surfsig

#endif // SURFSIG_HPP
