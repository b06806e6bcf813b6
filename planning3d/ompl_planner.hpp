#pragma once

#include "planning3d/planner.hpp"

#include <string_view>
#include <vector>

namespace stairwell::planning3d {

/// The sampling planners of OMPL. Looks for the shortest path (`clearance_weight` is not used), then shortens it; every
/// segment of an answer has been checked by exact voxel traversal (SegmentCheck) after the last change to the path.
///
/// Slice rule: start and goal are led straight up or down to one layer (the nearest that both reach so) and the path
/// between is planned in that layer's plane. Where there is none the answer is kNoPath: layers are not changed on the
/// way, that is left to the searches on the grid.
///
/// Statuses: kNoPath only where it is certain (start or goal lies in a small closed pocket, which is looked for first,
/// or they are apart, which is found out when `max_checks` or `deadline_s` has been used up: see GivingUp); otherwise a
/// goal that was not found is kTimedOut.
///
/// Repeatable: the same request on the same map gives the same path while only `max_checks` limits it and no other
/// thread uses OMPL's random numbers at the time. Not with a deadline that is met. Neither starts a thread. OMPL's
/// own messages are turned off for the whole program by the first call.
class OmplPlanner final : public Planner {
 public:
  enum class Algorithm { kRrtConnect, kRrtStar, kInformedRrtStar, kBitStar, kAbitStar, kPrmStar };
  /// Settings of OMPL's planners.
  struct Config {
    bool shorten = true;
    std::size_t flood_voxels = 40'000;  ///< closed pockets up to this size are seen at once; 0: nothing is proved
  };
  explicit OmplPlanner(Algorithm algorithm) : algorithm_(algorithm) {}
  OmplPlanner(Algorithm algorithm, const Config& config) : algorithm_(algorithm), config_(config) {}

  std::string_view name() const override;
  PlanResult plan(const FreeSpace& space, const PlanRequest& request) override;

  /// Names for make_planner: rrtconnect, rrtstar, informed_rrtstar, bitstar, abitstar, prmstar.
  static std::vector<std::string_view> names();
  /// Null for other names.
  static std::unique_ptr<OmplPlanner> make(std::string_view name);

 private:
  Algorithm algorithm_;
  Config config_{};
};

}  // namespace stairwell::planning3d
