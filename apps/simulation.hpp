#pragma once

#include "apps/run_config.hpp"
#include "apps/starts.hpp"
#include "explore/fleet.hpp"
#include "sim3d/ground_truth.hpp"
#include "sim3d/ray_caster.hpp"
#include "sim3d/world.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace stairwell::apps {

/// The simulated side of a run: the world, its truth on the map's lattice, and each UAV's vehicle and sensor.
/// Completes the configuration: the box (the world's bounds) and the starts.
class Simulation {
 public:
  /// @throws InputError when world, box or starts cannot be used.
  explicit Simulation(RunConfig config);
  ~Simulation();

  const RunConfig& config() const { return config_; }
  const sim3d::World& world() const { return world_; }
  const sim3d::GroundTruth& truth() const { return *truth_; }
  const sim3d::RayCaster& caster() const { return *caster_; }
  std::shared_ptr<const sim3d::RayCaster> shared_caster() const { return caster_; }
  std::vector<explore::UavDoors> doors() const;
  /// Null where everybody is in touch, always.
  const Radio* radio() const { return radio_.get(); }
  /// Collision-free positions of the UAVs at or right above their starts.
  std::vector<Eigen::Vector3d> airborne_starts_m() const;

  /// Voxels that a UAV can get to from the starts, and of the task box what can be seen from there; a byte each.
  std::vector<std::uint8_t> reachable() const;
  std::vector<std::uint8_t> explorable(const std::vector<std::uint8_t>& reachable) const;

  std::vector<std::uint64_t> scans_taken() const;
  /// @throws InputError for another number of UAVs.
  void set_scans_taken(const std::vector<std::uint64_t>& counts);

 private:
  class FellowAwareSensor;

  RunConfig config_;
  sim3d::World world_;
  std::shared_ptr<const sim3d::RayCaster> caster_;
  std::unique_ptr<sim3d::GroundTruth> truth_;
  std::vector<CheckedStart> starts_;
  std::vector<std::unique_ptr<Vehicle>> vehicles_;
  std::vector<std::unique_ptr<FellowAwareSensor>> sensors_;
  std::unique_ptr<Radio> radio_;
};

/// The map of a fleet with this configuration: the task box and a margin.
GridSpec map_grid(const explore::FleetConfig& config);

}  // namespace stairwell::apps
