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

/// Hands the next rays of the batch to the lanes of `free`; lanes that get none mark the spare cell for ever.
inline void refill(Lanes& lanes, __mmask16 free, const RayBatch& batch, std::size_t count, std::size_t& next,
                   const WindowView& window) {
  for (int axis = 0; axis < 3; ++axis) {
    lanes.t[axis] = _mm512_mask_expandloadu_epi32(lanes.t[axis], free, batch.t[axis].data() + next);
    lanes.delta[axis] = _mm512_mask_expandloadu_epi32(lanes.delta[axis], free, batch.delta[axis].data() + next);
    lanes.stride[axis] = _mm512_mask_expandloadu_epi32(lanes.stride[axis], free, batch.stride[axis].data() + next);
  }
  lanes.end = _mm512_mask_expandloadu_epi32(lanes.end, free, batch.end.data() + next);
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

void walk(const RayBatch& batch, std::size_t count, const WindowView& window, std::int32_t tolerance,
          std::vector<std::uint32_t>& uncertain) {
  constexpr int kEnough = 4;  // lanes that wait before they are served
  std::uint8_t* const cells = window.cells;
  const __m512i reach = _mm512_set1_epi32(tolerance);
  const __m512i length = _mm512_set1_epi32(kLength);
  const __m512i spare = _mm512_set1_epi32(window.spare_cell);
  Lanes lanes{};
  lanes.ray = _mm512_set1_epi32(static_cast<int>(count));
  std::size_t next = 0;
  refill(lanes, 0xFFFF, batch, count, next, window);
  alignas(64) std::int32_t marked[16];
  std::size_t left = count;  // rays not finished
  while (left > 0) {
    const int enough = next < count ? kEnough : 1;
    __mmask16 going = 0;
    for (;;) {
      const __m512i xy = _mm512_min_epi32(lanes.t[0], lanes.t[1]);
      const __m512i nearest = _mm512_min_epi32(xy, lanes.t[2]);
      const __m512i second =
          _mm512_max_epi32(xy, _mm512_min_epi32(_mm512_max_epi32(lanes.t[0], lanes.t[1]), lanes.t[2]));
      const __m512i as_near = _mm512_add_epi32(nearest, reach);
      going = _mm512_cmpgt_epi32_mask(second, as_near) & _mm512_cmple_epi32_mask(as_near, length) &
              _mm512_cmpneq_epi32_mask(lanes.cell, lanes.end);
      if (std::popcount(static_cast<unsigned>(going)) > 16 - enough) [[likely]] {
        _mm512_store_si512(marked, _mm512_mask_mov_epi32(spare, going, lanes.cell));
        for (const std::int32_t cell : marked) cells[cell] = ScanWindow::kMiss;
        const __mmask16 along_x = _mm512_cmple_epi32_mask(lanes.t[0], as_near) & going;
        const __mmask16 along_y = _mm512_cmple_epi32_mask(lanes.t[1], as_near) & going;
        const __mmask16 along_z = _mm512_cmple_epi32_mask(lanes.t[2], as_near) & going;
        lanes.t[0] = _mm512_mask_add_epi32(lanes.t[0], along_x, lanes.t[0], lanes.delta[0]);
        lanes.t[1] = _mm512_mask_add_epi32(lanes.t[1], along_y, lanes.t[1], lanes.delta[1]);
        lanes.t[2] = _mm512_mask_add_epi32(lanes.t[2], along_z, lanes.t[2], lanes.delta[2]);
        lanes.cell = _mm512_mask_add_epi32(lanes.cell, along_x, lanes.cell, lanes.stride[0]);
        lanes.cell = _mm512_mask_add_epi32(lanes.cell, along_y, lanes.cell, lanes.stride[1]);
        lanes.cell = _mm512_mask_add_epi32(lanes.cell, along_z, lanes.cell, lanes.stride[2]);
        continue;
      }
      break;
    }
    const auto stopped = static_cast<__mmask16>(~going);
    left -= static_cast<std::size_t>(std::popcount(static_cast<unsigned>(stopped)));
    const __mmask16 unsure = _mm512_mask_cmpneq_epi32_mask(stopped, lanes.cell, lanes.end);
    if (unsure != 0) {
      _mm512_store_si512(marked, lanes.ray);
      for (unsigned bits = unsure; bits != 0; bits &= bits - 1) {
        uncertain.push_back(static_cast<std::uint32_t>(marked[std::countr_zero(bits)]));
      }
    }
    refill(lanes, stopped, batch, count, next, window);
  }
}

}  // namespace

const WalkKernels& avx512_kernels() {
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
