/// The nearest voxels and some by chance, against sorting them all.
#include "coverage3d/nearest_and_random.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <vector>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;

std::vector<VoxelIndex> by_sorting(const GridSpec& grid, const Eigen::Vector3d& from_m, std::vector<VoxelIndex> all,
                                   std::size_t kept, std::size_t count, Rng& rng) {
  std::stable_sort(all.begin(), all.end(), [&](const VoxelIndex& a, const VoxelIndex& b) {
    return (grid.center_of(a) - from_m).squaredNorm() < (grid.center_of(b) - from_m).squaredNorm();
  });
  for (std::size_t i = kept; i < count; ++i) {
    const int other = rng.uniform_int(static_cast<int>(i), static_cast<int>(all.size()) - 1);
    std::swap(all[i], all[static_cast<std::size_t>(other)]);
  }
  all.resize(count);
  return all;
}

TEST_CASE("the nearest voxels and some by chance are those of a full sort", "[nearest_and_random]") {
  const GridSpec grid(Aabb{{-3.0, -3.0, 0.0}, {3.0, 3.0, 3.0}}, 0.2);
  Rng chooser(17);
  for (const std::size_t n : {1U, 7U, 40U, 700U, 5000U}) {
    std::vector<VoxelIndex> voxels;
    for (std::size_t i = 0; i < n; ++i)
      voxels.push_back({chooser.uniform_int(0, 29), chooser.uniform_int(0, 29), chooser.uniform_int(0, 14)});
    for (const Eigen::Vector3d& from_m : {Eigen::Vector3d(0.1, -0.3, 1.1), grid.center_of(voxels.front())}) {
      const std::size_t count = std::min<std::size_t>(n, 400);
      Rng a(3), b(3);
      CAPTURE(n);
      CHECK(nearest_and_random(grid, from_m, voxels, count / 2, count, a) ==
            by_sorting(grid, from_m, voxels, count / 2, count, b));
    }
  }
  const std::vector<VoxelIndex> same(5, VoxelIndex{1, 1, 1});
  Rng rng(1);
  CHECK(nearest_and_random(grid, grid.center_of({1, 1, 1}), same, 2, 4, rng).size() == 4);
}

}  // namespace
