#pragma once

#include "planning3d/travel_costs.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>

namespace stairwell::coverage3d {

/// Approximate geodesic distances between viewpoints: straight where nothing is in the way, else from a bounded
/// number of cost fields kept from call to call.
class TravelBook {
 public:
  /// Starts a round of questions; at most `new_fields` cost fields are computed during it.
  void begin(const planning3d::FreeSpace& space, const planning3d::MotionRule& rule, int new_fields);
  double distance_m(const planning3d::FreeSpace& space, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m);

 private:
  struct Field {
    planning3d::TravelCosts costs;
    Eigen::Vector3d source_m;
    std::uint64_t made = 0;
  };
  using Key = std::array<int, 3>;
  static Key key_of(const Eigen::Vector3d& position_m);
  const Field* field_near(const planning3d::FreeSpace& space, const Eigen::Vector3d& position_m, bool may_compute);

  std::map<Key, Field> fields_;
  planning3d::MotionRule rule_;
  std::uint64_t round_ = 0;
  int new_fields_left_ = 0;
  std::size_t most_fields_ = 8;
  int stride_ = 1;
  planning3d::PassableLattice lattice_{1};
};

/// Whether the straight segment stays in traversable voxels (and, under the slice rule, is level).
bool straight_way(const planning3d::FreeSpace& space, const planning3d::MotionRule& rule, const Eigen::Vector3d& a_m,
                  const Eigen::Vector3d& b_m);

}  // namespace stairwell::coverage3d
