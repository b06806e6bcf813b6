#pragma once

#include "learning/nn/model_file.hpp"
#include "planning3d/agent_view.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/travel_costs.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::planning3d {

/// How a learned agent flies (Alg. 4.2): step by step where its network points.
struct RolloutConfig {
  double step_m = 0.12;        ///< SPEC A5
  double least_step_m = 0.03;  ///< a step that does not fit is halved down to this; then it is a collision
  double keep = 0.3;           ///< of the last direction in the next one
  double goal_reach_m = 0.5;   ///< from here on the goal itself is the next step, if nothing is between
  /// Where not even the least step fits: the free direction next to the network's, up to 80 degrees off. Without it the
  /// flight ends there as a collision.
  bool slide = true;
  double patience_m = 6.0;  ///< flown without coming nearer to the goal than before: a local minimum
  double detour = 3.0;      ///< the flight ends after so many times the way that was left at its start
};

enum class RolloutEnd { kReached, kCollision, kNoProgress, kTooLong, kNoWay };
const char* to_string(RolloutEnd end);

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
  bool try_step(const Eigen::Vector3d& direction, double step_m);
  bool slide_along(const Eigen::Vector3d& wanted);

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

/// Rounds of `smooth_path` after a flight.
inline constexpr int kSmoothings = 40;

/// A learned agent as a planner: `agent2d` in layers (by the slice rule also from one to another: straight up and down
/// where `slice_legs` says), `agent3d` anywhere. What it answers is only
/// what its network flew without touching anything; kLocalMinimum when it lost its way, kNoPath when it touched
/// something or there is no way (or, for the slice agent by the volume rule, the goal is in another layer).
class AgentPlanner final : public Planner {
 public:
  /// Settings of the walk and of the smoothing after it.
  struct Config {
    RolloutConfig rollout;
    int smoothings = kSmoothings;
  };
  /// @throws InputError for a model that is not one of a path agent
  explicit AgentPlanner(const nn::Model& model);
  AgentPlanner(const nn::Model& model, const Config& config);
  /// `agent2d` from `path2d.model`, `agent3d` from `path3d.model`. @throws InputError naming the file
  static std::unique_ptr<AgentPlanner> load(std::string_view name, const std::filesystem::path& models_dir);

  std::string_view name() const override { return input_.plane ? "agent2d" : "agent3d"; }
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;

  /// The network's answer to a look, in the world's frame.
  Eigen::Vector3d direction(const Observation& seen);
  RolloutEnd last_end() const { return last_end_; }

 private:
  Config config_;
  AgentInput input_;
  nn::Network network_;
  /// One flight; its path is added to `path_m`, which ends where it starts.
  PlanStatus fly(const FreeSpace& space, const SegmentCheck& check, const PlanRequest& request,
                 const Eigen::Vector3d& goal_m, std::vector<Eigen::Vector3d>& path_m, std::size_t& looks);

  ArrivalField field_;
  AgentView view_;
  TravelCosts costs_;
  Observation seen_;
  std::vector<float> outputs_;
  RolloutEnd last_end_ = RolloutEnd::kNoWay;
};

/// Checks that a network fits what it is to be shown. @throws InputError
void require_fitting(const AgentInput& input, const nn::NetworkSpec& network);

/// The same path with means of neighbouring points taken so many times; points stay where their segments would touch
/// something. Ends stay.
std::vector<Eigen::Vector3d> smooth_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, int rounds);

}  // namespace stairwell::planning3d
