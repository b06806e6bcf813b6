#pragma once

#include "core/pose.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_words.hpp"

#include <Eigen/Core>

#include <string>
#include <variant>
#include <vector>

namespace stairwell::mapping {

// Robot shapes, in the body frame, centred on the body's reference point. Metres.
/// A sphere.
struct SphereShape {
  double radius_m = 0.0;
};
/// A box, centred.
struct BoxShape {
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();  ///< half the edges along body x, y, z
};
/// An ellipsoid, centred.
struct EllipsoidShape {
  Eigen::Vector3d semi_axes_m = Eigen::Vector3d::Zero();  ///< along body x, y, z
};
/// A cylinder along body z, centred.
struct CylinderShape {
  double radius_m = 0.0;
  double half_height_m = 0.0;  ///< up and down along body z
};
using CollisionShape = std::variant<SphereShape, BoxShape, EllipsoidShape, CylinderShape>;

inline constexpr double kCollisionTouch_m = 1e-9;  ///< overlapping no deeper than this is no collision

/// What makes a shape unusable: lengths must be finite and at least a micrometre. Empty == usable.
std::vector<std::string> problems(const CollisionShape& shape);

/// Whether a robot of one shape touches obstacles of the map, at a pose or along a motion. Exact (not sampled): a pose
/// collides if the shape's inside overlaps an obstacle voxel's by more than a nanometre, so that a robot may rest
/// against a face. For Obstacles::kBlocked everything outside the grid is an obstacle, for kOccupied it is free.
///
/// The distance field settles the clear cases, the occupancy words the others. Both must have been brought up to date
/// with the same map; the checker holds references to them. Queries may run in several threads at once while neither
/// is updated. They allocate nothing.
///
/// Made to stand behind OMPL: a StateValidityChecker answers `!collides(pose)`, a MotionValidator
/// `!collides_between(from, to)`, and its second form (last valid state) `free_fraction(from, to)`.
class CollisionChecker {
 public:
  /// @throws InputError for an unusable shape, or where words and distance field differ in grid or kind of obstacle.
  CollisionChecker(const OccupancyWords& words, const DistanceField& distance, const CollisionShape& shape);

  const CollisionShape& shape() const { return shape_; }

  /// @pre the rotation is one (orthonormal). @throws InputError for a pose that is not finite or more than 1e7 m away.
  bool collides(const Pose& T_world_body) const;

  /// The motion from one pose to the other: the position along the straight segment, the orientation turning evenly
  /// about one axis the shorter way.
  /// Spheres: exact, by the capsule that is swept. Other shapes: conservative within `tolerance_m`; a motion that
  /// touches is never called free, one that touches nothing may be called a collision only if the shape passes an
  /// obstacle at about that distance or less.
  /// @throws InputError for poses as above, or a tolerance that is not at least a micrometre.
  bool collides_between(const Pose& T_world_from, const Pose& T_world_to, double tolerance_m = 0.001) const;

  /// How much of the same motion, from its start, touches nothing: 1 = all of it, 0 = the start collides. Never too
  /// much; less by at most about `tolerance_m` of way, or for other shapes than spheres where one passes that near.
  /// @throws InputError as above.
  double free_fraction(const Pose& T_world_from, const Pose& T_world_to, double tolerance_m = 0.001) const;

 private:
  friend struct CollisionQuery;

  const OccupancyWords* words_;
  const DistanceField* distance_;
  CollisionShape shape_;
  Eigen::Vector3d first_cell_;  ///< lattice coordinate of the corner of word 0
  double per_m_ = 0.0;
};

}  // namespace stairwell::mapping
