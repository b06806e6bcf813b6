#include "planning3d/agent_view.hpp"

#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"
#include "learning/train/training_world.hpp"

#include <catch2/catch.hpp>

#include <limits>

using namespace stairwell;
using namespace stairwell::planning3d;

namespace {

const Eigen::Vector3d kNowhere = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

/// A room of 8 x 8 x 3 m; `wall` leaves only a gap at its far end.
train::VoxelScene room(bool wall) {
  train::VoxelScene scene(Aabb{{0, 0, 0}, {8, 8, 3}}, 0.1);
  if (wall) scene.fill(Aabb{{3.8, 0, 0}, {4.2, 6.5, 3}}, true);
  return scene;
}

/// The same scene turned by a quarter about its middle: x' = 8 - y, y' = x.
train::VoxelScene quarter_turn(const train::VoxelScene& scene) {
  train::VoxelScene other = scene;
  const auto& n = scene.grid.size();
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        other.solid[other.grid.linear({n[1] - 1 - y, x, z})] = scene.solid[scene.grid.linear({x, y, z})];
      }
    }
  }
  return other;
}

struct Looked {
  Observation seen;
  Eigen::Vector3d way;
};

Looked look(const train::VoxelScene& scene, const Eigen::Vector3d& at_m, const Eigen::Vector3d& goal_m,
            AgentInput input, const std::vector<KeepOut>& keep_out = {}) {
  const train::TrainingWorld world(scene, Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  const SegmentCheck check(space, keep_out, at_m);
  ArrivalField::Config config;
  config.plane = input.plane;
  ArrivalField field(config);
  field.compute(space, check, goal_m, kNowhere);
  AgentView view(input);
  view.begin(space, keep_out, field);
  Looked looked;
  view.look(at_m, looked.seen);
  looked.way = view.way_ahead();
  return looked;
}

}  // namespace

TEST_CASE("directions and angles: round trip, seam and poles", "[agent]") {
  Rng rng = make_rng(1, "directions");
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d v = Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    const Eigen::Vector2d angles = angles_from_direction(v);
    CHECK((direction_from_angles(angles.x(), angles.y()) - v).norm() < 1e-12);
    for (const nn::Head head : {nn::Head::kUnitVector, nn::Head::kAngles}) {
      std::vector<float> outputs(head == nn::Head::kAngles ? 2 : 3);
      outputs_of(head, false, v, outputs);
      CHECK((direction_of(head, false, outputs) - v).norm() < 1e-6);
    }
  }
  // Both sides of the seam are one direction, and near to it in R3, though not in angles.
  const Eigen::Vector3d left = direction_from_angles(kPi - 1e-3, 0.2), right = direction_from_angles(-kPi + 1e-3, 0.2);
  CHECK((left - right).norm() < 3e-3);
  CHECK(std::abs(angles_from_direction(left).x() - angles_from_direction(right).x()) > 6.0);
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Vector2d pole = angles_from_direction(sign * Eigen::Vector3d::UnitZ());
    CHECK(pole.x() == 0.0);
    CHECK(pole.y() == Approx(sign * kPi / 2));
    CHECK((direction_from_angles(1.0, sign * kPi / 2) - sign * Eigen::Vector3d::UnitZ()).norm() < 1e-12);
  }
}

TEST_CASE("directions in the plane stay there; outputs that say nothing are +x", "[agent]") {
  for (const nn::Head head : {nn::Head::kUnitVector, nn::Head::kAngles}) {
    std::vector<float> outputs(head == nn::Head::kAngles ? 1 : 2);
    const Eigen::Vector3d v = direction_from_angles(-2.5, 0.0);
    outputs_of(head, true, v, outputs);
    CHECK((direction_of(head, true, outputs) - v).norm() < 1e-6);
  }
  const std::vector<float> nothing{0.0F, 0.0F, 0.0F}, wrong{std::nanf(""), 1.0F, 0.0F};
  CHECK(direction_of(nn::Head::kUnitVector, false, nothing) == Eigen::Vector3d::UnitX());
  CHECK(direction_of(nn::Head::kUnitVector, false, wrong) == Eigen::Vector3d::UnitX());
}

TEST_CASE("the field of arrival knows distances in the open and around a wall", "[agent]") {
  const train::TrainingWorld world(room(true), Robot{0.25, 0.0});
  const FreeSpace space = world.space();
  const SegmentCheck check(space, {}, kNowhere);
  const Eigen::Vector3d goal_m(6.03, 2.0, 1.52), start_m(2.0, 2.1, 1.5);
  for (const bool plane : {true, false}) {
    ArrivalField::Config config;
    config.plane = plane;
    ArrivalField field(config);
    field.compute(space, check, goal_m, kNowhere);
    CHECK(field.value_m({7.0, 6.0, goal_m.z()}) ==
          Approx((Eigen::Vector3d(7.0, 6.0, goal_m.z()) - goal_m).norm()).epsilon(0.05));
    // Past the wall's end, 0.25 m and a voxel off its corners.
    const double around_m =
        (start_m - Eigen::Vector3d(3.5, 6.8, 1.5)).norm() + (goal_m - Eigen::Vector3d(4.5, 6.8, 1.5)).norm() + 1.0;
    CHECK(field.value_m(start_m) == Approx(around_m).epsilon(0.06));
    CHECK(field.value_m({4.0, 3.0, 1.5}) == ArrivalField::kFar);
    std::vector<Eigen::Vector3d> way;
    field.descend(start_m, 100.0, way);
    REQUIRE(way.size() > 10);
    CHECK(way.back() == goal_m);
    double length_m = 0.0;
    for (std::size_t i = 1; i < way.size(); ++i) length_m += (way[i] - way[i - 1]).norm();
    CHECK(length_m < 1.1 * around_m);
    ArrivalField near(config);  // stops once the start is reached
    near.compute(space, check, goal_m, start_m);
    CHECK(near.value_m(start_m) == Approx(field.value_m(start_m)).epsilon(1e-3));
  }
}

TEST_CASE("a world turned by a quarter looks the same", "[agent]") {
  const auto turn = [](const Eigen::Vector3d& p) { return Eigen::Vector3d(8.0 - p.y(), p.x(), p.z()); };
  for (const bool plane : {true, false}) {
    const AgentInput input = plane ? AgentInput::slice() : AgentInput::volume();
    const Eigen::Vector3d at_m(2.53, 3.04, 1.51), goal_m(6.02, 2.04, 1.51);
    const Looked a = look(room(true), at_m, goal_m, input);
    const Looked b = look(quarter_turn(room(true)), turn(at_m), turn(goal_m), input);
    CHECK(std::abs(wrap_angle(b.seen.yaw_rad - a.seen.yaw_rad - kPi / 2)) < 0.02);
    for (std::size_t i = 0; i < a.seen.features.size(); ++i)
      CHECK(a.seen.features[i] == Approx(b.seen.features[i]).margin(0.05));
    int different = 0;
    for (std::size_t i = 0; i < a.seen.windows.size(); ++i)
      different += std::abs(a.seen.windows[i] - b.seen.windows[i]) > 40 ? 1 : 0;
    CHECK(different < static_cast<int>(a.seen.windows.size() / 50));  // samples that fall beside a cell's border
  }
}

TEST_CASE("only differences of the way left matter", "[agent]") {
  AgentInput input = AgentInput::volume();
  input.channels = {AgentInput::Channel::kAttraction};
  // In the open, the same place seen with the goal straight ahead, near and far.
  const Looked near = look(room(false), {2.05, 4.05, 1.55}, {5.05, 4.05, 1.55}, input);
  const Looked far = look(room(false), {2.05, 4.05, 1.55}, {7.05, 4.05, 1.55}, input);
  const std::size_t middle = (4 * 16 + 8) * 16 + 8;  // beside the centre of the fine window
  CHECK(std::abs(near.seen.windows[middle] - 128) < 25);
  CHECK(std::abs(far.seen.windows[middle] - near.seen.windows[middle]) < 12);
  CHECK(near.seen.windows[middle + 6] < near.seen.windows[middle]);  // down the way is lower
}

TEST_CASE("channels show walls, the unknown and where it has been", "[agent]") {
  using Channel = AgentInput::Channel;
  AgentInput input = AgentInput::slice();
  input.channels = {Channel::kClearance, Channel::kUnknown, Channel::kVisited};
  const Looked looked = look(room(false), {1.0, 4.05, 1.55}, {6.0, 4.05, 1.55}, input);
  const std::size_t plane = 32 * 32, middle = 16 * 32 + 16;
  CHECK(looked.seen.windows[middle] > 128);            // more room than the robot needs
  CHECK(looked.seen.windows[16 * 32] < 128);           // 1.55 m behind: beyond the wall
  CHECK(looked.seen.windows[plane + middle] == 128);   // known
  CHECK(looked.seen.windows[plane + 16 * 32] == 255);  // beyond the map
  int visited = 0;
  for (std::size_t i = 0; i < plane; ++i) visited += looked.seen.windows[2 * plane + i] == 255 ? 1 : 0;
  CHECK((visited >= 1 && visited <= 4));
}

TEST_CASE("a fellow in the way is flown around", "[agent]") {
  const Looked looked =
      look(room(false), {2.05, 4.05, 1.55}, {6.05, 4.05, 1.55}, AgentInput::slice(), {{{3.0, 4.0, 1.55}, 0.6}});
  CHECK(std::abs(looked.way.y()) > 0.2);
}

TEST_CASE("input descriptions are read as they are written", "[agent]") {
  AgentInput input = AgentInput::slice();
  CHECK(AgentInput::parse(input.text()) == input);
  input = AgentInput::volume();
  input.attraction = AgentInput::Attraction::kCone;
  input.channels.push_back(AgentInput::Channel::kVisited);
  input.spacings_m = {0.25};
  CHECK(AgentInput::parse(input.text()) == input);
  CHECK_THROWS_AS(AgentInput::parse("sphere"), InputError);
  CHECK_THROWS_AS(AgentInput::parse("plane samples 1x2"), InputError);
  CHECK_THROWS_AS(AgentInput::parse("plane samples 2x8x8"), InputError);
  CHECK_THROWS_AS(AgentInput::parse("volume channels smell"), InputError);
  CHECK_THROWS_AS(AgentInput::parse("volume spacings_m 0.1,x"), InputError);
}
