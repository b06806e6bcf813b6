/// What was seen and what should have been done, the latest of it.
#pragma once

#include "core/rng.hpp"
#include "learning/nn/trainer.hpp"
#include "planning3d/agent_view.hpp"

#include <cstdint>
#include <vector>

namespace stairwell::train {

/// Observations with the teacher's direction (in the turned frame), in a ring; windows stay bytes.
class Replay {
 public:
  /// Room for so many.
  Replay(const planning3d::AgentInput& input, nn::Head head, int outputs, std::size_t capacity);

  std::size_t size() const { return std::min(count_, capacity_); }
  void add(const planning3d::Observation& seen, const Eigen::Vector3d& direction);
  /// `count` of them at random, each mirrored (y to -y, in volumes also z to -z) with a chance of one half: worlds are
  /// as likely the other way round. @pre size() > 0. The batch's spans last until the next call.
  nn::Batch draw(std::size_t count, Rng& rng);

 private:
  void mirror(std::size_t row, int axis);

  planning3d::AgentInput input_;
  nn::Head head_;
  std::size_t outputs_, window_bytes_, capacity_, count_ = 0;
  std::vector<std::uint8_t> windows_;
  std::vector<float> features_, directions_;
  std::vector<std::uint8_t> batch_windows_, flipped_;
  std::vector<float> batch_features_, batch_targets_;
};

}  // namespace stairwell::train
