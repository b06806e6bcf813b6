#pragma once

#include "core/scan.hpp"
#include "core/trajectory.hpp"
#include "coverage3d/information_gain.hpp"
#include "coverage3d/task_board.hpp"
#include "planning3d/free_space.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::coverage3d {

/// Where a UAV should go and look.
struct Goal {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();  ///< centre of what is to be seen
  double gain_m3 = 0.0;                                ///< what is expected to be learnt there: see ViewGain
  double travel_m = 0.0;
};

/// A pose from which a UAV is going to look.
struct PlannedLook {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

/// What a strategy sees of a UAV.
struct UavView {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< where the next plan departs from
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  bool wants_goal = false;              ///< false: keeps what it has; still counts when work is shared out
  std::optional<Goal> goal;             ///< present goal
  std::vector<PlannedLook> ahead = {};  ///< on its commanded way, when it keeps its goal
  bool placed = true;                   ///< false: where it is this map knows nothing; only its goal counts
  bool shares_map = true;               ///< its scans are in this map
};

/// What a strategy is asked.
struct AssignmentRequest {
  double time_s = 0.0;
  std::vector<UavView> uavs;
  /// Where UAVs whose scans are not in this map have been since: what they have probably seen is theirs.
  std::vector<Eigen::Vector3d> passed_m;
  mapping::WorkerPool* workers = nullptr;  ///< threads that may help; the answer is the same. Null: none
  TaskBoard* tasks = nullptr;              ///< what the UAVs tell each other they answer for; null: all share one map
};

/// What a strategy decided.
struct Assignment {
  std::vector<std::optional<Goal>> goals;  ///< one per UAV; nullopt = nothing useful for it now
  std::size_t open_targets = 0;            ///< frontiers (or cells) still worth a visit
  std::size_t unreachable_targets = 0;     ///< left, but no reachable pose sees them
};

/// Decides where each UAV goes. Sees the map, never the world.
class CoverageStrategy {
 public:
  virtual ~CoverageStrategy() = default;
  virtual std::string_view name() const = 0;
  /// The same strategy with all it knows, for a copy of the map with the same revisions. Null: a new one that loads the
  /// saved state does as well.
  virtual std::unique_ptr<CoverageStrategy> clone() const { return nullptr; }
  /// How UAVs may move under this strategy at present (slice mode: the layers found so far).
  virtual planning3d::MotionRule motion_rule() const = 0;
  virtual Assignment assign(const planning3d::FreeSpace& space, const AssignmentRequest& request) = 0;
  /// Whether `goal` is still worth flying to: false once most of what it was for has been seen.
  virtual bool still_useful(const planning3d::FreeSpace& space, const Goal& goal) = 0;
  /// The goal could not be reached (no path, or nothing new was seen from it): avoid its surroundings
  /// (SPEC B4: 0.6 m) for a while.
  virtual void report_failure(const Goal& goal, double time_s) = 0;
  /// State that a resumed run needs (blacklist, layers, ...) as one opaque text; map-derived state is rebuilt.
  virtual std::string save_state() const = 0;
  /// @throws InputError when the text is damaged.
  virtual void load_state(const std::string& state) = 0;
};

/// Explored is what leaves no frontier between two heights (see SlabFinish) instead of all that can be seen.
struct FinishSlab {
  double lo_m = 1.0;
  double hi_m = 1.5;
  bool past_walls = false;  ///< see SlabFinish
};

/// What a strategy has to know about the UAVs and their task.
struct CoverageConfig {
  SensorModel sensor;
  MotionLimits limits;
  Robot robot;
  Aabb box;                      ///< task box: only frontiers inside count
  std::vector<double> layers_m;  ///< given layers; empty = automatic
  bool slice = false;            ///< viewpoints only at layer heights
  GainKind gain = GainKind::kVolume;
  mapping::OccupancyParams occupancy;  ///< of the map; for gain kEntropy
  bool turn_taking = true;             ///< UAVs plan knowing what the others are going to see; false: as if alone
  double min_gain_m3 = 0.1;            ///< views that show less unknown volume are not worth a flight
  double blacklist_radius_m = 0.6;     ///< SPEC B4
  double blacklist_time_s = 120.0;     ///< expiry
  std::optional<FinishSlab> finish;
  std::string hybrid_first = "greedy";  ///< `hybrid`: the strategy before the switch to k-means
  double hybrid_switch = 0.7;           ///< ... when this share of the box is known
  std::filesystem::path models_dir;     ///< `agent`: where coverage.model is
  std::uint64_t seed = 1;
};

/// `frontiers`, `layers`, `kmeans`, `hybrid`, `agent` and the baselines `nearest`, `greedy`, `lawnmower`, `random`.
/// @throws InputError listing the known names, or naming the agent's model when it cannot be used.
std::unique_ptr<CoverageStrategy> make_strategy(std::string_view name, const CoverageConfig& config);
std::vector<std::string_view> strategy_names();

}  // namespace stairwell::coverage3d
