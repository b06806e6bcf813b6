/// Whole explorations in generated buildings, for an agent that chooses where to go (SPEC A8, B7).
#pragma once

#include "core/scan.hpp"
#include "coverage3d/coverage_options.hpp"
#include "learning/rl/double_dqn.hpp"
#include "learning/train/training_world.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace stairwell::train {

struct CoverageEnvironmentConfig {
  /// kProgress: how far the logarithm of the share that is left to see falls, so that the last rooms count as the
  /// first. kThesis: (5.15). Shares are of what has been seen in the end.
  enum class Reward { kProgress, kThesis };

  StoreyWorldConfig worlds{.most_storeys = 2, .most_size_m = 13.0};
  Reward reward = Reward::kProgress;
  int most_uavs = 3;
  double resolution_m = 0.2;  ///< of the map; the buildings' own is the worlds'
  double horizon_s = 20.0;    ///< what comes later by this counts 1/e
  double time_limit_s = 600.0;
  std::uint64_t seed = 1;

  std::vector<std::string> problems() const;
};

/// How one exploration went. Times in simulated seconds.
struct ExplorationReport {
  std::vector<rl::Choice> choices;  ///< of all UAVs, and what came of each until the same UAV chose again
  double reward = 0.0;              ///< the fleet's, discounted from the start
  double t90_s = 0.0;               ///< 90 % of what was seen in the end
  double finish_s = 0.0;
  double seen_m3 = 0.0;
  std::size_t uavs = 0, failures = 0;
};

/// The fleet of explore/ with simulated sensors and vehicles, on a coarse map and with few rays. What happens in an
/// episode depends on its number and the choices alone.
class CoverageEnvironment {
 public:
  /// @throws InputError for an unusable config
  explicit CoverageEnvironment(const CoverageEnvironmentConfig& config);
  ExplorationReport fly(std::uint64_t episode, const coverage3d::OptionChooser& chooser) const;

 private:
  CoverageEnvironmentConfig config_;
};

/// A scene, and places for UAVs to start from side by side near the ground: at least one, fewer than asked for where
/// there is no room.
struct Building {
  VoxelScene scene;
  std::vector<Eigen::Vector3d> starts_m;
};
Building make_building(const StoreyWorldConfig& config, int uavs, Rng& rng);

}  // namespace stairwell::train
