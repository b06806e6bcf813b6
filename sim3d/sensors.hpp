#pragma once

#include "core/doors.hpp"
#include "core/rng.hpp"
#include "sim3d/ray_caster.hpp"

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace stairwell::sim3d {

/// Depth-dependent noise, quantisation and drop-outs of a RealSense-class stereo camera; all off by default.
struct SensorNoise {
  bool enabled = false;
  double sigma_at_1m_m = 0.0012;     ///< standard deviation at 1 m; grows with depth squared
  double disparity_step_m = 0.0008;  ///< quantisation step at 1 m; grows with depth squared; 0 = none
  double dropout = 0.01;             ///< share of pixels without an answer
};

/// Returns lie this far behind the surface, so that a surface exactly on a voxel face falls into the solid's voxel.
inline constexpr double kSurfaceBias_m = 1e-3;

/// A pinhole depth camera or a spinning lidar (by model.kind) in a simulated world. Rays that hit nothing give a
/// return beyond the maximum range (free space up to it). A camera's rays pass through its pixels' centres; a lidar's
/// lattice includes the ends of both angles (a full turn has no column twice). A scan depends only on the seed, the
/// stream's name, its number and the poses.
class SimulatedSensor final : public DepthSource {
 public:
  /// @throws InputError for an unusable model or noise.
  SimulatedSensor(std::shared_ptr<const RayCaster> caster, const SensorModel& model, const SensorNoise& noise,
                  std::uint64_t seed, std::string_view stream);

  const SensorModel& model() const override { return model_; }
  Scan capture(const Pose& T_world_sensor, double time_s) override;

  /// Bodies of the other UAVs, which block the view as spheres (from inside one nothing is seen).
  void set_fellows(std::vector<Eigen::Vector3d> centers_m, double radius_m);

  /// Stream state for checkpoints: number of scans taken so far (each scan draws from its own stream).
  std::uint64_t scans_taken() const { return scans_taken_; }
  void set_scans_taken(std::uint64_t count) { scans_taken_ = count; }

 private:
  /// Nearest surface or fellow along each direction; infinity for none.
  std::vector<float> ranges_m(const Pose& T_world_sensor, const std::vector<Eigen::Vector3f>& directions_sensor) const;

  std::shared_ptr<const RayCaster> caster_;
  SensorModel model_;
  SensorNoise noise_;
  std::uint64_t seed_;
  std::uint64_t stream_hash_ = 0;
  std::uint64_t scans_taken_ = 0;
  std::vector<Eigen::Vector3f> directions_;  ///< unit, sensor frame, the whole lattice
  std::vector<Eigen::Vector3d> fellows_m_;
  double fellow_radius_m_ = 0.0;
};

}  // namespace stairwell::sim3d
