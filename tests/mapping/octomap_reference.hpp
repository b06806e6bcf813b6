/// The map that OctoMap itself makes of the same scans, for comparison.
#pragma once

#include "mapping/scan_integrator.hpp"

#include <octomap/OcTree.h>

#include <sstream>
#include <string>

namespace stairwell::mapping::test {

inline octomap::point3d octomap_point(const Eigen::Vector3f& p) { return {p.x(), p.y(), p.z()}; }

inline void set_params(octomap::OcTree& tree, const OccupancyParams& params) {
  tree.setProbHit(params.p_hit);
  tree.setProbMiss(params.p_miss);
  tree.setClampingThresMin(params.clamp_min);
  tree.setClampingThresMax(params.clamp_max);
  tree.setOccupancyThres(params.p_occupied);
}

inline void insert_scan(octomap::OcTree& tree, const Scan& scan, bool discretize) {
  octomap::Pointcloud cloud;
  for (const Eigen::Vector3f& point_m : world_points_of(scan)) {
    cloud.push_back(octomap_point(point_m));
  }
  tree.insertPointCloud(cloud, octomap_point(world_origin_of(scan)), scan.max_range_m, false, discretize);
}

/// The bytes of the `.ot` file.
inline std::string ot_bytes(const octomap::OcTree& tree) {
  std::ostringstream stream;
  tree.write(stream);
  return stream.str();
}

}  // namespace stairwell::mapping::test
