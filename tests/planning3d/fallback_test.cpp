#include "planning3d/fallback_planner.hpp"

#include "checkers/path_checker.hpp"
#include "core/errors.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <stdexcept>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

class Stub final : public Planner {
 public:
  using Answer = std::function<PlanResult(const PlanRequest&)>;
  Stub(std::string_view name, Answer answer) : name_(name), answer_(std::move(answer)) {}
  std::string_view name() const override { return name_; }
  PlanResult plan(const FreeSpace& /*space*/, const PlanRequest& request) override { return answer_(request); }

 private:
  std::string_view name_;
  Answer answer_;
};

PlanResult claims(std::vector<Eigen::Vector3d> path_m) {
  PlanResult result;
  result.status = PlanStatus::kReached;
  result.path_m = std::move(path_m);
  return result;
}

FallbackPlanner with_astar(Stub::Answer answer) {
  std::vector<std::unique_ptr<Planner>> fallbacks;
  fallbacks.push_back(make_planner("astar"));
  return FallbackPlanner(std::make_unique<Stub>("odd", std::move(answer)), std::move(fallbacks));
}

FallbackPlanner alone(Stub::Answer answer) { return FallbackPlanner(std::make_unique<Stub>("odd", std::move(answer))); }

struct Scene {
  Scene() {
    world.fill({{2.8, 0.0, 0.0}, {3.2, 4.0, 2.5}}, true);
    request.start_m = {1.05, 1.05, 1.25};
    request.goal_m = {5.05, 1.05, 1.25};
  }
  TestWorld world{{6.0, 6.0, 2.5}, 0.1};
  PlanRequest request;
};

}  // namespace

TEST_CASE("no planner is believed: what is not a safe path from start to goal goes to the next", "[fallback]") {
  Scene scene;
  const FreeSpace space = scene.world.space();
  const Eigen::Vector3d a_m = scene.request.start_m;
  const Eigen::Vector3d b_m = scene.request.goal_m;
  const double nan = std::nan("");
  const Eigen::Vector3d round_m(3.05, 5.05, 1.25);
  struct Case {
    Stub::Answer answer;
    AttemptOutcome outcome;
    std::string reason;
  };
  const auto path = [](std::vector<Eigen::Vector3d> path_m) {
    return [path_m](const PlanRequest&) { return claims(path_m); };
  };
  const std::vector<Case> cases{
      {path({a_m, b_m}), AttemptOutcome::kUnsafe, "odd: unsafe: occupied"},
      {path({a_m, {1.05, 1.05, 7.0}, b_m}), AttemptOutcome::kUnsafe, "odd: unsafe: outside box"},
      {path({}), AttemptOutcome::kMalformed, "odd: malformed path"},
      {path({a_m}), AttemptOutcome::kMalformed, "odd: malformed path"},
      {path({a_m, {nan, 1.0, 1.0}, b_m}), AttemptOutcome::kMalformed, "odd: malformed path"},
      {path({a_m, {INFINITY, 1.0, 1.0}, b_m}), AttemptOutcome::kMalformed, "odd: malformed path"},
      {path({a_m + Eigen::Vector3d(0.2, 0.0, 0.0), round_m, b_m}), AttemptOutcome::kMalformed, "odd: malformed path"},
      {path({a_m, {1.05, 2.05, 1.25}}), AttemptOutcome::kMalformed, "odd: malformed path"},
      {[](const PlanRequest&) {
         return PlanResult{PlanStatus::kLocalMinimum, {}, 0.0, 0};
       },
       AttemptOutcome::kNoAnswer, "odd: local minimum"},
      {[](const PlanRequest&) -> PlanResult { throw std::runtime_error("out of order"); }, AttemptOutcome::kFailed,
       "odd: failed: out of order"},
  };
  for (const Case& wrong : cases) {
    INFO(wrong.reason);
    FallbackPlanner planner = with_astar(wrong.answer);
    CHECK(planner.name() == "odd");
    const FallbackResult result = planner.decide(space, scene.request);
    REQUIRE(result.attempts.size() == 2);
    CHECK(result.attempts[0].outcome == wrong.outcome);
    CHECK(result.reason() == wrong.reason);
    CHECK(result.fell_back());
    CHECK(!result.hover());
    CHECK(result.planner() == "astar");
    CHECK(result.plan.status == PlanStatus::kReached);
    CHECK(checkers::path_problem(space, result.plan.path_m) == "");

    const FallbackResult nobody = alone(wrong.answer).decide(space, scene.request);
    CHECK(nobody.hover());
    CHECK(!nobody.fell_back());
    CHECK(nobody.planner().empty());
    CHECK(nobody.plan.status != PlanStatus::kReached);
    CHECK(nobody.plan.path_m.empty());
    CHECK(std::isnan(nobody.plan.length_m));
    CHECK(nobody.reason() == wrong.reason);
  }
}

TEST_CASE("paths through space that nobody has seen are refused", "[fallback]") {
  Scene scene;
  mapping::OccupancyMap seen(scene.world.map.grid());
  for (int z = 0; z < 25; ++z) {
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        if (x < 28 || x > 32) seen.set_log_odds({x, y, z}, -1.0F);
      }
    }
  }
  scene.world.map = std::move(seen);
  const FreeSpace space = scene.world.space();
  const auto result = alone([](const PlanRequest& request) {
                        return claims({request.start_m, request.goal_m});
                      }).decide(space, scene.request);
  REQUIRE(result.attempts.size() == 1);
  CHECK(result.attempts[0].verdict == Verdict::kUnknown);
  CHECK(result.hover());
}

TEST_CASE("the first answer that passes is used and nobody else is asked", "[fallback]") {
  Scene scene;
  const FreeSpace space = scene.world.space();
  int asked = 0;
  std::vector<std::unique_ptr<Planner>> fallbacks;
  fallbacks.push_back(std::make_unique<Stub>("never", [&asked](const PlanRequest&) {
    ++asked;
    return PlanResult{};
  }));
  FallbackPlanner planner(make_planner("astar"), std::move(fallbacks));
  const FallbackResult result = planner.decide(space, scene.request);
  CHECK(asked == 0);
  CHECK(result.attempts.size() == 1);
  CHECK(result.planner() == "astar");
  CHECK(!result.fell_back());
  CHECK(result.reason() == "");
  CHECK(result.plan.path_m == make_planner("astar")->plan(space, scene.request).path_m);
  CHECK(planner.plan(space, scene.request).path_m == result.plan.path_m);
}

TEST_CASE("the caller may refuse a path, or all of them", "[fallback]") {
  Scene scene;
  const FreeSpace space = scene.world.space();
  std::vector<std::unique_ptr<Planner>> fallbacks;
  fallbacks.push_back(make_planner("rrtconnect"));
  FallbackPlanner planner(make_planner("astar"), std::move(fallbacks));
  const FallbackResult next = planner.decide(space, scene.request, [](const PlanResult&, std::string_view name) {
    if (name == "astar") return PlanVerdict{PlanVerdict::Kind::kTryNext, "too plain"};
    return PlanVerdict{};
  });
  CHECK(next.planner() == "rrtconnect");
  CHECK(next.fell_back());
  CHECK(next.reason() == "astar: refused: too plain");
  const FallbackResult stopped = planner.decide(space, scene.request, [](const PlanResult&, std::string_view) {
    return PlanVerdict{PlanVerdict::Kind::kStop, "fellow in the way"};
  });
  CHECK(stopped.attempts.size() == 1);
  CHECK(stopped.hover());
  CHECK(stopped.plan.path_m.empty());
  CHECK(stopped.plan.status == PlanStatus::kNoPath);
}

TEST_CASE("a closed goal ends in hovering with the primary's status", "[fallback]") {
  Scene scene;
  scene.world.fill({{2.8, 4.0, 0.0}, {3.2, 6.0, 2.5}}, true);
  const FreeSpace space = scene.world.space();
  std::vector<std::unique_ptr<Planner>> fallbacks;
  fallbacks.push_back(make_planner("bitstar"));
  FallbackPlanner planner(make_planner("apf"), std::move(fallbacks));
  const FallbackResult result = planner.decide(space, scene.request);
  CHECK(result.hover());
  CHECK(result.plan.status == PlanStatus::kNoPath);
  CHECK(result.reason() == "apf: no path, bitstar: no path");
}

TEST_CASE("fallbacks are chosen by name", "[fallback]") {
  CHECK(resolve_fallback("auto", "astar").empty());
  CHECK(resolve_fallback("auto", "apf") == "astar");
  CHECK(resolve_fallback("none", "apf").empty());
  CHECK(resolve_fallback("bitstar", "astar") == "bitstar");
  CHECK(resolve_fallback("bitstar", "bitstar").empty());
  CHECK_THROWS_WITH(resolve_fallback("luck", "apf"), Catch::Contains("luck") && Catch::Contains("bitstar"));
}
