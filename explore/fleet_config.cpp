#include "explore/fleet_config.hpp"

#include <cmath>

namespace stairwell::explore {

namespace {

constexpr int kMostThreads = 64;

void append(std::vector<std::string>& all, const std::vector<std::string>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

void require_positive(std::vector<std::string>& found, double value, const char* name) {
  if (!(value > 0.0) || !std::isfinite(value)) found.push_back(std::string(name) + " must be a positive number");
}

}  // namespace

std::vector<std::string> FleetConfig::problems() const {
  std::vector<std::string> found;
  if (task_box.empty() || !task_box.min_m.allFinite() || !task_box.max_m.allFinite()) {
    found.emplace_back("box is empty or not finite: give x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1, z0 < z1");
  }
  require_positive(found, resolution_m, "resolution");
  require_positive(found, step_delta_m, "step length");
  require_positive(found, step_period_s, "step period");
  require_positive(found, time_limit_s, "time limit");
  require_positive(found, radial_scan_radps, "radial scan speed");
  require_positive(found, replan_period_s, "replan period");
  require_positive(found, patience_s, "patience");
  require_positive(found, hybrid_switch, "hybrid_switch");
  if (!(min_growth >= 0.0)) found.emplace_back("least growth of the map must not be negative");
  if (fruitless_visits < 1) found.emplace_back("fruitless_visits must be at least 1");
  if (!(remainder_gain_m3 >= 0.0)) found.emplace_back("gain of a remainder must not be negative");
  require_positive(found, blacklist_radius_m, "blacklist radius");
  require_positive(found, blacklist_time_s, "blacklist time");
  if (threads < 1 || threads > kMostThreads) {
    found.push_back("threads must be 1 to " + std::to_string(kMostThreads) + ", got " + std::to_string(threads));
  }
  if (!(plan_latency_s >= 0.0)) found.emplace_back("plan latency must not be negative");
  if (!(battery_s >= 0.0) || !std::isfinite(battery_s)) found.emplace_back("battery must not be negative");
  if (!(lost_after_s >= 0.0)) found.emplace_back("time-out of lost UAVs must not be negative");
  for (const Loss& loss : losses) {
    if (!(loss.at_s >= 0.0)) found.emplace_back("a UAV is lost at a time that is not negative, as in 1@30");
  }
  require_positive(found, stalled_after_s, "time-out of stalled UAVs");
  for (const Stall& stall : stalls) {
    if (!(stall.from_s >= 0.0 && stall.from_s < stall.to_s)) {
      found.emplace_back("a UAV stalls from a time that is not negative to a later one, as in 1@30..60");
    }
  }
  if (!(takeoff_height_m >= 0.0)) found.emplace_back("take-off height must not be negative");
  if (!(start_bubble_m >= robot.clearance_m())) {
    found.emplace_back("start bubble must be at least the robot's radius plus margin");
  }
  if (!(fellow_clearance_m >= 2.0 * robot.radius_m)) {
    found.emplace_back("fellow clearance must be at least two robot radii");
  }
  if (avoidance == Avoidance::kOrca && motion == MotionModel::kStep) {
    found.emplace_back("avoidance orca needs motion limited, not step");
  }
  if (finish_slab && !(finish_slab->lo_m < finish_slab->hi_m && finish_slab->lo_m < task_box.max_m.z() &&
                       finish_slab->hi_m > task_box.min_m.z())) {
    found.emplace_back("finish frontier:Z0..Z1 needs Z0 < Z1, and heights inside the box");
  }
  if (gain == coverage3d::GainKind::kEntropy && !(occupancy.p_miss < 0.5 && occupancy.p_hit > 0.5)) {
    found.emplace_back("gain entropy needs p_miss below 0.5 and p_hit above it");
  }
  for (const double layer_m : layers_m) {
    if (!std::isfinite(layer_m) || layer_m < task_box.min_m.z() || layer_m > task_box.max_m.z()) {
      found.push_back("layer " + std::to_string(layer_m) + " m lies outside the box");
    }
  }
  append(found, occupancy.problems());
  append(found, sensor.problems());
  append(found, cloud.problems());
  append(found, limits.problems());
  append(found, robot.problems());
  return found;
}

}  // namespace stairwell::explore
