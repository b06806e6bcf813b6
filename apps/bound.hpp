#pragma once

#include "apps/settings.hpp"

#include <csignal>
#include <cstddef>
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

/// Tours over viewpoints chosen on the true map, flown within the run's limits with its sensor, until
/// `target_coverage` of the explorable voxels (default 0.99) is known. Repeatable; the seed does not matter.
/// @param settings as of `stairwell explore`
/// @throws InputError, RunError, the latter also when `interrupted`
Bound find_bound(Settings settings, const volatile std::sig_atomic_t& interrupted);

std::string bound_json(const Bound& bound);

}  // namespace stairwell::apps
