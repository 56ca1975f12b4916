/**
 * @file
 * Instances of models in scenes, in C++: included by surfsig.hpp.
 */

#ifndef SURFSIG_FINDING_HPP
#define SURFSIG_FINDING_HPP

#include <surfsig_registration.hpp>

namespace surfsig {

/** How models are prepared and looked for; by default with a score of 0.5 at least, on all cores. */
class FindOptions {
public:
  FindOptions &score(double score) { return checked(surfsig_find_options_set_score(handle_.get(), score)); }
  FindOptions &at_most(std::size_t count) {
    return checked(surfsig_find_options_set_at_most(handle_.get(), count));
  }
  FindOptions &threads(std::uint32_t threads) {
    return checked(surfsig_find_options_set_threads(handle_.get(), threads));
  }
  /** Called by the thread that searches; what it throws stops the search and is thrown by that. */
  FindOptions &progress(Progress progress) {
    watch_->progress = std::move(progress);
    const auto call = watch_->progress ? &detail::Watch::call : nullptr;
    return checked(surfsig_find_options_set_progress(handle_.get(), call, watch_.get()));
  }
  const surfsig_find_options *get() const { return handle_.get(); }
  /** Throws where a call with these options failed. */
  void check(surfsig_code code) const { watch_->check(code); }

private:
  FindOptions &checked(surfsig_code code) {
    surfsig::check(code);
    return *this;
  }
  detail::Handle<surfsig_find_options, surfsig_find_options_free> handle_{surfsig_find_options_new()};
  std::unique_ptr<detail::Watch> watch_{std::make_unique<detail::Watch>()};
};

/** What is looked for: a whole object, or one view of it, prepared once. It refers to nothing of the scan. */
class Model {
public:
  explicit Model(const Scan &scan, const FindOptions &options = FindOptions()) {
    const surfsig_scan given = scan.get();
    surfsig_model *made = nullptr;
    options.check(surfsig_model_new(&given, options.get(), &made));
    handle_.reset(made);
  }
  /** Number of finite points. */
  std::size_t size() const { return surfsig_model_size(get()); }
  /** Radius of the patches that describe it. */
  double radius() const { return surfsig_model_radius(get()); }
  /** Median distance of its points to their nearest other ones. */
  double spacing() const { return surfsig_model_spacing(get()); }
  const surfsig_model *get() const { return handle_.get(); }

private:
  detail::Handle<surfsig_model, surfsig_model_free> handle_;
};

/** A model that is in a scene; surfsig_instance says what its numbers mean. */
struct Instance : surfsig_instance {
  /** Takes the model's points to the scene. */
  Isometry transform() const { return Isometry(T_scene_model); }
  /** Numbers of the scene's points that are the instance's, ascending. */
  std::vector<std::uint32_t> indices;
};

namespace detail {
inline std::vector<Instance> found(const std::vector<const surfsig_model *> &models, const Scan &scene,
                                   const FindOptions &options) {
  const surfsig_scan given = scene.get();
  surfsig_instances *made = nullptr;
  options.check(surfsig_find_instances(models.data(), models.size(), &given, options.get(), &made));
  const Handle<surfsig_instances, surfsig_instances_free> all(made);
  std::vector<Instance> instances(surfsig_instances_size(made));
  for (std::size_t i = 0; i < instances.size(); ++i) {
    surfsig::check(surfsig_instances_get(made, i, &instances[i]));
    const std::uint32_t *const first = surfsig_instances_indices(made, i);
    instances[i].indices.assign(first, first + instances[i].point_count);
  }
  return instances;
}
} // namespace detail

/** Finds every instance of a model in a scene; the best first. */
inline std::vector<Instance> find_instances(const Model &model, const Scan &scene,
                                            const FindOptions &options = FindOptions()) {
  return detail::found({model.get()}, scene, options);
}

/** Finds every instance of several models, which it tells by their number. */
inline std::vector<Instance> find_instances(const std::vector<Model> &models, const Scan &scene,
                                            const FindOptions &options = FindOptions()) {
  std::vector<const surfsig_model *> all;
  for (const Model &model : models) all.push_back(model.get());
  return detail::found(all, scene, options);
}

} // namespace surfsig

#endif // SURFSIG_FINDING_HPP
