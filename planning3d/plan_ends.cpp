#include "planning3d/plan_ends.hpp"

namespace stairwell::planning3d {

PlanStatus find_ends(const FreeSpace& space, const PlanRequest& request, const SegmentCheck& check, PlanEnds& ends) {
  const GridSpec& grid = space.grid();
  if (!space.nearest_traversable(request.start_m, kSnap_m, ends.start)) return PlanStatus::kStartBlocked;
  if (!space.nearest_traversable(request.goal_m, kSnap_m, ends.goal)) return PlanStatus::kGoalBlocked;
  const auto place = [&](const Eigen::Vector3d& wanted_m, const VoxelIndex& v) {
    return grid.index_of(wanted_m) == v && check.fits(wanted_m) ? wanted_m : grid.center_of(v);
  };
  ends.start_m = place(request.start_m, ends.start);
  ends.goal_m = place(request.goal_m, ends.goal);
  if (!check.voxel_free(ends.goal) || !check.outside_keep_out(ends.goal_m)) return PlanStatus::kGoalBlocked;
  return PlanStatus::kReached;
}

}  // namespace stairwell::planning3d
