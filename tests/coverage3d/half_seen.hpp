/// A scene in which a strategy is asked for goals without flying to them.
#pragma once

#include "toy_world.hpp"

namespace stairwell::coverage3d::toy {

inline constexpr double kStartHeight_m = 1.6;  // not where layers lie while nothing is known

/// A storey seen from one place, and what the strategies ask about it.
struct HalfSeen {
  explicit HalfSeen(bool slice)
      : world(toy::two_storeys(0.2)),
        map(world.grid()),
        distance(world.grid(), 1.0, mapping::Obstacles::kBlocked),
        config(toy::config_for(world, toy::lidar())) {
    config.slice = slice;
    const Eigen::Vector3d start_m(1.5, 1.5, kStartHeight_m);
    map.assume_free(start_m, 0.6);
    toy::look(world, config.sensor, start_m, 0.0, map);
    distance.update(map);
    UavView uav;
    uav.position_m = start_m;
    uav.wants_goal = true;
    request.uavs.push_back(uav);
  }

  planning3d::FreeSpace space() const { return {map, distance, config.robot, config.box}; }

  toy::World world;
  mapping::OccupancyMap map;
  mapping::DistanceField distance;
  CoverageConfig config;
  AssignmentRequest request;
};

}  // namespace stairwell::coverage3d::toy
