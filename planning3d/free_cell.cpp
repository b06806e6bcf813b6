#include "planning3d/free_cell.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

constexpr std::size_t kMostPlanes = 32;
constexpr double kRounding_m = 1e-9;

struct Surface {
  Eigen::Vector3d voxel_m;    ///< centre
  Eigen::Vector3d nearest_m;  ///< of the voxel's points
  double squared_m2;
};

/// Voxels in the midst of blocked ones can only be reached through others.
bool enclosed(const mapping::OccupancyMap& map, const VoxelIndex& v) {
  constexpr VoxelIndex kSides[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  return std::all_of(std::begin(kSides), std::end(kSides), [&](const VoxelIndex& s) { return map.blocked(v + s); });
}

std::vector<Surface> surfaces_within(const FreeSpace& space, const Eigen::Vector3d& center_m, double reach_m) {
  std::vector<Surface> found;
  const GridSpec& grid = space.grid();
  const double half_m = 0.5 * grid.resolution_m();
  const VoxelIndex from = grid.index_of(center_m - Eigen::Vector3d::Constant(reach_m));
  const VoxelIndex to = grid.index_of(center_m + Eigen::Vector3d::Constant(reach_m));
  for (int z = from.z; z <= to.z; ++z) {
    for (int y = from.y; y <= to.y; ++y) {
      for (int x = from.x; x <= to.x; ++x) {
        const VoxelIndex v{x, y, z};
        const int squared_cells = space.blocked_distance().squared_cells(v);
        if (squared_cells > 0) {  // nothing nearer than this in the row either
          x += static_cast<int>(std::sqrt(static_cast<double>(squared_cells))) - 1;
          continue;
        }
        const Eigen::Vector3d voxel_m = grid.center_of(v);
        const Eigen::Vector3d nearest_m =
            center_m.cwiseMax((voxel_m.array() - half_m).matrix()).cwiseMin((voxel_m.array() + half_m).matrix());
        const double squared_m2 = (nearest_m - center_m).squaredNorm();
        if (squared_m2 < reach_m * reach_m && !enclosed(space.map(), v)) {
          found.push_back({voxel_m, nearest_m, squared_m2});
        }
      }
    }
  }
  return found;
}

}  // namespace

FreeCell::FreeCell(const FreeSpace& space, const Eigen::Vector3d& center_m, double reach_m, double spare_m)
    : center_m_(center_m), reach_m_(reach_m) {
  const double radius_m = space.robot().radius_m + spare_m;
  add_flight_box(space.flight_box());
  if (space.surely_free(center_m, radius_m + reach_m)) return;
  std::vector<Surface> surfaces = surfaces_within(space, center_m, radius_m + reach_m);
  const double half_m = 0.5 * space.grid().resolution_m();
  const auto nearer = [](const Surface& a, const Surface& b) { return a.squared_m2 < b.squared_m2; };
  while (!surfaces.empty()) {
    const Surface nearest = *std::min_element(surfaces.begin(), surfaces.end(), nearer);
    if (planes_.size() >= kMostPlanes) {
      reach_m_ = std::min(reach_m_, std::max(0.0, std::sqrt(nearest.squared_m2) - radius_m));
      break;
    }
    const bool inside = nearest.squared_m2 < 1e-18;
    Eigen::Vector3d normal = (center_m - (inside ? nearest.voxel_m : nearest.nearest_m)).normalized();
    if (normal.squaredNorm() < 0.5) normal = Eigen::Vector3d::UnitZ();
    const double support_m = normal.dot(nearest.voxel_m) + half_m * normal.lpNorm<1>();
    planes_.push_back({normal, support_m + radius_m});
    std::erase_if(surfaces, [&](const Surface& s) {
      return normal.dot(s.voxel_m) + half_m * normal.lpNorm<1>() <= support_m + kRounding_m;
    });
  }
}

void FreeCell::add_flight_box(const Aabb& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    if (center_m_[axis] - box.min_m[axis] < reach_m_) planes_.push_back({unit, box.min_m[axis]});
    if (box.max_m[axis] - center_m_[axis] < reach_m_) planes_.push_back({-unit, -box.max_m[axis]});
  }
}

bool FreeCell::contains(const Eigen::Vector3d& point_m) const {
  if ((point_m - center_m_).norm() > reach_m_ + kRounding_m) return false;
  return std::all_of(planes_.begin(), planes_.end(), [&](const Plane& plane) {
    return plane.gap_m(point_m) >= std::min(0.0, plane.gap_m(center_m_)) - kRounding_m;
  });
}

}  // namespace stairwell::planning3d
