/// Random small worlds, flown as the fleet flies: plan, trajectory, replans in full flight, obstacles that appear
/// ahead. Every flown state is judged by plain geometry, voxel by voxel, not by the code under test.
#pragma once

#include "core/rng.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/trajectory_builder.hpp"
#include "test_world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace stairwell::test {

/// What happened in a number of worlds.
struct FlownTally {
  int worlds = 0;
  int plans = 0;
  int no_path = 0;      ///< the planner found no way
  int refused = 0;      ///< a way, but no trajectory
  int flights = 0;      ///< trajectories flown, at least for a while
  int in_flight = 0;    ///< of these departed from while moving
  int appearances = 0;  ///< obstacles or unknown regions that came up ahead
  int brakes = 0;       ///< the check stopped the UAV for one
  int beyond_limits = 0;
  int missed = 0;  ///< the motion under way was called safe and was not
  long states = 0;
  long in_collision = 0;
  long in_unknown = 0;
  double deepest_m = 0.0;
  std::string first_problem;

  bool clean() const { return in_collision == 0 && in_unknown == 0 && beyond_limits == 0 && missed == 0; }
  void add(const FlownTally& other) {
    for (int FlownTally::*count : {&FlownTally::worlds, &FlownTally::plans, &FlownTally::no_path, &FlownTally::refused,
                                   &FlownTally::flights, &FlownTally::in_flight, &FlownTally::appearances,
                                   &FlownTally::brakes, &FlownTally::beyond_limits, &FlownTally::missed}) {
      this->*count += other.*count;
    }
    states += other.states;
    in_collision += other.in_collision;
    in_unknown += other.in_unknown;
    deepest_m = std::max(deepest_m, other.deepest_m);
    if (first_problem.empty()) first_problem = other.first_problem;
  }
  std::string text() const {
    std::ostringstream out;
    out << worlds << " worlds, " << plans << " plans (" << no_path << " without a path, " << refused
        << " without a trajectory), " << flights << " flights (" << in_flight << " departed from in flight), "
        << appearances << " appearances ahead, " << brakes << " brakes, " << states << " states: " << in_collision
        << " in collision, " << in_unknown << " in unknown, deepest " << deepest_m << " m; " << beyond_limits
        << " beyond limits, " << missed << " missed by the check";
    return out.str();
  }
};

class FlownWorld {
 public:
  static constexpr double kSampling_s = 0.005;
  static constexpr double kTouch_m = 1.1e-6;  ///< what the check grants, and rounding

  FlownWorld(std::uint64_t seed, FlownTally& tally)
      : seed_(seed), tally_(tally), rng_(make_rng(seed, "flown worlds")), world_(make_world()) {
    ++tally_.worlds;
  }

  void fly() {
    limits_ = random_limits();
    const planning3d::TrajectoryBuilder builder(limits_, check_);
    Eigen::Vector3d start_m;
    if (!free_place(start_m)) return;
    Trajectory flying = Trajectory::hover(0.0, start_m, rng_.uniform(-3.0, 3.0));
    double now_s = rng_.uniform(0.0, 2.0);
    for (int decision = 0; decision < 4; ++decision) {
      if (auto next = decide(builder, flying, now_s)) {
        flying = std::move(*next);
        motion_ = "trajectory";
      }
      const double until_s = rng_.uniform(now_s, flying.end_time_s() + 0.2);
      judge(flying, now_s, until_s);
      now_s = until_s;
      if (rng_.uniform() < 0.4) meet_something(builder, flying, now_s);
    }
    judge(flying, now_s, flying.end_time_s());
  }

 private:
  struct Depth {
    double m = 0.0;
    bool occupied = false;
  };

  TestWorld make_world() {
    const std::array<double, 4> resolutions_m{0.1, 0.15, 0.2, 0.25};
    const double res_m = resolutions_m[static_cast<std::size_t>(rng_.uniform_int(0, 3))];
    const Eigen::Vector3d size_m =
        res_m * Eigen::Vector3d(rng_.uniform_int(12, 26), rng_.uniform_int(12, 26), rng_.uniform_int(7, 13));
    const Robot robot{rng_.uniform(0.08, 0.3), rng_.uniform() < 0.5 ? 0.0 : 0.05};
    TestWorld world(size_m, res_m, robot);
    if (rng_.uniform() < 0.6) walls(world);
    const int blocks = rng_.uniform_int(0, 14);
    for (int i = 0; i < blocks; ++i) put(world, random_box(world, 6), rng_.uniform() < 0.3);
    if (rng_.uniform() < 0.3) world.box = world.box.inflated(-rng_.uniform(0.0, 0.3));
    return world;
  }

  /// Walls right through with a doorway or hatch that is often hardly wider than the robot.
  void walls(TestWorld& world) {
    const GridSpec& grid = world.map.grid();
    const double res_m = grid.resolution_m();
    for (int wall = rng_.uniform_int(1, 2); wall > 0; --wall) {
      const int axis = rng_.uniform_int(0, 2);
      const auto n = static_cast<std::size_t>(axis);
      if (grid.size()[n] < 6) continue;
      Aabb slab{Eigen::Vector3d::Zero(), world.box.max_m};
      slab.min_m[axis] = res_m * rng_.uniform_int(2, grid.size()[n] - 4);
      slab.max_m[axis] = slab.min_m[axis] + res_m * rng_.uniform_int(1, 2);
      put(world, slab, false);
      Aabb door = slab;
      const int robot_cells = static_cast<int>(std::ceil(2.0 * world.robot.clearance_m() / res_m));
      for (int side = 0; side < 3; ++side) {
        if (side == axis) continue;
        const int cells = grid.size()[static_cast<std::size_t>(side)];
        const int wide = std::min(cells, robot_cells + rng_.uniform_int(0, 3));
        door.min_m[side] = res_m * rng_.uniform_int(0, cells - wide);
        door.max_m[side] = door.min_m[side] + res_m * wide;
      }
      world.fill(door, false);
    }
  }

  Aabb random_box(const TestWorld& world, int most_cells) {
    const GridSpec& grid = world.map.grid();
    Aabb box;
    for (int axis = 0; axis < 3; ++axis) {
      const int cells = grid.size()[static_cast<std::size_t>(axis)];
      const int wide = rng_.uniform_int(1, std::min(cells, most_cells));
      box.min_m[axis] = grid.resolution_m() * rng_.uniform_int(0, cells - wide);
      box.max_m[axis] = box.min_m[axis] + grid.resolution_m() * wide;
    }
    return box;
  }

  static void put(TestWorld& world, const Aabb& region, bool unknown) {
    if (!unknown) {
      world.fill(region, true);
      return;
    }
    for_each_voxel(world, region, [&](const VoxelIndex& v) { world.map.set_log_odds(v, std::nanf("")); });
  }

  template <typename Visit>
  static void for_each_voxel(const TestWorld& world, const Aabb& region, const Visit& visit) {
    const VoxelIndex lo = world.map.grid().index_of(region.min_m + Eigen::Vector3d::Constant(1e-6));
    const VoxelIndex hi = world.map.grid().index_of(region.max_m - Eigen::Vector3d::Constant(1e-6));
    for (int z = lo.z; z <= hi.z; ++z) {
      for (int y = lo.y; y <= hi.y; ++y) {
        for (int x = lo.x; x <= hi.x; ++x) visit(VoxelIndex{x, y, z});
      }
    }
  }

  MotionLimits random_limits() {
    MotionLimits limits;
    limits.speed_mps = rng_.uniform(0.5, 4.0);
    limits.acceleration_mps2 = rng_.uniform(0.5, 5.0);
    limits.yaw_rate_radps = rng_.uniform(0.5, 3.0);
    limits.yaw_acceleration_radps2 = rng_.uniform(0.5, 3.0);
    limits.norm = rng_.uniform() < 0.5 ? MotionLimits::Norm::kEuclidean : MotionLimits::Norm::kPerAxis;
    return limits;
  }

  /// How deep the robot's sphere is in something not known to be free. Anything outside the grid is unknown.
  Depth depth_at(const Eigen::Vector3d& at_m) const {
    const GridSpec& grid = world_.map.grid();
    const double radius_m = world_.robot.radius_m;
    const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(0.5 * grid.resolution_m());
    const VoxelIndex lo = grid.index_of(at_m - Eigen::Vector3d::Constant(radius_m));
    const VoxelIndex hi = grid.index_of(at_m + Eigen::Vector3d::Constant(radius_m));
    Depth worst;
    for (int z = lo.z; z <= hi.z; ++z) {
      for (int y = lo.y; y <= hi.y; ++y) {
        for (int x = lo.x; x <= hi.x; ++x) {
          const VoxelIndex v{x, y, z};
          const Occupancy there = grid.contains(v) ? world_.map.at(v) : Occupancy::kUnknown;
          if (there == Occupancy::kFree) continue;
          const Eigen::Vector3d c_m = grid.center_of(v);
          const Eigen::Vector3d nearest_m = at_m.cwiseMax(c_m - half_m).cwiseMin(c_m + half_m);
          const double depth_m = radius_m - (nearest_m - at_m).norm();
          if (depth_m > worst.m) worst = {depth_m, there == Occupancy::kOccupied};
        }
      }
    }
    return worst;
  }

  bool clear(const Trajectory& motion, double from_s, double tolerance_m) const {
    for (double t_s = from_s;; t_s += kSampling_s) {
      if (depth_at(motion.sample(t_s).position_m).m > tolerance_m) return false;
      if (t_s >= motion.end_time_s()) return true;
    }
  }

  bool free_place(Eigen::Vector3d& place_m) {
    const planning3d::FreeSpace space = world_.space();
    const GridSpec& grid = space.grid();
    for (int attempt = 0; attempt < 60; ++attempt) {
      const VoxelIndex v{rng_.uniform_int(0, grid.size()[0] - 1), rng_.uniform_int(0, grid.size()[1] - 1),
                         rng_.uniform_int(0, grid.size()[2] - 1)};
      if (!space.traversable(v)) continue;
      place_m = grid.center_of(v);
      const double off_m = 0.5 * grid.resolution_m();
      const Eigen::Vector3d beside_m =
          place_m +
          Eigen::Vector3d(rng_.uniform(-off_m, off_m), rng_.uniform(-off_m, off_m), rng_.uniform(-off_m, off_m));
      if (world_.box.contains(beside_m) && depth_at(beside_m).m <= 0.0) place_m = beside_m;
      return depth_at(place_m).m <= 0.0;
    }
    return false;
  }

  std::optional<Trajectory> decide(const planning3d::TrajectoryBuilder& builder, const Trajectory& flying,
                                   double now_s) {
    planning3d::PlanRequest request;
    request.start_m = flying.sample(now_s).position_m;
    if (!free_place(request.goal_m)) return std::nullopt;
    const double draw = rng_.uniform();
    const char* name = draw < 0.5 ? "astar" : draw < 0.7 ? "theta" : draw < 0.85 ? "apf" : "rrtconnect";
    request.max_checks = 300;
    request.seed = seed_;
    request.clearance_weight = rng_.uniform() < 0.5 ? 0.0 : 1.0;
    if (rng_.uniform() < 0.2) request.rule = planning3d::MotionRule::slice({request.start_m.z(), request.goal_m.z()});
    const planning3d::FreeSpace space = world_.space();
    ++tally_.plans;
    const planning3d::PlanResult plan = planning3d::make_planner(name)->plan(space, request);
    if (plan.status != planning3d::PlanStatus::kReached) {
      ++tally_.no_path;
      return std::nullopt;
    }
    planning3d::TrajectoryRequest wanted;
    wanted.previous = &flying;
    wanted.depart_s = now_s;
    wanted.path_m = plan.path_m;
    wanted.goal_yaw_rad = rng_.uniform(-3.0, 3.0);
    wanted.look_along_path = rng_.uniform() < 0.5;
    auto trajectory = builder.build(space, wanted);
    if (!trajectory) {
      ++tally_.refused;
      return std::nullopt;
    }
    ++tally_.flights;
    if (flying.sample(now_s).velocity_mps.norm() > 0.05) ++tally_.in_flight;
    require_limits(*trajectory, now_s);
    return trajectory;
  }

  /// Something comes up on the way ahead, so that the UAV can still stop before it (it sees as far as it takes to
  /// stop); then the motion is checked again and stopped if it is no longer safe.
  void meet_something(const planning3d::TrajectoryBuilder& builder, Trajectory& flying, double now_s) {
    if (now_s >= flying.end_time_s()) return;
    const Trajectory stop = builder.brake(flying, now_s);
    for (int attempt = 0; attempt < 4; ++attempt) {
      const Eigen::Vector3d ahead_m = flying.sample(rng_.uniform(now_s, flying.end_time_s())).position_m;
      const double reach_m = world_.map.grid().resolution_m() * rng_.uniform(0.3, 2.5);
      const Eigen::Vector3d off_m(rng_.uniform(-0.3, 0.3), rng_.uniform(-0.3, 0.3), rng_.uniform(-0.3, 0.3));
      Aabb block{ahead_m + off_m - Eigen::Vector3d::Constant(reach_m),
                 ahead_m + off_m + Eigen::Vector3d::Constant(reach_m)};
      block = block.intersection(world_.map.grid().box());
      if (block.empty() || block.size_m().minCoeff() < 0.01) continue;
      std::vector<std::pair<VoxelIndex, Occupancy>> before;
      for_each_voxel(world_, block, [&](const VoxelIndex& v) { before.emplace_back(v, world_.map.at(v)); });
      put(world_, block, rng_.uniform() < 0.3);
      if (clear(stop, now_s, 0.0)) return look_again(stop, flying, now_s);
      for (const auto& [v, occupancy] : before) {
        world_.map.set_log_odds(v, std::nanf(""));  // forgets that it was ever hit
        if (occupancy != Occupancy::kUnknown) world_.map.set_log_odds(v, occupancy == Occupancy::kFree ? -1.0F : 2.0F);
      }
    }
  }

  void look_again(const Trajectory& stop, Trajectory& flying, double now_s) {
    ++tally_.appearances;
    const planning3d::FreeSpace space = world_.space();
    const bool safe = check_.check_space(space, flying, now_s).safe();
    if (safe && !clear(flying, now_s, kTouch_m)) {
      ++tally_.missed;
      note("missed", 0.0, now_s);
    }
    if (safe) return;
    ++tally_.brakes;
    flying = stop;
    motion_ = "brake";
    require_limits(flying, now_s);
  }

  void require_limits(const Trajectory& trajectory, double now_s) {
    if (check_.check_limits(trajectory, limits_, now_s).safe()) return;
    ++tally_.beyond_limits;
    note("limits", 0.0, now_s);
  }

  void judge(const Trajectory& flying, double from_s, double until_s) {
    for (double t_s = from_s; t_s < until_s + kSampling_s; t_s += kSampling_s) {
      const double at_s = std::min(t_s, until_s);
      const Depth depth = depth_at(flying.sample(at_s).position_m);
      ++tally_.states;
      tally_.deepest_m = std::max(tally_.deepest_m, depth.m);
      if (depth.m <= kTouch_m) continue;
      ++(depth.occupied ? tally_.in_collision : tally_.in_unknown);
      note(depth.occupied ? "collision" : "unknown", depth.m, at_s);
    }
  }

  void note(const char* what, double depth_m, double at_s) {
    if (!tally_.first_problem.empty()) return;
    std::ostringstream text;
    text << what << " (" << motion_ << "): world " << seed_ << ", " << at_s << " s, depth " << depth_m << " m, radius "
         << world_.robot.radius_m << ", resolution " << world_.map.grid().resolution_m();
    tally_.first_problem = text.str();
  }

  std::uint64_t seed_;
  FlownTally& tally_;
  Rng rng_;
  TestWorld world_;
  MotionLimits limits_;
  const char* motion_ = "hover";
  planning3d::SafetyCheck check_;
};

inline FlownTally fly_worlds(std::uint64_t first_seed, int worlds) {
  FlownTally tally;
  for (int i = 0; i < worlds; ++i) FlownWorld(first_seed + static_cast<std::uint64_t>(i), tally).fly();
  return tally;
}

}  // namespace stairwell::test
