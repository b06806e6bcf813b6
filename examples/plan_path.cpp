// plan_path MAP.bt X,Y,Z X,Y,Z: a safe path through the known-free space of a map, printed point by point.
#include "mapping/distance_field.hpp"
#include "mapping/octomap_io.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/safety_check.hpp"

#include <octomap/OcTree.h>

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

namespace {

using namespace stairwell;

Eigen::Vector3d parse_point(const char* text) {
  Eigen::Vector3d point_m;
  char rest = 0;
  if (std::sscanf(text, "%lf,%lf,%lf%c", &point_m.x(), &point_m.y(), &point_m.z(), &rest) != 3)
    throw std::invalid_argument(std::string("expected X,Y,Z in metres, got ") + text);
  return point_m;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: plan_path MAP.bt X,Y,Z X,Y,Z\n");
    return 2;
  }
  try {
    const auto tree = mapping::load_octree(argv[1]);
    const mapping::OccupancyMap map = mapping::map_from_octree(*tree);
    mapping::DistanceField distance(map.grid(), 1.0, mapping::Obstacles::kBlocked);
    distance.update(map);
    Robot robot;
    robot.radius_m = 0.25;
    const planning3d::FreeSpace space(map, distance, robot, map.grid().box());

    planning3d::PlanRequest request;
    request.start_m = parse_point(argv[2]);
    request.goal_m = parse_point(argv[3]);
    const planning3d::PlanResult result = planning3d::make_planner("astar")->plan(space, request);
    if (result.status != planning3d::PlanStatus::kReached) {
      std::printf("no path: %s\n", planning3d::to_string(result.status));
      return 1;
    }
    for (const Eigen::Vector3d& p : result.path_m) std::printf("%.3f,%.3f,%.3f\n", p.x(), p.y(), p.z());
    const planning3d::SafetyReport report = planning3d::SafetyCheck().check_path(space, result.path_m);
    std::printf("length %.2f m, %s\n", result.length_m, planning3d::to_string(report.verdict));
    return report.safe() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "plan_path: %s\n", error.what());
    return 1;
  }
}
