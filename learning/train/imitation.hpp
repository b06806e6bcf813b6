/// Behaviour cloning and DAgger (Ross, Gordon, Bagnell 2011) for the path agents.
#pragma once

#include "learning/nn/model_file.hpp"
#include "learning/nn/trainer.hpp"
#include "learning/train/replay.hpp"
#include "learning/train/teacher.hpp"
#include "learning/train/training_world.hpp"
#include "planning3d/agent_planner.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace stairwell::train {

struct ImitationConfig {
  enum class Algorithm { kBc, kDagger };

  planning3d::AgentInput input = planning3d::AgentInput::volume();
  nn::Head head = nn::Head::kUnitVector;
  Algorithm algorithm = Algorithm::kDagger;
  std::uint64_t seed = 1;
  std::uint64_t steps = 20'000;  ///< of gradient descent
  std::size_t batch = 256;
  std::size_t steps_per_round = 100;
  std::size_t looks_per_round = 5'000;  ///< at least so many are labelled anew in every round
  std::size_t capacity = 60'000;
  double learning_rate = 1e-3;  ///< falls to 0 along a cosine
  double teacher_share = 0.25;  ///< of DAgger's flights after the first rounds; the student flies the others
  std::string device = "cpu";

  static ImitationConfig slice();
  static ImitationConfig volume();
  nn::NetworkSpec network() const;
  std::vector<std::string> problems() const;
};

/// What one round did.
struct RoundReport {
  std::uint64_t round = 0;
  std::uint64_t steps = 0;       ///< done so far, of all rounds
  std::uint64_t looks = 0;       ///< labelled in this round
  double loss = 0.0;             ///< mean of the round
  double student_success = 0.0;  ///< of its own flights that reached the goal without touching anything; NaN: none
};

/// All that is needed to go on, except for the replay: that is filled again by the student as it is.
struct ImitationState {
  std::uint64_t round = 0;
  std::uint64_t steps = 0;
  std::vector<float> parameters;
  std::string optimiser;
};

/// Rounds of flying in new worlds and learning from what was seen there. Bitwise repeatable on the CPU for one seed
/// (without a resumption in between).
class Imitation {
 public:
  /// @throws InputError for an unusable config or state
  explicit Imitation(const ImitationConfig& config, const ImitationState* resumed = nullptr);

  bool finished() const { return steps_ >= config_.steps; }
  RoundReport round();
  ImitationState state() const;
  /// Its header lacks the command and the commit: those are the program's to tell.
  nn::Model model() const;

 private:
  struct Flight;
  void collect(RoundReport& report);
  void fly_in(const TrainingWorld& world, Rng& rng, RoundReport& report);
  void fly(Flight& flight, Rng& rng, RoundReport& report);
  void learn(RoundReport& report);

  ImitationConfig config_;
  nn::Trainer trainer_;
  Replay replay_;
  Teacher teacher_;
  planning3d::ArrivalField field_;
  planning3d::AgentView view_;
  planning3d::Observation seen_;
  std::vector<float> outputs_;
  std::unique_ptr<nn::Network> student_;
  std::uint64_t round_ = 0, steps_ = 0;
  std::uint64_t student_flights_ = 0, student_reached_ = 0;  ///< of this round
};

/// A path agent of these parameters; its header lacks the command and the commit.
nn::Model path_model(const planning3d::AgentInput& input, const nn::NetworkSpec& network, std::uint64_t seed,
                     std::uint64_t steps, std::vector<float> parameters);

/// One of the worlds that agents are trained in, by the kind of agent: slices of all densities, or storeys; half
/// of the latter only partly known.
TrainingWorld random_training_world(bool plane, Rng& rng);

}  // namespace stairwell::train
