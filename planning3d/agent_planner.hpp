#pragma once

#include "learning/nn/model_file.hpp"
#include "planning3d/agent_path.hpp"
#include "planning3d/agent_view.hpp"
#include "planning3d/planner.hpp"
#include "planning3d/rollout.hpp"
#include "planning3d/travel_costs.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::planning3d {

/// Rounds of `smooth_path` after a flight.
inline constexpr int kSmoothings = 40;

/// A learned agent as a planner: `agent2d` in layers (by the slice rule also from one to another: straight up and down
/// where `slice_legs` says), `agent3d` anywhere. What it answers is only
/// what its network flew without touching anything; kLocalMinimum when it lost its way, kNoPath when it touched
/// something or there is no way (or, for the slice agent by the volume rule, the goal is in another layer).
class AgentPlanner final : public Planner {
 public:
  /// Settings of the flight and of what is made of it.
  struct Config {
    RolloutConfig rollout;
    double second_keep = 0.8;  ///< RolloutConfig::keep of a second flight, where the first lost its way; 0: none
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

}  // namespace stairwell::planning3d
