#include "models.hpp"
#include "planning3d/connectivity.hpp"
#include "planning3d/planner.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <ctime>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Two rooms of 150 000 and more voxels each: too large to be seen as closed pockets at a glance.
TestWorld two_halls(bool door) {
  TestWorld world({10.0, 10.0, 4.0}, 0.1);
  world.fill({{4.8, door ? 1.0 : 0.0, 0.0}, {5.2, 10.0, 4.0}}, true);
  return world;
}

constexpr double kBudget_s = 0.06;

PlanRequest across() {
  PlanRequest request;
  request.start_m = {1.05, 8.05, 1.05};
  request.goal_m = {9.05, 8.05, 3.05};
  return request;
}

}  // namespace

TEST_CASE("a closed goal is no path, within the deadline and a tenth", "[deadline]") {
  TestWorld world = two_halls(false);
  const FreeSpace space = world.space();
  for (const std::string_view name : planner_names()) {
    const auto planner = make_planner(name, test::with_models());
    INFO(name);
    PlanRequest request = across();
    request.clock_s = thread_time_s;
    request.max_checks = 1'000'000'000;
    const double begin_s = thread_time_s();
    request.deadline_s = begin_s + kBudget_s;
    CHECK(planner->plan(space, request).status == PlanStatus::kNoPath);
    const double took_s = thread_time_s() - begin_s;
    CHECK(took_s < 1.1 * kBudget_s + 0.004);  // other programs on the machine cost a little even so
  }
}

TEST_CASE("without time planners say so, unless nothing could have helped", "[deadline]") {
  TestWorld open = two_halls(true);
  const FreeSpace space = open.space();
  for (const std::string_view name : planner_names()) {
    INFO(name);
    PlanRequest request = across();
    double now_s = 1.0;
    request.clock_s = [&now_s] { return now_s += 1e-9; };
    request.deadline_s = 1.0;
    const PlanStatus found = make_planner(name, test::with_models())->plan(space, request).status;
    CHECK(found == (name == "agent2d" ? PlanStatus::kLocalMinimum : PlanStatus::kTimedOut));  // it keeps its height
    CHECK(make_planner("apf", {Attraction::kGeodesic, false, {}})->plan(space, request).status ==
          PlanStatus::kTimedOut);
  }
  TestWorld shut = two_halls(false);
  PlanRequest request = across();
  request.max_expansions = 10;
  request.max_checks = 2000;
  CHECK(make_planner("rrtconnect")->plan(shut.space(), request).status == PlanStatus::kNoPath);
  CHECK(make_planner("astar")->plan(shut.space(), request).status == PlanStatus::kNoPath);
  CHECK(make_planner("astar")->plan(space, request).status == PlanStatus::kTimedOut);
}
