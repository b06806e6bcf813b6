#include "coverage3d/tour.hpp"
#include "core/rng.hpp"
#include "coverage3d/blacklist.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>
#include <numeric>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;

TourProblem random_problem(Rng& rng, std::size_t vehicles, std::size_t stops) {
  std::vector<Eigen::Vector2d> at(vehicles + stops);
  for (Eigen::Vector2d& p : at) p = {rng.uniform(0.0, 20.0), rng.uniform(0.0, 20.0)};
  TourProblem problem;
  problem.ready_s.assign(vehicles, 0.0);
  problem.start_s.assign(vehicles, std::vector<double>(stops));
  problem.between_s.assign(stops, std::vector<double>(stops));
  for (std::size_t i = 0; i < stops; ++i) {
    for (std::size_t k = 0; k < vehicles; ++k) problem.start_s[k][i] = (at[k] - at[vehicles + i]).norm();
    for (std::size_t j = 0; j < stops; ++j) problem.between_s[i][j] = (at[vehicles + i] - at[vehicles + j]).norm();
  }
  return problem;
}

double best_by_trying_all(const TourProblem& problem) {
  const std::size_t stops = problem.between_s.size();
  std::vector<std::size_t> order(stops);
  std::iota(order.begin(), order.end(), std::size_t{0});
  double best = std::numeric_limits<double>::infinity();
  do {
    if (problem.start_s.size() == 1) {
      best = std::min(best, tour_cost(problem, {order}));
      continue;
    }
    for (std::size_t cut = 0; cut <= stops; ++cut) {
      const auto middle = order.begin() + static_cast<std::ptrdiff_t>(cut);
      best = std::min(best, tour_cost(problem, {{order.begin(), middle}, {middle, order.end()}}));
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

}  // namespace

TEST_CASE("tours are near the best there is and visit every stop once") {
  Rng rng = make_rng(3, "tours");
  double sum = 0.0;
  constexpr int kProblems = 40;
  for (int i = 0; i < kProblems; ++i) {
    const TourProblem problem = random_problem(rng, i % 2 == 0 ? 1 : 2, 6);
    const auto tours = plan_tours(problem);
    std::vector<std::size_t> visited;
    for (const auto& tour : tours) visited.insert(visited.end(), tour.begin(), tour.end());
    std::sort(visited.begin(), visited.end());
    REQUIRE(visited == std::vector<std::size_t>{0, 1, 2, 3, 4, 5});
    const double ratio = tour_cost(problem, tours) / best_by_trying_all(problem);
    CHECK(ratio < 1.35);
    CHECK(ratio > 1.0 - 1e-9);
    sum += ratio;
  }
  CHECK(sum / kProblems < 1.05);
}

TEST_CASE("stops out of reach are left out") {
  Rng rng = make_rng(4, "tours");
  TourProblem problem = random_problem(rng, 2, 4);
  for (auto& row : problem.start_s) row[2] = std::numeric_limits<double>::infinity();
  for (auto& row : problem.between_s) row[2] = std::numeric_limits<double>::infinity();
  for (const auto& tour : plan_tours(problem)) CHECK(std::count(tour.begin(), tour.end(), std::size_t{2}) == 0);
  CHECK(plan_tours({}).empty());
}

TEST_CASE("what is avoided is what all failures so far tell, however long ago", "[blacklist]") {
  Rng rng(8);
  const auto place = [&rng] { return Eigen::Vector3d(4.0 * rng.uniform(), 4.0 * rng.uniform(), 1.0); };
  Blacklist blacklist(0.6, 3.0);
  for (double time_s = 0.0; time_s < 300.0; time_s += 0.5) {
    if (rng.uniform() < 0.3) blacklist.report(place(), place(), time_s);
    const Eigen::Vector3d at_m = place();
    const bool avoided = std::any_of(blacklist.entries().begin(), blacklist.entries().end(), [&](const auto& entry) {
      return time_s < entry.until_s && (entry.position_m - at_m).norm() <= 0.6;
    });
    CHECK(blacklist.blocks_place(at_m, time_s) == avoided);
    Blacklist loaded(0.6, 3.0);
    loaded.from_json(blacklist.to_json());
    CHECK(loaded.blocks_place(at_m, time_s) == avoided);
  }
}

TEST_CASE("a failed goal is left alone for a while, longer every time") {
  Blacklist blacklist(0.6, 10.0);
  const Eigen::Vector3d place(1.0, 1.0, 1.0);
  FrontierCluster small;
  small.center_m = {2.0, 1.0, 1.0};
  small.area_m2 = 0.1;
  FrontierCluster large = small;
  large.area_m2 = 2.0;
  blacklist.report(place, small.center_m, 0.0);
  CHECK(blacklist.blocks_place(place + Eigen::Vector3d(0.5, 0.0, 0.0), 5.0));
  CHECK_FALSE(blacklist.blocks_place(place + Eigen::Vector3d(0.7, 0.0, 0.0), 5.0));
  CHECK(blacklist.blocks_target(small, 5.0));
  CHECK_FALSE(blacklist.blocks_target(large, 5.0));
  CHECK_FALSE(blacklist.blocks_target(small, 10.0));
  blacklist.report(place, small.center_m, 11.0);
  CHECK(blacklist.blocks_target(large, 30.0));
  CHECK_FALSE(blacklist.blocks_target(large, 31.5));
}
