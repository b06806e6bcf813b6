/// Learning by trial and error for the path agents: what is set how.
#pragma once

#include "learning/nn/model_file.hpp"
#include "learning/rl/training.hpp"
#include "learning/train/path_environment.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace stairwell::train {

struct PathReinforcementConfig {
  using Algorithm = rl::ActorCriticConfig::Algorithm;

  PathEnvironmentConfig environment;
  Algorithm algorithm = Algorithm::kTd3Bc;
  std::uint64_t seed = 1;
  std::uint64_t steps = 5'000;                ///< of gradient descent
  std::optional<double> demonstration_share;  ///< of each batch; none: a half for TD3+BC, else nothing
  std::string device = "cpu";

  nn::NetworkSpec network() const;
  rl::ActorCriticConfig agent() const;
  /// @param from_model  starts from a trained actor: its critics learn first, and it explores near what it knows
  rl::TrainingConfig training(bool from_model) const;
};

/// A training with its environment.
class PathReinforcement {
 public:
  /// @param from  a trained agent to start from; may be null. @throws InputError if it is for another network
  PathReinforcement(const PathReinforcementConfig& config, const nn::Model* from);

  rl::Training& training() { return training_; }
  const rl::Training& training() const { return training_; }
  /// Its header lacks the command and the commit: those are the program's to tell.
  nn::Model model() const;

 private:
  PathReinforcementConfig config_;
  PathEnvironment environment_;
  rl::Training training_;
};

}  // namespace stairwell::train
