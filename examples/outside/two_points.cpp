// two_points FILE.bt: a map from a scan of two points, saved for octovis.
#include "core/scan.hpp"
#include "core/version.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/octomap_io.hpp"
#include "mapping/scan_integrator.hpp"

#include <exception>
#include <iostream>

int main(int argc, char** argv) {
  using namespace stairwell;
  if (argc != 2) {
    std::cerr << "usage: two_points FILE.bt\n";
    return 2;
  }
  try {
    mapping::OccupancyMap map(GridSpec(Aabb{{-3.0, -3.0, 0.0}, {3.0, 3.0, 3.0}}, 0.1));
    Scan scan;
    scan.T_world_sensor = make_pose({0.05, 0.05, 1.05});
    scan.points_m = {{2.0f, 0.0f, 0.0f}, {0.0f, 1.5f, 0.5f}};
    mapping::ScanIntegrator().integrate(scan, map);
    mapping::save_octomap(map, argv[1]);
    std::cout << argv[1] << ": " << map.occupied_voxels() << " occupied of " << map.known_voxels() << " known voxels\n";
    return map.occupied_voxels() == 2 ? 0 : 1;
  } catch (const std::exception& error) {
    std::cerr << "two_points: " << error.what() << '\n';
    return 1;
  }
}
