#pragma once

#include "core/aabb.hpp"
#include "core/scan.hpp"
#include "coverage3d/frontier_finder.hpp"
#include "coverage3d/sight_lines.hpp"
#include "coverage3d/view_gain.hpp"
#include "planning3d/free_space.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <functional>
#include <vector>

namespace stairwell::coverage3d {

/// A pose from which a part of a frontier cluster is seen.
struct Viewpoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< centre of a traversable voxel
  VoxelIndex voxel;
  double yaw_rad = 0.0;
  double seen_fraction = 0.0;          ///< of the cluster's cells
  double gain_m3 = 0.0;                ///< in the whole field of view: see ViewGain
  std::vector<VoxelIndex> seen_cells;  ///< a sample of the unknown voxels beside the frontier that come into sight
};

/// Where viewpoints are looked for and what they have to see.
struct ViewpointConfig {
  SensorModel sensor;
  Aabb box;  ///< only space inside counts as gain
  GainKind gain = GainKind::kVolume;
  mapping::OccupancyParams occupancy;  ///< of the map
  double nearest_m = 0.4;              ///< least horizontal distance between viewpoint and cluster centre
  double range_fraction = 0.8;         ///< farthest: this times the sensor's range
  int max_cells = 60;                  ///< cells looked at per cluster
  bool planar = false;  ///< only what is unknown at a frontier voxel's own height counts (FrontierConfig::planar)
  int keep = 5;         ///< viewpoints returned
  std::uint64_t seed = 1;
};

/// What is asked of a viewpoint's place beyond being traversable.
struct ViewpointPlaces {
  std::function<bool(const VoxelIndex&)> reachable;
  std::vector<double> layers_m;         ///< slice mode: heights of the viewpoints; empty = any height
  bool only_between_layers = false;     ///< slice mode: heights away from the layers (inside openings)
  std::vector<Eigen::Vector3d> also_m;  ///< further candidates (where the UAVs are)
};

/// Candidate poses on circles around a cluster, judged by walking rays through the map: a cell counts when the first
/// voxel on the ray that is not free is unknown and belongs to the cluster's border.
class ViewpointSampler {
 public:
  explicit ViewpointSampler(const ViewpointConfig& config);

  /// Best first; empty when none sees anything.
  std::vector<Viewpoint> sample(const planning3d::FreeSpace& space, const FrontierCluster& cluster,
                                const ViewpointPlaces& places) const;
  /// The same, but candidates are all places near the cluster (a bounded, seeded sample of them). Slower; for
  /// clusters that the circles do not serve.
  std::vector<Viewpoint> search(const planning3d::FreeSpace& space, const FrontierCluster& cluster,
                                const ViewpointPlaces& places) const;

  /// Those of a vanished cluster's views from which this one is seen, with what they show of it now; best first. Gains
  /// of a sensor that sees all round are those that the views had.
  std::vector<Viewpoint> inherit(const planning3d::FreeSpace& space, const FrontierCluster& cluster,
                                 const std::vector<Viewpoint>& views) const;

  /// Part of a cluster that is seen from a pose (with its yaw), by a few rays.
  double seen_part(const planning3d::FreeSpace& space, const Viewpoint& view, const FrontierCluster& cluster) const;

  /// Of a pose: see ViewGain.
  double gain_m3(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, double yaw_rad) const {
    return gain_.gain_m3(map, from_m, yaw_rad);
  }

  const ViewGain& gain() const { return gain_; }
  const ViewpointConfig& config() const { return config_; }

 private:
  void turn_to_most(const mapping::OccupancyMap& map, Viewpoint& view) const;
  struct Target {
    VoxelIndex unknown;
    Eigen::Vector3d unknown_m;
  };
  std::vector<Target> targets(const planning3d::FreeSpace& space, const FrontierCluster& cluster, int most) const;
  /// @param gains_m3  of the candidates; empty: they are worked out, and the views turned to where they are largest
  std::vector<Viewpoint> best_of(const planning3d::FreeSpace& space, const std::vector<VoxelIndex>& candidates,
                                 const std::vector<Target>& targets, const std::vector<double>& gains_m3 = {}) const;
  double sight_m(const GridSpec& grid) const;
  static bool sees(const mapping::OccupancyMap& map, std::uint32_t stop, const Target& target);
  std::vector<int> rough_counts(const mapping::OccupancyMap& map, const std::vector<VoxelIndex>& candidates,
                                const std::vector<Target>& targets, SightLines& lines) const;
  Viewpoint judge(const mapping::OccupancyMap& map, const VoxelIndex& voxel, const std::vector<Target>& targets,
                  SightLines& lines) const;

  ViewpointConfig config_;
  ViewGain gain_;
};

}  // namespace stairwell::coverage3d
