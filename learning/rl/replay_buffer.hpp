/// Transitions, the latest of them (SPEC A10, Alg. 3.1 line 10).
#pragma once

#include "core/rng.hpp"
#include "learning/nn/sealed_bytes.hpp"
#include "learning/rl/environment.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace stairwell::rl {

/// `count` transitions, row by row.
struct TransitionBatch {
  std::size_t count = 0;
  std::vector<std::uint8_t> windows, next_windows;
  std::vector<float> features, next_features, actions;
  std::vector<float> rewards;       ///< sum of discount^k r_k over the steps in between
  std::vector<float> discounts;     ///< discount^steps of what follows; 0 where nothing does
  std::vector<float> demonstrated;  ///< 1 where somebody showed the action, else 0
};

/// A ring of looks, each with the action that was taken on it; the next look is the action's result, so that windows
/// are kept once, as bytes.
class ReplayBuffer {
 public:
  struct Shape {
    std::size_t window_bytes = 0, features = 0, actions = 0;
  };
  struct Draw {
    std::size_t n_step = 1;  ///< rewards added up, fewer at an episode's end
    double discount = 0.95;
    bool demonstrated = false;  ///< what TransitionBatch says of them
  };

  /// Room for so many looks. @throws InputError for fewer than 2
  ReplayBuffer(const Shape& shape, std::size_t capacity);

  /// An episode's first look.
  void begin(const State& state);
  /// What was done on the last look, and what came of it. @pre begin() was called
  void step(std::span<const float> action, double reward, bool terminal, const State& next);

  std::size_t transitions() const { return transitions_; }
  /// Adds `count` transitions at random to the batch. @pre transitions() > 0
  void draw(std::size_t count, const Draw& how, Rng& rng, TransitionBatch& batch) const;

  void save(nn::ByteWriter& writer) const;
  /// @throws InputError for a buffer of another shape
  void load(nn::ByteReader& reader);

 private:
  enum class Kind : std::uint8_t { kNothingDone, kStep, kTerminal };
  void push(const State& state);
  std::size_t size() const;
  void copy_state(std::size_t at, std::vector<std::uint8_t>& windows, std::vector<float>& features) const;

  Shape shape_;
  std::size_t capacity_;
  std::uint64_t count_ = 0;  ///< looks ever pushed
  std::size_t transitions_ = 0;
  std::vector<std::uint8_t> windows_;
  std::vector<float> features_, actions_, rewards_;
  std::vector<Kind> kinds_;
};

/// `count` transitions, so many of them (a share, rounded) demonstrations and the others own (RLPD, Ball et al. 2023,
/// with 0.5); all from the one that is not empty where the other one is.
TransitionBatch draw_mixed(const ReplayBuffer& own, const ReplayBuffer& demonstrations, std::size_t count,
                           double demonstration_share, const ReplayBuffer::Draw& how, Rng& rng);

}  // namespace stairwell::rl
