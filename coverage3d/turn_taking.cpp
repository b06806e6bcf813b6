/// Turn-taking (SPEC C7): each UAV decides knowing what the others are going to see.
#include "coverage3d/frontier_strategy.hpp"
#include "coverage3d/voxel_walk.hpp"

#include <algorithm>

namespace stairwell::coverage3d {
namespace {

constexpr double kForeseen = 0.7;       // a stop is left to others when they see this part of what it is for
constexpr double kLookEvery_m = 1.0;    // on a straight way
constexpr double kLeastFlight_s = 0.5;  // as of GreedyStrategy

bool open_between(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  return walk_voxels(map.grid(), from_m, to_m, [&](const VoxelIndex& v) { return map.at(v) == Occupancy::kFree; });
}

}  // namespace

void FrontierStrategy::foresee(const planning3d::FreeSpace& space, const Eigen::Vector3d& from_m, const Goal& goal,
                               Foreseen& foreseen) const {
  const ViewGain& gain = book_.sampler().gain();
  gain.foresee(space.map(), goal.position_m, goal.yaw_rad, foreseen);
  const Eigen::Vector3d offset_m = goal.position_m - from_m;
  if (!open_between(space.map(), from_m, goal.position_m)) return;
  for (double part_m = kLookEvery_m; part_m < offset_m.norm(); part_m += kLookEvery_m)
    gain.foresee(space.map(), goal.position_m - part_m * offset_m.normalized(), goal.yaw_rad, foreseen);
}

Foreseen FrontierStrategy::foreseen_by_others(const planning3d::FreeSpace& space,
                                              const AssignmentRequest& request) const {
  Foreseen foreseen(space.grid());
  const ViewGain& gain = book_.sampler().gain();
  for (const UavView& uav : request.uavs) {
    if (uav.wants_goal || !uav.goal) continue;
    gain.foresee(space.map(), uav.goal->position_m, uav.goal->yaw_rad, foreseen);
    for (const PlannedLook& look : uav.ahead) gain.foresee(space.map(), look.position_m, look.yaw_rad, foreseen);
  }
  return foreseen;
}

void FrontierStrategy::deduct(const planning3d::FreeSpace& space, const Foreseen& foreseen,
                              std::vector<Stop>& stops) const {
  const ViewGain& gain = book_.sampler().gain();
  for (Stop& stop : stops) {
    const Viewpoint& pose = stop.pose();
    stop.foreseen_m3 =
        std::max(0.0, pose.gain_m3 - gain.gain_m3(space.map(), pose.position_m, pose.yaw_rad, &foreseen));
  }
}

/// Without turns: a tour of each UAV's own over all that is open, as if nobody else flew. Only goals are never shared.
void FrontierStrategy::share_out_alone(const planning3d::FreeSpace& space, const AssignmentRequest& request,
                                       const Crew& crew, std::vector<Stop> stops, Assignment& assignment) {
  for (Stop& stop : stops) stop.view = 0;
  for (std::size_t k = 0; k < crew.uavs.size(); ++k) {
    if (!request.uavs[crew.uavs[k]].wants_goal) continue;
    const Crew alone{{crew.uavs[k]},    {crew.ways[k]},    {crew.start_m[k]}, {crew.velocity_mps[k]},
                     {crew.yaw_rad[k]}, {crew.ready_s[k]}, {crew.target_m[k]}};
    std::vector<Stop> mine = stops;
    choose_poses(request, alone, mine);
    mine = without_absorbed(space, alone, nearest_stops(request, alone, mine));
    const auto plan = tours(space, alone, mine, request.workers);
    if (plan[0].empty()) continue;
    const Stop& first = mine[plan[0][0]];
    const Stop* const next = plan[0].size() > 1 ? &mine[plan[0][1]] : nullptr;
    assignment.goals[crew.uavs[k]] = goal_for(space, alone, 0, first, next, request.time_s);
    std::erase_if(stops, [&](const Stop& stop) { return stop.cluster == first.cluster; });
  }
}

}  // namespace stairwell::coverage3d
