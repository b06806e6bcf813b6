#pragma once

#include "planning3d/planner.hpp"

namespace stairwell::test {

/// Learned agents need their weights.
inline planning3d::PlannerOptions with_models() {
  planning3d::PlannerOptions options;
  options.models_dir = STAIRWELL_SOURCE_DIR "/models";
  return options;
}

}  // namespace stairwell::test
