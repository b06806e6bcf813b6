/// Double DQN for the coverage agent.
#pragma once

#include "learning/nn/model_file.hpp"
#include "learning/rl/double_dqn.hpp"
#include "learning/train/coverage_environment.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace stairwell::train {

struct CoverageTrainingConfig {
  CoverageEnvironmentConfig environment;
  std::uint64_t seed = 1;
  std::uint64_t steps = 20'000;  ///< of gradient descent
  double shown_share = 0.15;     ///< of the later episodes
  double updates_per_choice = 3.0;
  std::size_t batch = 256;
  std::size_t capacity = 60'000;
  double first_epsilon = 0.3, last_epsilon = 0.03;  ///< chance of any option, falling with the steps
  double learning_rate = 5e-4;
  std::string device = "cpu";

  /// Flown by rules of thumb before the first step.
  std::uint64_t shown_episodes() const;
  nn::NetworkSpec network() const;
  std::vector<std::string> problems() const;
};

/// What one episode brought.
struct CoverageEpisode {
  std::uint64_t episode = 0;
  std::uint64_t steps = 0;  ///< of gradient descent, of all episodes so far
  bool shown = false;       ///< flown by a rule of thumb
  ExplorationReport flown;  ///< without its choices
  double loss = 0.0;        ///< mean; NaN: nothing was learned
};

/// Repeatable bit by bit (CPU) for a seed, also when it goes on from its state().
class CoverageTraining {
 public:
  /// @throws InputError for an unusable config
  explicit CoverageTraining(const CoverageTrainingConfig& config);

  bool finished() const { return steps_ >= config_.steps; }
  std::uint64_t steps() const { return steps_; }
  /// One exploration, and then the learning that it allows.
  CoverageEpisode episode();

  std::string state() const;
  /// @throws InputError for another training's
  void set_state(std::string_view state);
  /// Its header lacks the command and the commit: those are the program's to tell.
  nn::Model model() const;

 private:
  ExplorationReport fly(bool shown, Rng& rng) const;
  double learn(std::size_t choices, Rng& rng);

  CoverageTrainingConfig config_;
  CoverageEnvironment environment_;
  rl::DoubleDqn agent_;
  rl::ChoiceReplay replay_;
  std::uint64_t episodes_ = 0, steps_ = 0;
};

}  // namespace stairwell::train
