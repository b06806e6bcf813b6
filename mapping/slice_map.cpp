#include "mapping/slice_map.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace stairwell::mapping {

SliceMap::SliceMap(const OccupancyMap& map, const HeightBand& band)
    : resolution_m_(map.grid().resolution_m()), size_{map.grid().size()[0], map.grid().size()[1]} {
  const GridSpec& grid = map.grid();
  lowest_ = grid.size()[2];
  for (int z = 0; z < grid.size()[2]; ++z) {
    const double height_m = grid.center_of({0, 0, z}).z();
    if (height_m >= band.lo_m && height_m <= band.hi_m) {
      lowest_ = std::min(lowest_, z);
      highest_ = z;
    }
  }
  if (highest_ < 0) {
    std::ostringstream message;
    message << "no voxel layer of the map lies between " << band.lo_m << " and " << band.hi_m << " m";
    throw InputError(message.str());
  }
  cells_.assign(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]), Occupancy::kUnknown);
  inflated_.assign(cells_.size(), 0);
  VoxelIndex v;
  for (v.z = lowest_; v.z <= highest_; ++v.z) {
    for (v.y = 0; v.y < size_[1]; ++v.y) {
      for (v.x = 0; v.x < size_[0]; ++v.x) {
        Occupancy& cell = cells_[index(v.x, v.y)];
        const Occupancy found = map.at(v);
        if (found == Occupancy::kOccupied || (found == Occupancy::kFree && cell == Occupancy::kUnknown)) {
          cell = found;
        }
      }
    }
  }
}

void SliceMap::inflate(double radius_m) {
  const double radius = radius_m / resolution_m_;
  const int reach = std::max(0, static_cast<int>(std::ceil(radius + 0.5)));
  std::vector<std::array<int, 2>> disc{{0, 0}};
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      if (std::hypot(std::max(std::abs(dx) - 0.5, 0.0), std::max(std::abs(dy) - 0.5, 0.0)) < radius * (1.0 - 1e-9)) {
        disc.push_back({dx, dy});
      }
    }
  }
  std::fill(inflated_.begin(), inflated_.end(), std::uint8_t{0});
  for (int y = 0; y < size_[1]; ++y) {
    for (int x = 0; x < size_[0]; ++x) {
      if (cells_[index(x, y)] != Occupancy::kOccupied) {
        continue;
      }
      for (const auto& [dx, dy] : disc) {
        if (contains(x + dx, y + dy)) {
          inflated_[index(x + dx, y + dy)] = 1;
        }
      }
    }
  }
}

std::size_t clear_stale(OccupancyMap& map, const Aabb& region, double keep_probability) {
  const GridSpec& grid = map.grid();
  const Aabb box = region.intersection(grid.box());
  if (box.empty()) {
    return 0;
  }
  const double keep_log_odds = std::log(keep_probability / (1.0 - keep_probability));
  const VoxelIndex lo = grid.index_of(box.min_m);
  const VoxelIndex hi = grid.index_of(box.max_m);
  std::size_t cleared = 0;
  VoxelIndex v;
  for (v.z = lo.z; v.z <= hi.z; ++v.z) {
    for (v.y = lo.y; v.y <= hi.y; ++v.y) {
      for (v.x = lo.x; v.x <= hi.x; ++v.x) {
        if (map.at(v) == Occupancy::kOccupied && static_cast<double>(map.log_odds(v)) < keep_log_odds &&
            region.contains(grid.center_of(v))) {
          map.set_log_odds(v, std::numeric_limits<float>::quiet_NaN());
          ++cleared;
        }
      }
    }
  }
  return cleared;
}

}  // namespace stairwell::mapping
