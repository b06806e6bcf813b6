/// What learns by trial and error learns in one of these.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace stairwell::rl {

/// What an agent sees: bytes of windows and numbers, as nn::Network::infer takes them. Either may be empty.
struct State {
  std::vector<std::uint8_t> windows;
  std::vector<float> features;
};

struct StepResult {
  double reward = 0.0;
  bool ended = false;     ///< the episode is over
  bool terminal = false;  ///< and nothing comes after it (else it was only broken off, and values go on)
  bool success = false;   ///< the episode ended as it should
};

/// Episodes are numbered, and what happens in one depends on its number and the actions alone, so that a training can
/// go on at any of them. Actions: a unit vector, or numbers in [-1, 1].
class Environment {
 public:
  virtual ~Environment() = default;
  virtual void begin(std::uint64_t episode, State& state) = 0;
  virtual StepResult step(std::span<const float> action, State& state) = 0;
  /// What somebody who knows would do here. @returns false if there is nobody
  virtual bool demonstrate(std::span<float> action) {
    static_cast<void>(action);
    return false;
  }
};

}  // namespace stairwell::rl
