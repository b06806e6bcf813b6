/// avoidance_scenarios [SEEDS [NAME...]]: reciprocal avoidance in closed loop
/// (tests/planning3d/avoidance_scenarios.hpp), 100 seeds of each scenario by default, as a table. Collisions are pairs
/// of UAVs that touched and UAVs that touched the map; deadlocks are runs in which not all had arrived after 120 s.
/// Times of the thread's processor clock.
#include "planning3d/avoidance_scenarios.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

using namespace stairwell;
using namespace stairwell::test;

namespace {

double at_share(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// @returns whether all went well
bool measure(std::string_view name, std::uint64_t seeds) {
  int collisions = 0;
  int deadlocks = 0;
  std::size_t uavs = 0;
  std::size_t brakings = 0;
  double min_distance_m = std::numeric_limits<double>::infinity();
  std::vector<double> over_bound;
  std::vector<double> step_us;
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const AvoidanceScenario scenario = make_avoidance_scenario(name, seed);
    const AvoidanceOutcome outcome = run_avoidance(scenario, planning3d::OrcaConfig{});
    uavs = scenario.uavs.size();
    collisions += outcome.collisions;
    deadlocks += outcome.not_arrived > 0 ? 1 : 0;
    brakings += outcome.brakings;
    min_distance_m = std::min(min_distance_m, outcome.min_distance_m);
    over_bound.push_back(outcome.finish_s / outcome.least_s);
    step_us.insert(step_us.end(), outcome.step_us.begin(), outcome.step_us.end());
    if (outcome.collisions > 0 || outcome.not_arrived > 0) {
      std::fprintf(stderr, "%s, seed %d: %d collisions, %d not arrived\n", std::string(name).c_str(),
                   static_cast<int>(seed), outcome.collisions, outcome.not_arrived);
    }
  }
  std::printf("| %s | %zu | %d | %d | %d | %.2f | %.2f | %.3f | %.1f | %.0f | %.0f |\n", std::string(name).c_str(),
              uavs, static_cast<int>(seeds), collisions, deadlocks, mean(over_bound), at_share(over_bound, 0.95),
              min_distance_m, 100.0 * static_cast<double>(brakings) / static_cast<double>(step_us.size()),
              mean(step_us), at_share(step_us, 0.99));
  std::fflush(stdout);
  return collisions == 0 && deadlocks == 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::uint64_t seeds = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 100;
    std::vector<std::string> names(argv + std::min(argc, 2), argv + argc);
    if (names.empty()) names.assign(avoidance_scenario_names().begin(), avoidance_scenario_names().end());
    std::printf(
        "| scenario | UAVs | seeds | collisions | deadlocks | time over bound, mean | p95 | least distance m | "
        "braking %% | step us, mean | p99 |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    bool well = seeds > 0;
    for (const std::string& name : names) well = measure(name, seeds) && well;
    return well ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "avoidance_scenarios: %s\n", error.what());
    return 2;
  }
}
