#include "planning3d/theta_planner.hpp"

#include "checkers/path_checker.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/safety_check.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <cmath>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

/// Lengths plus the extra near obstacles, by fine sampling: the cost that both planners say they keep low.
double cost_m(const FreeSpace& space, const std::vector<Eigen::Vector3d>& path_m, double weight) {
  const double least_m = std::sqrt(static_cast<double>(space.min_squared_cells())) * space.grid().resolution_m();
  double sum_m = 0.0;
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) {
    const double length_m = (path_m[i + 1] - path_m[i]).norm();
    const int pieces = std::max(1, static_cast<int>(length_m / 0.01));
    for (int k = 0; k < pieces; ++k) {
      const Eigen::Vector3d at_m = path_m[i] + (k + 0.5) / pieces * (path_m[i + 1] - path_m[i]);
      const double clear_m = space.blocked_distance().distance_m(space.grid().index_of(at_m));
      const double near = std::clamp(1.0 - (clear_m - least_m) / 0.5, 0.0, 1.0);
      sum_m += length_m / pieces * (1.0 + weight * near * near);
    }
  }
  return sum_m;
}

}  // namespace

TEST_CASE("Theta* reaches what A* reaches, by free paths that are no longer", "[theta]") {
  Rng rng = make_rng(21, "theta");
  AstarPlanner astar;
  ThetaPlanner theta;
  int reached = 0, cut_off = 0;
  double lattice_m = 0.0, length_m = 0.0, astar_cost_m = 0.0, theta_cost_m = 0.0;
  for (int round = 0; round < 60; ++round) {
    TestWorld world({5.0, 5.0, 2.0}, 0.1, {0.2, round % 3 == 0 ? 0.1 : 0.0});
    world.clutter(rng, 30, 1.5);
    const FreeSpace space = world.space();
    const std::vector<double> layers_m{0.65, 1.45};
    const bool slice = round % 2 == 1;
    PlanRequest request;
    request.clearance_weight = round % 4 < 2 ? 0.0 : 1.0;
    if (slice) request.rule = MotionRule::slice(layers_m);
    const auto jitter = [&rng] { return Eigen::Vector3d(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)); };
    request.start_m = world.random_place(space, rng) + (slice ? 0.0 : 0.04) * jitter();
    request.goal_m = world.random_place(space, rng) + (slice ? 0.0 : 0.04) * jitter();
    const PlanResult result = theta.plan(space, request);
    const PlanResult reference = astar.plan(space, request);
    REQUIRE(result.status == reference.status);
    if (result.status != PlanStatus::kReached) {
      CHECK(result.path_m.empty());
      CHECK(std::isnan(result.length_m));
      ++cut_off;
      continue;
    }
    ++reached;
    CHECK(checkers::path_problem(space, result.path_m) == "");
    CHECK(SafetyCheck{}.check_path(space, result.path_m).safe());
    CHECK((result.path_m.front() - request.start_m).norm() < 1e-12);
    CHECK((result.path_m.back() - request.goal_m).norm() < 1e-12);
    if (slice) CHECK(checkers::slice_problem(space.grid(), result.path_m, layers_m) == "");
    if (request.clearance_weight == 0.0) {
      CHECK(result.length_m <= astar.lattice_cost_m() + 0.1);
      lattice_m += astar.lattice_cost_m();
      length_m += result.length_m;
    } else {
      astar_cost_m += cost_m(space, reference.path_m, 1.0);
      theta_cost_m += cost_m(space, result.path_m, 1.0);
    }
  }
  CHECK(reached > 25);
  CHECK(cut_off > 0);
  CHECK(length_m <= 0.97 * lattice_m);
  CHECK(theta_cost_m <= 1.01 * astar_cost_m);
  WARN("Theta*: length " << length_m / lattice_m << " of the lattice's, cost with clearance "
                         << theta_cost_m / astar_cost_m << " of A*'s pulled path");
}

TEST_CASE("Theta* takes the taut path round an edge and does not squeeze through a diagonal gap", "[theta]") {
  TestWorld world({6.0, 6.0, 3.0}, 0.1);
  world.fill({{2.0, 0.0, 0.0}, {4.0, 3.0, 3.0}}, true);
  PlanRequest request;
  request.clearance_weight = 0.0;
  request.start_m = {1.05, 0.55, 1.55};
  request.goal_m = {4.95, 0.55, 1.55};
  const FreeSpace space = world.space();
  const PlanResult round_edge = ThetaPlanner{}.plan(space, request);
  REQUIRE(round_edge.status == PlanStatus::kReached);
  // Tangents to the two corners' circles of 0.2 m and the way between them.
  const double to_corner_m = std::hypot(0.95, 2.45);
  const double taut_m = 2.0 * std::sqrt(to_corner_m * to_corner_m - 0.04) + 2.0;
  CHECK(round_edge.length_m >= taut_m);
  CHECK(round_edge.length_m <= 1.1 * taut_m);

  TestWorld gap({2.0, 2.0, 0.6}, 0.2, {0.02, 0.0});  // two blocks that touch along an edge
  gap.fill({{0.0, 1.0, 0.0}, {1.0, 2.0, 0.6}}, true);
  gap.fill({{1.0, 0.0, 0.0}, {2.0, 1.0, 0.6}}, true);
  request.start_m = {0.5, 0.5, 0.3};
  request.goal_m = {1.5, 1.5, 0.3};
  CHECK(ThetaPlanner{}.plan(gap.space(), request).status == PlanStatus::kNoPath);
}
