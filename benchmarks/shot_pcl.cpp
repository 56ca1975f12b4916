// Computes PCL's SHOT at some points of a cloud with normals, and prints a line of JSON with the processor seconds.
//
//     shot_pcl RADIUS CLOUD.f32 PLACES ANSWERS.f32
//     shot_pcl versions
//
// CLOUD.f32 holds x y z and a normal as raw float32. The first PLACES points are described, by all points;
// ANSWERS.f32 gets 352 numbers for each, not finite where PCL has none.
#include <pcl/features/shot_omp.h>
#include <pcl/pcl_config.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include <cstdlib>
#include <ctime>
#include <exception>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

std::vector<float> read_numbers(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::vector<float> values(static_cast<std::size_t>(file.tellg()) / sizeof(float));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
  return values;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 2 && std::string(argv[1]) == "versions") {
    std::cout << R"({"PCL": ")" << PCL_VERSION_PRETTY << "\"}\n";
    return EXIT_SUCCESS;
  }
  if (argc != 5) throw std::runtime_error("usage: shot_pcl RADIUS CLOUD.f32 PLACES ANSWERS.f32");
  const std::vector<float> values = read_numbers(argv[2]);
  const std::size_t places = std::stoul(argv[3]);
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  pcl::PointCloud<pcl::PointXYZ>::Ptr asked(new pcl::PointCloud<pcl::PointXYZ>);
  pcl::PointCloud<pcl::Normal>::Ptr normals(new pcl::PointCloud<pcl::Normal>);
  for (std::size_t i = 0; i + 5 < values.size(); i += 6) {
    cloud->push_back({values[i], values[i + 1], values[i + 2]});
    normals->push_back({values[i + 3], values[i + 4], values[i + 5]});
    if (asked->size() < places) asked->push_back(cloud->back());
  }
  pcl::SHOTEstimationOMP<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(asked);
  estimation.setSearchSurface(cloud);
  estimation.setInputNormals(normals);
  estimation.setSearchMethod(pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  estimation.setRadiusSearch(std::stod(argv[1]));
  pcl::PointCloud<pcl::SHOT352> found;
  const std::clock_t start = std::clock();
  estimation.compute(found);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  std::ofstream file(argv[4], std::ios::binary);
  for (const pcl::SHOT352& signature : found)
    file.write(reinterpret_cast<const char*>(signature.descriptor), sizeof signature.descriptor);
  if (!file) throw std::runtime_error(std::string("cannot write ") + argv[4]);
  std::cout << R"({"processor_seconds": )" << seconds << "}\n";
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 2;
}
