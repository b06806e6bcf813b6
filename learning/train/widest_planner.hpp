/// How much clearance there is to be had: no agent, a measure for them.
#pragma once

#include "mapping/distance_field.hpp"
#include "planning3d/planner.hpp"

#include <vector>

namespace stairwell::train {

/// Of the ways from voxel to voxel (8 moves in the plane, 26 in space) that whose narrowest place is the widest, and of
/// these the shortest: first the widest bottleneck (Pollack 1960), then Dijkstra over the voxels at least as wide.
class WidestPlanner final : public planning3d::Planner {
 public:
  /// @param plane  keeps to the layer of the start
  explicit WidestPlanner(bool plane) : plane_(plane) {}
  /// What is near; the space's own distances count the unknown as an obstacle. Has to outlive plan().
  void set_solid(const mapping::DistanceField& solid) { solid_ = &solid; }

  std::string_view name() const override { return "widest"; }
  /// @pre set_solid() was called
  planning3d::PlanResult plan(const planning3d::FreeSpace& space, const planning3d::PlanRequest& request) override;

 private:
  struct Search;

  bool plane_;
  const mapping::DistanceField* solid_ = nullptr;
};

}  // namespace stairwell::train
