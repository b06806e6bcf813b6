/// In large worlds: which of very many stops are looked at closely.
#include "coverage3d/frontier_strategy.hpp"
#include "mapping/worker_pool.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::coverage3d {
namespace {

constexpr std::size_t kManyStops = 1000;
constexpr std::size_t kNearStops = 100;

}  // namespace

/// Those that a UAV has the shortest ways to, and of those that show much the same number; all where they are not very
/// many. Ways are measured to the view that gains most.
std::vector<FrontierStrategy::Stop> FrontierStrategy::near_ones(const AssignmentRequest& request, const Crew& crew,
                                                                std::vector<Stop> stops) const {
  if (stops.size() <= kManyStops || finish_ || request.tasks != nullptr) return stops;
  std::vector<std::vector<std::size_t>> chosen(crew.uavs.size());
  mapping::for_each_index(request.workers, crew.uavs.size(), [&](std::size_t k) {
    std::vector<std::pair<float, std::size_t>> ways, ways_to_much;
    for (std::size_t i = 0; i < stops.size(); ++i) {
      const float way_m = costs_[crew.ways[k]].distance_m(stops[i].pose().voxel);
      if (!std::isfinite(way_m)) continue;
      ways.emplace_back(way_m, i);
      if (rank(stops[i]) == 0) ways_to_much.emplace_back(way_m, i);
    }
    for (auto* each : {&ways, &ways_to_much}) {
      const auto last = each->begin() + static_cast<std::ptrdiff_t>(std::min(kNearStops, each->size()));
      std::nth_element(each->begin(), last, each->end());
      std::for_each(each->begin(), last, [&](const auto& way) { chosen[k].push_back(way.second); });
    }
  });
  std::vector<bool> kept(stops.size(), false);
  for (const auto& of_uav : chosen) {
    for (const std::size_t i : of_uav) kept[i] = true;
  }
  std::vector<Stop> near;
  for (std::size_t i = 0; i < stops.size(); ++i) {
    if (kept[i]) near.push_back(std::move(stops[i]));
  }
  return near;
}

}  // namespace stairwell::coverage3d
