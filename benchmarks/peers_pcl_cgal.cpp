// Times one method of PCL or CGAL on one cloud and prints one JSON line.
//
//     peers_pcl_cgal METHOD CLOUD.f32 RADIUS THREADS QUERIES
//     peers_pcl_cgal versions
//
// CLOUD.f32 holds x y z as raw float32. QUERIES points, evenly spaced in the file's order, are worked on (0: all of
// them); all points are the search surface. The kd-tree, and the normals that a method asks for, are made before
// the clock starts.
#include <CGAL/Monge_via_jet_fitting.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>
#include <pcl/features/fpfh_omp.h>
#include <pcl/features/normal_3d_omp.h>
#include <pcl/features/principal_curvatures.h>
#include <pcl/pcl_config.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;
using Tree = pcl::search::KdTree<pcl::PointXYZ>;

struct Job {
  Cloud::Ptr cloud;
  Tree::Ptr tree;
  pcl::IndicesPtr queries;
  double radius;
  int threads;
};

struct Times {
  double seconds;
  double processor_seconds;  // of all threads together
};

struct Outcome {
  Times times;
  std::size_t valid;  // how many answers are finite
};

Cloud::Ptr read_cloud(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<float> values(static_cast<std::size_t>(file.tellg()) / sizeof(float));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
  Cloud::Ptr cloud(new Cloud);
  cloud->reserve(values.size() / 3);
  for (std::size_t i = 0; i + 2 < values.size(); i += 3)
    cloud->push_back({values[i], values[i + 1], values[i + 2]});
  return cloud;
}

pcl::IndicesPtr evenly_spaced(std::size_t wanted, std::size_t available) {
  const std::size_t count = wanted == 0 ? available : std::min(wanted, available);
  pcl::IndicesPtr indices(new pcl::Indices(count));
  for (std::size_t i = 0; i < count; ++i) (*indices)[i] = static_cast<int>(i * available / count);
  return indices;
}

double mean_neighbours(const Job& job) {
  const pcl::IndicesPtr sample = evenly_spaced(1000, job.cloud->size());
  std::size_t sum = 0;
  pcl::Indices indices;
  std::vector<float> squared_distances;
  for (const int i : *sample) sum += job.tree->radiusSearch((*job.cloud)[i], job.radius, indices, squared_distances);
  return static_cast<double>(sum) / static_cast<double>(sample->size());
}

template <class Work>
Times times_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t processor_start = std::clock();
  work();
  const std::clock_t processor_time = std::clock() - processor_start;
  const auto time = std::chrono::steady_clock::now() - start;
  return {std::chrono::duration<double>(time).count(), static_cast<double>(processor_time) / CLOCKS_PER_SEC};
}

template <class Point, class IsFinite>
std::size_t count_valid(const pcl::PointCloud<Point>& points, const IsFinite& is_finite) {
  return static_cast<std::size_t>(std::count_if(points.begin(), points.end(), is_finite));
}

bool normal_is_finite(const pcl::Normal& normal) { return std::isfinite(normal.normal_x); }

pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> normal_estimation(const Job& job) {
  pcl::NormalEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation(job.threads);
  estimation.setInputCloud(job.cloud);
  estimation.setSearchMethod(job.tree);
  estimation.setRadiusSearch(job.radius);
  return estimation;
}

Normals::Ptr normals_of_all(const Job& job) {
  Normals::Ptr normals(new Normals);
  normal_estimation(job).compute(*normals);
  return normals;
}

Outcome pcl_normals(const Job& job) {
  auto estimation = normal_estimation(job);
  estimation.setIndices(job.queries);
  Normals normals;
  const Times times = times_of([&] { estimation.compute(normals); });
  return {times, count_valid(normals, normal_is_finite)};
}

// PCL has no parallel version of this one.
Outcome pcl_curvatures(const Job& job) {
  pcl::PrincipalCurvaturesEstimation<pcl::PointXYZ, pcl::Normal, pcl::PrincipalCurvatures> estimation;
  estimation.setInputCloud(job.cloud);
  estimation.setInputNormals(normals_of_all(job));
  estimation.setSearchMethod(job.tree);
  estimation.setRadiusSearch(job.radius);
  estimation.setIndices(job.queries);
  pcl::PointCloud<pcl::PrincipalCurvatures> curvatures;
  const Times times = times_of([&] { estimation.compute(curvatures); });
  return {times, count_valid(curvatures, [](const auto& curvature) { return std::isfinite(curvature.pc1); })};
}

Outcome pcl_fpfh(const Job& job) {
  pcl::FPFHEstimationOMP<pcl::PointXYZ, pcl::Normal, pcl::FPFHSignature33> estimation(job.threads);
  estimation.setInputCloud(job.cloud);
  estimation.setInputNormals(normals_of_all(job));
  estimation.setSearchMethod(job.tree);
  estimation.setRadiusSearch(job.radius);
  estimation.setIndices(job.queries);
  pcl::PointCloud<pcl::FPFHSignature33> histograms;
  const Times times = times_of([&] { estimation.compute(histograms); });
  return {times, count_valid(histograms, [](const auto& h) { return std::isfinite(h.histogram[0]); })};
}

// CGAL fits a jet to points that somebody else has found: PCL's tree finds them here.
Outcome cgal_jet(const Job& job, std::size_t degree) {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Fit = CGAL::Monge_via_jet_fitting<Kernel>;
  const std::size_t fewest = (degree + 1) * (degree + 2) / 2;
  const auto to_cgal = [](const pcl::PointXYZ& p) { return Kernel::Point_3(p.x, p.y, p.z); };
  std::size_t valid = 0;
  const Times times = times_of([&] {
#pragma omp parallel num_threads(job.threads) reduction(+ : valid)
    {
      pcl::Indices indices;
      std::vector<float> squared_distances;
      std::vector<Kernel::Point_3> points;
#pragma omp for schedule(dynamic, 16)
      for (std::size_t q = 0; q < job.queries->size(); ++q) {
        const int query = (*job.queries)[q];
        job.tree->radiusSearch((*job.cloud)[query], job.radius, indices, squared_distances);
        if (indices.size() < fewest) continue;
        points.assign(1, to_cgal((*job.cloud)[query]));  // CGAL fits about the first point
        for (const int i : indices)
          if (i != query) points.push_back(to_cgal((*job.cloud)[i]));
        Fit fit;
        const auto form = fit(points.begin(), points.end(), degree, 2);
        valid += std::isfinite(form.principal_curvatures(0)) ? 1 : 0;
      }
    }
  });
  return {times, valid};
}

const std::map<std::string, std::function<Outcome(const Job&)>> METHODS = {
    {"pcl_normals", pcl_normals},
    {"pcl_normals_unsorted", pcl_normals},
    {"pcl_curvatures", pcl_curvatures},
    {"pcl_fpfh", pcl_fpfh},
    {"cgal_jet2", [](const Job& job) { return cgal_jet(job, 2); }},
    {"cgal_jet4", [](const Job& job) { return cgal_jet(job, 4); }},
};

void print_versions() {
  std::cout << R"({"PCL": ")" << PCL_VERSION_PRETTY << R"(", "CGAL": ")" << CGAL_VERSION_STR << R"(", "Eigen": ")"
            << EIGEN_WORLD_VERSION << '.' << EIGEN_MAJOR_VERSION << '.' << EIGEN_MINOR_VERSION
            << R"(", "C++ compiler": ")" << __VERSION__ << "\"}\n";
}

void time_method(const std::string& name, const std::string& path, double radius, int threads, std::size_t queries) {
  const auto method = METHODS.find(name);
  if (method == METHODS.end()) throw std::runtime_error("no such method: " + name);
  // As PCL's tutorials set it up, the tree sorts neighbours by distance, which no method here needs: only the
  // method that is named so pays for it.
  const bool sorted = name == "pcl_normals";
  Job job{read_cloud(path), Tree::Ptr(new Tree(sorted)), nullptr, radius, threads};
  job.tree->setInputCloud(job.cloud);
  job.queries = evenly_spaced(queries, job.cloud->size());
  const Outcome outcome = method->second(job);
  const auto points = static_cast<double>(job.queries->size());
  std::cout.precision(9);
  std::cout << R"({"method": ")" << name << R"(", "points": )" << job.queries->size() << R"(, "seconds": )"
            << outcome.times.seconds << R"(, "processor_seconds": )" << outcome.times.processor_seconds
            << R"(, "points_per_second": )" << points / outcome.times.seconds
            << R"(, "mean_neighbours": )" << mean_neighbours(job) << R"(, "threads": )"
            << (name == "pcl_curvatures" ? 1 : threads) << R"(, "valid": )"
            << static_cast<double>(outcome.valid) / points << "}\n";
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 2 && std::string(argv[1]) == "versions") {
    print_versions();
    return EXIT_SUCCESS;
  }
  if (argc != 6) throw std::runtime_error("usage: peers_pcl_cgal METHOD CLOUD.f32 RADIUS THREADS QUERIES");
  time_method(argv[1], argv[2], std::stod(argv[3]), std::stoi(argv[4]), std::stoul(argv[5]));
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
