/// What `stairwell train` was asked for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace stairwell::apps {

struct TrainingRequest {
  std::string agent, algorithm, head = "unit_vector", attraction = "geodesic", reward = "progress", device = "cpu",
                                from, out;
  std::uint64_t steps = 20'000, seed = 1;
  int scales = 2;
  std::optional<double> demonstrations;
  bool resume = false, quiet = false;
};

/// The options that the trained weights depend on, as they would be typed: for the model's header, and so that only the
/// same training goes on from a checkpoint.
std::string command_of(const TrainingRequest& request);

}  // namespace stairwell::apps
