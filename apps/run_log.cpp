#include "apps/run_log.hpp"

#include "core/units.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>

namespace stairwell::apps {

using nlohmann::ordered_json;

namespace {

constexpr double kStepsPeriod_s = 0.5;
constexpr double kTrajectoriesPeriod_s = 0.1;

/// Whether a multiple of the period lies in (time - tick, time]: needs no state, so resumed runs write the same rows.
bool due(double time_s, double tick_s, double period_s) {
  constexpr double kRounding = 1e-9;
  return std::floor(time_s / period_s + kRounding) > std::floor((time_s - tick_s) / period_s + kRounding);
}

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

ordered_json entry(double time_s, std::size_t uav, std::string_view event) {
  return {{"time_s", rounded(time_s)}, {"uav", uav}, {"event", event}};
}

}  // namespace

RunLog::RunLog(const std::filesystem::path& folder, std::size_t uavs, const Offsets& keep)
    : steps_(folder / "steps.csv", keep[0]),
      trajectories_(folder / "trajectories.csv", keep[1]),
      log_(folder / "log.jsonl", keep[2]) {
  if (keep[0] == 0) steps_.append(steps_header(uavs));
  if (keep[1] == 0) trajectories_.append("time_s,uav,x_m,y_m,z_m,yaw_rad,speed_mps\n");
}

void RunLog::record(const explore::Fleet& fleet, double coverage) {
  if (due(fleet.time_s(), fleet.tick_s(), kStepsPeriod_s)) record_step(fleet, coverage);
  if (due(fleet.time_s(), fleet.tick_s(), kTrajectoriesPeriod_s)) record_trajectories(fleet);
}

void RunLog::record_step(const explore::Fleet& fleet, double coverage) {
  std::string row = fixed(fleet.time_s(), 3) + "," + fixed(coverage, 6) + "," + fixed(fleet.map().known_volume_m3(), 3);
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

RunLog::Offsets RunLog::flush() { return {steps_.flush(), trajectories_.flush(), log_.flush()}; }

void RunLog::publish() {
  steps_.publish();
  trajectories_.publish();
  log_.publish();
}

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
}

}  // namespace stairwell::apps
