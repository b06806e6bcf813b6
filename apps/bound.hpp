#pragma once

#include "apps/settings.hpp"

#include <csignal>
#include <cstddef>
#include <functional>
#include <string>

namespace stairwell::apps {

/// What a fleet needs that knows the world: see docs/metrics.md.
struct Bound {
  double finish_s = 0.0;       ///< when the wanted share is known
  double path_length_m = 0.0;  ///< of all UAVs until then
  std::size_t viewpoints = 0;  ///< passed until then
  std::size_t uavs = 0;
  double coverage = 0.0;
  double target_coverage = 0.0;
};

struct BoundRequest {
  Settings settings;                                    ///< as of `stairwell explore`
  int rounds = 6;                                       ///< of searching and flying; more are never worse
  std::function<void(const std::string& line)> report;  ///< is told how it goes; may be empty
};

/// Tours over viewpoints chosen on the true map, flown within the run's limits with its sensor, until
/// `target_coverage` of the explorable voxels (default 0.99) is known. Repeatable; another seed is another search.
/// @throws InputError, RunError, the latter also when `interrupted`
Bound find_bound(const BoundRequest& request, const volatile std::sig_atomic_t& interrupted);

std::string bound_json(const Bound& bound);

}  // namespace stairwell::apps
