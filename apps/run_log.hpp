#pragma once

#include "apps/append_file.hpp"
#include "core/trajectory.hpp"
#include "explore/exploration_log.hpp"
#include "explore/fleet.hpp"

#include <array>
#include <cstdint>
#include <filesystem>

namespace stairwell::apps {

/// steps.csv, trajectories.csv and log.jsonl of a run folder.
class RunLog final : public explore::ExplorationLog {
 public:
  using Offsets = std::array<std::uint64_t, 3>;  ///< lengths of steps.csv, trajectories.csv, log.jsonl

  /// @param keep lengths at the checkpoint that is resumed; zeros for a new run
  RunLog(const std::filesystem::path& folder, std::size_t uavs, const Offsets& keep = {});

  /// After every tick; writes rows at 2 Hz (steps) and 10 Hz (trajectories) of simulated time.
  void record(const explore::Fleet& fleet, double coverage);
  Offsets flush();
  void publish();

  void on_state(double time_s, std::size_t uav, std::string_view state) override;
  void on_goal(double time_s, std::size_t uav, const Eigen::Vector3d& goal_m, double gain_m3,
               std::string_view planner) override;
  void on_event(double time_s, std::size_t uav, std::string_view event, std::string_view reason) override;
  void on_trajectory(double time_s, std::size_t uav, const Trajectory& trajectory) override;

 private:
  void record_step(const explore::Fleet& fleet, double coverage);
  void record_trajectories(const explore::Fleet& fleet);

  AppendFile steps_;
  AppendFile trajectories_;
  AppendFile log_;
};

}  // namespace stairwell::apps
