#include "planning3d/apf_planner.hpp"

#include "core/units.hpp"
#include "planning3d/connectivity.hpp"
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

/// Leaves out what lies between two points of a path that are a step apart: only where the descent went back.
std::vector<Eigen::Vector3d> without_loops(const std::vector<Eigen::Vector3d>& path_m, const SegmentCheck& check,
                                           double step_m, bool level_only) {
  std::vector<Eigen::Vector3d> kept;
  for (std::size_t i = 0; i < path_m.size(); ++i) {
    kept.push_back(path_m[i]);
    for (std::size_t j = path_m.size() - 1; j > i + 1; --j) {
      if ((path_m[j] - path_m[i]).norm() > step_m || (level_only && path_m[j].z() != path_m[i].z())) continue;
      if (!check.segment_free(path_m[i], path_m[j])) continue;
      i = j - 1;
      break;
    }
  }
  return kept;
}

}  // namespace

struct ApfPlanner::Descent {
  const FreeSpace& space;
  const PlanRequest& request;
  const SegmentCheck& check;
  const PlanEnds& ends;
  bool slice;
  std::vector<Eigen::Vector3d> directions;
  std::vector<Eigen::Vector3d> path_m;
  double here = 0.0;  ///< potential at its end

  VoxelIndex voxel() const { return space.grid().index_of(path_m.back()); }
};

double ApfPlanner::gauss(double distance_m) const {
  if (distance_m >= config_.influence_m) return 0.0;
  const double scale = config_.repulsion / (config_.sigma_m * std::sqrt(2.0 * kPi));
  return scale * std::exp(-0.5 * (distance_m / config_.sigma_m) * (distance_m / config_.sigma_m));
}

/// U_rep, of obstacles and keep-out spheres.
double ApfPlanner::hill(const Descent& descent, const Eigen::Vector3d& at_m, double obstacle_m) const {
  double u = gauss(std::max(0.0, obstacle_m - descent.space.robot().clearance_m()));
  for (const KeepOut& sphere : descent.request.keep_out) {
    u += gauss(std::max(0.0, (at_m - sphere.center_m).norm() - sphere.radius_m));
  }
  return u;
}

double ApfPlanner::potential(const Descent& descent, const Eigen::Vector3d& at_m) const {
  const bool cone = config_.attraction == Attraction::kCone;
  double u = cone ? config_.per_metre * (at_m - descent.ends.goal_m).norm() : geodesic_.value(at_m);
  u += hill(descent, at_m, obstacle_distance_m(descent.space, at_m));
  for (const mapping::PotentialBump& pot : pots_) {
    const double over_sigma = (at_m - pot.center_m).norm() / pot.sigma_m;
    if (over_sigma * pot.sigma_m >= pot.reach_m) continue;
    u += pot.gain / (pot.sigma_m * std::sqrt(2.0 * kPi)) * std::exp(-0.5 * over_sigma * over_sigma);
  }
  return u;
}

/// To the lowest place a step away. @return whether there is one lower than here
bool ApfPlanner::step(Descent& descent) const {
  const Eigen::Vector3d at_m = descent.path_m.back();
  double least = descent.here - 1e-6;  // only ever downhill: no cycles
  Eigen::Vector3d best_m = at_m;
  const auto consider = [&](const Eigen::Vector3d& direction) {
    const Eigen::Vector3d to_m = at_m + config_.step_m * direction;
    const double there = potential(descent, to_m);
    if (!(there < least) || !descent.check.segment_free(at_m, to_m)) return;
    least = there;
    best_m = to_m;
  };
  Eigen::Vector3d towards_m = descent.ends.goal_m - at_m;
  if (descent.slice) towards_m.z() = 0.0;
  if (towards_m.norm() > 1e-9) consider(towards_m.normalized());
  for (const Eigen::Vector3d& direction : descent.directions) consider(direction);
  if (best_m == at_m) return false;
  descent.here = least;
  descent.path_m.push_back(best_m);
  return true;
}

/// From voxel to voxel until lower than here. @return whether it came so far, or to the goal's voxel
bool ApfPlanner::follow_voxels(Descent& descent) const {
  const GridSpec& grid = descent.space.grid();
  const Eigen::Vector3d from_m = descent.path_m.back();
  std::optional<VoxelIndex> v = descent.voxel();
  if (!descent.check.segment_free(from_m, grid.center_of(*v))) return false;
  for (; v; v = geodesic_.next(*v)) {
    const Eigen::Vector3d at_m = grid.center_of(*v);
    if (at_m != from_m) descent.path_m.push_back(at_m);
    const double there = potential(descent, at_m);
    if (*v != descent.ends.goal && (there >= descent.here - 1e-6 || (descent.slice && !geodesic_.level(v->z))))
      continue;
    descent.here = there;
    return *v == descent.ends.goal || at_m != from_m;
  }
  return false;
}

/// Fills the minimum that the descent is caught in. @return whether there was a pot left
bool ApfPlanner::lay_pot(Descent& descent) {
  if (pots_.size() >= config_.most_pots) return false;
  pots_.push_back({descent.path_m.back(), config_.pot_gain, config_.pot_sigma_m, 4.0 * config_.pot_sigma_m});
  descent.here = potential(descent, descent.path_m.back());
  return true;
}

PlanStatus ApfPlanner::descend(Descent& descent, std::size_t& steps) {
  const PlanRequest& request = descent.request;
  const bool geodesic = config_.attraction == Attraction::kGeodesic;
  for (; steps < request.max_expansions; ++steps) {
    if (request.late()) return PlanStatus::kTimedOut;
    const VoxelIndex v = descent.voxel();
    const Eigen::Vector3d to_goal_m = descent.ends.goal_m - descent.path_m.back();
    const bool near = to_goal_m.norm() <= config_.step_m || (geodesic && v == descent.ends.goal);
    const bool level = !descent.slice || v.z == descent.ends.goal.z;
    if (near && level && descent.check.segment_free(descent.path_m.back(), descent.ends.goal_m)) {
      descent.path_m.push_back(descent.ends.goal_m);
      return PlanStatus::kReached;
    }
    const bool free = !geodesic || !descent.slice || geodesic_.level(v.z);  // else straight up or down to a layer
    if (free && step(descent)) continue;
    if (geodesic && follow_voxels(descent)) continue;
    if (!lay_pot(descent)) return PlanStatus::kLocalMinimum;
  }
  return PlanStatus::kTimedOut;
}

PlanResult ApfPlanner::plan(const FreeSpace& space, const PlanRequest& request) {
  PlanResult result;
  const GivingUp giving_up(space, request);
  pots_.clear();
  const SegmentCheck check(space, request.keep_out, request.start_m);
  PlanEnds ends;
  result.status = find_ends(space, request, check, ends);
  if (result.status != PlanStatus::kReached) return result;
  const bool slice = request.rule.kind == MotionRule::Kind::kSlice;
  Descent descent{space, request, check, ends, slice, directions(slice), {request.start_m}};
  if (ends.start_m != request.start_m) descent.path_m.push_back(ends.start_m);
  if (config_.attraction == Attraction::kGeodesic) {
    const auto rise = [&](const VoxelIndex& v) {
      return hill(descent, space.grid().center_of(v), space.blocked_distance().distance_m(v));
    };
    result.status = geodesic_.compute(space, request, check, {ends.goal, ends.start, config_.per_metre, rise});
    result.expansions = geodesic_.expansions();
    result.status = giving_up.status(result.status, ends.start, ends.goal);
    if (result.status != PlanStatus::kReached) return result;
  }
  descent.here = potential(descent, descent.path_m.back());
  std::size_t steps = 0;
  result.status = giving_up.status(descend(descent, steps), ends.start, ends.goal);
  result.expansions += steps;
  if (result.status != PlanStatus::kReached) return result;
  result.path_m =
      pots_.empty() ? std::move(descent.path_m) : without_loops(descent.path_m, check, 2.0 * config_.step_m, slice);
  result.length_m = path_length_m(result.path_m);
  return result;
}

}  // namespace stairwell::planning3d
