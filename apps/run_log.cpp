#include "apps/run_log.hpp"

#include "apps/due.hpp"
#include "core/units.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>

namespace stairwell::apps {

using nlohmann::ordered_json;

namespace {

constexpr double kStepsPeriod_s = 0.5;
constexpr double kTrajectoriesPeriod_s = 0.1;

std::string fixed(double value, int digits) {
  char buffer[64];
  std::snprintf(buffer, sizeof(buffer), "%.*f", digits, value);
  return buffer;
}

double rounded(double value) { return std::round(value * 1e4) / 1e4; }

std::string steps_header(std::size_t uavs) {
  std::string header = "time_s,coverage,known_volume_m3";
  for (std::size_t i = 0; i < uavs; ++i) {
    const std::string uav = ",uav" + std::to_string(i);
    for (const char* column : {"_x_m", "_y_m", "_z_m", "_yaw_rad", "_state"}) header += uav + column;
  }
  return header + "\n";
}

/// `count,mean,largest` of the values that came since `seen`, which moves on.
std::string since(const std::vector<double>& values, std::size_t& seen) {
  const std::span<const double> fresh = std::span(values).subspan(std::min(seen, values.size()));
  seen = values.size();
  if (fresh.empty()) return "0,,";
  const double sum = std::accumulate(fresh.begin(), fresh.end(), 0.0);
  return std::to_string(fresh.size()) + "," + fixed(sum / static_cast<double>(fresh.size()), 3) + "," +
         fixed(*std::ranges::max_element(fresh), 3);
}

ordered_json entry(double time_s, std::size_t uav, std::string_view event) {
  return {{"time_s", rounded(time_s)}, {"uav", uav}, {"event", event}};
}

}  // namespace

RunLog::RunLog(const std::filesystem::path& folder, const explore::FleetConfig& fleet, const GridSpec& grid,
               std::size_t uavs, const Offsets& keep)
    : steps_(folder / "steps.csv", keep[0]),
      trajectories_(folder / "trajectories.csv", keep[1]),
      log_(folder / "log.jsonl", keep[2]),
      timings_(folder / "timings.csv", keep[3]),
      replay_(folder, fleet, grid, uavs, keep[4]) {
  if (keep[0] == 0) steps_.append(steps_header(uavs));
  if (keep[1] == 0) trajectories_.append("time_s,uav,x_m,y_m,z_m,yaw_rad,speed_mps\n");
  if (keep[3] == 0) {
    timings_.append("time_s,plans,plan_ms_mean,plan_ms_max,scans,integrate_ms_mean,integrate_ms_max\n");
  }
}

void RunLog::resume(const explore::Fleet& fleet) {
  replay_.resume(fleet.map());
  plans_timed_ = fleet.stats().plan_ms.size();
  scans_timed_ = fleet.stats().integrate_ms.size();
}

void RunLog::record(const explore::Fleet& fleet, double coverage, double known_volume_m3) {
  if (due(fleet.time_s(), fleet.tick_s(), kStepsPeriod_s)) record_step(fleet, coverage, known_volume_m3);
  if (due(fleet.time_s(), fleet.tick_s(), kTrajectoriesPeriod_s)) record_trajectories(fleet);
  if (due(fleet.time_s(), fleet.tick_s(), kStepsPeriod_s)) record_timings(fleet);
  replay_.record(fleet.time_s(), fleet.tick_s(), fleet.map(), fleet.workers());
}

void RunLog::record_step(const explore::Fleet& fleet, double coverage, double known_volume_m3) {
  std::string row = fixed(fleet.time_s(), 3) + "," + fixed(coverage, 6) + "," + fixed(known_volume_m3, 3);
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    const MotionState state = fleet.uav_state(i);
    for (int axis = 0; axis < 3; ++axis) row += "," + fixed(state.position_m[axis], 3);
    row += "," + fixed(wrap_angle(state.yaw_rad), 4) + "," + fleet.uav_phase(i);
  }
  steps_.append(row + "\n");
}

void RunLog::record_trajectories(const explore::Fleet& fleet) {
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    const MotionState state = fleet.uav_state(i);
    std::string row = fixed(fleet.time_s(), 3) + "," + std::to_string(i);
    for (int axis = 0; axis < 3; ++axis) row += "," + fixed(state.position_m[axis], 4);
    trajectories_.append(row + "," + fixed(wrap_angle(state.yaw_rad), 4) + "," + fixed(state.velocity_mps.norm(), 3) +
                         "\n");
  }
}

/// Rows without plans leave their two numbers out.
void RunLog::record_timings(const explore::Fleet& fleet) {
  timings_.append(fixed(fleet.time_s(), 3) + "," + since(fleet.stats().plan_ms, plans_timed_) + "," +
                  since(fleet.stats().integrate_ms, scans_timed_) + "\n");
}

RunLog::Offsets RunLog::flush() {
  return {steps_.flush(), trajectories_.flush(), log_.flush(), timings_.flush(), replay_.flush()};
}

void RunLog::publish(const mapping::OccupancyMap& map, const Expected& expected) {
  steps_.publish();
  trajectories_.publish();
  log_.publish();
  timings_.publish();
  replay_.publish(map, expected);
}

void RunLog::on_scan(double, std::size_t uav, const mapping::OccupancyMap& map) { replay_.on_scan(uav, map); }

void RunLog::on_state(double time_s, std::size_t uav, std::string_view state) {
  ordered_json j = entry(time_s, uav, "state");
  j["state"] = state;
  log_.append(j.dump() + "\n");
}

void RunLog::on_goal(double time_s, std::size_t uav, const Eigen::Vector3d& goal_m, double gain_m3,
                     std::string_view planner) {
  ordered_json j = entry(time_s, uav, "goal");
  j["goal_m"] = {rounded(goal_m.x()), rounded(goal_m.y()), rounded(goal_m.z())};
  j["gain_m3"] = rounded(gain_m3);
  j["planner"] = planner;
  log_.append(j.dump() + "\n");
}

void RunLog::on_event(double time_s, std::size_t uav, std::string_view event, std::string_view reason) {
  ordered_json j = entry(time_s, uav, event);
  j["reason"] = reason;
  log_.append(j.dump() + "\n");
}

void RunLog::on_trajectory(double time_s, std::size_t uav, const Trajectory& trajectory) {
  ordered_json j = entry(time_s, uav, "trajectory");
  j["start_s"] = rounded(trajectory.start_time_s());
  j["end_s"] = rounded(trajectory.end_time_s());
  j["length_m"] = rounded(trajectory.length_m(trajectory.start_time_s(), trajectory.end_time_s()));
  log_.append(j.dump() + "\n");
  replay_.on_trajectory(time_s, uav, trajectory);
}

}  // namespace stairwell::apps
