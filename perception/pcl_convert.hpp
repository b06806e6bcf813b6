/// Adaptor header: names PCL types.
#pragma once

#include <Eigen/Core>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <span>
#include <vector>

namespace stairwell::perception {

/// Unorganised cloud of the same points; dense unless one of them is NaN or infinite.
inline pcl::PointCloud<pcl::PointXYZ>::Ptr to_pcl(std::span<const Eigen::Vector3f> points_m) {
  auto cloud = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  cloud->reserve(points_m.size());
  bool dense = true;
  for (const Eigen::Vector3f& p : points_m) {
    cloud->push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
    dense = dense && p.allFinite();
  }
  cloud->is_dense = dense;
  return cloud;
}

inline std::vector<Eigen::Vector3f> from_pcl(const pcl::PointCloud<pcl::PointXYZ>& cloud) {
  std::vector<Eigen::Vector3f> points_m;
  points_m.reserve(cloud.size());
  for (const pcl::PointXYZ& p : cloud) {
    points_m.emplace_back(p.x, p.y, p.z);
  }
  return points_m;
}

}  // namespace stairwell::perception
