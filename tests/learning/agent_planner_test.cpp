#include "planning3d/agent_planner.hpp"

#include "core/errors.hpp"
#include "learning/random_network.hpp"
#include "learning/train/training_world.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/shorten_path.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>

using namespace stairwell;
using namespace stairwell::planning3d;

namespace {

const std::filesystem::path kModels = std::filesystem::path(STAIRWELL_SOURCE_DIR) / "models";

train::VoxelScene two_rooms() {
  train::VoxelScene scene(Aabb{{0, 0, 0}, {8, 8, 3}}, 0.1);
  scene.fill(Aabb{{3.9, 0, 0}, {4.1, 8, 3}}, true);
  scene.fill(Aabb{{3.9, 5.5, 0}, {4.1, 6.9, 2.2}}, false);
  return scene;
}

}  // namespace

TEST_CASE("a rollout that is led down the way reaches the goal, one that is led astray does not", "[agent]") {
  const train::TrainingWorld world(two_rooms(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  const Eigen::Vector3d start_m(2.05, 2.05, 1.05), goal_m(6.05, 2.05, 1.05);
  const SegmentCheck check(space, {}, start_m);
  ArrivalField field(ArrivalField::Config{.plane = true});
  field.compute(space, check, goal_m, start_m);
  AgentView view(AgentInput::slice());
  Observation seen;
  const auto fly = [&](const auto& direction) {
    view.begin(space, {}, field);
    Rollout rollout(check, view, field, {}, start_m);
    int steps = 0;
    while (rollout.look(seen)) rollout.move(direction(steps++, rollout.path_m().back()));
    return std::pair(rollout.end(), rollout.path_m());
  };
  const auto led = fly([&](int, const Eigen::Vector3d& at_m) -> Eigen::Vector3d {
    if (at_m.x() < 4.6 && std::abs(at_m.y() - 6.2) > 0.2) return Eigen::Vector3d(3.2, 6.2, 1.05) - at_m;
    return (at_m.x() < 4.6 ? Eigen::Vector3d(4.8, 6.2, 1.05) : goal_m) - at_m;
  });
  CHECK(led.first == RolloutEnd::kReached);
  CHECK(led.second.back() == goal_m);
  CHECK(SafetyCheck().check_path(space, led.second).safe());
  CHECK(fly([](int, const auto&) { return Eigen::Vector3d(1, 0, 0); }).first == RolloutEnd::kCollision);
  const auto circling =
      fly([](int step, const auto&) { return Eigen::Vector3d(std::cos(0.4 * step), std::sin(0.4 * step), 0); });
  CHECK(circling.first == RolloutEnd::kNoProgress);
  CHECK(circling.second.size() < 100);
}

TEST_CASE("smoothing shortens a path and keeps its ends and its distance", "[agent]") {
  const train::TrainingWorld world(two_rooms(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  const SegmentCheck check(space, {}, Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector3d> zigzag;
  for (int i = 0; i < 20; ++i) zigzag.emplace_back(1.0 + 0.1 * i, 3.0 + 0.05 * (i % 2), 1.5);
  const auto smooth = smooth_path(check, zigzag, 6);
  CHECK(smooth.front() == zigzag.front());
  CHECK(smooth.back() == zigzag.back());
  CHECK(smooth.size() == zigzag.size());
  CHECK(std::abs(smooth[10].y() - smooth[11].y()) < 0.01);
  // Where the mean would touch something, the path stays.
  const std::vector<Eigen::Vector3d> through{{3.5, 5.2, 1.5}, {4.0, 6.2, 1.5}, {4.5, 5.2, 1.5}};
  CHECK(smooth_path(check, through, 6) == through);
}

TEST_CASE("a step that does not fit gives way to the one next to it that does", "[agent]") {
  const train::TrainingWorld world(two_rooms(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  const SegmentCheck check(space, {}, Eigen::Vector3d::Zero());
  const RolloutConfig config;
  RolloutConfig alone;
  alone.slide = false;
  Eigen::Vector3d to_m;
  const Eigen::Vector3d east(1, 0, 0), none(0, 0, 0);
  // In the open: a whole step, mixed with the last direction.
  REQUIRE(fitting_step(check, config, true, {2, 4, 1.5}, none, 3.0 * east, to_m));
  CHECK((to_m - Eigen::Vector3d(2.12, 4, 1.5)).norm() < 1e-12);
  REQUIRE(fitting_step(check, config, true, {2, 4, 1.5}, {0, 1, 0}, east, to_m));
  CHECK(std::atan2(to_m.y() - 4.0, to_m.x() - 2.0) == Approx(std::atan(config.keep)));
  // At a wall (x = 3.9, so 3.65 is as near as the sphere gets): along it, rather on in the last direction.
  for (const double side : {-1.0, 1.0}) {
    const Eigen::Vector3d at_m(3.64, 3, 1.5), wanted = Eigen::Vector3d(1, side * 0.5, 0);
    CHECK_FALSE(fitting_step(check, alone, true, at_m, none, wanted, to_m));
    REQUIRE(fitting_step(check, config, true, at_m, none, wanted, to_m));
    CHECK(side * (to_m.y() - 3.0) > 0.02);
    CHECK(to_m.z() == 1.5);
    REQUIRE(fitting_step(check, config, true, {3.62, 3, 1.5}, {0, side, 0}, east, to_m));
    CHECK(side * (to_m.y() - 3.0) > 0.02);
  }
  // Whatever is asked for: what is flown is free, not longer than a step (or the way to a voxel's centre), not back.
  Rng rng = make_rng(3, "steps");
  int fitted = 0;
  for (int i = 0; i < 3000; ++i) {
    const bool plane = i % 2 == 0;
    const Eigen::Vector3d at_m(rng.uniform(3.3, 4.7), rng.uniform(5.2, 7.2), rng.uniform(0.3, 2.7));
    if (!check.sweep_free(at_m, at_m)) continue;
    const Eigen::Vector3d wanted =
        Eigen::Vector3d(rng.normal(0, 1), rng.normal(0, 1), plane ? 0.0 : rng.normal(0, 1)).normalized();
    if (!fitting_step(check, config, plane, at_m, none, wanted, to_m)) continue;
    ++fitted;
    CHECK(check.sweep_free(at_m, to_m));
    CHECK((to_m - at_m).norm() < 0.3);
    CHECK((to_m - at_m).dot(wanted) > 0.0);
    if (plane) CHECK(to_m.z() == at_m.z());
  }
  CHECK(fitted > 500);
  CHECK_FALSE(fitting_step(check, config, true, {4.0, 3.0, 1.5}, none, east, to_m));  // in the wall
}

TEST_CASE("two voxels that meet in an edge let an agent through where its sphere fits", "[agent]") {
  train::VoxelScene scene(Aabb{{0, 0, 0}, {6, 6, 2}}, 0.1);
  scene.fill(Aabb{{0, 0, 0}, {6, 6, 2}}, true);
  for (int i = 0; i < 40; ++i) {  // a lane that goes up by one voxel with each one along
    const double x = 0.5 + 0.1 * i, y = 0.95 + 0.1 * i;
    scene.fill(Aabb{{x, y - 0.45, 0.3}, {x + 0.1, y + 0.45, 1.7}}, false);
  }
  scene.fill(Aabb{{0.2, 0.2, 0.3}, {1.4, 1.8, 1.7}}, false);
  scene.fill(Aabb{{3.8, 4.2, 0.3}, {5.4, 5.8, 1.7}}, false);
  const train::TrainingWorld world(scene, Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  const Eigen::Vector3d start_m(0.75, 0.95, 1.05), goal_m(4.65, 5.05, 1.05);
  const SegmentCheck check(space, {}, start_m);
  ArrivalField field(ArrivalField::Config{.plane = true});
  field.compute(space, check, goal_m, start_m);
  AgentView view(AgentInput::slice());
  view.begin(space, {}, field);
  Rollout rollout(check, view, field, {}, start_m);
  Observation seen;
  while (rollout.look(seen)) rollout.move(view.way_ahead());
  CHECK(rollout.end() == RolloutEnd::kReached);
  CHECK(SafetyCheck().check_path(space, rollout.path_m()).safe());
  int refused = 0;  // by voxels
  for (std::size_t i = 1; i < rollout.path_m().size(); ++i) {
    CHECK(check.sweep_free(rollout.path_m()[i - 1], rollout.path_m()[i]));
    if (!check.segment_free(rollout.path_m()[i - 1], rollout.path_m()[i])) ++refused;
  }
  CHECK(refused > 0);
}

TEST_CASE("straightening leaves few corners and the room there was", "[agent]") {
  const train::TrainingWorld world(two_rooms(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  const SegmentCheck check(space, {}, Eigen::Vector3d::Zero());
  std::vector<Eigen::Vector3d> path_m{{2, 2, 1.5}};
  Rng rng = make_rng(5, "path");
  const auto fly_to = [&](const Eigen::Vector3d& goal_m) {
    while ((path_m.back() - goal_m).norm() > 0.12) {
      const Eigen::Vector3d towards = (goal_m - path_m.back()).normalized();
      path_m.emplace_back(path_m.back() + 0.1 * (towards + rng.uniform(-0.4, 0.4) * towards.unitOrthogonal()));
    }
  };
  for (const Eigen::Vector3d& corner : {Eigen::Vector3d(3.2, 6.2, 1.5), {4.8, 6.2, 1.5}, {6, 2, 1.2}}) fly_to(corner);
  const auto least_room = [&](const std::vector<Eigen::Vector3d>& line_m) {
    double room_m = 1.0;
    for (std::size_t i = 1; i < line_m.size(); ++i) {
      for (double u = 0.0; u <= 1.0; u += 0.01) {
        room_m = std::min(room_m, space.room_m(line_m[i - 1] + u * (line_m[i] - line_m[i - 1])));
      }
    }
    return room_m;
  };
  const auto straight_m = straighten_path(check, path_m);
  CHECK(straight_m.front() == path_m.front());
  CHECK(straight_m.back() == path_m.back());
  CHECK(straight_m.size() < 9);
  CHECK(path_length_m(straight_m) < path_length_m(path_m));
  CHECK(SafetyCheck().check_path(space, straight_m).safe());
  CHECK(least_room(straight_m) > std::min(0.15, least_room(path_m)) - 0.03);
  for (std::size_t i = 1; i < straight_m.size(); ++i) CHECK(check.sweep_free(straight_m[i - 1], straight_m[i]));
  const std::vector<Eigen::Vector3d> short_m{{1, 1, 1}, {1, 2, 1}};
  CHECK(straighten_path(check, short_m) == short_m);
  CHECK(straighten_path(check, {{1, 1, 1}, {1.1, 1.5, 1}, {1, 2, 1}}) == short_m);
}

TEST_CASE("agents that do not know what they do answer honestly", "[agent]") {
  const train::TrainingWorld world(two_rooms(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  PlanRequest request;
  request.start_m = {2.05, 2.05, 1.05};
  request.goal_m = {6.05, 2.05, 1.05};
  for (const bool plane : {true, false}) {
    AgentPlanner planner(testing::random_agent(plane ? AgentInput::slice() : AgentInput::volume()));
    const PlanResult result = planner.plan(space, request);
    CHECK((result.status == PlanStatus::kLocalMinimum || result.status == PlanStatus::kNoPath));
    CHECK(result.path_m.empty());
  }
}

TEST_CASE("an agent that lost its way flies once more, and says so", "[agent]") {
  const train::TrainingWorld world(two_rooms(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  PlanRequest request;
  request.start_m = {2.05, 4.05, 1.05};
  request.goal_m = {2.05, 6.05, 1.05};
  nn::Model model = testing::random_agent(AgentInput::slice());
  std::ranges::fill(model.parameters, 0.0F);
  model.parameters.back() = 1.0F;  // the bias of y: always to the left of the way, round and round
  AgentPlanner::Config once;
  once.second_keep = 0.0;
  AgentPlanner one(model, once), two(model);
  const PlanResult first = one.plan(space, request), both = two.plan(space, request);
  CHECK(first.status == PlanStatus::kLocalMinimum);
  CHECK(both.expansions > first.expansions + 40);
}

TEST_CASE("a model of another kind is refused", "[agent]") {
  nn::Model model = testing::random_agent(AgentInput::slice());
  model.input = AgentInput::volume().text();
  CHECK_THROWS_WITH(AgentPlanner(model), Catch::Contains("not what the agent is shown"));
  model = testing::random_agent(AgentInput::slice());
  model.network.head = nn::Head::kValues;
  CHECK_THROWS_WITH(AgentPlanner(model), Catch::Contains("no direction"));
  CHECK_THROWS_WITH(AgentPlanner::load("agent3d", "/no/such/folder"), Catch::Contains("path3d.model"));
}

TEST_CASE("the shipped agents find their way through a door", "[agent]") {
  const train::TrainingWorld world(two_rooms(), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  for (const char* name : {"agent2d", "agent3d"}) {
    const auto planner = AgentPlanner::load(name, kModels);
    CHECK(planner->name() == name);
    PlanRequest request;
    request.start_m = {2.05, 2.05, 1.05};
    request.goal_m = {6.05, 2.05, 1.05};
    const PlanResult result = planner->plan(space, request);
    REQUIRE(result.status == PlanStatus::kReached);
    CHECK(result.path_m.front() == request.start_m);
    CHECK((result.path_m.back() - request.goal_m).norm() < 1e-9);
    CHECK(SafetyCheck().check_path(space, result.path_m).safe());
    CHECK(planner->plan(space, request).path_m == result.path_m);
    request.goal_m.z() = 2.05;
    const bool another_layer = planner->plan(space, request).status == PlanStatus::kReached;
    CHECK(another_layer == (std::string_view(name) == "agent3d"));
  }
}

TEST_CASE("the slice agent changes layers where there is an opening", "[agent]") {
  train::VoxelScene scene(Aabb{{0, 0, 0}, {8, 8, 5}}, 0.1);
  scene.fill(Aabb{{0, 0, 2.4}, {8, 8, 2.6}}, true);
  scene.fill(Aabb{{5.5, 5.5, 2.4}, {6.9, 6.9, 2.6}}, false);
  const train::TrainingWorld world(scene, Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  PlanRequest request;
  request.start_m = {2.05, 2.05, 1.05};
  request.goal_m = {2.05, 3.05, 3.55};
  request.rule = MotionRule::slice({1.05, 3.55});
  const auto planner = AgentPlanner::load("agent2d", kModels);
  const PlanResult result = planner->plan(space, request);
  REQUIRE(result.status == PlanStatus::kReached);
  CHECK(SafetyCheck().check_path(space, result.path_m).safe());
  CHECK(result.path_m.back() == request.goal_m);
  for (std::size_t i = 1; i < result.path_m.size(); ++i) {
    const Eigen::Vector3d leg = result.path_m[i] - result.path_m[i - 1];
    const bool level = std::abs(leg.z()) < 1e-9, upright = leg.head<2>().norm() < 1e-9;
    CHECK((level || upright));
    const double z = result.path_m[i].z();
    if (level) CHECK((std::abs(z - 1.05) < 1e-9 || std::abs(z - 3.55) < 1e-9));
  }
  request.start_m.z() = 1.35;  // between layers: first to the nearest
  CHECK(planner->plan(space, request).status == PlanStatus::kReached);
  const train::VoxelScene closed = [&] {
    train::VoxelScene other = scene;
    other.fill(Aabb{{0, 0, 2.4}, {8, 8, 2.6}}, true);
    return other;
  }();
  const train::TrainingWorld no_way(closed, Robot{0.25, 0.0});
  CHECK(planner->plan(no_way.space(), request).status == PlanStatus::kNoPath);
}

TEST_CASE("one look of the shipped agents is quick to answer", "[agent]") {
  for (const char* agent : {"path2d", "path3d"}) {
    const nn::Model model = nn::read_model(kModels / (std::string(agent) + ".model"), agent);
    CHECK(model.parameters.size() <= 350'000);
    nn::Network network(model.network, model.parameters);
    const auto inputs = testing::random_inputs(model.network, 64, 1);
    std::vector<float> outputs(64 * static_cast<std::size_t>(model.network.outputs));
    double least_ms = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 10; ++i) {
      const std::clock_t begin = std::clock();
      network.infer_batch(64, inputs.windows, inputs.features, outputs);
      least_ms = std::min(least_ms, 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / 64);
    }
    WARN(agent << ": " << least_ms << " ms a window, " << model.parameters.size() << " parameters");
    CHECK(least_ms < 10.0);  // sanitizers take their time; 0.5 ms is what is wanted
  }
}
