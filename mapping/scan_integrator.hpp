#pragma once

#include "core/scan.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstddef>
#include <memory>

namespace stairwell::mapping {

struct IntegrationStats {
  std::size_t points = 0;
  std::size_t dropped_not_finite = 0;
  std::size_t ray_steps = 0;      ///< voxels walked
  std::size_t voxels_updated = 0; ///< distinct voxels hit or missed
  std::size_t voxels_changed = 0; ///< tri-state class changed
};

/// Carves scans into an OccupancyMap exactly as octomap::OcTree::insertPointCloud(points, origin, maxrange, lazy,
/// discretize) does: the same ray walk on the same float32 numbers, occupied wins over free within one scan,
/// returns beyond the range carve up to it. NaN and infinite points are dropped and counted.
/// Rays leaving the map's grid are carved up to its border; hits outside it are not stored.
class ScanIntegrator {
 public:
  struct Config {
    bool discretize = false;  ///< one ray per end voxel
  };
  ScanIntegrator();
  explicit ScanIntegrator(Config config);
  ~ScanIntegrator();
  ScanIntegrator(ScanIntegrator&&) noexcept;

  IntegrationStats integrate(const Scan& scan, OccupancyMap& map);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace stairwell::mapping
