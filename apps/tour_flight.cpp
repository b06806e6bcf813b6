#include "apps/tour_flight.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"
#include "planning3d/curve.hpp"
#include "planning3d/safety_check.hpp"
#include "planning3d/speed_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace stairwell::apps {

namespace {

using planning3d::Curve;
using Path = std::vector<Eigen::Vector3d>;

constexpr double kReach_m = 1.5;    // of the rounding of a corner
constexpr double kSharp = -0.3;     // cosine of the turn from which on the UAV stops at a corner
constexpr double kLeast_m = 1e-3;   // shorter ways are turns on the spot
constexpr double kLeft_rad = 1e-9;  // rounding shall not decide which way half a turn goes
constexpr double kLeastShare = 1e-4;
constexpr int kSlowDowns = 60;
constexpr int kMostTightenings = 4000;

/// A stretch flown from rest to rest, after a pause.
struct Stretch {
  Curve curve;
  std::vector<double> share;  ///< of the squared speed allowed at each node
  std::vector<double> squared_speed;
  std::vector<double> time_s;  ///< at each node, from its start
  double pause_s = 0.0;
  double start_s = 0.0;  ///< of the flight, after the pause
};

/// Where a stop lies: on a stretch, or before the next one begins (a turn on the spot).
struct Place {
  std::size_t stretch = 0;
  double arc_m = 0.0;
};

Curve rounded_curve(const planning3d::FreeSpace& space, const Path& corners_m) {
  const planning3d::SafetyCheck check;
  planning3d::RoundedPath rounded(corners_m, kReach_m);
  for (int attempt = 0; attempt < kMostTightenings; ++attempt) {
    Curve curve = rounded.curve();
    const planning3d::SafetyReport report = check.check_path(space, curve.point_m);
    if (report.safe()) return curve;
    if (!rounded.tighten_near(report.at_m)) break;
  }
  throw RunError("the reference tour does not fit round its corners");
}

void time_nodes(Stretch& stretch) {
  stretch.time_s.assign(stretch.curve.size(), 0.0);
  for (std::size_t i = 1; i < stretch.curve.size(); ++i) {
    const double speeds = std::sqrt(stretch.squared_speed[i - 1]) + std::sqrt(stretch.squared_speed[i]);
    stretch.time_s[i] =
        stretch.time_s[i - 1] + 2.0 * (stretch.curve.arc_m[i] - stretch.curve.arc_m[i - 1]) / std::max(speeds, 1e-6);
  }
}

void set_speeds(Stretch& stretch, const MotionLimits& limits) {
  const auto speeds = planning3d::squared_speeds(stretch.curve, limits, 0.0, {}, &stretch.share);
  if (!speeds) throw RunError("the reference tour has a corner that cannot be flown");
  stretch.squared_speed = *speeds;
  time_nodes(stretch);
}

/// Where along the curve a point lies, from an arc length on.
double arc_of(const Curve& curve, const Eigen::Vector3d& point_m, double from_m) {
  double at_m = from_m;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < curve.size(); ++i) {
    if (curve.arc_m[i] < from_m) continue;
    const double away_m = (curve.point_m[i] - point_m).norm();
    if (away_m < nearest_m) {
      nearest_m = away_m;
      at_m = curve.arc_m[i];
    }
    if (nearest_m < kReach_m && curve.arc_m[i] > at_m + 2.0 * kReach_m) break;  // a later pass is another stop's
  }
  return at_m;
}

bool sharp(const Eigen::Vector3d& before_m, const Eigen::Vector3d& at_m, const Eigen::Vector3d& after_m) {
  return (at_m - before_m).normalized().dot((after_m - at_m).normalized()) < kSharp;
}

/// Joins the ways and cuts them where the UAV has to stop.
class Cutter {
 public:
  explicit Cutter(const planning3d::FreeSpace& space) : space_(space) {}

  void fly_to(const Eigen::Vector3d& to_m) {
    if (!corners_m_.empty() && (to_m - corners_m_.back()).norm() < kLeast_m) return;
    if (corners_m_.size() > 1 && sharp(corners_m_[corners_m_.size() - 2], corners_m_.back(), to_m)) close();
    corners_m_.push_back(to_m);
  }
  void stop_here() { stops_m_.push_back(corners_m_.back()); }
  void turn_here(double pause_s) {
    close();
    pause_s_ += pause_s;
    places_.push_back({stretches_.size(), 0.0});
  }
  void close() {
    if (corners_m_.size() < 2) return;
    Stretch stretch;
    stretch.curve = rounded_curve(space_, corners_m_);
    stretch.share.assign(stretch.curve.size(), 1.0);
    stretch.pause_s = std::exchange(pause_s_, 0.0);
    double arc_m = 0.0;
    for (const Eigen::Vector3d& stop_m : stops_m_) {
      arc_m = arc_of(stretch.curve, stop_m, arc_m);
      places_.push_back({stretches_.size(), arc_m});
    }
    stretches_.push_back(std::move(stretch));
    corners_m_ = {corners_m_.back()};
    stops_m_.clear();
  }
  std::vector<Stretch>& stretches() { return stretches_; }
  const std::vector<Place>& places() const { return places_; }
  double last_pause_s() const { return pause_s_; }

 private:
  const planning3d::FreeSpace& space_;
  Path corners_m_, stops_m_;
  std::vector<Stretch> stretches_;
  std::vector<Place> places_;
  double pause_s_ = 0.0;
};

double time_at(const Stretch& stretch, double arc_m) {
  const auto node = std::ranges::lower_bound(stretch.curve.arc_m, arc_m - 1e-9) - stretch.curve.arc_m.begin();
  return stretch.time_s[std::min(static_cast<std::size_t>(node), stretch.time_s.size() - 1)];
}

/// Whole steps, so that the states of all stretches lie on one clock.
double steps_s(double time_s) { return std::ceil(time_s / Trajectory::kStep_s - 1e-6) * Trajectory::kStep_s; }

std::vector<double> arrivals_s(std::vector<Stretch>& stretches, const std::vector<Place>& places, double last_pause_s) {
  double time_s = 0.0;
  for (Stretch& stretch : stretches) {
    stretch.start_s = time_s + steps_s(stretch.pause_s);
    time_s = stretch.start_s + steps_s(stretch.time_s.back());
  }
  std::vector<double> arrivals;
  for (const Place& place : places) {
    const bool at_end = place.stretch >= stretches.size();
    arrivals.push_back(at_end ? time_s + steps_s(last_pause_s)
                              : stretches[place.stretch].start_s + time_at(stretches[place.stretch], place.arc_m));
  }
  return arrivals;
}

/// Slows the nodes between two places down.
void slow_down(std::vector<Stretch>& stretches, const Place& from, const Place& to, double factor) {
  for (std::size_t s = from.stretch; s <= to.stretch && s < stretches.size(); ++s)
    for (std::size_t i = 0; i < stretches[s].curve.size(); ++i) {
      const double arc_m = stretches[s].curve.arc_m[i];
      const bool before = s == from.stretch && arc_m < from.arc_m;
      const bool behind = s == to.stretch && arc_m > to.arc_m;
      if (!before && !behind) stretches[s].share[i] = std::max(kLeastShare, stretches[s].share[i] * factor);
    }
}

void add_yaws(TourFlight& flight, const std::vector<FlightStop>& stops, const MotionLimits& limits,
              double start_yaw_rad) {
  std::size_t next = 0;
  double from_s = 0.0;
  double from_rad = start_yaw_rad;
  for (std::size_t i = 0; i < flight.states.size(); ++i) {
    const double time_s = static_cast<double>(i) * Trajectory::kStep_s;
    while (next < stops.size() && time_s >= flight.arrival_s[next]) {
      from_s = flight.arrival_s[next];
      from_rad = stops[next++].yaw_rad;
    }
    flight.states[i].yaw_rad = from_rad;
    if (next == stops.size()) continue;
    const auto state = tour_turn(limits, from_rad, stops[next].yaw_rad).at(time_s - from_s);
    flight.states[i].yaw_rad = from_rad + state.turned_rad;
    flight.states[i].yaw_rate_radps = state.rate_radps;
  }
}

void append_states(TourFlight& flight, const Stretch& stretch, const MotionLimits& limits) {
  const auto begin = static_cast<std::size_t>(std::lround(stretch.start_s / Trajectory::kStep_s));
  MotionState rest;
  rest.position_m = stretch.curve.point_m.front();
  while (flight.states.size() < begin) flight.states.push_back(rest);
  flight.states.resize(begin);
  const auto states = planning3d::timed_states(stretch.curve, stretch.squared_speed, limits);
  flight.states.insert(flight.states.end(), states.begin(), states.end());
}

}  // namespace

planning3d::YawTurn tour_turn(const MotionLimits& limits, double from_rad, double to_rad) {
  return planning3d::YawTurn::to_heading(0.0, wrap_angle(to_rad - from_rad - kLeft_rad), limits.yaw_rate_radps,
                                         limits.yaw_acceleration_radps2);
}

TourFlight fly_tour(const planning3d::FreeSpace& space, const MotionLimits& limits,
                    const std::vector<FlightStop>& stops, double start_yaw_rad, bool turns) {
  TourFlight flight;
  if (stops.empty()) return flight;
  Cutter cutter(space);
  std::vector<double> needed_s;
  double yaw_rad = start_yaw_rad;
  for (const FlightStop& stop : stops) {
    needed_s.push_back(turns ? tour_turn(limits, yaw_rad, stop.yaw_rad).duration_s() : 0.0);
    yaw_rad = stop.yaw_rad;
    double length_m = 0.0;
    for (std::size_t i = 1; i < stop.way_m.size(); ++i) length_m += (stop.way_m[i] - stop.way_m[i - 1]).norm();
    for (const Eigen::Vector3d& corner_m : stop.way_m) cutter.fly_to(corner_m);
    length_m < 2.0 * kLeast_m ? cutter.turn_here(needed_s.back()) : cutter.stop_here();
  }
  cutter.close();
  std::vector<Stretch>& stretches = cutter.stretches();
  for (int round = 0; round < kSlowDowns; ++round) {
    for (Stretch& stretch : stretches) set_speeds(stretch, limits);
    flight.arrival_s = arrivals_s(stretches, cutter.places(), cutter.last_pause_s());
    bool in_time = true;
    for (std::size_t j = 0; j < stops.size(); ++j) {
      const double has_s = flight.arrival_s[j] - (j == 0 ? 0.0 : flight.arrival_s[j - 1]);
      if (has_s >= needed_s[j] - 1e-6) continue;
      in_time = false;
      const double slower = std::max(has_s, 0.1 * needed_s[j]) / needed_s[j];
      slow_down(stretches, j == 0 ? Place{} : cutter.places()[j - 1], cutter.places()[j], 0.95 * slower * slower);
    }
    if (in_time) break;
  }
  for (const Stretch& stretch : stretches) append_states(flight, stretch, limits);
  const auto end = static_cast<std::size_t>(std::ceil(flight.arrival_s.back() / Trajectory::kStep_s)) + 1;
  while (!flight.states.empty() && flight.states.size() < end) {
    MotionState rest;
    rest.position_m = flight.states.back().position_m;
    flight.states.push_back(rest);
  }
  if (turns) add_yaws(flight, stops, limits, start_yaw_rad);
  return flight;
}

}  // namespace stairwell::apps
