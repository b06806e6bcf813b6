#include "learning/train/replay.hpp"

#include <algorithm>

namespace stairwell::train {

namespace {

constexpr std::size_t kFeatures = planning3d::AgentInput::kFeatures;

/// Where vectors begin among the features (their y and z change sign in a mirror).
constexpr std::array<std::size_t, 6> kVectors{0, 3, 6, 9, 12, 16};

}  // namespace

Replay::Replay(const planning3d::AgentInput& input, nn::Head head, int outputs, std::size_t capacity)
    : input_(input), head_(head), outputs_(static_cast<std::size_t>(outputs)), window_bytes_(0), capacity_(capacity) {
  for (const nn::WindowInput& window : input.windows()) window_bytes_ += window.values();
  windows_.resize(window_bytes_ * capacity);
  features_.resize(kFeatures * capacity);
  directions_.resize(3 * capacity);
  flipped_.resize(window_bytes_);
}

void Replay::add(const planning3d::Observation& seen, const Eigen::Vector3d& direction) {
  const std::size_t at = count_++ % capacity_;
  std::ranges::copy(seen.windows, windows_.begin() + static_cast<std::ptrdiff_t>(at * window_bytes_));
  std::ranges::copy(seen.features, features_.begin() + static_cast<std::ptrdiff_t>(at * kFeatures));
  for (std::size_t a = 0; a < 3; ++a) {
    directions_[3 * at + a] = static_cast<float>(direction[static_cast<Eigen::Index>(a)]);
  }
}

/// @param axis 1: y, 2: z
void Replay::mirror(std::size_t row, int axis) {
  std::uint8_t* windows = batch_windows_.data() + row * window_bytes_;
  const auto nz = static_cast<std::size_t>(input_.samples[0]), ny = static_cast<std::size_t>(input_.samples[1]),
             nx = static_cast<std::size_t>(input_.samples[2]);
  for (std::size_t line = 0; line < window_bytes_ / nx; ++line) {
    const std::size_t y = line % ny, z = line / ny % nz, block = line / (ny * nz);
    const std::size_t from = axis == 1 ? (block * nz + z) * ny + (ny - 1 - y) : (block * nz + (nz - 1 - z)) * ny + y;
    std::copy_n(windows + from * nx, nx, flipped_.data() + line * nx);
  }
  std::ranges::copy(flipped_, windows);
  const auto component = static_cast<std::size_t>(axis);
  for (const std::size_t vector : kVectors) {
    float& value = batch_features_[row * kFeatures + vector + component];
    value = -value;
  }
}

nn::Batch Replay::draw(std::size_t count, Rng& rng) {
  batch_windows_.resize(count * window_bytes_);
  batch_features_.resize(count * kFeatures);
  batch_targets_.resize(count * outputs_);
  for (std::size_t row = 0; row < count; ++row) {
    const auto at = static_cast<std::size_t>(rng.uniform_int(0, static_cast<int>(size()) - 1));
    std::copy_n(windows_.begin() + static_cast<std::ptrdiff_t>(at * window_bytes_), window_bytes_,
                batch_windows_.begin() + static_cast<std::ptrdiff_t>(row * window_bytes_));
    std::copy_n(features_.begin() + static_cast<std::ptrdiff_t>(at * kFeatures), kFeatures,
                batch_features_.begin() + static_cast<std::ptrdiff_t>(row * kFeatures));
    Eigen::Vector3d direction(directions_[3 * at], directions_[3 * at + 1], directions_[3 * at + 2]);
    for (int axis = 1; axis <= (input_.plane ? 1 : 2); ++axis) {
      if (rng.uniform() < 0.5) continue;
      mirror(row, axis);
      direction[axis] = -direction[axis];
    }
    planning3d::outputs_of(head_, input_.plane, direction, std::span(batch_targets_).subspan(row * outputs_, outputs_));
  }
  return {count, batch_windows_, batch_features_, batch_targets_};
}

}  // namespace stairwell::train
