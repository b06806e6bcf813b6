#pragma once

#include "planning3d/travel_costs.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <memory>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::coverage3d {

/// Ways of UAVs in a large world: exact nearby, farther off estimated by a graph of regions. What was looked up for one
/// place serves others near it for a while: a UAV under way is planned for from its goal, then from its place, and so
/// on.
class FarWays {
 public:
  /// Where ways begin, and what answers for them.
  struct Source {
    Eigen::Vector3d start_m;
    planning3d::TravelCosts* costs;
  };

  /// @param lattice  up to date, volume rule @param uavs  to keep lengths for @param workers  may be null
  /// @post the costs refer to this object
  void compute(const planning3d::FreeSpace& space, planning3d::PassableLattice& lattice,
               const std::vector<Source>& sources, double time_s, std::size_t uavs, mapping::WorkerPool* workers);

 private:
  struct Lengths {
    Eigen::Vector3d start_m;
    double time_s;
    std::shared_ptr<const std::vector<float>> by_part;
  };
  std::shared_ptr<const std::vector<float>> known_near(const Eigen::Vector3d& start_m) const;

  std::unique_ptr<planning3d::RegionGraph> regions_ = std::make_unique<planning3d::RegionGraph>();
  std::vector<Lengths> kept_;  ///< the oldest first
};

}  // namespace stairwell::coverage3d
