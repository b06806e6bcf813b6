#include "coverage3d/sight_lines_kernel.hpp"

#include <bit>
#include <cmath>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif

namespace stairwell::coverage3d::sight {
namespace {

/// Lines made ready: `walk_voxels` before its loop, axis by axis.
struct Batch {
  alignas(32) double next[3][kMostLines];
  alignas(32) double stride[3][kMostLines];
  alignas(32) std::int64_t left[3][kMostLines];  ///< borders still to be crossed
  alignas(32) std::int64_t hop[3][kMostLines];
  alignas(32) std::int64_t cell[kMostLines];
  alignas(32) std::int64_t last[kMostLines];
};

/// GridSpec's own rounding.
inline int lattice(double scaled) {
  const int truncated = static_cast<int>(scaled);
  return truncated - (scaled < static_cast<double>(truncated) ? 1 : 0);
}

void prepare(const Field& field, const Lines& lines, Batch& batch) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < lines.count; ++i) batch.cell[i] = batch.last[i] = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* const begin_m = lines.begin[axis].data() + lines.first;
    const double* const end_m = lines.end[axis].data() + lines.first;
    const int first_cell = field.first_cell[axis];
    for (std::size_t i = 0; i < lines.count; ++i) {
      const double from = begin_m[i] * field.per_m;
      const int cell = lattice(from) - first_cell;
      const int last = lattice(end_m[i] * field.per_m) - first_cell;
      const double offset = from - (cell + first_cell);
      const double stride = 1.0 / std::fabs((end_m[i] - begin_m[i]) * field.per_m);
      const bool still = cell == last;
      batch.stride[axis][i] = still ? kNever : stride;
      batch.next[axis][i] = still ? kNever : (last > cell ? 1.0 - offset : offset) * stride;
      batch.left[axis][i] = last > cell ? last - cell : cell - last;
      batch.hop[axis][i] = last > cell ? field.hop[axis] : -field.hop[axis];
      batch.cell[i] += field.hop[axis] * cell;
      batch.last[i] += field.hop[axis] * last;
    }
  }
}

constexpr std::size_t kLanes = 4;

/// Four lines, and where they are in the batch.
struct Group {
  __m256d next[3];
  __m256d stride[3];
  __m256i left[3];
  __m256i hop[3];
  __m256i cell;
  __m256i last;
  std::size_t line[kLanes];
  unsigned busy = 0;  ///< a bit for each lane that has a line
};

/// Not through memory: a vector cannot be loaded for a while after one of its numbers was stored.
__attribute__((always_inline)) inline void set_lane(__m256d& vector, __m256d lane, double value) {
  vector = _mm256_blendv_pd(vector, _mm256_set1_pd(value), lane);
}
__attribute__((always_inline)) inline void set_lane(__m256i& vector, __m256d lane, std::int64_t value) {
  const __m256d values = _mm256_castsi256_pd(_mm256_set1_epi64x(value));
  vector = _mm256_castpd_si256(_mm256_blendv_pd(_mm256_castsi256_pd(vector), values, lane));
}

/// Gives the next line of the batch to each lane of `free`, as far as there are any.
inline void refill(Group& group, unsigned free, const Batch& batch, std::size_t count, std::size_t& next) {
  for (; free != 0; free &= free - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(free));
    const bool any = next < count;
    group.busy = (group.busy & ~(1U << lane)) | static_cast<unsigned>(any) << lane;
    if (!any) continue;
    const __m256i number = _mm256_set1_epi64x(static_cast<std::int64_t>(lane));
    const __m256d here = _mm256_castsi256_pd(_mm256_cmpeq_epi64(number, _mm256_setr_epi64x(0, 1, 2, 3)));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      set_lane(group.next[axis], here, batch.next[axis][next]);
      set_lane(group.stride[axis], here, batch.stride[axis][next]);
      set_lane(group.left[axis], here, batch.left[axis][next]);
      set_lane(group.hop[axis], here, batch.hop[axis][next]);
    }
    set_lane(group.cell, here, batch.cell[next]);
    set_lane(group.last, here, batch.last[next]);
    group.line[lane] = next++;
  }
}

struct Look {
  __m256i clear;  ///< lanes whose voxel can be looked through
  __m256i going;  ///< those of them that are not at their end
};

__attribute__((always_inline)) inline Look look(const Group& group, const std::uint8_t* summaries) {
  constexpr int kRead = mapping::OccupancyMap::kClassBits | mapping::OccupancyMap::kHitBit;
  const __m128i there = _mm256_i64gather_epi32(reinterpret_cast<const int*>(summaries), group.cell, 1);
  const __m128i read = _mm_and_si128(there, _mm_set1_epi32(kRead));
  const __m128i clear = _mm_cmpeq_epi32(read, _mm_set1_epi32(static_cast<int>(Occupancy::kFree)));
  Look now;
  now.clear = _mm256_cvtepi32_epi64(clear);
  now.going = _mm256_andnot_si256(_mm256_cmpeq_epi64(group.cell, group.last), now.clear);
  return now;
}

inline unsigned lanes_of(__m256i mask) { return static_cast<unsigned>(_mm256_movemask_pd(_mm256_castsi256_pd(mask))); }

/// Takes the going lanes across the nearest border; of equally near ones the one that `walk_voxels` takes.
__attribute__((always_inline)) inline void step(Group& group, __m256i going) {
  const __m256d x_first = _mm256_cmp_pd(group.next[0], group.next[1], _CMP_LT_OQ);
  const __m256d nearer = _mm256_blendv_pd(group.next[1], group.next[0], x_first);
  const __m256d z_first = _mm256_cmp_pd(group.next[2], nearer, _CMP_LT_OQ);
  const __m256d moving = _mm256_castsi256_pd(going);
  const __m256d not_z = _mm256_andnot_pd(z_first, moving);
  const __m256d along[3] = {_mm256_and_pd(x_first, not_z), _mm256_andnot_pd(x_first, not_z),
                            _mm256_and_pd(z_first, moving)};
  const __m256d never = _mm256_set1_pd(std::numeric_limits<double>::infinity());
  for (int axis = 0; axis < 3; ++axis) {
    const __m256i mask = _mm256_castpd_si256(along[axis]);
    group.cell = _mm256_add_epi64(group.cell, _mm256_and_si256(group.hop[axis], mask));
    group.left[axis] = _mm256_add_epi64(group.left[axis], mask);
    const __m256d farther = _mm256_add_pd(group.next[axis], _mm256_and_pd(group.stride[axis], along[axis]));
    const __m256d none_left = _mm256_castsi256_pd(_mm256_cmpeq_epi64(group.left[axis], _mm256_setzero_si256()));
    group.next[axis] = _mm256_blendv_pd(farther, never, none_left);
  }
}

/// Notes where the lanes that stopped are. @returns them
inline unsigned note(const Group& group, const Look& now, std::uint32_t* stops) {
  const unsigned stopped = group.busy & ~lanes_of(now.going);
  const unsigned clear = lanes_of(now.clear);
  alignas(32) std::int64_t cells[kLanes];
  _mm256_store_si256(reinterpret_cast<__m256i*>(cells), group.cell);
  for (unsigned rest = stopped; rest != 0; rest &= rest - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(rest));
    stops[group.line[lane]] =
        (clear >> lane & 1U) != 0 ? SightLines::kNothing : static_cast<std::uint32_t>(cells[lane]);
  }
  return stopped;
}

}  // namespace

/// Two groups, so that each has something to do while the other's look is under way.
void follow_avx2(const Field& field, const Lines& lines, std::uint32_t* stops) {
  constexpr int kEnough = 3;  // lanes of both that wait before they are served
  Batch batch;
  prepare(field, lines, batch);
  Group a{}, b{};
  std::size_t next = 0;
  refill(a, 0xF, batch, lines.count, next);
  refill(b, 0xF, batch, lines.count, next);
  while ((a.busy | b.busy) != 0) {
    const int busy = std::popcount(a.busy << kLanes | b.busy);
    const int fewest = next < lines.count ? busy - kEnough : busy - 1;
    Look at_a = look(a, field.summaries);
    Look at_b = look(b, field.summaries);
    while (std::popcount((lanes_of(at_a.going) & a.busy) << kLanes | (lanes_of(at_b.going) & b.busy)) > fewest) {
      step(a, at_a.going);
      step(b, at_b.going);
      at_a = look(a, field.summaries);
      at_b = look(b, field.summaries);
    }
    const unsigned stopped_a = note(a, at_a, stops);
    const unsigned stopped_b = note(b, at_b, stops);
    refill(a, stopped_a, batch, lines.count, next);
    refill(b, stopped_b, batch, lines.count, next);
  }
}

}  // namespace stairwell::coverage3d::sight

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#endif
