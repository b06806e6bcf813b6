#pragma once

#include "core/scan.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/simd.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace stairwell::mapping {

/// What a scan cost and did.
struct IntegrationStats {
  std::size_t points = 0;
  std::size_t dropped_not_finite = 0;
  std::size_t ray_steps = 0;       ///< voxels walked
  std::size_t voxels_updated = 0;  ///< distinct voxels hit or missed
  std::size_t voxels_changed = 0;  ///< tri-state class changed
};

/// What a scan says about a map's voxels, block by block.
struct CarvedScan {
  std::vector<std::vector<BlockUpdate>> updates;  ///< in a row in the order of blocks
  IntegrationStats stats;                         ///< voxels are counted when it is stored
};

/// The finite returns in the world frame, exactly as they are integrated: pose and products in float32,
/// ((r0*x + r1*y) + r2*z) + t. OctoMap given these points, and this origin, makes the same map.
std::vector<Eigen::Vector3f> world_points_of(const Scan& scan);
Eigen::Vector3f world_origin_of(const Scan& scan);

/// Carves scans into an OccupancyMap exactly as octomap::OcTree::insertPointCloud(points, origin, maxrange, lazy,
/// discretize) does: the same ray walk on the same float32 numbers, occupied wins over free within one scan,
/// returns beyond the range carve up to it. NaN and infinite points are dropped and counted.
/// With `discretize`, returns outside the key space are left out (OctoMap wraps them round to the other side).
/// Rays leaving the map's grid are carved up to its border; hits outside it are not stored.
class ScanIntegrator {
 public:
  /// How scans are integrated.
  struct Config {
    bool discretize = false;  ///< one ray per end voxel
    int threads = 1;          ///< the map is the same with any number
    Simd simd = Simd::kBest;
    /// As octomap::OcTree::useBBXLimit: rays whose return lies outside, or beyond the range, are left out, and nothing
    /// outside is carved. (The map's own grid limits what is stored and leaves no ray out.)
    std::optional<Aabb> limit = std::nullopt;
  };
  ScanIntegrator();
  /// @throws InputError unless threads is 1 to 64, the processor has the instructions and the limit is finite.
  explicit ScanIntegrator(Config config);
  ~ScanIntegrator();
  ScanIntegrator(ScanIntegrator&&) noexcept;
  ScanIntegrator& operator=(ScanIntegrator&&) noexcept;

  /// @throws InputError when the sensor pose or range is not finite or the sensor is outside OctoMap's key space.
  IntegrationStats integrate(const Scan& scan, OccupancyMap& map);

  /// The first half of `integrate`, which changes nothing of the map: several integrators may be at it at once, each
  /// with a scan of its own. @param parts  lists of updates, for so many threads to store @throws as integrate()
  void carve(const Scan& scan, const OccupancyMap& map, CarvedScan& carved, int parts);
  /// The second half. The integrator need not be the one that carved. @pre carved for a map of the same grid
  IntegrationStats store(const CarvedScan& carved, OccupancyMap& map);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stairwell::mapping
