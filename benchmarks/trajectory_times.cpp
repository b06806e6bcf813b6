/// trajectory_times [JMAX_MPS3]: how much longer trajectories take than their paths must. Between 200 random pairs of
/// places of each world (all of it known, 0.1 m), A*'s path as in exploration (at least 2 m long) is flown from rest to
/// rest: by a UAV that sees all round, and by one with a depth camera that faces the direction of flight (from a random
/// yaw to a random one). Lower bound: the bang-bang time of the polyline's length with the limits of speed and
/// acceleration, as if it had no corners and whatever the limit of jerk (none if left out). Times are this thread's
/// processor time.
#include "benchmarks/known_building.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/shorten_path.hpp"
#include "planning3d/trajectory_builder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

using namespace stairwell;
using namespace stairwell::planning3d;
using benchmarks::KnownBuilding;
using benchmarks::thread_time_s;

namespace {

constexpr int kPairs = 200;
constexpr double kLeastLength_m = 2.0;

std::vector<std::vector<Eigen::Vector3d>> make_paths(const KnownBuilding& building, const FreeSpace& space) {
  Rng rng = make_rng(1, "trajectory times");
  const auto planner = make_planner("astar");
  std::vector<std::vector<Eigen::Vector3d>> paths;
  while (paths.size() < kPairs) {
    PlanRequest request;
    request.start_m = building.any_place_m(rng);
    request.goal_m = building.any_place_m(rng);
    const PlanResult plan = planner->plan(space, request);
    if (plan.status == PlanStatus::kReached && plan.length_m >= kLeastLength_m) paths.push_back(plan.path_m);
  }
  return paths;
}

double bang_bang_s(double length_m, const MotionLimits& limits) {
  const double ramps_m = limits.speed_mps * limits.speed_mps / limits.acceleration_mps2;
  if (length_m <= ramps_m) return 2.0 * std::sqrt(length_m / limits.acceleration_mps2);
  return 2.0 * limits.speed_mps / limits.acceleration_mps2 + (length_m - ramps_m) / limits.speed_mps;
}

double at_share(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void measure(const char* name, const FreeSpace& space, const std::vector<std::vector<Eigen::Vector3d>>& paths,
             bool camera, const MotionLimits& limits) {
  const TrajectoryBuilder builder(limits, SafetyCheck{});
  Rng rng = make_rng(2, "trajectory times");
  std::vector<double> ratios;
  std::vector<double> times_ms;
  double sum = 0.0;
  double length_m = 0.0;
  int unsafe = 0;
  for (const auto& path_m : paths) {
    const Trajectory still = Trajectory::hover(0.0, path_m.front(), rng.uniform(-kPi, kPi));
    const double begin_s = thread_time_s();
    const auto trajectory = builder.build(space, {&still, 0.0, path_m, rng.uniform(-kPi, kPi), camera});
    times_ms.push_back(1e3 * (thread_time_s() - begin_s));
    if (!trajectory) continue;
    if (!SafetyCheck{}.check_space(space, *trajectory, 0.0).safe()) ++unsafe;
    length_m += path_length_m(path_m);
    ratios.push_back(trajectory->end_time_s() / bang_bang_s(path_length_m(path_m), limits));
    sum += ratios.back();
  }
  const double flown = static_cast<double>(ratios.size());
  const double middle = at_share(ratios, 0.5);
  const double high = at_share(ratios, 0.95);
  const double middle_ms = at_share(times_ms, 0.5);
  std::printf("| `%s` | %s | %.0f of %zu | %.1f | %.3f | %.3f | %.3f | %.3f | %.2f | %.2f | %d |\n", name,
              camera ? "camera" : "all round", flown, paths.size(), length_m / flown, sum / flown, middle, high,
              ratios.empty() ? 0.0 : ratios.back(), middle_ms, times_ms.back(), unsafe);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    MotionLimits limits;
    if (argc > 1) limits.jerk_mps3 = std::atof(argv[1]);
    std::printf(
        "| world | sensor | built | length m, mean | flown/lower, mean | median | p95 | max | build ms, median | max "
        "| unsafe |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    struct {
      const char* name;
      Eigen::Vector3d start_m;
    } const worlds[] = {
        {"office_tower", {-6.5, 0.0, 0.95}}, {"duplex", {-3.5, -2.5, 0.95}}, {"warehouse", {-11.0, 0.0, 0.95}}};
    for (const auto& world : worlds) {
      const KnownBuilding building((std::string(world.name) + ".sdf").c_str(), world.start_m);
      const FreeSpace space = building.space();
      const auto paths = make_paths(building, space);
      for (const bool camera : {false, true}) measure(world.name, space, paths, camera, limits);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "trajectory_times: %s\n", error.what());
    return 1;
  }
}
