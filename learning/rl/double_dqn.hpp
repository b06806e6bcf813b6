/// Choosing among options (SPEC B7): Double DQN (van Hasselt, Guez, Silver 2016). LibTorch, behind this door.
#pragma once

#include "core/rng.hpp"
#include "learning/nn/network_spec.hpp"
#include "learning/nn/sealed_bytes.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stairwell::rl {

/// One choice and what came of it. Options are rows of numbers that describe what would be done where: the network
/// gives each a value, so that there may be more or fewer of them each time.
struct Choice {
  std::vector<float> chosen;  ///< [features]
  double reward = 0.0;
  double discount = 0.95;           ///< of what follows, over the time that passed; 0 where nothing does
  std::vector<float> next_options;  ///< [options, features]; may be empty with discount 0
};

/// The latest choices.
class ChoiceReplay {
 public:
  explicit ChoiceReplay(std::size_t capacity) : capacity_(capacity) {}
  void add(Choice choice);
  std::size_t size() const { return choices_.size(); }
  /// @pre size() > 0
  std::vector<const Choice*> draw(std::size_t count, Rng& rng) const;

  void save(nn::ByteWriter& writer) const;
  void load(nn::ByteReader& reader);

 private:
  std::size_t capacity_;
  std::uint64_t count_ = 0;
  std::vector<Choice> choices_;
};

struct DoubleDqnConfig {
  nn::NetworkSpec network;  ///< features in, one value out; no windows
  double learning_rate = 1e-3;
  double smoothing = 0.01;  ///< of the target network
  double max_gradient_norm = 10.0;
  std::uint64_t seed = 1;
  std::string device = "cpu";

  std::vector<std::string> problems() const;
};

/// Repeatable bit by bit on the CPU (one thread) for one seed.
class DoubleDqn {
 public:
  /// @throws InputError for an unusable config
  explicit DoubleDqn(const DoubleDqnConfig& config);
  ~DoubleDqn();
  DoubleDqn(DoubleDqn&&) noexcept;
  DoubleDqn& operator=(DoubleDqn&&) noexcept;

  /// One value for each option. @param options  [count, features]
  std::vector<float> values(std::span<const float> options) const;
  /// The best option, or with a chance of `epsilon` any. @pre there is one
  std::size_t choose(std::span<const float> options, double epsilon, Rng& rng) const;
  /// One step; the network chooses the next option, the target network says what it is worth. @returns the loss (Huber)
  double learn(const std::vector<const Choice*>& batch);

  std::vector<float> parameters() const;
  void save(nn::ByteWriter& writer) const;
  /// @throws InputError for another network's
  void load(nn::ByteReader& reader);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stairwell::rl
