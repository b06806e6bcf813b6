#include "perception/cloud_pipeline.hpp"

#include "core/errors.hpp"
#include "perception/pcl_convert.hpp"

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>

#include <array>
#include <cmath>
#include <map>

namespace stairwell::perception {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// Fellow UAVs as spheres in the sensor frame.
class FellowShadow {
 public:
  FellowShadow(const Scan& scan, const std::vector<Eigen::Vector3d>& fellows_m, double radius_m) {
    if (!(radius_m > 0.0)) {
      return;
    }
    const Pose T_sensor_world = scan.T_world_sensor.inverse();
    for (const Eigen::Vector3d& fellow_m : fellows_m) {
      const Eigen::Vector3d center_m = T_sensor_world * fellow_m;
      // A sphere beyond the range does not touch the part of a ray that is used.
      if (center_m.allFinite() && center_m.norm() < scan.max_range_m + radius_m) {
        spheres_.push_back({center_m.cast<float>(), static_cast<float>(center_m.squaredNorm())});
      }
    }
    squared_radius_ = static_cast<float>(radius_m * radius_m);
  }

  /// The return lies inside a fellow, or behind one that its ray passes through.
  bool covers(const Eigen::Vector3f& point_m, float squared_range) const {
    for (const Sphere& sphere : spheres_) {
      if ((point_m - sphere.center_m).squaredNorm() <= squared_radius_) {
        return true;
      }
      const float along = point_m.dot(sphere.center_m);  // times range
      const bool behind = along > 0.0F && along < squared_range;
      const float off_ray = sphere.squared_distance * squared_range - along * along;  // times range squared
      if (behind && off_ray <= squared_radius_ * squared_range) {
        return true;
      }
    }
    return false;
  }

 private:
  struct Sphere {
    Eigen::Vector3f center_m;
    float squared_distance = 0.0F;
  };
  std::vector<Sphere> spheres_;
  float squared_radius_ = 0.0F;
};

Points without_outliers(const Points& points_m, const CloudConfig& config) {
  // With fewer points than neighbours the statistics mean nothing (and PCL prints an error).
  if (points_m.size() <= static_cast<std::size_t>(config.outlier_neighbours)) {
    return points_m;
  }
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(to_pcl(points_m));
  filter.setMeanK(config.outlier_neighbours);
  filter.setStddevMulThresh(config.outlier_sigma);
  pcl::PointCloud<pcl::PointXYZ> kept;
  filter.filter(kept);
  return from_pcl(kept);
}

Points downsampled(const Points& points_m, double voxel_m) {
  // pcl::VoxelGrid counts its voxels in 32 bits, and prints and gives up beyond: clouds are cut into blocks of whole
  // voxels (its lattice starts at 0), which changes nothing in the result.
  constexpr double kBlockVoxels = 1024.0;
  std::map<std::array<int, 3>, Points> blocks;
  const double inverse_block = 1.0 / (voxel_m * kBlockVoxels);
  for (const Eigen::Vector3f& p : points_m) {
    const Eigen::Array3d block = (p.cast<double>().array() * inverse_block).floor().cwiseMax(-1e9).cwiseMin(1e9);
    blocks[{static_cast<int>(block.x()), static_cast<int>(block.y()), static_cast<int>(block.z())}].push_back(p);
  }
  Points kept_m;
  for (const auto& [key, block_points_m] : blocks) {
    pcl::VoxelGrid<pcl::PointXYZ> filter;
    filter.setInputCloud(to_pcl(block_points_m));
    const auto leaf = static_cast<float>(voxel_m);
    filter.setLeafSize(leaf, leaf, leaf);
    pcl::PointCloud<pcl::PointXYZ> kept;
    filter.filter(kept);
    const Points centroids_m = from_pcl(kept);
    kept_m.insert(kept_m.end(), centroids_m.begin(), centroids_m.end());
  }
  return kept_m;
}

}  // namespace

std::vector<std::string> CloudConfig::problems() const {
  std::vector<std::string> found;
  const auto at_least_0 = [&found](const char* name, double value) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      found.push_back(std::string(name) + " must be finite and not negative, not " + std::to_string(value));
    }
  };
  at_least_0("fellow_radius_m", fellow_radius_m);
  at_least_0("min_range_m", min_range_m);
  at_least_0("outlier_sigma", outlier_sigma);
  if (!(voxel_m == 0.0 || (voxel_m >= 1e-3 && voxel_m <= 100.0))) {
    found.push_back("voxel_m must be 0 (off) or between 0.001 and 100, not " + std::to_string(voxel_m));
  }
  if (outlier_neighbours < 1 || outlier_neighbours > 1000) {
    found.push_back("outlier_neighbours must be between 1 and 1000, not " + std::to_string(outlier_neighbours));
  }
  return found;
}

CloudPipeline::CloudPipeline(const CloudConfig& config) : config_(config) {
  std::string message;
  for (const std::string& problem : config.problems()) {
    message += (message.empty() ? "cloud filter: " : "; ") + problem;
  }
  if (!message.empty()) {
    throw InputError(message);
  }
}

Scan CloudPipeline::filter(const Scan& scan, const std::vector<Eigen::Vector3d>& fellows_m, CloudStats* stats) const {
  CloudStats counts;
  counts.in = scan.points_m.size();
  const FellowShadow shadow(scan, fellows_m, config_.fellow_radius_m);
  const auto squared_min_range = static_cast<float>(config_.min_range_m * config_.min_range_m);
  const auto squared_max_range = static_cast<float>(scan.max_range_m * scan.max_range_m);
  const bool use_pcl = config_.remove_outliers || config_.voxel_m > 0.0;

  Scan kept;
  kept.T_world_sensor = scan.T_world_sensor;
  kept.time_s = scan.time_s;
  kept.max_range_m = scan.max_range_m;
  kept.points_m.reserve(scan.points_m.size());
  Points beyond_m;
  for (const Eigen::Vector3f& point_m : scan.points_m) {
    const float squared_range = point_m.squaredNorm();
    if (!std::isfinite(squared_range)) {
      ++counts.not_finite;
    } else if (squared_range < squared_min_range) {
      ++counts.cropped;
    } else if (shadow.covers(point_m, squared_range)) {
      ++counts.fellows;
    } else if (use_pcl && squared_range > squared_max_range) {
      beyond_m.push_back(point_m);
    } else {
      kept.points_m.push_back(point_m);
    }
  }
  if (config_.remove_outliers) {
    const std::size_t before = kept.points_m.size();
    kept.points_m = without_outliers(kept.points_m, config_);
    counts.outliers = before - kept.points_m.size();
  }
  if (config_.voxel_m > 0.0) {
    const std::size_t before = kept.points_m.size();
    kept.points_m = downsampled(kept.points_m, config_.voxel_m);
    counts.downsampled = before - kept.points_m.size();
  }
  kept.points_m.insert(kept.points_m.end(), beyond_m.begin(), beyond_m.end());
  counts.out = kept.points_m.size();
  if (stats != nullptr) {
    *stats = counts;
  }
  return kept;
}

}  // namespace stairwell::perception
