#pragma once

#include "apps/settings.hpp"
#include "explore/fleet_config.hpp"
#include "sim3d/world.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stairwell::apps {

struct Start {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

/// Everything one run of `stairwell explore` depends on, besides the world file's contents.
struct RunConfig {
  static constexpr std::size_t kMostUavs = 64;
  static constexpr double kMostVoxels = 4e8;  ///< of the task box: some bytes each for map and ground truth

  std::filesystem::path world;
  sim3d::WorldOptions world_options;
  explore::FleetConfig fleet;  ///< task_box is empty until `complete` when no box was given
  bool box_given = false;
  std::size_t uavs = 1;
  std::vector<Start> starts;     ///< as given; `complete` fills up to `uavs`
  double start_spread_m = 0.0;   ///< every start is moved by up to this along x and y, drawn from the seed
  double target_coverage = 1.0;  ///< the run ends when this much of the explorable space is known; 1 = never
  bool noise = false;
  std::optional<double> radio_range_m;  ///< of the exchange of maps; nullopt: unlimited
  double checkpoint_period_s = 2.0;     ///< wall time
  std::string out;                      ///< empty: runs/<world>-<mode>-<seed>[-k]

  /// Every reason why the configuration cannot be used; empty = usable. Each names the setting and the mend.
  std::vector<std::string> problems() const;
};

/// Gives settings their meaning and fills in the defaults (which depend on mode and sensor).
/// @param[in,out] settings gets the default texts added, so that it is the resolved configuration.
/// @throws InputError naming the first setting whose value cannot be read.
RunConfig resolve(Settings& settings);

/// Writes what was found out about the world (box, starts) into the resolved settings.
void record_resolved(const RunConfig& config, Settings& settings);

/// @throws InputError holding every problem in one line when there are any.
void require_usable(const RunConfig& config);

const char* to_string(explore::Mode mode);

}  // namespace stairwell::apps
