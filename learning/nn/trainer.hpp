/// Gradient descent on a network (LibTorch, behind this door).
#pragma once

#include "learning/nn/network_spec.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stairwell::nn {

/// `count` inputs as Network::infer_batch takes them, and what should come out.
struct Batch {
  std::size_t count = 0;
  std::span<const std::uint8_t> windows;  ///< [count, window_values]
  std::span<const float> features;        ///< [count, features]
  std::span<const float> targets;  ///< [count, outputs]: kUnitVector unit vectors, kAngles and kValues the outputs
};

/// Settings of the gradient descent.
struct TrainerConfig {
  double learning_rate = 1e-3;
  double weight_decay = 1e-4;
  double max_gradient_norm = 1.0;
  std::string device = "cpu";  ///< or "cuda"
};

/// Bitwise repeatable on the CPU (it works on one thread) for one seed.
class Trainer {
 public:
  /// Weights from the seed. @throws InputError for an unusable spec or a device that is not there
  Trainer(const NetworkSpec& spec, std::uint64_t seed, const TrainerConfig& config = {});
  ~Trainer();
  Trainer(Trainer&&) noexcept;
  Trainer& operator=(Trainer&&) noexcept;

  /// One step of AdamW. Loss: kUnitVector 1 - cos of the angle between, kAngles and kValues the squared error; the
  /// mean over the batch. @returns the loss before the step
  double step(const Batch& batch);
  void set_learning_rate(double learning_rate);
  /// What Network::infer_batch gives for these inputs.
  std::vector<float> forward(const Batch& batch) const;

  /// In the order of layers_of().
  std::vector<float> parameters() const;
  void set_parameters(std::span<const float> parameters);
  /// The optimiser's memory, to go on later as if there had been no break. @throws InputError for a foreign one
  std::string optimiser_state() const;
  void set_optimiser_state(const std::string& state);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stairwell::nn
