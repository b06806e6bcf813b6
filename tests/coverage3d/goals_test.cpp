#include "coverage3d/task_board.hpp"
#include "half_seen.hpp"
#include "planning3d/travel_costs.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;
using toy::HalfSeen;

/// Asks until every cluster has been looked at: a single assignment may leave some for later.
Assignment settled(CoverageStrategy& strategy, const planning3d::FreeSpace& space, const AssignmentRequest& request) {
  Assignment assignment;
  for (int i = 0; i < 20; ++i) assignment = strategy.assign(space, request);
  return assignment;
}

Assignment settled(CoverageStrategy& strategy, const HalfSeen& scene) {
  return settled(strategy, scene.space(), scene.request);
}

/// The same for UAVs in a row along x.
Assignment settled_goals(const planning3d::FreeSpace& space, const CoverageConfig& config,
                         const std::vector<double>& along_m) {
  AssignmentRequest request;
  for (const double x_m : along_m) {
    UavView& uav = request.uavs.emplace_back();
    uav.position_m = {x_m, 2.1, 1.5};
    uav.wants_goal = true;
  }
  return settled(*make_strategy("frontiers", config), space, request);
}

/// A second UAV, in the far corner, whose map is its own.
UavView add_absent(HalfSeen& scene) {
  UavView absent;
  absent.position_m = scene.config.box.max_m;
  absent.placed = false;
  absent.shares_map = false;
  scene.request.uavs.push_back(absent);
  return absent;
}

}  // namespace

TEST_CASE("goals that failed are left alone with their surroundings until their time is over") {
  for (const std::string_view name : strategy_names()) {
    for (const bool slice : {false, true}) {
      INFO(name << (slice ? " slice" : " volume"));
      HalfSeen scene(slice);
      const auto strategy = make_strategy(name, scene.config);
      const Assignment first = settled(*strategy, scene);
      REQUIRE(first.open_targets > 0);
      planning3d::TravelCosts costs;
      costs.compute(scene.space(), scene.request.uavs[0].position_m, strategy->motion_rule(),
                    std::numeric_limits<double>::infinity());
      std::vector<Eigen::Vector3d> failed_m;
      Assignment present = first;
      while (present.goals[0] && failed_m.size() < 40) {
        const Goal goal = *present.goals[0];
        CHECK(std::isfinite(costs.distance_m(scene.map.grid().index_of(goal.position_m))));
        CHECK(goal.gain_m3 >= scene.config.min_gain_m3);
        for (const Eigen::Vector3d& p_m : failed_m)
          CHECK((p_m - goal.position_m).norm() >= scene.config.blacklist_radius_m);
        failed_m.push_back(goal.position_m);
        strategy->report_failure(goal, scene.request.time_s);
        scene.request.time_s += 0.5;
        const Assignment next = strategy->assign(scene.space(), scene.request);
        CHECK(next.unreachable_targets >= present.unreachable_targets);
        CHECK(next.open_targets + next.unreachable_targets == first.open_targets + first.unreachable_targets);
        present = next;
      }
      CHECK(failed_m.size() >= 3);
      CHECK(present.unreachable_targets > first.unreachable_targets);
      scene.request.time_s += 1e4 * scene.config.blacklist_time_s;
      const Assignment later = strategy->assign(scene.space(), scene.request);
      CHECK(later.open_targets == first.open_targets);
      CHECK(later.unreachable_targets == first.unreachable_targets);
    }
  }
}

TEST_CASE("what no UAV gets to is unreachable, not open") {
  for (const std::string_view name : strategy_names()) {
    INFO(name);
    toy::World world({{0, 0, 0}, {8, 4, 3}}, 0.2);
    world.fill({{4, 0, 0}, {4.4, 4, 3}}, true);
    mapping::OccupancyMap map(world.grid());
    const CoverageConfig config = toy::config_for(world, toy::lidar());
    for (const double x_m : {0.7, 2.1, 3.3})
      for (const double y_m : {0.7, 2.1, 3.3})
        for (const double z_m : {0.5, 1.5, 2.5}) toy::look(world, toy::lidar(), {x_m, y_m, z_m}, 0.0, map);
    toy::look(world, toy::camera(), {5.1, 2.1, 1.5}, 0.0, map);  // a wedge of the room beyond
    mapping::DistanceField distance(world.grid(), 1.0, mapping::Obstacles::kBlocked);
    distance.update(map);
    AssignmentRequest request;
    request.uavs.emplace_back();
    request.uavs[0].position_m = {2.1, 2.1, 1.5};
    request.uavs[0].wants_goal = true;
    const auto strategy = make_strategy(name, config);
    const planning3d::FreeSpace space{map, distance, config.robot, config.box};
    Assignment assignment;
    for (int i = 0; i < 20; ++i) assignment = strategy->assign(space, request);
    CHECK_FALSE(assignment.goals.at(0).has_value());
    CHECK(assignment.open_targets == 0);
    CHECK(assignment.unreachable_targets > 0);
    // With somebody there it is work, for them alone.
    request.uavs.push_back(request.uavs[0]);
    request.uavs[1].position_m = {6.9, 2.1, 1.5};
    assignment = make_strategy(name, config)->assign(space, request);
    CHECK_FALSE(assignment.goals.at(0).has_value());
    REQUIRE(assignment.goals.at(1).has_value());
    CHECK(assignment.goals[1]->position_m.x() > 4.4);
    CHECK(assignment.open_targets > 0);
  }
}

TEST_CASE("every UAV of a fleet is offered what is near it, however much there is near the others") {
  // A hall with fifty dark recesses along one side: more than a plan holds.
  toy::World world({{0, 0, 0}, {100, 6, 3}}, 0.2);
  for (double x_m = 2.0; x_m < 99.0; x_m += 2.0) world.fill({{x_m - 0.2, 4, 0}, {x_m + 0.2, 6, 3}}, true);
  mapping::OccupancyMap map(world.grid());
  for (std::size_t i = 0; i < world.grid().voxel_count(); ++i) {
    const VoxelIndex v = world.grid().voxel(i);
    if (world.grid().center_of(v).y() < 4.4) map.set_log_odds(v, world.occupied(v) ? 1.0F : -1.0F);
  }
  mapping::DistanceField distance(world.grid(), 1.0, mapping::Obstacles::kBlocked);
  distance.update(map);
  const CoverageConfig config = toy::config_for(world, toy::lidar());
  const planning3d::FreeSpace space{map, distance, config.robot, config.box};
  const std::vector<double> along_m{10.0, 35.0, 60.0, 84.0, 94.0};
  const Assignment assignment = settled_goals(space, config, along_m);
  REQUIRE(assignment.open_targets > 40);
  for (std::size_t i = 0; i < along_m.size(); ++i) {
    INFO("UAV " << i);
    REQUIRE(assignment.goals[i].has_value());
    CHECK((assignment.goals[i]->position_m - Eigen::Vector3d(along_m[i], 2.1, 1.5)).norm() < 6.0);
  }
}

TEST_CASE("a UAV that sees all round does small work near it while the others get at the large work sooner") {
  // A hall with a dark end, and a dark niche in the wall at the other end.
  toy::World world({{0, 0, 0}, {40, 6, 3}}, 0.2);
  world.fill({{0, 4, 0}, {36, 6, 3}}, true);
  world.fill({{2, 4, 1.2}, {2.6, 6, 1.8}}, false);
  mapping::OccupancyMap map(world.grid());
  for (std::size_t i = 0; i < world.grid().voxel_count(); ++i) {
    const VoxelIndex v = world.grid().voxel(i);
    const Eigen::Vector3d at_m = world.grid().center_of(v);
    if (at_m.y() < 4.4 && at_m.x() < 36.0) map.set_log_odds(v, world.occupied(v) ? 1.0F : -1.0F);
  }
  mapping::DistanceField distance(world.grid(), 1.0, mapping::Obstacles::kBlocked);
  distance.update(map);
  const CoverageConfig config = toy::config_for(world, toy::lidar());
  const planning3d::FreeSpace space{map, distance, config.robot, config.box};
  const auto goal_x_m = [&](const std::vector<double>& along_m) {
    const Assignment assignment = settled_goals(space, config, along_m);
    return assignment.goals.front() ? assignment.goals.front()->position_m.x() : 40.0;  // waits
  };
  CHECK(goal_x_m({4.0, 31.0, 33.0, 35.0}) < 10.0);
  CHECK(goal_x_m({4.0}) > 25.0);                     // alone it has the large work to do
  CHECK(goal_x_m({24.0, 31.0, 33.0, 35.0}) > 25.0);  // and what is nothing nearer can wait
}

TEST_CASE("in slice mode goals lie at the layers given") {
  for (const std::string_view name : strategy_names()) {
    HalfSeen scene(true);
    scene.config.layers_m = {toy::kStartHeight_m};
    const auto strategy = make_strategy(name, scene.config);
    const GridSpec& grid = scene.map.grid();
    const int layer = grid.index_of({0.0, 0.0, toy::kStartHeight_m}).z;
    for (int i = 0; i < 3; ++i) {
      const Assignment assignment = settled(*strategy, scene);
      REQUIRE(assignment.goals.at(0).has_value());
      CHECK(grid.index_of(assignment.goals[0]->position_m).z == layer);
      strategy->report_failure(*assignment.goals[0], 0.0);
    }
  }
}

TEST_CASE("parts are done when anybody's map says so, and nobody flies for what absent UAVs have done") {
  HalfSeen scene(false);
  const UavView absent = add_absent(scene);
  TaskBoard tasks(scene.config.box, scene.config.limits.speed_mps);
  tasks.share({{1, absent.position_m}});
  scene.request.tasks = &tasks;
  const auto strategy = make_strategy("frontiers", scene.config);
  const auto goal_part = [&]() -> std::optional<std::size_t> {
    const Assignment assignment = settled(*strategy, scene);
    if (!assignment.goals[0]) return std::nullopt;
    return tasks.part_at(assignment.goals[0]->target_m);
  };
  const std::optional<std::size_t> part = goal_part();
  REQUIRE(part.has_value());
  CHECK(tasks.part_open(*part));
  tasks.close_part(*part, 0);  // said too early
  CHECK(goal_part().has_value());
  CHECK(tasks.part_open(*part));
  for (std::size_t i = 0; i < tasks.parts(); ++i) {
    if (tasks.part_open(i)) tasks.close_part(i, 1);
  }
  CHECK_FALSE(goal_part().has_value());
  CHECK(tasks.closer(*part) == 1);

  tasks = TaskBoard(scene.config.box, scene.config.limits.speed_mps);
  tasks.share({{1, absent.position_m}});
  for (int i = 0; i < 400; ++i) {  // from wherever is free by now
    const Eigen::Vector3d at_m(0.7 + i % 10, 0.7 + i / 10 % 8, 0.6 + i / 80 % 5);
    if (scene.map.at(at_m) == Occupancy::kFree) toy::look(scene.world, scene.config.sensor, at_m, 0.0, scene.map);
  }
  scene.distance.update(scene.map);
  scene.request.uavs[0].wants_goal = false;  // it takes nothing over
  goal_part();
  std::size_t done = 0;
  for (std::size_t i = 0; i < tasks.parts(); ++i) done += tasks.closer(i) == 0 ? 1 : 0;
  CHECK(2 * done > tasks.parts());  // although they are the absent one's
}

TEST_CASE(
    "ways to what a UAV answers for lead through what others have done, while somebody knows what is to be seen "
    "there") {
  HalfSeen scene(false);
  const UavView absent = add_absent(scene);
  TaskBoard tasks(scene.config.box, scene.config.limits.speed_mps);
  tasks.share({{0, scene.request.uavs[0].position_m}});
  scene.request.tasks = &tasks;
  const std::size_t last = tasks.part_at(absent.position_m);
  for (std::size_t part = 0; part < tasks.parts(); ++part) {
    if (part != last) tasks.close_part(part, 1);
  }
  const auto strategy = make_strategy("frontiers", scene.config);
  CHECK_FALSE(settled(*strategy, scene).goals[0].has_value());
  REQUIRE(tasks.part_open(last));  // no map shows all of it
  std::vector<bool> claims(tasks.parts(), false);
  claims[last] = true;
  tasks.claim(1, claims);
  CHECK(settled(*strategy, scene).goals[0].has_value());
  // Absent UAVs have seen all that can be visited.
  for (std::size_t i = 0; i < scene.map.grid().voxel_count(); i += 3) {
    const VoxelIndex v = scene.map.grid().voxel(i);
    if (scene.map.at(v) == Occupancy::kFree) scene.request.passed_m.push_back(scene.map.grid().center_of(v));
  }
  CHECK(settled(*strategy, scene).goals[0].has_value());
}
