#include "planning3d/storey_portals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::planning3d {

namespace {

constexpr double kAround_m = 1.5;
constexpr double kBeyond_m = 0.3;  // so far behind an opening's middle it has been passed for sure

struct Levels {
  int first;
  int last;
};

/// Traversable voxels of each level.
std::vector<int> traversable_counts(const FreeSpace& space) {
  std::vector<int> counts(static_cast<std::size_t>(space.grid().size()[2]), 0);
  const std::uint16_t* squared_cells = space.blocked_distance().data().data();
  for (int z = space.lo().z; z <= space.hi().z; ++z) {
    for (int y = space.lo().y; y <= space.hi().y; ++y) {
      const std::uint16_t* row = squared_cells + space.grid().linear({0, y, z});
      counts[static_cast<std::size_t>(z)] +=
          static_cast<int>(std::count_if(row + space.lo().x, row + space.hi().x + 1,
                                         [&](int squared) { return squared >= space.min_squared_cells(); }));
    }
  }
  return counts;
}

/// Runs of levels that are narrow beside what is below and above them.
std::vector<Levels> slab_levels(const std::vector<int>& counts, int around) {
  std::vector<Levels> slabs;
  const int size = static_cast<int>(counts.size());
  const auto most = [&](int from, int to) {
    return *std::max_element(counts.begin() + std::max(0, from), counts.begin() + std::min(size, to));
  };
  for (int z = 1; z + 1 < size; ++z) {
    const int beside = std::min(most(z - around, z), most(z + 1, z + 1 + around));
    if (2 * counts[static_cast<std::size_t>(z)] >= beside) continue;
    if (!slabs.empty() && slabs.back().last == z - 1) {
      slabs.back().last = z;
    } else {
      slabs.push_back({z, z});
    }
  }
  return slabs;
}

/// The traversable voxels of a level that hang together with this one; they are marked.
std::vector<VoxelIndex> gather(const FreeSpace& space, const VoxelIndex& first, std::vector<std::uint8_t>& marked) {
  const auto mark = [&](const VoxelIndex& v) {
    if (!space.traversable(v)) return false;
    const std::size_t at = space.grid().linear({v.x, v.y, 0});
    return std::exchange(marked[at], std::uint8_t{1}) == 0;
  };
  std::vector<VoxelIndex> found;
  if (mark(first)) found.push_back(first);
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (int side = 0; side < 9; ++side) {
      const VoxelIndex v = found[i] + VoxelIndex{side % 3 - 1, side / 3 - 1, 0};
      if (mark(v)) found.push_back(v);
    }
  }
  return found;
}

StoreyPortals::Portal portal_of(const GridSpec& grid, const std::vector<VoxelIndex>& voxels) {
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (const VoxelIndex& v : voxels) mean_m += grid.center_of(v) / static_cast<double>(voxels.size());
  const VoxelIndex middle =
      *std::ranges::min_element(voxels, {}, [&](const VoxelIndex& v) { return (grid.center_of(v) - mean_m).norm(); });
  return {grid.center_of(middle), static_cast<int>(voxels.size())};
}

}  // namespace

StoreyPortals::StoreyPortals(const FreeSpace& space) {
  const GridSpec& grid = space.grid();
  const int around = std::max(1, static_cast<int>(std::lround(kAround_m / grid.resolution_m())));
  for (const Levels& slab : slab_levels(traversable_counts(space), around)) {
    const int z = (slab.first + slab.last) / 2;
    std::vector<std::uint8_t> marked(grid.linear({0, 0, 1}), 0);
    std::vector<Portal> portals;
    for (int y = space.lo().y; y <= space.hi().y; ++y) {
      for (int x = space.lo().x; x <= space.hi().x; ++x) {
        const auto voxels = gather(space, {x, y, z}, marked);
        if (!voxels.empty()) portals.push_back(portal_of(grid, voxels));
      }
    }
    heights_m_.push_back(grid.center_of({0, 0, z}).z());
    portals_.push_back(std::move(portals));
  }
}

StoreyPortals::Heading StoreyPortals::towards(const Eigen::Vector3d& from_m, const Eigen::Vector3d& goal_m) const {
  const auto storey = [&](double height_m) {
    return std::ranges::count_if(heights_m_, [&](double h) { return h <= height_m; });
  };
  const auto here = storey(from_m.z()), there = storey(goal_m.z());
  const bool up = there > here;
  // From the goal back: what is left from each opening of the slab last looked at.
  std::vector<Heading> left{{goal_m, 0.0}};
  for (auto k = there; k != here; k += up ? -1 : 1) {
    const auto& portals = portals_[static_cast<std::size_t>(up ? k - 1 : k)];
    std::vector<Heading> nearer;
    for (const Portal& portal : portals) {
      const Eigen::Vector3d place_m = portal.center_m + Eigen::Vector3d(0.0, 0.0, up ? kBeyond_m : -kBeyond_m);
      double least_m = std::numeric_limits<double>::infinity();
      for (const Heading& next : left) least_m = std::min(least_m, (next.place_m - place_m).norm() + next.rest_m);
      nearer.push_back({place_m, least_m});
    }
    if (!nearer.empty()) left = std::move(nearer);
  }
  return *std::ranges::min_element(left, {}, [&](const Heading& h) { return (h.place_m - from_m).norm() + h.rest_m; });
}

}  // namespace stairwell::planning3d
