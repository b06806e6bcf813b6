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

inline unsigned bits_of(__m256 mask) { return static_cast<unsigned>(_mm256_movemask_ps(mask)); }

WordEffect update(float* log_odds, std::uint64_t miss, std::uint64_t hit, const UpdateRule& rule) {
  const __m256i bit_of_lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256 lowest = _mm256_set1_ps(rule.lowest);
  const __m256 highest = _mm256_set1_ps(rule.highest);
  const __m256 threshold = _mm256_set1_ps(rule.threshold);
  const __m256 zero = _mm256_setzero_ps();
  const auto lanes_of = [&](unsigned bits) {
    const __m256i spread = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(bits)), bit_of_lane);
    return _mm256_castsi256_ps(_mm256_cmpeq_epi32(spread, bit_of_lane));
  };
  WordEffect effect;
  for (unsigned row = 0; row < 64; row += 8) {
    const auto hits = static_cast<unsigned>(hit >> row & 0xFFU);
    const unsigned both = hits | static_cast<unsigned>(miss >> row & 0xFFU);
    if (both == 0) continue;
    const __m256 touched = lanes_of(both);
    const __m256 before = _mm256_loadu_ps(log_odds + row);
    const __m256 unknown = _mm256_cmp_ps(before, before, _CMP_UNORD_Q);
    const __m256 add = _mm256_blendv_ps(_mm256_set1_ps(rule.miss), _mm256_set1_ps(rule.hit), lanes_of(hits));
    const __m256 sum = _mm256_add_ps(_mm256_andnot_ps(unknown, before), add);
    const __m256 clamped = _mm256_min_ps(_mm256_max_ps(sum, lowest), highest);
    const __m256 settled =
        _mm256_or_ps(_mm256_and_ps(_mm256_cmp_ps(add, zero, _CMP_GE_OQ), _mm256_cmp_ps(before, highest, _CMP_GE_OQ)),
                     _mm256_and_ps(_mm256_cmp_ps(add, zero, _CMP_LE_OQ), _mm256_cmp_ps(before, lowest, _CMP_LE_OQ)));
    const __m256 after = _mm256_blendv_ps(before, clamped, _mm256_andnot_ps(settled, touched));
    _mm256_storeu_ps(log_odds + row, after);
    const auto put = [&](__m256 mask) { return static_cast<std::uint64_t>(bits_of(mask) & both) << row; };
    effect.stored |= put(_mm256_cmp_ps(after, before, _CMP_NEQ_UQ));
    effect.unknown_before |= put(unknown);
    effect.occupied_before |= put(_mm256_cmp_ps(before, threshold, _CMP_GE_OQ));
    effect.occupied_after |= put(_mm256_cmp_ps(after, threshold, _CMP_GE_OQ));
  }
  return effect;
}

}  // namespace

const ScanKernels& avx2_kernels() {
  static const ScanKernels kernels{transform, find_ends, prepare, walk, update, find_keys};
  return kernels;
}

}  // namespace stairwell::mapping::lanes

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
