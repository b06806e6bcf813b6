/// One training as the command `train` drives it.
#pragma once

#include "apps/training_request.hpp"
#include "learning/nn/model_file.hpp"
#include "planning3d/agent_view.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace stairwell::apps {

class TrainingRun {
 public:
  virtual ~TrainingRun() = default;
  virtual std::uint64_t steps() const = 0;  ///< of gradient descent, so far
  virtual bool finished() const = 0;
  /// Columns of a row; the second one is `step`.
  virtual std::string columns() const = 0;
  /// Goes on for a while. @returns the row
  virtual std::string advance() = 0;
  /// Of the last while, for people.
  virtual std::string summary() const = 0;
  virtual std::string checkpoint(const std::string& command) const = 0;
  /// @throws InputError when the bytes are not this training's
  virtual void resume(std::string_view bytes, const std::string& command) = 0;
  virtual double seconds_between_checkpoints() const = 0;
  /// Its header lacks the command and the commit.
  virtual nn::Model model() const = 0;
};

/// What a path agent is shown.
planning3d::AgentInput input_of(const TrainingRequest& request);

/// bc, dagger
std::unique_ptr<TrainingRun> make_imitation_run(const TrainingRequest& request);
/// Coverage: dqn. @throws InputError for options that are not for it
std::unique_ptr<TrainingRun> make_coverage_run(const TrainingRequest& request);
/// ddpg, td3, sac, td3bc. @throws InputError naming the model to start from when it cannot be used
std::unique_ptr<TrainingRun> make_reinforcement_run(const TrainingRequest& request);

}  // namespace stairwell::apps
