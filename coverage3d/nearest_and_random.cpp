#include "coverage3d/nearest_and_random.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

namespace stairwell::coverage3d {

std::vector<VoxelIndex> nearest_and_random(const GridSpec& grid, const Eigen::Vector3d& from_m,
                                           const std::vector<VoxelIndex>& voxels, std::size_t kept, std::size_t count,
                                           Rng& rng) {
  const std::size_t n = voxels.size();
  std::vector<double> squared_m2(n);
  double most_m2 = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    squared_m2[i] = (grid.center_of(voxels[i]) - from_m).squaredNorm();
    most_m2 = std::max(most_m2, squared_m2[i]);
  }
  std::vector<std::uint32_t> place(n);  // in the sorted order
  std::iota(place.begin(), place.end(), 0U);
  for (std::size_t i = kept; i < count; ++i)
    std::swap(place[i], place[static_cast<std::size_t>(rng.uniform_int(static_cast<int>(i), static_cast<int>(n) - 1))]);

  const std::size_t buckets = n / 8 + 1;
  const double per_bucket = static_cast<double>(buckets - 1) / std::max(most_m2, 1e-12);
  const auto bucket_of = [&](std::size_t i) { return static_cast<std::size_t>(squared_m2[i] * per_bucket); };
  std::vector<std::uint32_t> begin(buckets + 1, 0);
  for (std::size_t i = 0; i < n; ++i) ++begin[bucket_of(i) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> order(n);
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t i = 0; i < n; ++i) order[next[bucket_of(i)]++] = static_cast<std::uint32_t>(i);
  std::vector<bool> sorted(buckets, false);
  std::vector<VoxelIndex> found;
  found.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t bucket = bucket_of(order[place[i]]);
    if (!sorted[bucket]) {
      std::sort(
          order.begin() + begin[bucket], order.begin() + begin[bucket + 1],
          [&](std::uint32_t a, std::uint32_t c) { return std::pair(squared_m2[a], a) < std::pair(squared_m2[c], c); });
      sorted[bucket] = true;
    }
    found.push_back(voxels[order[place[i]]]);
  }
  return found;
}

}  // namespace stairwell::coverage3d
