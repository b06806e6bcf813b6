#include "loader_checks.hpp"
#include "sim3d/world.hpp"
#include "sim3d/world_io.hpp"

#include <catch2/catch.hpp>

#include <ctime>

namespace stairwell::sim3d::test {

namespace {
struct Expected {
  const char* file;
  std::size_t triangles;
  double area_m2;
  Eigen::Vector3d min_m;
  Eigen::Vector3d max_m;
};
}  // namespace

TEST_CASE("real buildings and maps load with their known size, fast") {
  const std::filesystem::path data = std::filesystem::path(STAIRWELL_SOURCE_DIR) / ".." / "shared" / "data";
  const std::vector<Expected> expected{
      {"buildings/duplex_office.sdf", 1146, 3540.79, {-10.6, -10.6, -0.3}, {10, 10, 4.6}},
      {"buildings/complex_office.sdf", 572, 3673.72, {-15.5, -15.5, -0.5}, {15.5, 15.5, 3}},
      {"multi_uav/cubicle_office.pcd", 445670, 7468.9, {-15.2, -15.7, -0.2}, {15.9, 15.4, 2.4}},
      {"octomap/geb079.bt", 261232, 2284.86, {-8, -7.52, -0.32}, {30.96, 7.44, 2.8}},
      {"planning/Complex.3dmap", 49900, 61442, {50, 50, 50}, {196, 104, 155}},
      {"planning/levine.stl", 587, 1624.22, {-2.3, -0.3, -0.00205}, {12.8, 27.3, 2.5}},
      {"thesis/map_A.yaml", 140, 843.44, {0, 0, 0}, {20, 20, 2.5}},
      {"thesis/map_3D.bt", 104, 884.64, {0, 0, 0}, {10, 10, 5}}};
  for (const Expected& e : expected) {
    if (!std::filesystem::exists(data / e.file)) {
      WARN("skipped: " << e.file << " is not there");
      continue;
    }
    INFO(e.file);
    const std::clock_t begin = std::clock();  // computing time, so that other programs on the machine do not count
    const WorldInfo info = world_info(load_world(data / e.file));
    const double taken_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    CHECK(info.triangles == e.triangles);
    CHECK(info.area_m2 == Approx(e.area_m2).epsilon(1e-4));
    CHECK((info.bounds.min_m - e.min_m).cwiseAbs().maxCoeff() < 1e-3);
    CHECK((info.bounds.max_m - e.max_m).cwiseAbs().maxCoeff() < 1e-3);
    CHECK(taken_s < 10.0);
  }
}

}  // namespace stairwell::sim3d::test
