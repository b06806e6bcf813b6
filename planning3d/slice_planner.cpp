#include "planning3d/slice_planner.hpp"

#include "planning3d/connectivity.hpp"
#include "planning3d/plan_ends.hpp"
#include "planning3d/shorten_path.hpp"

#include <cmath>

namespace stairwell::planning3d {

namespace {

void append(std::vector<Eigen::Vector3d>& path_m, const Eigen::Vector3d& point_m) {
  if (path_m.empty() || (path_m.back() - point_m).norm() > 1e-9) path_m.push_back(point_m);
}

}  // namespace

MotionRule SlicePlanner::rule_for(const FreeSpace& space, const PlanRequest& request) const {
  if (request.rule.kind == MotionRule::Kind::kSlice) return request.rule;
  std::vector<double> layers_m{request.start_m.z(), request.goal_m.z()};
  const Aabb box = space.flight_box().intersection(space.grid().box());
  const int count = static_cast<int>(std::floor(box.size_m().z() / config_.spacing_m));
  for (int k = 0; k < count; ++k) layers_m.push_back(box.min_m.z() + (k + 0.5) * config_.spacing_m);
  return MotionRule::slice(std::move(layers_m));
}

PlanResult SlicePlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  PlanResult result;
  const GivingUp giving_up(space, request);
  const SegmentCheck check(space, request.keep_out, request.start_m);
  PlanEnds ends;
  result.status = find_ends(space, request, check, ends);
  if (result.status != PlanStatus::kReached) return result;
  PlanRequest aimed = request;
  aimed.goal_m = ends.goal_m;
  PlanRequest levelled = request;  // where an end was led in, its layer is that of the voxel
  levelled.start_m = ends.start_m;
  levelled.goal_m = ends.goal_m;
  const LayerGraph graph(space, check, rule_for(space, levelled), ends.start, ends.goal);
  const LayerGraph::Route route = graph.route(request);
  result.expansions = route.expansions;
  result.status = giving_up.status(route.status, ends.start, ends.goal);
  if (result.status != PlanStatus::kReached) return result;
  append(result.path_m, request.start_m);
  result.status = plan_layers(space, aimed, route, result);
  if (result.status != PlanStatus::kReached) {
    result.path_m.clear();
    return result;
  }
  append(result.path_m, aimed.goal_m);
  if (result.path_m.size() == 1) result.path_m.push_back(result.path_m.front());
  result.length_m = path_length_m(result.path_m);
  return result;
}

/// Up and down as the route says, and what the inner planner makes of each layer.
PlanStatus SlicePlanner::plan_layers(const FreeSpace& space, const PlanRequest& request, const LayerGraph::Route& route,
                                     PlanResult& result) {
  const GridSpec& grid = space.grid();
  for (std::size_t i = 0; i < route.legs.size(); ++i) {
    const LayerGraph::Leg& leg = route.legs[i];
    if (!leg.level() || leg.from == leg.to) {
      append(result.path_m, grid.center_of(leg.from));
      append(result.path_m, grid.center_of(leg.to));
      continue;
    }
    PlanRequest part = request;
    if (i > 0) part.start_m = grid.center_of(leg.from);
    if (i + 1 < route.legs.size()) part.goal_m = grid.center_of(leg.to);
    part.rule = MotionRule::slice({grid.center_of(leg.from).z()});
    const PlanResult planned = inner_->plan(space, part);
    result.expansions += planned.expansions;
    if (planned.status != PlanStatus::kReached) return planned.status;
    for (const Eigen::Vector3d& point_m : planned.path_m) append(result.path_m, point_m);
  }
  return PlanStatus::kReached;
}

}  // namespace stairwell::planning3d
