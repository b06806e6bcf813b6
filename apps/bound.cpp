#include "apps/bound.hpp"

#include "apps/known_roads.hpp"
#include "apps/metrics.hpp"
#include "apps/run_config.hpp"
#include "apps/simulation.hpp"
#include "apps/tour_flight.hpp"
#include "apps/tour_model.hpp"
#include "apps/tour_search.hpp"
#include "core/errors.hpp"
#include "mapping/scan_integrator.hpp"
#include "sim3d/sensors.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

namespace stairwell::apps {

namespace {

constexpr double kDefaultTarget = 0.99;
constexpr std::size_t kEvaluationsPerStop = 35'000;
constexpr std::size_t kLeastEvaluations = 50'000, kMostEvaluations = 3'000'000;
constexpr double kSeenByChance = 0.005;  // so much more than expected a flight sees, as a rule
constexpr double kLeastMore = 0.002;     // to be seen next time, where too little was seen
constexpr double kNearer = 0.9;          // of the distance from which a target was missed: seen from there
constexpr int kMoreRounds = 12;          // at most, until a flight sees enough
constexpr double kLater_s = 0.5;         // temperature at the beginning of all rounds but the first
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

  struct Outcome {
    Bound bound;
    double seen_share = 0.0;  ///< of the explorable voxels, at the end of all flights
    mapping::OccupancyMap map;
  };

  /// Flies all to their ends. `finish_s` stays infinite where too little is seen.
  Outcome fly(const std::vector<TourFlight>& flights, double target) const {
    const explore::FleetConfig& fleet = simulation_.config().fleet;
    Outcome outcome{.bound = {}, .map = mapping::OccupancyMap(simulation_.truth().grid(), fleet.occupancy)};
    Bound& bound = outcome.bound;
    bound.finish_s = std::numeric_limits<double>::infinity();
    CoverageMeter coverage(outcome.map.grid(), explorable_);
    mapping::ScanIntegrator integrator(mapping::ScanIntegrator::Config{fleet.discretize});
    std::vector<std::unique_ptr<sim3d::SimulatedSensor>> sensors;
    std::size_t last = 0;
    for (std::size_t k = 0; k < flights.size(); ++k) {
      sensors.push_back(std::make_unique<sim3d::SimulatedSensor>(simulation_.shared_caster(), fleet.sensor,
                                                                 sim3d::SensorNoise{}, 1, "bound" + std::to_string(k)));
      last = std::max(last, flights[k].states.size());
    }
    const double per_scan = 1.0 / (fleet.sensor.rate_hz * Trajectory::kStep_s);
    for (std::size_t scan = 0; static_cast<double>(scan) * per_scan < static_cast<double>(last) + per_scan; ++scan) {
      const auto step = static_cast<std::size_t>(std::llround(static_cast<double>(scan) * per_scan));
      const double time_s = static_cast<double>(scan) / fleet.sensor.rate_hz;
      for (std::size_t k = 0; k < flights.size(); ++k) {
        if (scan > 0 && static_cast<double>(flights[k].states.size()) + per_scan <= static_cast<double>(step)) continue;
        const MotionState& state = state_at(flights[k], step);
        integrator.integrate(sensors[k]->capture(make_pose(state.position_m, state.yaw_rad), time_s), outcome.map);
      }
      coverage.update(outcome.map);
      outcome.seen_share = coverage.coverage();
      if (outcome.seen_share < target || std::isfinite(bound.finish_s)) continue;
      bound.finish_s = time_s;
      bound.coverage = outcome.seen_share;
      for (const TourFlight& flight : flights) {
        bound.path_length_m += length_m(flight, step);
        bound.viewpoints += static_cast<std::size_t>(
            std::ranges::count_if(flight.arrival_s, [&](double at_s) { return at_s <= bound.finish_s; }));
      }
    }
    return outcome;
  }

 private:
  const Simulation& simulation_;
  const std::vector<std::uint8_t>& explorable_;
};

/// A world and a fleet that knows it: finds tours and flies them.
class Reference {
 public:
  Reference(const Simulation& simulation, const BoundRequest& request, double target)
      : simulation_(simulation),
        fleet_(simulation.config().fleet),
        request_(request),
        target_(target),
        reachable_(simulation.reachable()),
        explorable_(simulation.explorable(reachable_)),
        known_(fully_known_map(simulation, reachable_)),
        space_(known_.space(fleet_.robot, fleet_.task_box)),
        views_(simulation, space_, explorable_),
        roads_(space_, fleet_.limits, places_and_starts_m(), simulation.config().starts.size()),
        model_(views_, roads_, fleet_.limits, start_yaws_rad()),
        search_(model_, make_rng(fleet_.seed, "bound/search")),
        observer_(simulation, explorable_) {
    best_.finish_s = std::numeric_limits<double>::infinity();
  }

  Bound find(const volatile std::sig_atomic_t& interrupted) {
    say("%zu places, %zu points to see", views_.places(), views_.targets());
    fly(Tours(model_.uavs()));
    double share = target_ - kSeenByChance;
    Tours tours = search_.order(cover_greedily(views_, share));
    const std::size_t evaluations = evaluations_for(tours);
    const auto ends = [&](int round) {
      return best_.finish_s == 0.0 || round > request_.rounds + (std::isfinite(best_.finish_s) ? 0 : kMoreRounds);
    };
    for (int round = 1; !ends(round); ++round) {
      Annealing annealing;
      annealing.evaluations = evaluations;
      if (round > 1) annealing.from_s = kLater_s;
      tours = search_.anneal(std::move(tours), static_cast<std::size_t>(std::ceil(share * targets())), annealing);
      if (interrupted != 0) throw RunError("interrupted");
      const double expected = static_cast<double>(search_.seen(tours)) / targets();
      const double seen = fly(tours);
      say("round %d of %d: tours of %.1f s, %.2f %% seen of %.2f %% expected, best %.1f s", round, request_.rounds,
          search_.longest_s(tours), 100.0 * seen, 100.0 * expected, best_.finish_s);
      const double more = seen < target_ ? std::max(target_ - seen, kLeastMore) : target_ - seen;
      share = std::clamp(share + more, 0.5 * target_, 1.0);
    }
    if (!std::isfinite(best_.finish_s)) {
      throw RunError("the reference tours see only " + std::to_string(most_seen_) +
                     " of what is explorable: lower --target-coverage");
    }
    best_.uavs = model_.uavs();
    best_.target_coverage = target_;
    return best_;
  }

 private:
  template <typename... Values>
  void say(const char* format, Values... values) const {
    if (!request_.report) return;
    char line[200];
    std::snprintf(line, sizeof line, format, values...);
    request_.report(line);
  }

  /// The more poses there are to be put in order, the longer it takes.
  static std::size_t evaluations_for(const Tours& tours) {
    std::size_t stops = 0;
    for (const Tour& tour : tours) stops += tour.size();
    return std::clamp(kEvaluationsPerStop * stops, kLeastEvaluations, kMostEvaluations);
  }

  double targets() const { return static_cast<double>(views_.targets()); }

  std::vector<Eigen::Vector3d> places_and_starts_m() const {
    std::vector<Eigen::Vector3d> points_m = views_.places_m();
    for (const Eigen::Vector3d& start_m : simulation_.airborne_starts_m()) points_m.push_back(start_m);
    return points_m;
  }

  std::vector<double> start_yaws_rad() const {
    std::vector<double> yaws_rad;
    for (const Start& start : simulation_.config().starts) yaws_rad.push_back(start.yaw_rad);
    return yaws_rad;
  }

  TourFlight flight_of(std::size_t uav, const Tour& tour) const {
    const double yaw_rad = simulation_.config().starts[uav].yaw_rad;
    std::vector<FlightStop> stops;
    for (std::size_t i = 0; i < tour.size(); ++i)
      stops.push_back({model_.way_m(uav, tour, i), TrueViews::yaw_rad(tour[i].yaw)});
    TourFlight flight = fly_tour(space_, fleet_.limits, stops, yaw_rad, !fleet_.sensor.panoramic());
    if (!flight.states.empty()) return flight;
    MotionState rest;
    rest.position_m = roads_.point_m(model_.start(uav).place);
    rest.yaw_rad = yaw_rad;
    flight.states.push_back(rest);
    return flight;
  }

  /// Keeps what is best and learns what the model saw wrongly. @returns the share seen at the end
  double fly(const Tours& tours) {
    std::vector<TourFlight> flights;
    for (std::size_t k = 0; k < tours.size(); ++k) flights.push_back(flight_of(k, tours[k]));
    const Observer::Outcome outcome = observer_.fly(flights, target_);
    learn(tours, outcome.map);
    most_seen_ = std::max(most_seen_, outcome.seen_share);
    if (outcome.bound.finish_s < best_.finish_s) best_ = outcome.bound;
    return outcome.seen_share;
  }

  /// What the flight missed is not expected again from where it was expected.
  void learn(const Tours& tours, const mapping::OccupancyMap& map) {
    std::vector<std::uint64_t> missed(views_.words(), 0);
    for (std::size_t target = 0; target < views_.targets(); ++target) {
      if (map.at(views_.target_voxels()[target]) != Occupancy::kUnknown) continue;
      missed[target / 64] |= std::uint64_t{1} << (target % 64);
    }
    model_.distrust(tours, missed);
    for (std::size_t target = 0; target < views_.targets(); ++target) {
      if ((missed[target / 64] >> (target % 64) & 1u) == 0) continue;
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const Tour& tour : tours) {
        for (const TrueViews::Pose& pose : tour)
          if (views_.sees(pose, target)) nearest_m = std::min(nearest_m, views_.distance_m(pose.place, target));
      }
      if (std::isfinite(nearest_m)) views_.forget(target, kNearer * nearest_m);
    }
  }

  const Simulation& simulation_;
  const explore::FleetConfig& fleet_;
  const BoundRequest& request_;
  double target_;
  std::vector<std::uint8_t> reachable_, explorable_;
  KnownMap known_;
  planning3d::FreeSpace space_;
  TrueViews views_;
  KnownRoads roads_;
  TourModel model_;
  TourSearch search_;
  Observer observer_;
  Bound best_;
  double most_seen_ = 0.0;
};

}  // namespace

Bound find_bound(const BoundRequest& request, const volatile std::sig_atomic_t& interrupted) {
  Settings settings = request.settings;
  const bool target_given = settings.contains("target_coverage");
  const RunConfig config = resolve(settings);
  require_usable(config);
  const Simulation simulation(config);
  Reference reference(simulation, request, target_given ? config.target_coverage : kDefaultTarget);
  return reference.find(interrupted);
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
