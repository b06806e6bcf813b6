/// Flights in generated worlds, one step after the other, for learning by trial and error (SPEC A7).
#pragma once

#include "learning/rl/environment.hpp"
#include "learning/train/teacher.hpp"
#include "learning/train/training_world.hpp"
#include "planning3d/agent_planner.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stairwell::train {

struct PathEnvironmentConfig {
  /// kThesis: (5.7), -10 for a collision, +10 at the goal, else -w1 dU - w2 dpsi - w3 tau of each step, with the
  /// potential U of attraction and repulsion. kProgress: what came nearer along the way, in steps, less nearness to
  /// obstacles, turns and time; -5 for a collision, +5 at the goal.
  enum class Reward { kProgress, kThesis };

  planning3d::AgentInput input = planning3d::AgentInput::slice();
  nn::Head head = nn::Head::kUnitVector;
  Reward reward = Reward::kProgress;
  std::uint64_t seed = 1;
  int most_steps = 150;  ///< table 5.2
};

/// Flown as AgentPlanner does without sliding, in worlds of random_training_world(). Actions: what the network puts
/// out, in the turned frame. The teacher demonstrates.
class PathEnvironment final : public rl::Environment {
 public:
  explicit PathEnvironment(const PathEnvironmentConfig& config);

  void begin(std::uint64_t episode, rl::State& state) override;
  rl::StepResult step(std::span<const float> action, rl::State& state) override;
  bool demonstrate(std::span<float> action) override;

 private:
  /// Which world and goal are there already.
  struct Place {
    std::uint64_t number = ~std::uint64_t{0};
    int attempt = 0;
    friend bool operator==(const Place&, const Place&) = default;
  };
  void make_world(const Place& place);
  bool make_goal(const Place& place);
  bool start(std::uint64_t episode, rl::State& state);
  bool look(rl::State& state);
  double way_left_m(const Eigen::Vector3d& at_m);
  double potential(const Eigen::Vector3d& at_m, double clearance);
  double reward(const Eigen::Vector3d& from_m, double clearance_before);

  PathEnvironmentConfig config_;
  planning3d::ArrivalField field_;
  planning3d::AgentView view_;
  Teacher teacher_;
  Place world_place_, goal_place_;
  std::unique_ptr<TrainingWorld> world_;
  std::optional<planning3d::FreeSpace> space_;
  std::optional<planning3d::SegmentCheck> check_;
  std::optional<planning3d::Rollout> rollout_;
  std::optional<double> height_m_;
  planning3d::Observation seen_;
  bool teacher_ready_ = false;
  int steps_ = 0;
  double last_left_m_ = 0.0;
  double clearance_ = 0.0;                          ///< at the last look, as a feature
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();  ///< direction of the last step
};

}  // namespace stairwell::train
