/// A small world of voxels with a perfect sensor and UAVs that jump to their goals, to run strategies to the end.
#pragma once

#include "core/grid_spec.hpp"
#include "coverage3d/strategy.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <string>
#include <vector>

namespace stairwell::coverage3d::toy {

class World {
 public:
  /// Free inside `box`, one layer of occupied voxels around it.
  World(const Aabb& box, double resolution_m);
  void fill(const Aabb& box, bool occupied);
  bool occupied(const VoxelIndex& v) const { return !grid_.contains(v) || occupied_[grid_.linear(v)] != 0; }
  const GridSpec& grid() const { return grid_; }

 private:
  GridSpec grid_;
  std::vector<char> occupied_;
};

/// Marks everything that the sensor sees from the pose: free along the rays, occupied at their ends.
void look(const World& world, const SensorModel& sensor, const Eigen::Vector3d& position_m, double yaw_rad,
          mapping::OccupancyMap& map);

struct Outcome {
  double known_part = 0.0;  ///< of the free voxels that can be seen from where a UAV can get to
  std::size_t goals = 0;
  std::size_t vain = 0;    ///< goals from which nothing of the target was seen
  double travel_m = 0.0;   ///< sum over UAVs, geodesic
  double longest_s = 0.0;  ///< of the UAVs' clocks: way / speed, turns and 1 s a stop
  double assign_ms = 0.0;  ///< mean
  double assign_max_ms = 0.0;
  bool finished = false;  ///< open_targets reached 0
};

struct Scenario {
  std::string name;
  World world;
  std::vector<Eigen::Vector3d> starts_m;
  CoverageConfig config;
  std::size_t most_goals = 400;
  std::vector<char> seeable = {};  ///< free voxels that can be seen; see `seeable_from`
};

SensorModel camera();
SensorModel lidar();
CoverageConfig config_for(const World& world, const SensorModel& sensor);

/// Two storeys of 3 m with rooms, doors and an opening in the slab.
World two_storeys(double resolution_m);
World office(double resolution_m);
World corridor(double resolution_m);

/// Free voxels that a perfect observer sees from the places that a UAV can get to.
std::vector<char> seeable_from(const Scenario& scenario);

Outcome run(const Scenario& scenario, CoverageStrategy& strategy);

}  // namespace stairwell::coverage3d::toy
