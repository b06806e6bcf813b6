#pragma once

#include "planning3d/agent_view.hpp"
#include "planning3d/segment_check.hpp"

#include <vector>

namespace stairwell::planning3d {

/// How a learned agent flies (Alg. 4.2): step by step where its network points.
struct RolloutConfig {
  double step_m = 0.12;        ///< SPEC A5
  double least_step_m = 0.03;  ///< a step that does not fit is halved down to this
  double keep = 0.3;           ///< of the last direction in the next one
  double goal_reach_m = 0.5;   ///< from here on the goal itself is the next step, if nothing is between
  /// A step that does not fit gives way to the one that does and is next to it in direction (see fitting_step()).
  /// Without it the flight ends as a collision where not even the least step fits.
  bool slide = true;
  double patience_m = 6.0;  ///< flown without coming nearer to the goal than before: a local minimum
  double detour = 3.0;      ///< the flight ends after so many times the way that was left at its start
};

enum class RolloutEnd { kReached, kCollision, kNoProgress, kTooLong, kNoWay };
const char* to_string(RolloutEnd end);

/// The step that is flown where `wanted` is asked for: the direction mixed with the last one, or unmixed, or the
/// fitting one next to it, up to 80 degrees off; shorter ones where no whole step fits near it. Among equals the one
/// that turns least. Voxel centres around are tried last: a lane one voxel wide always lets one through.
/// @param plane  no step leaves the layer
/// @returns false: nothing fits. The step ends at `to_m`
bool fitting_step(const SegmentCheck& check, const RolloutConfig& config, bool plane, const Eigen::Vector3d& from_m,
                  const Eigen::Vector3d& last, const Eigen::Vector3d& wanted, Eigen::Vector3d& to_m);

/// One flight of an agent, so far.
class Rollout {
 public:
  /// @param view  begun on the same space, keep-out spheres and field
  Rollout(const SegmentCheck& check, AgentView& view, const ArrivalField& field, const RolloutConfig& config,
          const Eigen::Vector3d& start_m);

  bool ended() const { return ended_; }
  RolloutEnd end() const { return end_; }  ///< @pre ended()
  /// Looks around, unless the flight has ended or ends here because the goal is in reach.
  /// @returns true when a direction is wanted
  bool look(Observation& seen);
  /// @param direction  in the world's frame; its length does not matter
  void move(const Eigen::Vector3d& direction);
  const std::vector<Eigen::Vector3d>& path_m() const { return path_m_; }

 private:
  bool finish(RolloutEnd end);

  const SegmentCheck* check_;
  AgentView* view_;
  const ArrivalField* field_;
  RolloutConfig config_;
  std::vector<Eigen::Vector3d> path_m_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  double least_left_m_ = 0.0, since_least_m_ = 0.0, longest_m_ = 0.0, flown_m_ = 0.0;
  bool ended_ = false;
  RolloutEnd end_ = RolloutEnd::kNoWay;
};

}  // namespace stairwell::planning3d
