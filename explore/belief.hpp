#pragma once

#include "coverage3d/strategy.hpp"
#include "explore/fleet_config.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/occupancy_words.hpp"
#include "planning3d/free_space.hpp"
#include "planning3d/passable_lattice.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace stairwell::mapping {
class WorkerPool;
}

namespace stairwell::explore {

/// What UAVs that are in touch with each other (directly, or through others) know: their map and everything derived
/// from it. Of the other UAVs they know poses, tasks and commanded motions, never the map.
struct Belief {
  Belief(const FleetConfig& config, std::uint64_t belief_id);
  Belief(const Belief&) = delete;
  Belief& operator=(const Belief&) = delete;

  /// The same knowledge once more, for UAVs that go out of range. Members are the caller's to share out.
  std::unique_ptr<Belief> clone(std::uint64_t belief_id) const;
  /// Takes over what `other` knows and this does not. Members stay as they are.
  /// @returns voxels told
  std::size_t absorb(const Belief& other);
  /// Brings what is derived from the map up to date with it. @param workers  may be null
  void update(mapping::WorkerPool* workers);
  planning3d::FreeSpace space() const { return {map, blocked, config->robot, config->task_box, &blocked_words}; }
  bool has(std::size_t uav) const;
  /// Notes where an absent UAV is, as it tells everybody.
  void note_absent(std::size_t uav, const Eigen::Vector3d& at_m);
  /// Where absent UAVs have been since they were last in touch.
  std::vector<Eigen::Vector3d> passed_m() const;

  const FleetConfig* config;
  std::uint64_t id;                  ///< never used again
  std::vector<std::size_t> members;  ///< ascending
  mapping::OccupancyMap map;
  mapping::DistanceField blocked;
  mapping::OccupancyWords blocked_words;
  planning3d::PassableLattice passable;  ///< for ways that the fleet itself looks for; as of the last one
  std::unique_ptr<coverage3d::CoverageStrategy> strategy;
  std::map<std::size_t, std::uint64_t> known_by;  ///< absent UAVs: the map's revision up to which they know it
  std::map<std::size_t, std::vector<Eigen::Vector3d>> passed;  ///< see passed_m(), by UAV
  double yield_since_s = 0.0;                                  ///< last time that exploring was clearly worth it
  std::size_t yield_voxels = 0;                                ///< known voxels then
  std::size_t fruitless = 0;                                   ///< goals at which nothing new was seen ...
  std::size_t fruitless_voxels = 0;                            ///< ... since so many voxels were known
  bool winding_down = false;                                   ///< no more goals are given
};

}  // namespace stairwell::explore
