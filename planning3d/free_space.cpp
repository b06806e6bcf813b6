#include "planning3d/free_space.hpp"

#include "mapping/collision.hpp"
#include "mapping/convex_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr double kTouch_m = 1e-9;                       // rounding, so that a sphere may rest against a face
constexpr double kHalfDiagonal = 0.866025403784438647;  // of a unit voxel

bool all_finite(const Eigen::Vector3d& v) { return v.array().isFinite().all(); }

}  // namespace

FreeSpace::FreeSpace(const mapping::OccupancyMap& map, const mapping::DistanceField& blocked_distance,
                     const Robot& robot, const Aabb& flight_box, const mapping::OccupancyWords* blocked_words)
    : map_(&map), distance_(&blocked_distance), words_(blocked_words), robot_(robot), flight_box_(flight_box) {
  const GridSpec& grid = map.grid();
  min_squared_cells_ = mapping::min_squared_cells_for(robot.clearance_m(), grid.resolution_m());
  int lo[3];
  int hi[3];
  for (int axis = 0; axis < 3; ++axis) {
    const int first = grid.first_cell()[static_cast<std::size_t>(axis)];
    const int last = grid.size()[static_cast<std::size_t>(axis)] - 1;
    // Centre (first + v + 0.5) * res inside [min, max]; clamped before the cast so that huge boxes are fine.
    const double from = std::ceil(flight_box.min_m[axis] / grid.resolution_m() - 0.5 - 1e-9) - first;
    const double to = std::floor(flight_box.max_m[axis] / grid.resolution_m() - 0.5 + 1e-9) - first;
    lo[axis] = static_cast<int>(std::clamp(from, 0.0, last + 1.0));
    hi[axis] = static_cast<int>(std::clamp(to, -1.0, static_cast<double>(last)));
  }
  lo_ = {lo[0], lo[1], lo[2]};
  hi_ = {hi[0], hi[1], hi[2]};
}

bool FreeSpace::surely_free(const Eigen::Vector3d& center_m, double radius_m) const {
  if (!all_finite(center_m) || !grid().box().contains(center_m)) return false;
  const VoxelIndex v = grid().index_of(center_m);
  const double res_m = grid().resolution_m();
  const double between_centres_m = res_m * std::sqrt(static_cast<double>(distance_->squared_cells(v)));
  const double off_centre_m = (center_m - grid().center_of(v)).norm();
  return between_centres_m - kHalfDiagonal * res_m - off_centre_m >= radius_m;
}

bool FreeSpace::sphere_free(const Eigen::Vector3d& center_m, double radius_m) const {
  if (!all_finite(center_m) || !grid().box().contains(center_m)) return false;
  return surely_free(center_m, radius_m) || capsule_free(center_m, center_m, radius_m);
}

bool FreeSpace::swept_sphere_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m) const {
  if (!all_finite(from_m) || !all_finite(to_m)) return false;
  if (!grid().box().contains(from_m) || !grid().box().contains(to_m)) return false;
  if (surely_free(0.5 * (from_m + to_m), radius_m + 0.5 * (to_m - from_m).norm())) return true;
  return capsule_free(from_m, to_m, radius_m);
}

bool FreeSpace::capsule_free(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, double radius_m) const {
  const double reach_m = std::max(kTouch_m, radius_m - kTouch_m);
  if (words_ != nullptr) {
    const mapping::CollisionChecker checker(*words_, *distance_, mapping::SphereShape{reach_m});
    const Pose T_world_from(Eigen::Translation3d{from_m});
    if (from_m == to_m) return !checker.collides(T_world_from);
    return !checker.collides_between(T_world_from, Pose(Eigen::Translation3d{to_m}));
  }
  // The same without words: every voxel around it, in cells from the capsule's middle.
  const double per_m = 1.0 / grid().resolution_m();
  const Eigen::Vector3d middle_m = 0.5 * (from_m + to_m);
  const double length_m = (to_m - from_m).norm();
  const Eigen::Vector3d direction =
      length_m > 0.0 ? Eigen::Vector3d((to_m - from_m) / length_m) : Eigen::Vector3d::UnitX();
  const mapping::convex::Capsule capsule(reach_m * per_m, 0.5 * length_m * per_m, direction);
  const VoxelIndex from = grid().index_of(from_m.cwiseMin(to_m) - Eigen::Vector3d::Constant(reach_m));
  const VoxelIndex to = grid().index_of(from_m.cwiseMax(to_m) + Eigen::Vector3d::Constant(reach_m));
  for (int z = from.z; z <= to.z; ++z) {
    for (int y = from.y; y <= to.y; ++y) {
      for (int x = from.x; x <= to.x; ++x) {
        const VoxelIndex v{x, y, z};
        if (!map_->blocked(v)) continue;
        const Eigen::Vector3d at = (grid().center_of(v) - middle_m) * per_m;
        mapping::convex::CellBox box;
        for (std::size_t i = 0; i < 3; ++i) {
          box.lo[i] = at[static_cast<Eigen::Index>(i)] - 0.5;
          box.hi[i] = at[static_cast<Eigen::Index>(i)] + 0.5;
        }
        if (capsule.overlaps(box)) return false;
      }
    }
  }
  return true;
}

double FreeSpace::room_m(const Eigen::Vector3d& at_m) const {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid().resolution_m());
  const VoxelIndex low = grid().index_of(at_m - half);
  const Eigen::Vector3d u = (at_m - grid().center_of(low)) / grid().resolution_m();
  double cells = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const VoxelIndex v = low + VoxelIndex{corner & 1, corner >> 1 & 1, corner >> 2 & 1};
    const double weight = ((corner & 1) != 0 ? u.x() : 1.0 - u.x()) * ((corner & 2) != 0 ? u.y() : 1.0 - u.y()) *
                          ((corner & 4) != 0 ? u.z() : 1.0 - u.z());
    cells += weight * std::sqrt(static_cast<double>(distance_->squared_cells(v)));
  }
  return cells * grid().resolution_m() - robot_.clearance_m();
}

bool FreeSpace::nearest_traversable(const Eigen::Vector3d& point_m, double reach_m, VoxelIndex& found) const {
  if (!all_finite(point_m) || !(reach_m >= 0.0)) return false;
  const Eigen::Vector3d nearest_m = point_m.cwiseMax(grid().box().min_m).cwiseMin(grid().box().max_m);
  if ((nearest_m - point_m).norm() > reach_m) return false;
  const VoxelIndex at = grid().index_of(point_m);
  if (traversable(at)) {
    found = at;
    return true;
  }
  const int cells = static_cast<int>(std::ceil(reach_m / grid().resolution_m())) + 1;
  double best_m2 = reach_m * reach_m + 1e-12;
  bool any = false;
  for (int z = std::max(lo_.z, at.z - cells); z <= std::min(hi_.z, at.z + cells); ++z) {
    for (int y = std::max(lo_.y, at.y - cells); y <= std::min(hi_.y, at.y + cells); ++y) {
      for (int x = std::max(lo_.x, at.x - cells); x <= std::min(hi_.x, at.x + cells); ++x) {
        const VoxelIndex v{x, y, z};
        if (!traversable(v)) continue;
        const double squared_m2 = (grid().center_of(v) - point_m).squaredNorm();
        if (squared_m2 >= best_m2) continue;
        best_m2 = squared_m2;
        found = v;
        any = true;
      }
    }
  }
  return any;
}

}  // namespace stairwell::planning3d
