#include "apps/metrics.hpp"

#include "core/version.hpp"
#include "mapping/summary_bits.hpp"

#include <nlohmann/json.hpp>

#include <sys/resource.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>

namespace stairwell::apps {

using nlohmann::json;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMomentStep_s = 0.02;
/// Surfaces that lie on a voxel's face belong to the voxel behind it, so a map is a millimetre or two off.
constexpr double kContactTolerance_m = 2e-3;

/// JSON has no NaN.
json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

Eigen::Vector3d hermite_m(const MotionState& a, const MotionState& b, double duration_s, double share) {
  const double s = share, s2 = s * s, s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * a.position_m + (s3 - 2 * s2 + s) * duration_s * a.velocity_mps +
         (-2 * s3 + 3 * s2) * b.position_m + (s3 - s2) * duration_s * b.velocity_mps;
}

json to_json(const MotionState& s) {
  return {s.position_m.x(),   s.position_m.y(),   s.position_m.z(), s.velocity_mps.x(),
          s.velocity_mps.y(), s.velocity_mps.z(), s.yaw_rad};
}

MotionState state_from(const json& j) {
  const auto v = j.get<std::array<double, 7>>();
  MotionState state;
  state.position_m = {v[0], v[1], v[2]};
  state.velocity_mps = {v[3], v[4], v[5]};
  state.yaw_rad = v[6];
  return state;
}

}  // namespace

CoverageMeter::CoverageMeter(const GridSpec& grid, const std::vector<std::uint8_t>& explorable)
    : grid_(grid), pending_(explorable.size()) {
  for (std::size_t i = 0; i < explorable.size(); ++i) {
    if (explorable[i] == 0) continue;
    pending_.flip(i);
    ++explorable_count_;
  }
}

/// @pre the box lies in the grid
void CoverageMeter::visit(const mapping::OccupancyMap& map, const mapping::VoxelBox& box) {
  constexpr int kStep = 8;
  for (int z = box.lo.z; z <= box.hi.z; ++z) {
    for (int y = box.lo.y; y <= box.hi.y; ++y) {
      const std::size_t row = grid_.linear({0, y, z});
      for (int x = box.lo.x; x <= box.hi.x; x += kStep) {
        const std::size_t first = row + static_cast<std::size_t>(x);
        std::uint32_t seen = pending_.eight_from(first);
        if (seen == 0) continue;
        seen &= mapping::EightSummaries(map.summaries() + first, std::min(kStep, box.hi.x + 1 - x)).known();
        for (; seen != 0; seen &= seen - 1) {
          pending_.flip(first + static_cast<std::size_t>(std::countr_zero(seen)));
          ++known_count_;
        }
      }
    }
  }
}

void CoverageMeter::update(const mapping::OccupancyMap& map) {
  const auto look = [&](const mapping::VoxelBox& box) { visit(map, box); };
  if (fresh_) {
    const auto& size = grid_.size();
    look({{0, 0, 0}, {size[0] - 1, size[1] - 1, size[2] - 1}});
  } else {
    map.for_each_block_changed_since(revision_, look);
  }
  fresh_ = false;
  revision_ = map.revision();
}

double CoverageMeter::coverage() const {
  return explorable_count_ == 0 ? kNan : static_cast<double>(known_count_) / static_cast<double>(explorable_count_);
}

namespace {

std::string place_text(const Eigen::Vector3d& p_m) {
  char text[96];
  std::snprintf(text, sizeof(text), "%.3f,%.3f,%.3f", p_m.x(), p_m.y(), p_m.z());
  return text;
}

}  // namespace

FlightMeter::FlightMeter(const sim3d::GroundTruth& truth, double robot_radius_m, std::size_t uavs)
    : truth_(truth),
      radius_m_(robot_radius_m),
      path_length_m_(uavs, 0.0),
      touching_(uavs, false),
      pair_touching_(uavs * uavs, false),
      min_distance_m_(uavs > 1 ? std::numeric_limits<double>::infinity() : kNan) {}

void FlightMeter::observe(double time_s, const std::vector<MotionState>& states, const std::vector<bool>& near_ground) {
  std::vector<Eigen::Vector3d> positions_m(states.size());
  for (std::size_t i = 0; i < states.size(); ++i) positions_m[i] = states[i].position_m;
  if (!last_states_.empty()) {
    const double duration_s = time_s - last_time_s_;
    const int moments = std::max(1, static_cast<int>(std::ceil(duration_s / kMomentStep_s - 1e-9)));
    std::vector<bool> lenient = near_ground;
    for (std::size_t i = 0; i < lenient.size(); ++i) lenient[i] = lenient[i] || last_near_ground_[i];
    std::vector<Eigen::Vector3d> before_m(states.size()), now_m(states.size());
    for (std::size_t i = 0; i < states.size(); ++i) before_m[i] = last_states_[i].position_m;
    for (int moment = 1; moment <= moments; ++moment) {
      const double share = static_cast<double>(moment) / moments;
      for (std::size_t i = 0; i < states.size(); ++i) {
        now_m[i] = hermite_m(last_states_[i], states[i], duration_s, share);
        path_length_m_[i] += (now_m[i] - before_m[i]).norm();
      }
      observe_moment(now_m, lenient);
      before_m = now_m;
    }
  } else {
    observe_moment(positions_m, near_ground);
  }
  add_distances(positions_m);
  last_time_s_ = time_s;
  last_states_ = states;
  last_near_ground_ = near_ground;
}

bool FlightMeter::touches_world(const Eigen::Vector3d& position_m, bool near_ground) const {
  const double contact_m = radius_m_ - kContactTolerance_m;
  if (truth_.sphere_free(position_m, contact_m)) return false;
  return !near_ground || !truth_.sphere_free(position_m + radius_m_ * Eigen::Vector3d::UnitZ(), contact_m);
}

void FlightMeter::observe_moment(const std::vector<Eigen::Vector3d>& positions_m,
                                 const std::vector<bool>& near_ground) {
  const std::size_t count = positions_m.size();
  for (std::size_t i = 0; i < count; ++i) {
    const bool touches = touches_world(positions_m[i], near_ground[i]);
    if (touches && !touching_[i]) {
      ++collisions_;
      contacts_.push_back({i, "world at " + place_text(positions_m[i]) + ", " +
                                  std::to_string(truth_.clearance_m(positions_m[i], radius_m_)) +
                                  " m from its centre"});
    }
    touching_[i] = touches;
    for (std::size_t j = i + 1; j < count; ++j) {
      const double distance_m = (positions_m[i] - positions_m[j]).norm();
      min_distance_m_ = std::min(min_distance_m_, distance_m);
      const bool pair_touches = distance_m < 2.0 * radius_m_;
      if (pair_touches && !pair_touching_[i * count + j]) {
        ++collisions_;
        contacts_.push_back({i, "uav " + std::to_string(j) + " at " + place_text(positions_m[i])});
      }
      pair_touching_[i * count + j] = pair_touches;
    }
  }
}

void FlightMeter::add_distances(const std::vector<Eigen::Vector3d>& positions_m) {
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    for (std::size_t j = i + 1; j < positions_m.size(); ++j) {
      const double distance_m = (positions_m[i] - positions_m[j]).norm();
      ++pair_samples_;
      const double delta_m = distance_m - distance_mean_m_;
      distance_mean_m_ += delta_m / static_cast<double>(pair_samples_);
      distance_m2_ += delta_m * (distance_m - distance_mean_m_);
    }
  }
}

double FlightMeter::mean_distance_m() const { return pair_samples_ == 0 ? kNan : distance_mean_m_; }
double FlightMeter::std_distance_m() const {
  return pair_samples_ == 0 ? kNan : std::sqrt(distance_m2_ / static_cast<double>(pair_samples_));
}

json FlightMeter::save() const {
  json states = json::array();
  for (const MotionState& state : last_states_) states.push_back(to_json(state));
  return {{"time_s", last_time_s_},
          {"states", std::move(states)},
          {"near_ground", last_near_ground_},
          {"path_length_m", path_length_m_},
          {"touching", touching_},
          {"pair_touching", pair_touching_},
          {"collisions", collisions_},
          {"pair_samples", pair_samples_},
          {"distance_mean_m", distance_mean_m_},
          {"distance_m2", distance_m2_},
          {"min_distance_m", number(min_distance_m_)}};
}

void FlightMeter::load(const json& state) {
  last_time_s_ = state.at("time_s").get<double>();
  last_states_.clear();
  for (const json& saved : state.at("states")) last_states_.push_back(state_from(saved));
  last_near_ground_ = state.at("near_ground").get<std::vector<bool>>();
  path_length_m_ = state.at("path_length_m").get<std::vector<double>>();
  touching_ = state.at("touching").get<std::vector<bool>>();
  pair_touching_ = state.at("pair_touching").get<std::vector<bool>>();
  collisions_ = state.at("collisions").get<std::size_t>();
  pair_samples_ = state.at("pair_samples").get<std::uint64_t>();
  distance_mean_m_ = state.at("distance_mean_m").get<double>();
  distance_m2_ = state.at("distance_m2").get<double>();
  if (!state.at("min_distance_m").is_null()) min_distance_m_ = state.at("min_distance_m").get<double>();
}

void Milestones::observe(double time_s, double coverage) {
  for (std::size_t i = 0; i < kPercent.size(); ++i) {
    if (!times_s_[i] && coverage * 100.0 >= kPercent[i]) times_s_[i] = time_s;
  }
}

json Milestones::save() const {
  json times = json::array();
  for (const auto& time_s : times_s_) times.push_back(time_s ? json(*time_s) : json(nullptr));
  return times;
}

void Milestones::load(const json& state) {
  for (std::size_t i = 0; i < times_s_.size(); ++i) {
    times_s_[i] = state.at(i).is_null() ? std::nullopt : std::optional(state.at(i).get<double>());
  }
}

Percentiles percentiles(std::vector<double> values) {
  if (values.empty()) return {kNan, kNan, kNan};
  std::ranges::sort(values);
  const auto rank = [&](double share) {
    const auto at = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
    return values[std::clamp<std::size_t>(at, 1, values.size()) - 1];
  };
  return {rank(0.50), rank(0.99), values.back()};
}

double peak_rss_mib() {
  rusage usage{};
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) / 1024.0 : kNan;  // KiB on Linux
}

namespace {

/// What was not explored, and why not.
nlohmann::ordered_json left_json(const explore::FleetStats& stats) {
  return {{"open_targets", stats.open_targets},
          {"unreachable_targets", stats.unreachable_targets},
          {"uavs_out_of_battery", stats.out_of_battery},
          {"uavs_lost", stats.lost},
          {"uavs_stalled", stats.stalled}};
}

}  // namespace

std::string metrics_json(const RunFigures& figures) {
  const auto& [config, fleet, coverage, flight, milestones, finish, known_volume_m3, coverage_per_uav, wall_s] =
      figures;
  const auto spread = [](const std::vector<double>& values) {
    const Percentiles p = percentiles(values);
    return nlohmann::ordered_json{{"p50", number(p.p50)}, {"p99", number(p.p99)}, {"max", number(p.max)}};
  };
  double path_m = 0.0;
  for (const double length_m : flight.path_length_m()) path_m += length_m;
  nlohmann::ordered_json j;
  j["world"] = config.world.stem().string();
  j["mode"] = to_string(config.fleet.mode);
  j["planner"] = config.fleet.planner;
  j["coverage_strategy"] = config.fleet.coverage;
  j["uavs"] = config.uavs;
  j["seed"] = config.fleet.seed;
  j["stop_reason"] = explore::to_string(fleet.stop_reason());
  j["left"] = left_json(fleet.stats());
  j["coverage"] = number(coverage.coverage());
  j["coverage_per_uav"] = coverage_per_uav;
  j["known_volume_m3"] = number(known_volume_m3);
  j["explorable_volume_m3"] = coverage.explorable_volume_m3();
  for (std::size_t i = 0; i < Milestones::kPercent.size(); ++i) {
    const auto& time_s = milestones.times_s()[i];
    j["t" + std::to_string(Milestones::kPercent[i]) + "_s"] = time_s ? json(*time_s) : json(nullptr);
  }
  const auto moment = [](const std::optional<double>& time_s) { return time_s ? json(*time_s) : json(nullptr); };
  j["finish_s"] = fleet.exploration_end_s();
  j["finish_rule_met_s"] = moment(finish.met_s());
  j["first_motion_s"] = moment(finish.first_motion_s());
  j["last_motion_s"] = moment(finish.last_motion_s());
  j["path_length_m"] = path_m;
  j["path_length_per_uav_m"] = flight.path_length_m();
  j["mean_uav_distance_m"] = number(flight.mean_distance_m());
  j["std_uav_distance_m"] = number(flight.std_distance_m());
  j["min_uav_distance_m"] = number(flight.min_distance_m());
  j["collisions"] = flight.collisions();
  j["map_exchanges"] = fleet.stats().map_exchanges;
  j["voxels_told"] = fleet.stats().voxels_told;
  j["stalls"] = fleet.stats().stalls;
  j["fallbacks"] = fleet.stats().fallbacks;
  j["fallback_reasons"] = fleet.stats().fallback_reasons;
  j["plan_ms"] = spread(fleet.stats().plan_ms);
  j["integrate_ms"] = spread(fleet.stats().integrate_ms);
  j["realtime_factor"] = number(wall_s > 0.0 ? fleet.time_s() / wall_s : kNan);
  j["wall_s"] = wall_s;
  j["peak_rss_mib"] = number(peak_rss_mib());
  j["version"] = kVersion;
  return j.dump(2) + "\n";
}

}  // namespace stairwell::apps
