#include "mapping/lane_walk.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

// No instructions beyond what every processor of the architecture has.
namespace stairwell::mapping::lanes {

namespace {

#include "mapping/lane_walk_kernels.hpp"

constexpr int kLanes = 4;
constexpr int kEnough = 2;
using Integers = std::int32_t __attribute__((vector_size(kLanes * sizeof(std::int32_t))));
constexpr Integers kNumbers{0, 1, 2, 3};

#if defined(__SSE2__)
// SSE2 has no minimum of integers; positive integers are in the same order as the floats of the same bits.
inline __m128 as_floats(Integers values) { return reinterpret_cast<__m128>(values); }
inline Integers lower_of(Integers a, Integers b) {
  return reinterpret_cast<Integers>(_mm_min_ps(as_floats(a), as_floats(b)));
}
inline Integers higher_of(Integers a, Integers b) {
  return reinterpret_cast<Integers>(_mm_max_ps(as_floats(a), as_floats(b)));
}
inline int going_lanes(const Integers& going) {
  constexpr std::array<std::uint8_t, 16> kOnes{0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4};
  return kOnes[static_cast<unsigned>(_mm_movemask_ps(as_floats(going)))];
}
#else
inline Integers lower_of(Integers a, Integers b) { return a < b ? a : b; }
inline Integers higher_of(Integers a, Integers b) { return a > b ? a : b; }
inline int going_lanes(const Integers& going) { return -(going[0] + going[1] + going[2] + going[3]); }
#endif

#include "mapping/lane_walk_group.hpp"

WordEffect update(float* log_odds, std::uint64_t miss, std::uint64_t hit, const UpdateRule& rule) {
  WordEffect effect;
  for (std::uint64_t bits = miss | hit; bits != 0; bits &= bits - 1) {
    const std::uint64_t bit = bits & -bits;
    float& value = log_odds[std::countr_zero(bits)];
    const float before = value;
    const bool known = before == before;
    const float add = (hit & bit) != 0 ? rule.hit : rule.miss;
    effect.unknown_before |= known ? 0 : bit;
    effect.occupied_before |= before >= rule.threshold ? bit : 0;
    const bool settled = (add >= 0.0F && before >= rule.highest) || (add <= 0.0F && before <= rule.lowest);
    if (!settled) {
      const float sum = (known ? before : 0.0F) + add;
      value = sum < rule.lowest ? rule.lowest : (sum > rule.highest ? rule.highest : sum);
      effect.stored |= value != before ? bit : 0;
    }
    effect.occupied_after |= value >= rule.threshold ? bit : 0;
  }
  return effect;
}

}  // namespace

const ScanKernels& scalar_kernels() {
  static const ScanKernels kernels{transform, find_ends, prepare, walk, update, find_keys};
  return kernels;
}

}  // namespace stairwell::mapping::lanes
