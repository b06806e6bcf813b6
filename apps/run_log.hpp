#pragma once

#include "apps/append_file.hpp"
#include "apps/replay_recorder.hpp"
#include "core/trajectory.hpp"
#include "explore/exploration_log.hpp"
#include "explore/fleet.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

namespace stairwell::apps {

/// steps.csv, trajectories.csv, log.jsonl, timings.csv and replay.bin of a run folder.
class RunLog final : public explore::ExplorationLog {
 public:
  using Offsets = std::array<std::uint64_t, 5>;  ///< lengths of the files, in the order above
  using Expected = std::function<mapping::ExpectedOccupancy(const VoxelIndex&)>;

  /// @param grid of the fleet's map; @param keep lengths at the checkpoint that is resumed; zeros for a new run
  RunLog(const std::filesystem::path& folder, const explore::FleetConfig& fleet, const GridSpec& grid, std::size_t uavs,
         const Offsets& keep = {});
  /// The fleet as it was at the checkpoint.
  void resume(const explore::Fleet& fleet);

  /// After every tick; writes rows at 2 Hz (steps, timings) and 10 Hz (trajectories) of simulated time.
  /// @param coverage, known_volume_m3 of all that the fleet has seen
  void record(const explore::Fleet& fleet, double coverage, double known_volume_m3);
  Offsets flush();
  /// Gives the files their names. @param expected what the world says about each voxel of the map
  void publish(const mapping::OccupancyMap& map, const Expected& expected);

  void on_state(double time_s, std::size_t uav, std::string_view state) override;
  void on_goal(double time_s, std::size_t uav, const Eigen::Vector3d& goal_m, double gain_m3,
               std::string_view planner) override;
  void on_event(double time_s, std::size_t uav, std::string_view event, std::string_view reason) override;
  void on_scan(double time_s, std::size_t uav, const mapping::OccupancyMap& map) override;
  void on_trajectory(double time_s, std::size_t uav, const Trajectory& trajectory) override;

 private:
  void record_step(const explore::Fleet& fleet, double coverage, double known_volume_m3);
  void record_trajectories(const explore::Fleet& fleet);
  void record_timings(const explore::Fleet& fleet);

  AppendFile steps_;
  AppendFile trajectories_;
  AppendFile log_;
  AppendFile timings_;
  ReplayRecorder replay_;
  std::size_t plans_timed_ = 0;
  std::size_t scans_timed_ = 0;
};

}  // namespace stairwell::apps
