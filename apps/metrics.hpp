/// How well a run went, measured from outside the agents against the true world.
#pragma once

#include "apps/finish_meter.hpp"
#include "apps/run_config.hpp"
#include "apps/voxel_bits.hpp"
#include "core/trajectory.hpp"
#include "explore/fleet.hpp"
#include "mapping/occupancy_map.hpp"
#include "sim3d/ground_truth.hpp"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace stairwell::apps {

/// Share of the explorable voxels that a map knows. Follows the map's changes.
class CoverageMeter {
 public:
  /// @param explorable one byte per voxel of `grid` @pre grid is the map's
  CoverageMeter(const GridSpec& grid, const std::vector<std::uint8_t>& explorable);

  void update(const mapping::OccupancyMap& map);
  double coverage() const;
  double explorable_volume_m3() const { return static_cast<double>(explorable_count_) * grid_.voxel_volume_m3(); }
  std::size_t explorable_count() const { return explorable_count_; }

 private:
  void visit(const mapping::OccupancyMap& map, const mapping::VoxelBox& box);

  GridSpec grid_;
  VoxelBits pending_;  ///< explorable and not yet known
  std::size_t explorable_count_ = 0;
  std::size_t known_count_ = 0;
  std::uint64_t revision_ = 0;
  bool fresh_ = true;
};

/// Motion of the fleet: path lengths, distances between UAVs, collisions. Looks at several moments between two ticks
/// (cubic Hermite interpolation of the true states).
class FlightMeter {
 public:
  FlightMeter(const sim3d::GroundTruth& truth, double robot_radius_m, std::size_t uavs);

  /// @param near_ground per UAV: takes off, lands or stands, so that touching the floor below it is no collision
  void observe(double time_s, const std::vector<MotionState>& states, const std::vector<bool>& near_ground);

  const std::vector<double>& path_length_m() const { return path_length_m_; }
  std::size_t collisions() const { return collisions_; }
  struct Contact {
    std::size_t uav;
    std::string with;  ///< where, and with what
  };
  /// Contacts that began since the last call.
  std::vector<Contact> take_contacts() { return std::exchange(contacts_, {}); }
  /// Over all pairs of UAVs and all ticks; NaN for a single UAV.
  double mean_distance_m() const;
  double std_distance_m() const;
  double min_distance_m() const { return min_distance_m_; }

  nlohmann::json save() const;
  void load(const nlohmann::json& state);

 private:
  void observe_moment(const std::vector<Eigen::Vector3d>& positions_m, const std::vector<bool>& near_ground);
  void add_distances(const std::vector<Eigen::Vector3d>& positions_m);
  bool touches_world(const Eigen::Vector3d& position_m, bool near_ground) const;

  const sim3d::GroundTruth& truth_;
  double radius_m_;
  double last_time_s_ = 0.0;
  std::vector<MotionState> last_states_;
  std::vector<bool> last_near_ground_;
  std::vector<double> path_length_m_;
  std::vector<bool> touching_;       ///< per UAV: in a contact episode with the world
  std::vector<bool> pair_touching_;  ///< per pair of UAVs
  std::size_t collisions_ = 0;
  std::vector<Contact> contacts_;
  std::uint64_t pair_samples_ = 0;
  double distance_mean_m_ = 0.0, distance_m2_ = 0.0;  ///< Welford's running mean and sum of squared differences
  double min_distance_m_;
};

/// Simulated times at which coverage first reached 50, 70, 80, 90, 95 and 99 %.
class Milestones {
 public:
  static constexpr std::array<int, 6> kPercent{50, 70, 80, 90, 95, 99};
  void observe(double time_s, double coverage);
  const std::array<std::optional<double>, 6>& times_s() const { return times_s_; }
  nlohmann::json save() const;
  void load(const nlohmann::json& state);

 private:
  std::array<std::optional<double>, 6> times_s_{};
};

struct Percentiles {
  double p50, p99, max;  ///< NaN when there are no values
};
/// Nearest rank.
Percentiles percentiles(std::vector<double> values);

double peak_rss_mib();

/// What metrics.json is made of.
struct RunFigures {
  const RunConfig& config;
  const explore::Fleet& fleet;
  const CoverageMeter& coverage;
  const FlightMeter& flight;
  const Milestones& milestones;
  const FinishMeter& finish;
  double known_volume_m3 = 0.0;
  std::vector<double> coverage_per_uav = {};  ///< of each UAV's own map; empty where all share one
  double wall_s = 0.0;
};

/// The text of metrics.json.
std::string metrics_json(const RunFigures& figures);

}  // namespace stairwell::apps
