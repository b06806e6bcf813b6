#include "mapping/lane_walk.hpp"

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx512f,avx512dq,avx512bw,avx512vl"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx512f,avx512dq,avx512bw,avx512vl,prefer-vector-width=512")
#endif

namespace stairwell::mapping::lanes {

namespace {

#include "mapping/lane_walk_kernels.hpp"

/// Sixteen rays.
struct Lanes {
  __m512i t[3];
  __m512i delta[3];
  __m512i stride[3];
  __m512i cell;
  __m512i end;
  __m512i ray;
};

/// The first values go to the lanes of `free`, in order. Loading all sixteen (the columns are padded) and spreading
/// them in the register is quicker than a masked load.
inline __m512i dealt(__m512i lanes, __mmask16 free, const std::int32_t* values) {
  return _mm512_mask_expand_epi32(lanes, free, _mm512_loadu_si512(values));
}

/// Hands the next rays of the batch to the lanes of `free`; lanes that get none mark the spare cell for ever.
inline void refill(Lanes& lanes, __mmask16 free, const RayBatch& batch, std::size_t count, std::size_t& next,
                   const WindowView& window) {
  for (int axis = 0; axis < 3; ++axis) {
    lanes.t[axis] = dealt(lanes.t[axis], free, batch.t[axis].data() + next);
    lanes.delta[axis] = dealt(lanes.delta[axis], free, batch.delta[axis].data() + next);
    lanes.stride[axis] = dealt(lanes.stride[axis], free, batch.stride[axis].data() + next);
  }
  lanes.end = dealt(lanes.end, free, batch.end.data() + next);
  lanes.cell = _mm512_mask_mov_epi32(lanes.cell, free, _mm512_set1_epi32(window.origin_cell));
  const __m512i numbers = _mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(next)),
                                           _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
  lanes.ray = _mm512_mask_expand_epi32(lanes.ray, free, numbers);
  next += static_cast<std::size_t>(std::popcount(static_cast<unsigned>(free)));
  if (next <= count) return;
  const __mmask16 idle = _mm512_mask_cmpge_epi32_mask(free, lanes.ray, _mm512_set1_epi32(static_cast<int>(count)));
  for (int axis = 0; axis < 3; ++axis) {
    lanes.t[axis] = _mm512_mask_mov_epi32(lanes.t[axis], idle, _mm512_set1_epi32(axis == 0 ? 0 : kFar));
    lanes.delta[axis] = _mm512_mask_mov_epi32(lanes.delta[axis], idle, _mm512_setzero_si512());
    lanes.stride[axis] = _mm512_mask_mov_epi32(lanes.stride[axis], idle, _mm512_setzero_si512());
  }
  lanes.cell = _mm512_mask_mov_epi32(lanes.cell, idle, _mm512_set1_epi32(window.spare_cell));
  lanes.end = _mm512_mask_mov_epi32(lanes.end, idle, _mm512_set1_epi32(-1));
  next = count;
}

/// What one group of lanes is about to do.
struct Look {
  __m512i as_near;
  __mmask16 going;
};

struct Constants {
  __m512i tolerance;
  __m512i length;
  __m512i spare;
};

__attribute__((always_inline)) inline Look look(const Lanes& lanes, const Constants& constants) {
  const __m512i xy = _mm512_min_epi32(lanes.t[0], lanes.t[1]);
  const __m512i nearest = _mm512_min_epi32(xy, lanes.t[2]);
  const __m512i second = _mm512_max_epi32(xy, _mm512_min_epi32(_mm512_max_epi32(lanes.t[0], lanes.t[1]), lanes.t[2]));
  const __m512i as_near = _mm512_add_epi32(nearest, constants.tolerance);
  const auto going = static_cast<__mmask16>(_mm512_cmpgt_epi32_mask(second, as_near) &
                                            _mm512_cmple_epi32_mask(as_near, constants.length) &
                                            _mm512_cmpneq_epi32_mask(lanes.cell, lanes.end));
  return {as_near, going};
}

/// Marks where the going lanes are and takes them one voxel on.
__attribute__((always_inline)) inline void step(Lanes& lanes, const Look& now, const Constants& constants,
                                                std::uint8_t* cells) {
  alignas(64) std::uint32_t marked[16];
  _mm512_store_si512(marked, _mm512_mask_mov_epi32(constants.spare, now.going, lanes.cell));
  __asm__ volatile("" : "+m"(marked));  // through memory: taking the lanes apart in registers is slower
  for (const std::uint32_t cell : marked) cells[cell] = ScanWindow::kMiss;
  const __mmask16 along_x = _mm512_mask_cmple_epi32_mask(now.going, lanes.t[0], now.as_near);
  const __mmask16 along_y = _mm512_mask_cmple_epi32_mask(now.going, lanes.t[1], now.as_near);
  const __mmask16 along_z = _mm512_mask_cmple_epi32_mask(now.going, lanes.t[2], now.as_near);
  lanes.t[0] = _mm512_mask_add_epi32(lanes.t[0], along_x, lanes.t[0], lanes.delta[0]);
  lanes.t[1] = _mm512_mask_add_epi32(lanes.t[1], along_y, lanes.t[1], lanes.delta[1]);
  lanes.t[2] = _mm512_mask_add_epi32(lanes.t[2], along_z, lanes.t[2], lanes.delta[2]);
  lanes.cell = _mm512_mask_add_epi32(lanes.cell, along_x, lanes.cell, lanes.stride[0]);
  lanes.cell = _mm512_mask_add_epi32(lanes.cell, along_y, lanes.cell, lanes.stride[1]);
  lanes.cell = _mm512_mask_add_epi32(lanes.cell, along_z, lanes.cell, lanes.stride[2]);
}

/// Notes the rays that stopped without having reached their end voxel. @return lanes stopped
inline std::size_t note(const Lanes& lanes, __mmask16 stopped, std::vector<std::uint32_t>& uncertain) {
  const __mmask16 unsure = _mm512_mask_cmpneq_epi32_mask(stopped, lanes.cell, lanes.end);
  if (unsure != 0) {
    alignas(64) std::uint32_t rays[16];
    _mm512_store_si512(rays, lanes.ray);
    for (unsigned bits = unsure; bits != 0; bits &= bits - 1) uncertain.push_back(rays[std::countr_zero(bits)]);
  }
  return static_cast<std::size_t>(std::popcount(static_cast<unsigned>(stopped)));
}

/// Two groups, so that each has something to do while the other's comparisons are under way.
void walk(const RayBatch& batch, std::size_t count, const WindowView& window, std::int32_t tolerance,
          std::vector<std::uint32_t>& uncertain) {
  constexpr int kEnough = 6;  // lanes of both that wait before they are served
  const Constants constants{_mm512_set1_epi32(tolerance), _mm512_set1_epi32(kLength),
                            _mm512_set1_epi32(window.spare_cell)};
  Lanes a{}, b{};
  a.ray = b.ray = _mm512_set1_epi32(static_cast<int>(count));
  std::size_t next = 0;
  refill(a, 0xFFFF, batch, count, next, window);
  refill(b, 0xFFFF, batch, count, next, window);
  std::size_t left = count;  // rays not finished
  while (left > 0) {
    const int enough = next < count ? kEnough : 1;
    Look at_a = look(a, constants);
    Look at_b = look(b, constants);
    while (std::popcount(static_cast<unsigned>(at_a.going) << 16 | at_b.going) > 32 - enough) {
      step(a, at_a, constants, window.cells);
      step(b, at_b, constants, window.cells);
      at_a = look(a, constants);
      at_b = look(b, constants);
    }
    const auto stopped_a = static_cast<__mmask16>(~at_a.going);
    const auto stopped_b = static_cast<__mmask16>(~at_b.going);
    left -= note(a, stopped_a, uncertain) + note(b, stopped_b, uncertain);
    refill(a, stopped_a, batch, count, next, window);
    refill(b, stopped_b, batch, count, next, window);
  }
}

WordEffect update(float* log_odds, std::uint64_t miss, std::uint64_t hit, const UpdateRule& rule) {
  const __m512 lowest = _mm512_set1_ps(rule.lowest);
  const __m512 highest = _mm512_set1_ps(rule.highest);
  const __m512 threshold = _mm512_set1_ps(rule.threshold);
  const __m512 zero = _mm512_setzero_ps();
  WordEffect effect;
  for (unsigned row = 0; row < 64; row += 16) {
    const auto hits = static_cast<__mmask16>(hit >> row);
    const auto both = static_cast<__mmask16>(hits | static_cast<__mmask16>(miss >> row));
    if (both == 0) continue;
    const __m512 before = _mm512_loadu_ps(log_odds + row);
    const __mmask16 unknown = _mm512_mask_cmp_ps_mask(both, before, before, _CMP_UNORD_Q);
    const __m512 add = _mm512_mask_mov_ps(_mm512_set1_ps(rule.miss), hits, _mm512_set1_ps(rule.hit));
    const __m512 sum = _mm512_add_ps(_mm512_mask_mov_ps(before, unknown, zero), add);
    const __m512 clamped = _mm512_min_ps(_mm512_max_ps(sum, lowest), highest);
    const auto settled = static_cast<__mmask16>(
        (_mm512_cmp_ps_mask(add, zero, _CMP_GE_OQ) & _mm512_cmp_ps_mask(before, highest, _CMP_GE_OQ)) |
        (_mm512_cmp_ps_mask(add, zero, _CMP_LE_OQ) & _mm512_cmp_ps_mask(before, lowest, _CMP_LE_OQ)));
    const __m512 after = _mm512_mask_mov_ps(before, static_cast<__mmask16>(both & ~settled), clamped);
    _mm512_storeu_ps(log_odds + row, after);
    effect.stored |= static_cast<std::uint64_t>(_mm512_mask_cmp_ps_mask(both, after, before, _CMP_NEQ_UQ)) << row;
    effect.unknown_before |= static_cast<std::uint64_t>(unknown) << row;
    effect.occupied_before |= static_cast<std::uint64_t>(_mm512_mask_cmp_ps_mask(both, before, threshold, _CMP_GE_OQ))
                              << row;
    effect.occupied_after |= static_cast<std::uint64_t>(_mm512_mask_cmp_ps_mask(both, after, threshold, _CMP_GE_OQ))
                             << row;
  }
  return effect;
}

}  // namespace

const ScanKernels& avx512_kernels() {
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
