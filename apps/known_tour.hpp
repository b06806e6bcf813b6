#pragma once

#include "apps/true_views.hpp"
#include "core/trajectory.hpp"
#include "explore/fleet_config.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/travel_costs.hpp"

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

namespace stairwell::apps {

/// Open tours of a fleet over poses on a known map, made short while what is seen on the way stays enough.
class KnownTour {
 public:
  using Pose = TrueViews::Pose;

  KnownTour(const TrueViews& views, const planning3d::FreeSpace& space, const explore::FleetConfig& config,
            const std::vector<Eigen::Vector3d>& starts_m, const std::vector<double>& start_yaws_rad);

  /// Tours over these poses by the local search that exploration uses (coverage3d/tour).
  void order(const std::vector<Pose>& poses);
  /// Leaves out, moves and turns poses, each time what saves most, as long as this share of the targets is seen.
  void improve(double share);

  const std::vector<std::vector<Pose>>& tours() const { return tours_; }
  std::vector<Pose> all_poses() const;
  /// Straight segments from the pose before (or the start) to this one.
  const std::vector<Eigen::Vector3d>& way_m(std::size_t uav, std::size_t stop);
  double longest_s();
  double seen_share() const;

 private:
  struct Leg {
    std::vector<Eigen::Vector3d> way_m;
    double length_m = 0.0;
    std::vector<std::pair<double, std::size_t>> passed;  ///< part of the way, place
  };
  const Leg& leg(std::size_t from_place, std::size_t to_place);
  std::size_t start_place(std::size_t uav) const { return views_.places() + uav; }
  Eigen::Vector3d place_m(std::size_t place) const;
  Pose pose_before(std::size_t uav, std::size_t stop) const;
  double move_s(double way_m, const Pose& from, const Pose& to) const;
  double leg_s(const Pose& from, const Pose& to);
  const std::vector<float>& ways_from(std::size_t place);
  double tour_s(std::size_t uav);
  double cost();
  void count(const Pose& from, const Pose& to, int sign);
  void count_around(std::size_t uav, std::size_t stop, int sign);
  void recount();
  void replace(std::size_t uav, std::size_t stop, const Pose& pose);
  void erase(std::size_t uav, std::size_t stop);
  void insert(std::size_t uav, std::size_t stop, const Pose& pose);
  double saved_s(std::size_t uav, std::size_t stop);
  void leave_out(double share);
  std::vector<Pose> alternatives(std::size_t uav, std::size_t stop);
  void shift(std::size_t uav, std::size_t stop, double share);

  const TrueViews& views_;
  const planning3d::FreeSpace& space_;
  const explore::FleetConfig& config_;
  std::vector<Eigen::Vector3d> starts_m_;
  std::vector<int> start_yaws_;
  planning3d::AstarPlanner planner_;
  std::map<std::pair<std::size_t, std::size_t>, Leg> legs_;
  planning3d::PassableLattice lattice_;
  std::map<std::size_t, std::vector<float>> ways_m_;  ///< by place: to every place
  std::vector<std::vector<Pose>> tours_;
  std::vector<int> seen_;  ///< [target]: by how many of the poses passed
  std::size_t seen_targets_ = 0;
};

}  // namespace stairwell::apps
