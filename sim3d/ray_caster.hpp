#pragma once

#include "sim3d/world.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

namespace stairwell::sim3d {

/// Where a ray ends.
struct RayHit {
  float distance_m = std::numeric_limits<float>::infinity();  ///< infinity: nothing within range
  std::uint32_t triangle = 0;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< geometric, not normalised
};

/// Embree over one mesh (copied). Both sides of a triangle are hit. Safe to share between threads. An empty mesh is
/// an empty world: no ray hits anything.
class RayCaster {
 public:
  /// @throws std::invalid_argument for a triangle that names a missing vertex; RunError if Embree fails.
  explicit RayCaster(const TriangleMesh& mesh);
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;

  /// @param direction unit length
  RayHit cast(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float max_range_m) const;
  /// Distances for many directions from one origin (the sensor's case); infinity where nothing is hit.
  /// Fastest when neighbours in `directions` point alike.
  /// @throws std::invalid_argument when the spans differ in size.
  void cast_from(const Eigen::Vector3f& origin_m, std::span<const Eigen::Vector3f> directions, float max_range_m,
                 std::span<float> distances_m) const;
  /// The same for directions in rows of `columns`, neighbours beside and above each other, in half the time: by a tree
  /// that now and then lets a ray slip between two triangles, after which rays that reach farther than their neighbours
  /// are cast as above. Distances are those of `cast_from` to 1e-5 of themselves, but for rays that graze a rim.
  /// @throws std::invalid_argument when the spans differ in size or the rows are not whole.
  void cast_lattice(const Eigen::Vector3f& origin_m, std::span<const Eigen::Vector3f> directions, int columns,
                    float max_range_m, std::span<float> distances_m) const;
  /// The same for rays that share nothing; each has its own origin and range.
  void cast_many(std::span<const Eigen::Vector3f> origins_m, std::span<const Eigen::Vector3f> directions,
                 std::span<const float> max_ranges_m, std::span<float> distances_m) const;
  bool occluded(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float max_range_m) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stairwell::sim3d
