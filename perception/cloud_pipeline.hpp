#pragma once

#include "core/scan.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace stairwell::perception {

struct CloudConfig {
  double fellow_radius_m = 0.5;    ///< returns this near to a fellow UAV's reported position are dropped
  double voxel_m = 0.0;            ///< voxel-grid downsampling of the returns within range; 0 = off
  bool remove_outliers = false;    ///< statistical outlier removal (for noisy sensors)
  int outlier_neighbours = 8;
  double outlier_sigma = 2.0;
  double min_range_m = 0.0;        ///< crop: nearer returns are the UAV itself

  std::vector<std::string> problems() const;
};

struct CloudStats {
  std::size_t in = 0, out = 0, not_finite = 0, cropped = 0, fellows = 0, outliers = 0;
};

/// Scan in, filtered scan out (PCL inside). Returns beyond the scan's range (free-space rays) pass untouched, except
/// through fellow UAVs. NaN is dropped.
class CloudPipeline {
 public:
  explicit CloudPipeline(const CloudConfig& config = {}) : config_(config) {}
  Scan filter(const Scan& scan, const std::vector<Eigen::Vector3d>& fellows_m, CloudStats* stats = nullptr) const;

 private:
  CloudConfig config_;
};

}  // namespace stairwell::perception
