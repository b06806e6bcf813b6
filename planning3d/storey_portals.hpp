#pragma once

#include "planning3d/free_space.hpp"

#include <Eigen/Core>

#include <limits>
#include <vector>

namespace stairwell::planning3d {

/// Openings between storeys, as far as the map shows them, and which of them to take, by straight lines between them.
///
/// Slabs are where few voxels of a level are traversable, beside the levels around: less than half of the most within
/// 1.5 m below, and of the most within 1.5 m above. Openings are the connected traversable voxels (8 neighbours) in the
/// slab's middle.
class StoreyPortals {
 public:
  /// An opening, in the world frame.
  struct Portal {
    Eigen::Vector3d center_m;  ///< a voxel's centre: the one nearest to the mean of them all
    int voxels = 0;
  };
  /// What to head for next on the way to a goal, and the straight lines from there on.
  struct Heading {
    Eigen::Vector3d place_m;  ///< the goal, or a little beyond an opening's middle
    double rest_m = 0.0;      ///< from there to the goal through the further openings
  };

  StoreyPortals() = default;
  /// Looks at every traversable voxel once.
  explicit StoreyPortals(const FreeSpace& space);

  /// From below; one list per slab, empty where no opening is known.
  const std::vector<std::vector<Portal>>& slabs() const { return portals_; }
  /// The shortest chain of straight lines through one opening of each slab between. Slabs without one are passed as if
  /// they were not there.
  Heading towards(const Eigen::Vector3d& from_m, const Eigen::Vector3d& goal_m) const;

 private:
  std::vector<std::vector<Portal>> portals_;
  std::vector<double> heights_m_;  ///< of the slabs' middles
};

}  // namespace stairwell::planning3d
