/// What can be seen from where in the true world: the raw material of `stairwell bound`.
#pragma once

#include "apps/known_map.hpp"
#include "apps/simulation.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::apps {

/// The map that a fleet has when nothing is left to see: open space that connects to the reachable voxels is free, all
/// else occupied. @param reachable as GroundTruth::reachable gives it
mapping::OccupancyMap fully_known_map(const Simulation& simulation, const std::vector<std::uint8_t>& reachable);

/// Places spread over the space that UAVs can get to, and the targets (a sample of the explorable voxels) that are in
/// sight from each at each of `kYaws` yaws.
class TrueViews {
 public:
  static constexpr int kYaws = 24;
  struct Sight {
    std::uint32_t target;
    std::uint32_t yaws;  ///< bit by yaw
  };
  struct Pose {
    std::size_t place = 0;
    int yaw = 0;  ///< in steps of 2 pi / kYaws
    double yaw_rad() const;
  };

  /// @param explorable as GroundTruth::explorable gives it
  TrueViews(const Simulation& simulation, const planning3d::FreeSpace& space,
            const std::vector<std::uint8_t>& explorable);

  std::size_t places() const { return place_m_.size(); }
  std::size_t targets() const { return target_count_; }
  int yaws() const { return yaws_; }
  const Eigen::Vector3d& place_m(std::size_t place) const { return place_m_[place]; }
  const std::vector<Sight>& sights(std::size_t place) const { return sights_[place]; }
  /// The place that stands for what is seen from around a point.
  std::size_t place_near(const Eigen::Vector3d& at_m) const;
  /// The nearest of the yaws.
  int yaw_step(double yaw_rad) const;
  /// Places no farther from this one than a step of their lattice, corner to corner.
  std::vector<std::size_t> beside(std::size_t place) const;

 private:
  void find_places(const planning3d::FreeSpace& space, const std::vector<Eigen::Vector3d>& starts_m);
  void look_around(const Simulation& simulation, const std::vector<VoxelIndex>& targets);

  int yaws_ = kYaws;
  double step_m_ = 0.0;
  std::size_t target_count_ = 0;
  GridSpec cells_;
  std::vector<std::vector<std::uint32_t>> places_in_;  ///< by cell
  std::vector<Eigen::Vector3d> place_m_;
  std::vector<std::vector<Sight>> sights_;
};

/// Poses that together see the wanted share of the targets, each the one that adds most (greedy set cover).
std::vector<TrueViews::Pose> cover_greedily(const TrueViews& views, double share);

}  // namespace stairwell::apps
