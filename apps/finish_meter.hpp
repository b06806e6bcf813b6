#pragma once

#include "apps/run_config.hpp"
#include "core/trajectory.hpp"
#include "coverage3d/frontier_finder.hpp"
#include "coverage3d/slab_finish.hpp"
#include "mapping/occupancy_map.hpp"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <vector>

namespace stairwell::apps {

/// The published clock (first to last motion of the exploration) and when the rule of `--finish` was met in the fleet's
/// map, observed from outside the agents.
class FinishMeter {
 public:
  FinishMeter(const GridSpec& grid, const explore::FleetConfig& fleet);

  /// @param map all that the fleet has seen @param exploring false once the UAVs only go home or land
  void observe(double time_s, const mapping::OccupancyMap& map, const std::vector<MotionState>& states, bool exploring);

  std::optional<double> first_motion_s() const { return first_motion_s_; }
  std::optional<double> last_motion_s() const { return last_motion_s_; }
  /// Since when the rule has been met without a break; nullopt: it is not met, or it is `coverage`.
  std::optional<double> met_s() const { return met_s_; }

  nlohmann::json save() const;
  void load(const nlohmann::json& state);

 private:
  std::optional<coverage3d::FrontierFinder> finder_;
  coverage3d::SlabFinish slab_;
  std::vector<Eigen::Vector3d> before_m_;
  std::optional<double> first_motion_s_, last_motion_s_, met_s_;
  std::uint64_t revision_ = 0;
  double next_look_s_ = 0.0;
};

}  // namespace stairwell::apps
