#pragma once

#include "apps/append_file.hpp"
#include "apps/replay_file.hpp"
#include "apps/voxel_bits.hpp"
#include "core/trajectory.hpp"
#include "coverage3d/frontier_cells.hpp"
#include "explore/fleet.hpp"
#include "mapping/map_compare.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace stairwell::apps {

/// Writes `replay.bin` while a run flies: who found which voxel when, frontiers, plans. Holds one bit per voxel of the
/// map and what belongs to the present fifth of a second.
class ReplayRecorder {
 public:
  static constexpr double kVoxelPeriod_s = 0.2;
  static constexpr double kFrontierPeriod_s = 1.0;
  static constexpr int kFrontierCell = coverage3d::FrontierCells::kEdge;  ///< frontiers are kept in cells so wide

  /// @param grid of the fleet's map; @param keep_bytes length at the checkpoint that is resumed, 0 for a new run
  ReplayRecorder(const std::filesystem::path& folder, const explore::FleetConfig& fleet, const GridSpec& grid,
                 std::size_t uavs, std::uint64_t keep_bytes);

  /// The map at the checkpoint that is resumed.
  void resume(const mapping::OccupancyMap& map);
  void on_scan(std::size_t uav, const mapping::OccupancyMap& map);
  void on_trajectory(double time_s, std::size_t uav, const Trajectory& trajectory);
  /// After every tick.
  /// @param workers  may be null
  void record(double time_s, double tick_s, const mapping::OccupancyMap& map,
              mapping::WorkerPool* workers = nullptr);
  /// Everything up to now, so that a run resumed from here loses nothing. @returns the file's length
  std::uint64_t flush();
  /// What only the end can tell, and the file gets its name. A run that is resumed drops this part again.
  /// @param expected what the world says about each voxel
  void publish(const mapping::OccupancyMap& map,
               const std::function<mapping::ExpectedOccupancy(const VoxelIndex&)>& expected);

 private:
  struct Toggle {
    std::uint64_t cell;
    std::size_t uav;
  };

  std::string header(const explore::FleetConfig& fleet, std::size_t uavs) const;
  void put(ReplayRecord kind, std::string_view payload);
  bool occupied(std::uint64_t cell) const { return occupied_[grid_.linear(cells_.voxel(cell))]; }
  void write_voxels();
  void write_frontiers(const mapping::OccupancyMap& map, mapping::WorkerPool* workers);
  void write_difference(const mapping::OccupancyMap& map,
                        const std::function<mapping::ExpectedOccupancy(const VoxelIndex&)>& expected);
  void write_open_sides(const mapping::OccupancyMap& map);
  void write_storeys(const mapping::OccupancyMap& map);

  GridSpec grid_;
  CellOrder cells_;
  CellOrder frontier_cells_;
  AppendFile file_;
  std::string records_;  ///< not yet in the file
  double time_s_ = 0.0;
  VoxelBits occupied_;
  std::vector<Toggle> toggles_;
  struct Followed {
    std::uint64_t revision = 0;
    std::size_t known = 0;  ///< voxels
  };
  std::map<const mapping::OccupancyMap*, Followed> followed_;  ///< several where not all UAVs are in touch
  std::vector<std::uint64_t> newly_known_;                     ///< per UAV
  coverage3d::FrontierCells frontier_;
  bool frontier_written_ = false;
};

}  // namespace stairwell::apps
