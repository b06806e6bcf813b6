#include "planning3d/right_of_way.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stairwell::planning3d {

namespace {

constexpr double kStep_m = 0.1;
constexpr double kMerge_m = 0.6;     // narrow places nearer to each other are one section
constexpr double kWait_m = 1.2;      // waiting place, before the section
constexpr double kNotice_m = 3.0;    // fellows nearer than this to the section count
constexpr double kMoving_mps = 0.1;  // towards the section: wants to go through
constexpr double kStanding_mps = 0.05;
constexpr double kStandsOff_m = 0.3;  // from the goal: has not arrived
constexpr double kPatience_s = 2.0;
constexpr double kBack_s = 4.0;
constexpr double kPerNumber_m = 1e-3;
constexpr double kNever = std::numeric_limits<double>::infinity();

/// Room for a fellow in any of 16 directions across the path?
bool room_beside(const FreeSpace& space, const Eigen::Vector3d& at_m, const Eigen::Vector3d& along, double abreast_m) {
  const Eigen::Vector3d across = along.unitOrthogonal();
  const Eigen::Vector3d other = along.cross(across);
  for (int i = 0; i < 16; ++i) {
    const double angle_rad = i * M_PI / 8.0;
    const Eigen::Vector3d to = std::cos(angle_rad) * across + std::sin(angle_rad) * other;
    const double radius_m = space.robot().radius_m;
    if (space.sphere_free(at_m + abreast_m * to, radius_m) &&
        space.sphere_free(at_m + 0.5 * abreast_m * to, radius_m)) {
      return true;
    }
  }
  return false;
}

/// Where a UAV is with respect to a section.
struct Approach {
  double distance_m = kNever;  ///< to the section's line
  bool entry_side = true;      ///< nearer to the beginning than to the end
  double towards_mps = 0.0;    ///< towards the section
  double forward_mps = 0.0;    ///< along it, in the direction of the path
};

Approach approach(const NarrowSection& section, const SeenUav& uav) {
  Approach result;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < section.points_m.size(); ++i) {
    const double distance_m = (section.points_m[i] - uav.position_m).norm();
    if (distance_m >= result.distance_m) continue;
    result.distance_m = distance_m;
    nearest = i;
  }
  const Eigen::Vector3d along_m = section.points_m.back() - section.points_m.front();
  result.entry_side = along_m.dot(uav.position_m - 0.5 * (section.points_m.front() + section.points_m.back())) < 0.0;
  const Eigen::Vector3d to_m = section.points_m[nearest] - uav.position_m;
  if (result.distance_m > 1e-9) result.towards_mps = uav.velocity_mps.dot(to_m) / result.distance_m;
  result.forward_mps = uav.velocity_mps.dot(along_m.normalized());
  return result;
}

double rank_m(const Approach& approach, const SeenUav& uav) {
  return approach.distance_m + kPerNumber_m * static_cast<double>(uav.number);
}

bool held_by(const NarrowSection& section, const Approach& mine, const SeenUav& own, const SeenUav& fellow,
             double inside_m) {
  const Approach theirs = approach(section, fellow);
  if (theirs.distance_m < inside_m) return theirs.forward_mps < kMoving_mps;  // may follow, not meet
  if (theirs.distance_m > kNotice_m || theirs.towards_mps < kMoving_mps) return false;
  return rank_m(theirs, fellow) < rank_m(mine, own);
}

}  // namespace

std::vector<NarrowSection> narrow_sections(const FreeSpace& space, const PathFollower& path, double abreast_m) {
  std::vector<NarrowSection> sections;
  for (double arc_m = 0.0; arc_m <= path.length_m(); arc_m += kStep_m) {
    const Eigen::Vector3d at_m = path.point_at(arc_m);
    const Eigen::Vector3d along_m = path.point_at(arc_m + 0.5 * kStep_m) - path.point_at(arc_m - 0.5 * kStep_m);
    if (along_m.norm() < 1e-9 || room_beside(space, at_m, along_m.normalized(), abreast_m)) continue;
    if (sections.empty() || arc_m - sections.back().to_m > kMerge_m) sections.push_back({arc_m, arc_m, {}});
    sections.back().to_m = arc_m;
  }
  for (NarrowSection& section : sections) {
    section.from_m = std::max(0.0, section.from_m - kStep_m);
    section.to_m = std::min(path.length_m(), section.to_m + kStep_m);
    for (double arc_m = section.from_m; arc_m < section.to_m; arc_m += kStep_m) {
      section.points_m.push_back(path.point_at(arc_m));
    }
    section.points_m.push_back(path.point_at(section.to_m));
  }
  return sections;
}

double RightOfWay::stop_arc_m(const PathFollower& path, const SeenUav& own, const std::vector<SeenUav>& fellows,
                              const OrcaConfig& config) {
  const double held_m = section_stop_arc_m(path, own, fellows, config);
  if (back_s_ > 0.0) {
    back_s_ -= config.period_s;
    return std::min(held_m, back_arc_m_);
  }
  const bool stands = own.velocity_mps.norm() < kStanding_mps && path.length_m() - path.progress_m() > kStandsOff_m;
  blocked_s_ = stands && held_m == kNever ? blocked_s_ + config.period_s : 0.0;
  if (blocked_s_ < kPatience_s) return held_m;
  const bool yields = std::any_of(fellows.begin(), fellows.end(), [&](const SeenUav& fellow) {
    return fellow.number < own.number && (fellow.position_m - own.position_m).norm() < 2.0 * abreast_m_;
  });
  blocked_s_ = 0.0;
  if (!yields) return held_m;
  back_s_ = kBack_s;
  back_arc_m_ = std::max(0.0, path.progress_m() - kWait_m);
  return back_arc_m_;
}

double RightOfWay::section_stop_arc_m(const PathFollower& path, const SeenUav& own, const std::vector<SeenUav>& fellows,
                                      const OrcaConfig& config) const {
  const double speed_mps = own.velocity_mps.norm();
  const double stop_m = 0.5 * speed_mps * speed_mps / config.acceleration_mps2() + speed_mps * config.period_s;
  for (const NarrowSection& section : sections_) {
    if (path.progress_m() > section.to_m) continue;
    if (section.from_m - path.progress_m() > kWait_m + stop_m + 0.5) return kNever;  // still far
    const double wait_arc_m = std::max(0.0, section.from_m - kWait_m);
    const Approach mine = approach(section, own);
    for (const SeenUav& fellow : fellows) {
      if (!fellow.position_m.allFinite() || !fellow.velocity_mps.allFinite()) continue;
      if (mine.distance_m < abreast_m_) {
        const Approach theirs = approach(section, fellow);
        const bool meet = theirs.distance_m < abreast_m_ && !(theirs.forward_mps > kMoving_mps);
        const bool ahead = (fellow.position_m - own.position_m)
                               .dot(path.point_at(path.progress_m() + 0.3) - path.point_at(path.progress_m())) > 0.0;
        if (meet && ahead && fellow.number < own.number) return wait_arc_m;
      } else if (held_by(section, mine, own, fellow, abreast_m_)) {
        return wait_arc_m;
      }
    }
    return kNever;
  }
  return kNever;
}

}  // namespace stairwell::planning3d
