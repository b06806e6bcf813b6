#include "mapping/lane_walk.hpp"

#include <cmath>
#include <cstdlib>
#include <limits>

// No instructions beyond what every processor of the architecture has.
namespace stairwell::mapping::lanes {

namespace {

#include "mapping/lane_walk_kernels.hpp"

constexpr int kLanes = 4;
constexpr int kEnough = 1;
using Integers = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
constexpr Integers kNumbers{0, 1, 2, 3};

inline int going_lanes(const Integers& going) { return -(going[0] + going[1] + going[2] + going[3]); }

#include "mapping/lane_walk_group.hpp"

}  // namespace

const WalkKernels& scalar_kernels() {
  static const WalkKernels kernels{transform, find_ends, prepare, walk};
  return kernels;
}

}  // namespace stairwell::mapping::lanes
