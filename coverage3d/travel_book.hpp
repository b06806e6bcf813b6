#pragma once

#include "planning3d/travel_costs.hpp"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::coverage3d {

/// Approximate geodesic distances between viewpoints: straight where nothing is in the way, else from a bounded
/// number of cost fields kept from call to call.
class TravelBook {
 public:
  /// Starts a round of questions; at most `new_fields` cost fields are computed during it.
  void begin(const planning3d::FreeSpace& space, const planning3d::MotionRule& rule, int new_fields);
  double distance_m(const planning3d::FreeSpace& space, const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m);
  /// The same for each pair as if they were asked one after the other. @param workers  may be null
  using Pair = std::pair<Eigen::Vector3d, Eigen::Vector3d>;
  std::vector<double> distances_m(const planning3d::FreeSpace& space, const std::vector<Pair>& pairs,
                                  mapping::WorkerPool* workers);

 private:
  struct Field {
    planning3d::TravelCosts costs;
    Eigen::Vector3d source_m;
    std::uint64_t made = 0;
  };
  using Key = std::array<int, 3>;
  static Key key_of(const Eigen::Vector3d& position_m);
  /// What answers a question: a field, perhaps still to be computed, and the end that it does not begin at.
  struct Source {
    const Field* field = nullptr;  ///< null: nothing better than a guess
    const Eigen::Vector3d* far_m = nullptr;
  };
  const Field* field_near(const Eigen::Vector3d& position_m, bool may_compute);
  Source source_for(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m);
  void compute_new(const planning3d::FreeSpace& space, mapping::WorkerPool* workers);
  static double answer_m(const Source& source, double straight_m);

  std::map<Key, Field> fields_;
  std::vector<Field*> new_;                                ///< those still to be computed
  std::vector<std::map<Key, Field>::node_type> replaced_;  ///< what was asked of them is still to be answered
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
