#pragma once

#include "core/scan.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <string>
#include <vector>

namespace stairwell::perception {

/// What is dropped from a scan.
struct CloudConfig {
  double fellow_radius_m = 0.5;  ///< returns this near to a fellow UAV's reported position are dropped; 0 = off
  double voxel_m = 0.0;          ///< voxel-grid downsampling of the returns within range; 0 = off
  bool remove_outliers = false;  ///< statistical outlier removal (for noisy sensors)
  int outlier_neighbours = 8;
  double outlier_sigma = 2.0;  ///< a return is dropped when its mean neighbour distance exceeds mean + this * sigma
  double min_range_m = 0.0;    ///< crop: nearer returns are the UAV itself

  std::vector<std::string> problems() const;
};

/// in == out + not_finite + cropped + fellows + outliers + downsampled.
struct CloudStats {
  std::size_t in = 0, out = 0, not_finite = 0, cropped = 0, fellows = 0, outliers = 0, downsampled = 0;
};

/// Scan in, filtered scan out (PCL inside). Returns beyond the scan's range (free-space rays) pass untouched, except
/// through fellow UAVs. NaN is dropped.
///
/// A fellow is a sphere of fellow_radius_m: returns inside it and returns whose ray passes through it and ends behind
/// it are dropped (the fellow may have moved since the ray passed; what it said about the way there is not trusted).
/// Without outlier removal and voxel grid one pass over the points, in their order; otherwise the returns within range
/// come first and those beyond it last. Const and without shared state: safe from several threads.
class CloudPipeline {
 public:
  /// @throws InputError naming every problem of the config
  explicit CloudPipeline(const CloudConfig& config = {});
  Scan filter(const Scan& scan, const std::vector<Eigen::Vector3d>& fellows_m, CloudStats* stats = nullptr) const;

 private:
  CloudConfig config_;
};

}  // namespace stairwell::perception
