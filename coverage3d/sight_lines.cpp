#include "coverage3d/sight_lines.hpp"

#include "core/errors.hpp"
#include "coverage3d/sight_lines_kernel.hpp"
#include "coverage3d/voxel_walk.hpp"

#include <algorithm>
#include <string>

namespace stairwell::coverage3d {
namespace {

using mapping::OccupancyMap;
using mapping::Simd;

std::uint32_t follow_one(const OccupancyMap& map, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  std::uint32_t stop = SightLines::kNothing;
  walk_voxels(map.grid(), from_m, to_m, [&](const VoxelIndex& v) {
    const std::size_t index = map.grid().linear(v);
    if (map.at(index) == Occupancy::kFree && !map.ever_hit(index)) return true;
    stop = static_cast<std::uint32_t>(index);
    return false;
  });
  return stop;
}

}  // namespace

void SightLines::clear() {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    begin_[axis].clear();
    end_[axis].clear();
  }
}

void SightLines::add(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    begin_[axis].push_back(from_m[static_cast<Eigen::Index>(axis)]);
    end_[axis].push_back(to_m[static_cast<Eigen::Index>(axis)]);
  }
}

const std::vector<std::uint32_t>& SightLines::follow(const OccupancyMap& map, Simd simd) {
  if (!mapping::supported(simd)) {
    throw InputError(std::string("this processor has no ") + mapping::name_of(simd) + " instructions");
  }
  stops_.resize(size());
#if defined(__x86_64__)
  if (simd != Simd::kScalar && mapping::supported(Simd::kAvx2)) {
    const GridSpec& grid = map.grid();
    const std::int64_t row = grid.size()[0];
    const sight::Field field{
        map.summaries(), 1.0 / grid.resolution_m(), grid.first_cell(), {1, row, row * grid.size()[1]}};
    for (std::size_t first = 0; first < size(); first += sight::kMostLines) {
      const std::size_t count = std::min(sight::kMostLines, size() - first);
      sight::follow_avx2(field, {begin_, end_, first, count}, stops_.data() + first);
    }
    return stops_;
  }
#endif
  for (std::size_t i = 0; i < size(); ++i) {
    stops_[i] = follow_one(map, {begin_[0][i], begin_[1][i], begin_[2][i]}, {end_[0][i], end_[1][i], end_[2][i]});
  }
  return stops_;
}

}  // namespace stairwell::coverage3d
