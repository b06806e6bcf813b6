#include "coverage3d/pick_strategy.hpp"

#include "core/rng.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

namespace stairwell::coverage3d {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kUnderWay = 1e12;      // before all ranks
constexpr double kLeastFlight_s = 0.5;  // a view from where the UAV is does not outweigh everything
constexpr double kBand_m = 3.0;         // height of a storey

}  // namespace

PickStrategy::Pick PickStrategy::best_for(const AssignmentRequest& request, const Crew& crew, std::size_t vehicle,
                                          const std::vector<Stop>& stops, const std::vector<bool>& taken) const {
  const Choice choice{crew, vehicle, request.time_s};
  Pick best{kNever, vehicle, stops.size()};
  for (std::size_t i = 0; i < stops.size(); ++i) {
    if (taken[i] || !std::isfinite(way_m(vehicle, stops[i].pose()))) continue;
    const bool under_way = loyal() && crew.target_m[vehicle] && belongs(*stops[i].cluster, *crew.target_m[vehicle]);
    const double value =
        under_way ? (stops[i].cluster->center_m - *crew.target_m[vehicle]).norm() - kUnderWay : rank(choice, stops[i]);
    if (value < best.rank) best = {value, vehicle, i};
  }
  return best;
}

void PickStrategy::share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                             const std::vector<Stop>& all_stops, Assignment& assignment) {
  std::vector<Stop> stops = all_stops;
  std::vector<bool> taken(stops.size(), false);
  for (std::size_t i = 0; i < stops.size(); ++i)
    taken[i] = std::any_of(request.uavs.begin(), request.uavs.end(), [&](const UavView& uav) {
      return !uav.wants_goal && uav.goal && belongs(*stops[i].cluster, uav.goal->target_m);
    });
  std::vector<std::size_t> waiting;
  for (std::size_t k = 0; k < crew.uavs.size(); ++k)
    if (request.uavs[crew.uavs[k]].wants_goal) waiting.push_back(k);
  std::optional<Foreseen> foreseen;
  if (takes_turns()) foreseen = foreseen_by_others(space, request);
  while (!waiting.empty()) {
    if (foreseen) deduct(space, *foreseen, stops);
    Pick best = best_for(request, crew, waiting.front(), stops, taken);
    for (std::size_t i = 1; foreseen && i < waiting.size(); ++i) {
      const Pick other = best_for(request, crew, waiting[i], stops, taken);
      if (other.rank < best.rank) best = other;
    }
    std::erase(waiting, best.vehicle);
    if (best.stop == stops.size()) continue;
    taken[best.stop] = true;
    const Goal goal = goal_for(space, crew, best.vehicle, stops[best.stop], nullptr, request.time_s);
    assignment.goals[crew.uavs[best.vehicle]] = goal;
    if (foreseen && !waiting.empty()) foresee(space, crew.start_m[best.vehicle], goal, *foreseen);
  }
}

double NearestStrategy::rank(const Choice& choice, const Stop& stop) const {
  return way_m(choice.vehicle, stop.pose());
}

double GreedyStrategy::rank(const Choice& choice, const Stop& stop) const {
  const double time_s = std::max(start_s(choice.crew, choice.vehicle, stop.pose()), kLeastFlight_s);
  return -stop.gain_m3() / time_s;
}

double RandomStrategy::rank(const Choice& choice, const Stop& stop) const {
  char stream[96];
  std::snprintf(stream, sizeof stream, "coverage/random/%zu/%.3f/%d,%d,%d", choice.crew.uavs[choice.vehicle],
                choice.time_s, stop.pose().voxel.x, stop.pose().voxel.y, stop.pose().voxel.z);
  return make_rng(config().seed, stream).uniform();
}

double LawnmowerStrategy::rank(const Choice& choice, const Stop& stop) const {
  const double lane_m = 1.5 * config().sensor.max_range_m;
  const auto part = [&](const Eigen::Vector3d& at_m) { return mown_part(config().box, lane_m, kBand_m, at_m); };
  const auto uavs = static_cast<double>(choice.crew.uavs.size());
  const double there = part(stop.pose().position_m);
  const bool own = std::floor(std::min(there, 0.999999) * uavs) == static_cast<double>(choice.vehicle);
  const double ahead = there - part(choice.crew.start_m[choice.vehicle]);
  return (ahead < 0.0 ? ahead + 1.0 : ahead) + (own ? 0.0 : 1.0);
}

double mown_part(const Aabb& box, double lane_m, double band_m, const Eigen::Vector3d& at_m) {
  const Eigen::Vector3d size_m = box.size_m();
  const Eigen::Vector3d in_m = (at_m - box.min_m).cwiseMax(0.0).cwiseMin(size_m);
  const double lanes = std::max(1.0, std::round(size_m.y() / lane_m));
  const double bands = std::max(1.0, std::round(size_m.z() / band_m));
  const double lane = std::min(lanes - 1.0, std::floor(in_m.y() / size_m.y() * lanes));
  const double band = std::min(bands - 1.0, std::floor(in_m.z() / size_m.z() * bands));
  const bool back_up = std::fmod(band, 2.0) != 0.0;  // every other band is mown from its far lane
  const double row = band * lanes + (back_up ? lanes - 1.0 - lane : lane);
  const double along = in_m.x() / size_m.x();
  return (row + (std::fmod(row, 2.0) == 0.0 ? along : 1.0 - along)) / (bands * lanes);
}

}  // namespace stairwell::coverage3d
