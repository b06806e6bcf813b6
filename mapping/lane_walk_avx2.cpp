#include "mapping/lane_walk.hpp"

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif

namespace stairwell::mapping::lanes {

namespace {

#include "mapping/lane_walk_kernels.hpp"

constexpr int kLanes = 8;
constexpr int kEnough = 3;
using Integers = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
constexpr Integers kNumbers{0, 1, 2, 3, 4, 5, 6, 7};

inline int going_lanes(const Integers& going) {
  return std::popcount(static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<const __m256&>(going))));
}

inline Integers lower_of(Integers a, Integers b) { return a < b ? a : b; }
inline Integers higher_of(Integers a, Integers b) { return a > b ? a : b; }

#include "mapping/lane_walk_group.hpp"

}  // namespace

const WalkKernels& avx2_kernels() {
  static const WalkKernels kernels{transform, find_ends, prepare, walk};
  return kernels;
}

}  // namespace stairwell::mapping::lanes

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
