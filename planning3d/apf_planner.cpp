#include "planning3d/apf_planner.hpp"

#include "core/units.hpp"
#include "planning3d/plan_ends.hpp"
#include "planning3d/shorten_path.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::planning3d {

namespace {

/// Distance to the nearest blocked voxel, trilinear between voxel centres.
double obstacle_distance_m(const FreeSpace& space, const Eigen::Vector3d& at_m) {
  const GridSpec& grid = space.grid();
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid.resolution_m());
  const VoxelIndex low = grid.index_of(at_m - half);
  const Eigen::Vector3d u = (at_m - grid.center_of(low)) / grid.resolution_m();
  double distance_m = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const VoxelIndex v = low + VoxelIndex{corner & 1, corner >> 1 & 1, corner >> 2 & 1};
    const double weight = ((corner & 1) != 0 ? u.x() : 1.0 - u.x()) * ((corner & 2) != 0 ? u.y() : 1.0 - u.y()) *
                          ((corner & 4) != 0 ? u.z() : 1.0 - u.z());
    distance_m +=
        weight * grid.resolution_m() * std::sqrt(static_cast<double>(space.blocked_distance().squared_cells(v)));
  }
  return distance_m;
}

std::vector<Eigen::Vector3d> directions(bool slice) {
  std::vector<Eigen::Vector3d> all;
  constexpr int kAzimuths = 24;
  for (const double elevation_deg : {0.0, -60.0, -30.0, 30.0, 60.0}) {
    if (slice && elevation_deg != 0.0) continue;
    for (int k = 0; k < kAzimuths; ++k) {
      const double azimuth = 2.0 * kPi * k / kAzimuths;
      const double elevation = rad_from_deg(elevation_deg);
      all.emplace_back(std::cos(azimuth) * std::cos(elevation), std::sin(azimuth) * std::cos(elevation),
                       std::sin(elevation));
    }
  }
  if (!slice) all.insert(all.end(), {Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ()});
  return all;
}

}  // namespace

double ApfPlanner::potential(const FreeSpace& space, const PlanRequest& request, const Eigen::Vector3d& at_m) const {
  const auto gauss = [this](double d) {
    if (d >= config_.influence_m) return 0.0;
    const double scale = config_.repulsion / (config_.sigma_m * std::sqrt(2.0 * kPi));
    return scale * std::exp(-0.5 * (d / config_.sigma_m) * (d / config_.sigma_m));
  };
  double u = config_.attraction * (at_m - request.goal_m).norm();
  u += gauss(std::max(0.0, obstacle_distance_m(space, at_m) - space.robot().clearance_m()));
  for (const KeepOut& sphere : request.keep_out) {
    u += gauss(std::max(0.0, (at_m - sphere.center_m).norm() - sphere.radius_m));
  }
  return u;
}

PlanResult ApfPlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  PlanResult result;
  const SegmentCheck check(space, request.keep_out, request.start_m);
  PlanEnds ends;
  result.status = find_ends(space, request, check, ends);
  if (result.status != PlanStatus::kReached) return result;
  const bool slice = request.rule.kind == MotionRule::Kind::kSlice;
  PlanRequest aimed = request;
  aimed.goal_m = ends.goal_m;
  std::vector<Eigen::Vector3d> path_m{request.start_m};
  if (ends.start_m != request.start_m) path_m.push_back(ends.start_m);
  const std::vector<Eigen::Vector3d> fixed = directions(slice);
  double here = potential(space, aimed, path_m.back());
  result.status = PlanStatus::kLocalMinimum;
  for (; result.expansions < request.max_expansions; ++result.expansions) {
    const Eigen::Vector3d at_m = path_m.back();
    Eigen::Vector3d towards_m = aimed.goal_m - at_m;
    const bool level = !slice || ends.start.z == ends.goal.z;
    if (level && towards_m.norm() <= config_.step_m && check.segment_free(at_m, aimed.goal_m)) {
      path_m.push_back(aimed.goal_m);
      result.status = PlanStatus::kReached;
      break;
    }
    if (slice) towards_m.z() = 0.0;
    double least = here - 1e-6;  // only ever downhill: no cycles
    Eigen::Vector3d best_m = at_m;
    const auto consider = [&](const Eigen::Vector3d& direction) {
      const Eigen::Vector3d to_m = at_m + config_.step_m * direction;
      const double there = potential(space, aimed, to_m);
      if (there >= least || !check.segment_free(at_m, to_m)) return;
      least = there;
      best_m = to_m;
    };
    if (towards_m.norm() > 1e-9) consider(towards_m.normalized());
    for (const Eigen::Vector3d& direction : fixed) consider(direction);
    if (best_m == at_m) break;
    here = least;
    path_m.push_back(best_m);
  }
  if (result.status != PlanStatus::kReached) {
    if (result.expansions >= request.max_expansions) result.status = PlanStatus::kTimedOut;
    return result;
  }
  result.length_m = path_length_m(path_m);
  result.path_m = std::move(path_m);
  return result;
}

}  // namespace stairwell::planning3d
