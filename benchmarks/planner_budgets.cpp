/// planner_budgets [PLANNER...]: what planners make of a time budget. Between 200 random pairs of places of
/// worlds/office_tower.sdf (all of it known, 0.1 m) that do not see each other: how many are reached, length over that
/// of A* with string pulling, and time. The clock is this thread's processor time, so that other programs do not count.
#include "benchmarks/known_building.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/segment_check.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

using namespace stairwell;
using namespace stairwell::planning3d;
using benchmarks::KnownBuilding;
using benchmarks::thread_time_s;

namespace {

constexpr int kPairs = 200;
constexpr double kLeastApart_m = 3.0;
constexpr std::size_t kNoLimit = 1'000'000'000;

struct Pair {
  PlanRequest request;
  double astar_m;
};

std::vector<Pair> make_pairs(const KnownBuilding& office, const FreeSpace& space) {
  Rng rng = make_rng(1, "planner budgets");
  AstarPlanner astar;
  std::vector<Pair> pairs;
  while (pairs.size() < kPairs) {
    Pair pair{{}, 0.0};
    pair.request.start_m = office.any_place_m(rng);
    pair.request.goal_m = office.any_place_m(rng);
    pair.request.clearance_weight = 0.0;
    pair.request.seed = pairs.size();
    if ((pair.request.start_m - pair.request.goal_m).norm() < kLeastApart_m) continue;
    const SegmentCheck check(space, {}, pair.request.start_m);
    if (!space.traversable(space.grid().index_of(pair.request.start_m)) ||
        !space.traversable(space.grid().index_of(pair.request.goal_m)) ||
        check.segment_free(pair.request.start_m, pair.request.goal_m)) {
      continue;
    }
    const PlanResult best = astar.plan(space, pair.request);
    if (best.status != PlanStatus::kReached) continue;
    pair.astar_m = best.length_m;
    pairs.push_back(pair);
  }
  return pairs;
}

double at_share(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void measure(const FreeSpace& space, const std::vector<Pair>& pairs, const std::string& name, double budget_s) {
  const auto planner = make_planner(name);
  std::vector<double> ratios;
  std::vector<double> times_ms;
  int unsafe = 0;
  for (const Pair& pair : pairs) {
    PlanRequest request = pair.request;
    request.max_checks = kNoLimit;
    request.clock_s = thread_time_s;
    const double begin_s = thread_time_s();
    request.deadline_s = begin_s + budget_s;
    const PlanResult result = planner->plan(space, request);
    times_ms.push_back(1e3 * (thread_time_s() - begin_s));
    if (result.status != PlanStatus::kReached) continue;
    ratios.push_back(result.length_m / pair.astar_m);
    if (!SafetyCheck{}.check_path(space, result.path_m).safe()) ++unsafe;
  }
  const double reached = 100.0 * static_cast<double>(ratios.size()) / static_cast<double>(pairs.size());
  const double middle = at_share(ratios, 0.5);
  const double high = at_share(ratios, 0.95);
  const double median_ms = at_share(times_ms, 0.5);
  std::printf("| `%s` | %.0f | %.1f | %.3f | %.3f | %.1f | %.1f | %d |\n", name.c_str(), 1e3 * budget_s, reached,
              middle, high, median_ms, times_ms.back(), unsafe);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    std::vector<std::string> names(argv + 1, argv + argc);
    if (names.empty())
      names.assign({"astar", "rrtconnect", "rrtstar", "informed_rrtstar", "bitstar", "abitstar", "prmstar"});
    const KnownBuilding office("office_tower.sdf", {-6.5, 0.0, 0.95}, Robot{0.2, 0.05});
    const FreeSpace space = office.space();
    const std::vector<Pair> pairs = make_pairs(office, space);
    std::printf("| planner | budget ms | reached %% | length, median | p95 | time ms, median | max | unsafe |\n");
    std::printf("|---|---|---|---|---|---|---|---|\n");
    for (const std::string& name : names) {
      for (const double budget_s : {0.02, 0.1, 0.5}) measure(space, pairs, name, budget_s);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "planner_budgets: %s\n", error.what());
    return 1;
  }
}
