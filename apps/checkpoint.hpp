#pragma once

#include "apps/run_log.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stairwell::apps {

/// What a resumed run starts from, besides config.yaml.
struct Checkpoint {
  std::string fleet;       ///< explore::Fleet::save_state()
  std::string flight;      ///< FlightMeter, JSON
  std::string milestones;  ///< Milestones, JSON
  std::string finish;      ///< FinishMeter, JSON
  double wall_s = 0.0;
  std::vector<std::uint64_t> scans_taken;  ///< per UAV
  RunLog::Offsets log_bytes{};
};

/// `checkpoint/` of a run folder: state.json, which names the map files that belong to it. A new generation is
/// complete on the disk before state.json is renamed over the old one, so a kill at any moment leaves one of the two.
class CheckpointFolder {
 public:
  explicit CheckpointFolder(const std::filesystem::path& run_folder) : folder_(run_folder / "checkpoint") {}

  bool exists() const;
  /// @throws RunError naming the file that cannot be written.
  void save(const Checkpoint& checkpoint, const std::vector<const mapping::OccupancyMap*>& maps);
  /// @param blank grid and parameters of the maps
  /// @param[out] maps as saved
  /// @throws InputError naming the file that is damaged.
  Checkpoint load(const mapping::OccupancyMap& blank, std::vector<mapping::OccupancyMap>& maps) const;
  void remove();

 private:
  std::filesystem::path state_file() const { return folder_ / "state.json"; }

  std::filesystem::path folder_;
};

}  // namespace stairwell::apps
