#include "apps/bound.hpp"

#include "apps/known_tour.hpp"
#include "apps/metrics.hpp"
#include "apps/run_config.hpp"
#include "apps/simulation.hpp"
#include "apps/tour_flight.hpp"
#include "core/errors.hpp"
#include "mapping/scan_integrator.hpp"
#include "sim3d/sensors.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace stairwell::apps {

namespace {

constexpr double kDefaultTarget = 0.99;
/// What the tours are to see of the sampled targets, beside the wanted share: more is seen on the way than is looked
/// at, and less than the sample says. Each is tried, the quickest flight counts.
constexpr double kShifts[] = {-0.012, -0.006, 0.0, 0.006};

const MotionState& state_at(const TourFlight& flight, std::size_t step) {
  return flight.states[std::min(step, flight.states.size() - 1)];
}

double length_m(const TourFlight& flight, std::size_t steps) {
  double sum_m = 0.0;
  for (std::size_t i = 1; i <= std::min(steps, flight.states.size() - 1); ++i)
    sum_m += (flight.states[i].position_m - flight.states[i - 1].position_m).norm();
  return sum_m;
}

/// Scans along the flights into one map, as a fleet would, until the wanted share is known.
class Observer {
 public:
  Observer(const Simulation& simulation, const std::vector<std::uint8_t>& explorable)
      : simulation_(simulation), explorable_(explorable) {}

  Bound fly(const std::vector<TourFlight>& flights, double target) const {
    const explore::FleetConfig& fleet = simulation_.config().fleet;
    mapping::OccupancyMap map(simulation_.truth().grid(), fleet.occupancy);
    CoverageMeter coverage(map.grid(), explorable_);
    mapping::ScanIntegrator integrator(mapping::ScanIntegrator::Config{fleet.discretize});
    std::vector<std::unique_ptr<sim3d::SimulatedSensor>> sensors;
    for (std::size_t k = 0; k < flights.size(); ++k) {
      sensors.push_back(std::make_unique<sim3d::SimulatedSensor>(simulation_.shared_caster(), fleet.sensor,
                                                                 sim3d::SensorNoise{}, 1, "bound" + std::to_string(k)));
    }
    std::size_t last = 0;
    for (const TourFlight& flight : flights) last = std::max(last, flight.states.size());
    const double per_scan = 1.0 / (fleet.sensor.rate_hz * Trajectory::kStep_s);
    Bound bound;
    for (std::size_t scan = 0; static_cast<double>(scan) * per_scan <= static_cast<double>(last) + per_scan; ++scan) {
      const auto step = static_cast<std::size_t>(std::llround(static_cast<double>(scan) * per_scan));
      bound.finish_s = static_cast<double>(scan) / fleet.sensor.rate_hz;
      for (std::size_t k = 0; k < flights.size(); ++k) {
        if (flights[k].states.empty()) continue;
        const MotionState& state = state_at(flights[k], step);
        integrator.integrate(sensors[k]->capture(make_pose(state.position_m, state.yaw_rad), bound.finish_s), map);
      }
      coverage.update(map);
      bound.coverage = coverage.coverage();
      if (bound.coverage < target) continue;
      for (const TourFlight& flight : flights) {
        if (flight.states.empty()) continue;
        bound.path_length_m += length_m(flight, step);
        bound.viewpoints += static_cast<std::size_t>(
            std::ranges::count_if(flight.arrival_s, [&](double at_s) { return at_s <= bound.finish_s; }));
      }
      return bound;
    }
    bound.finish_s = std::numeric_limits<double>::infinity();
    return bound;
  }

 private:
  const Simulation& simulation_;
  const std::vector<std::uint8_t>& explorable_;
};

std::vector<TourFlight> flights_of(KnownTour& tour, const planning3d::FreeSpace& space,
                                   const explore::FleetConfig& fleet, const std::vector<double>& start_yaws_rad) {
  std::vector<TourFlight> flights;
  for (std::size_t k = 0; k < tour.tours().size(); ++k) {
    std::vector<FlightStop> stops;
    for (std::size_t i = 0; i < tour.tours()[k].size(); ++i)
      stops.push_back({tour.way_m(k, i), tour.tours()[k][i].yaw_rad()});
    flights.push_back(fly_tour(space, fleet.limits, stops, start_yaws_rad[k], !fleet.sensor.panoramic()));
  }
  return flights;
}

}  // namespace

Bound find_bound(Settings settings, const volatile std::sig_atomic_t& interrupted) {
  const bool target_given = settings.contains("target_coverage");
  const RunConfig config = resolve(settings);
  require_usable(config);
  const double target = target_given ? config.target_coverage : kDefaultTarget;
  const Simulation simulation(config);
  const explore::FleetConfig& fleet = simulation.config().fleet;
  const auto reachable = simulation.reachable();
  const auto explorable = simulation.explorable(reachable);
  const KnownMap known(fully_known_map(simulation, reachable));
  const planning3d::FreeSpace space = known.space(fleet.robot, fleet.task_box);
  const TrueViews views(simulation, space, explorable);
  std::vector<double> start_yaws_rad;
  for (const Start& start : simulation.config().starts) start_yaws_rad.push_back(start.yaw_rad);
  const Observer observer(simulation, explorable);
  Bound best;
  best.finish_s = std::numeric_limits<double>::infinity();
  double most_seen = 0.0;
  KnownTour tour(views, space, fleet, simulation.airborne_starts_m(), start_yaws_rad);
  for (const double shift : kShifts) {
    if (interrupted != 0) throw RunError("interrupted");
    const double share = std::clamp(target + shift, 0.0, 1.0);
    tour.order(cover_greedily(views, share));
    tour.improve(std::min(share, tour.seen_share()));
    const Bound bound = observer.fly(flights_of(tour, space, fleet, start_yaws_rad), target);
    most_seen = std::max(most_seen, bound.coverage);
    if (bound.finish_s < best.finish_s) best = bound;
  }
  if (!std::isfinite(best.finish_s)) {
    throw RunError("the reference tours see only " + std::to_string(most_seen) +
                   " of what is explorable: lower --target-coverage");
  }
  best.uavs = simulation.config().uavs;
  best.target_coverage = target;
  return best;
}

std::string bound_json(const Bound& bound) {
  nlohmann::ordered_json j;
  j["finish_s"] = bound.finish_s;
  j["path_length_m"] = bound.path_length_m;
  j["viewpoints"] = bound.viewpoints;
  j["uavs"] = bound.uavs;
  j["coverage"] = bound.coverage;
  j["target_coverage"] = bound.target_coverage;
  return j.dump(2) + "\n";
}

}  // namespace stairwell::apps
