/// The quickest ways between places of a known map, straight from one to the other.
#pragma once

#include "core/trajectory.hpp"
#include "planning3d/free_space.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace stairwell::apps {

class KnownRoads {
 public:
  /// Points that nothing leads to from the last `starts` of them stay unreachable.
  /// @param points_m  places, and the starts behind them; at most 60000
  KnownRoads(const planning3d::FreeSpace& space, const MotionLimits& limits, std::vector<Eigen::Vector3d> points_m,
             std::size_t starts);

  std::size_t points() const { return point_m_.size(); }
  const Eigen::Vector3d& point_m(std::size_t point) const { return point_m_[point]; }
  /// Whether the robot fits along the straight way; only known of points that are not far apart.
  bool straight(std::size_t a, std::size_t b) const {
    const std::size_t bit = a * point_m_.size() + b;
    return (straight_[bit / 64] >> (bit % 64) & 1u) != 0;
  }
  /// At full speed all the way; infinite where there is none.
  double cruise_s(std::size_t from, std::size_t to) const {
    return static_cast<double>(cruise_s_[from * point_m_.size() + to]);
  }
  /// At full speed, straight.
  double straight_s(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const;
  /// The points passed, both ends included; empty where there is none. @param way is overwritten
  void way(std::size_t from, std::size_t to, std::vector<std::uint32_t>& way) const;

 private:
  void find_straights(const planning3d::FreeSpace& space);
  void connect(const planning3d::FreeSpace& space, std::size_t starts);
  void find_ways_from(std::size_t source);

  MotionLimits limits_;
  std::vector<Eigen::Vector3d> point_m_;
  std::vector<std::uint64_t> straight_;  ///< bit by pair
  std::vector<std::vector<std::uint32_t>> beside_;
  std::vector<float> cruise_s_;        ///< [from][to]
  std::vector<std::uint16_t> before_;  ///< [from][to]: the last point passed on the way
};

}  // namespace stairwell::apps
