#include "coverage3d/gain_rays.hpp"

#include "mapping/simd.hpp"

#include <limits>
#include <stdexcept>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace stairwell::coverage3d::gain_rays {

bool usable(const mapping::OccupancyMap& map, const Aabb& box) {
  const GridSpec& grid = map.grid();
  return mapping::supported(mapping::Simd::kAvx2) && !box.empty() && grid.contains(box.min_m) &&
         grid.contains(box.max_m) &&
         grid.voxel_count() < static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
}

#if defined(__x86_64__)

#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2")
#endif

namespace {

/// One coordinate of four points: whether it lies in the box, and its voxel counted from the lattice's origin.
struct Along {
  __m256d inside;
  __m128i voxel;
};

__attribute__((always_inline)) inline Along along(double from_m, __m256d r_m,
                                                  const std::array<double, kLanes>& direction, double lo_m, double hi_m,
                                                  double per_m) {
  const __m256d point_m = _mm256_add_pd(_mm256_set1_pd(from_m), _mm256_mul_pd(r_m, _mm256_load_pd(direction.data())));
  const __m256d inside = _mm256_and_pd(_mm256_cmp_pd(point_m, _mm256_set1_pd(lo_m), _CMP_GE_OQ),
                                       _mm256_cmp_pd(point_m, _mm256_set1_pd(hi_m), _CMP_LE_OQ));
  return {inside, _mm256_cvttpd_epi32(_mm256_floor_pd(_mm256_mul_pd(point_m, _mm256_set1_pd(per_m))))};
}

}  // namespace

std::array<double, kLanes> sum(const mapping::OccupancyMap& map, const Aabb& box, const Eigen::Vector3d& from_m,
                               const Steps& steps, const Bundle& bundle) {
  constexpr int kRead = mapping::OccupancyMap::kClassBits | mapping::OccupancyMap::kHitBit;
  const GridSpec& grid = map.grid();
  const double per_m = 1.0 / grid.resolution_m();
  const auto& first = grid.first_cell();
  const __m128i nx = _mm_set1_epi32(grid.size()[0]);
  const __m128i ny = _mm_set1_epi32(grid.size()[1]);
  const __m128i first_x = _mm_set1_epi32(first[0]);
  const __m128i first_y = _mm_set1_epi32(first[1]);
  const __m128i first_z = _mm_set1_epi32(first[2]);
  const auto* const summaries = reinterpret_cast<const int*>(map.summaries());
  const __m256i most = _mm256_set1_epi64x(steps.most_unknown - 1);
  __m256d sums = _mm256_setzero_pd();
  for (const Bundle::Row& row : bundle.rows) {
    __m256i unknown_count = _mm256_setzero_si256();
    __m256i alive = _mm256_set1_epi64x(steps.most_unknown > 0 ? -1 : 0);
    for (std::size_t k = 0; k < steps.r_m.size() && _mm256_testz_si256(alive, alive) == 0; ++k) {
      const __m256d r_m = _mm256_set1_pd(steps.r_m[k]);
      const Along x = along(from_m.x(), r_m, row.x, box.min_m.x(), box.max_m.x(), per_m);
      const Along y = along(from_m.y(), r_m, row.y, box.min_m.y(), box.max_m.y(), per_m);
      const Along z = along(from_m.z(), r_m, row.z, box.min_m.z(), box.max_m.z(), per_m);
      const __m256i inside = _mm256_castpd_si256(_mm256_and_pd(_mm256_and_pd(x.inside, y.inside), z.inside));
      const __m128i in_column =
          _mm_add_epi32(_mm_mullo_epi32(_mm_sub_epi32(z.voxel, first_z), ny), _mm_sub_epi32(y.voxel, first_y));
      const __m128i index = _mm_add_epi32(_mm_mullo_epi32(in_column, nx), _mm_sub_epi32(x.voxel, first_x));
      // Lanes outside read the first voxel; those that are over go on reading, so that no look waits for the last.
      const __m256i cell = _mm256_and_si256(_mm256_cvtepi32_epi64(index), inside);
      const __m128i there = _mm256_i64gather_epi32(summaries, cell, 1);
      const __m128i is_unknown =
          _mm_cmpeq_epi32(_mm_and_si128(there, _mm_set1_epi32(mapping::OccupancyMap::kClassBits)), _mm_setzero_si128());
      const __m128i is_clear = _mm_cmpeq_epi32(_mm_and_si128(there, _mm_set1_epi32(kRead)),
                                               _mm_set1_epi32(static_cast<int>(Occupancy::kFree)));
      alive = _mm256_and_si256(alive, inside);
      const __m256i counts = _mm256_and_si256(_mm256_cvtepi32_epi64(is_unknown), alive);
      sums = _mm256_add_pd(sums, _mm256_and_pd(_mm256_set1_pd(steps.value_m3[k]), _mm256_castsi256_pd(counts)));
      unknown_count = _mm256_sub_epi64(unknown_count, counts);
      alive = _mm256_and_si256(alive, _mm256_cvtepi32_epi64(_mm_or_si128(is_unknown, is_clear)));
      alive = _mm256_andnot_si256(_mm256_cmpgt_epi64(unknown_count, most), alive);
    }
  }
  alignas(32) std::array<double, kLanes> result;
  _mm256_store_pd(result.data(), sums);
  return result;
}

#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif

#else

std::array<double, kLanes> sum(const mapping::OccupancyMap&, const Aabb&, const Eigen::Vector3d&, const Steps&,
                               const Bundle&) {
  throw std::logic_error("gain_rays::sum: not usable");
}

#endif

}  // namespace stairwell::coverage3d::gain_rays
