#include "sim3d/sensors.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

namespace stairwell::sim3d {

namespace {

/// How far beyond the maximum range the points of rays without a hit lie.
constexpr float kBeyond_m = 0.01f;

/// Centre of pixel `index` of `count` on an axis from -1 to 1.
double pixel_center(int index, int count) { return (2.0 * index + 1.0) / count - 1.0; }

std::vector<Eigen::Vector3f> camera_lattice(const SensorModel& model) {
  const double half_width = std::tan(0.5 * model.azimuth_fov_rad);
  const double bottom = std::tan(model.elevation_lo_rad);
  const double top = std::tan(model.elevation_hi_rad);
  std::vector<Eigen::Vector3f> directions;
  for (int row = 0; row < model.rays_elevation; ++row) {
    const double z = 0.5 * (top + bottom) - 0.5 * (top - bottom) * pixel_center(row, model.rays_elevation);
    for (int column = 0; column < model.rays_azimuth; ++column) {
      const double y = -half_width * pixel_center(column, model.rays_azimuth);
      directions.push_back(Eigen::Vector3d(1.0, y, z).normalized().cast<float>());
    }
  }
  return directions;
}

/// `index` of `count` evenly spaced values, both ends included; the middle if there is only one.
double inclusive(double lo, double hi, int index, int count) {
  return count == 1 ? 0.5 * (lo + hi) : lo + (hi - lo) * index / (count - 1);
}

std::vector<Eigen::Vector3f> lidar_lattice(const SensorModel& model) {
  const double half_rad = 0.5 * model.azimuth_fov_rad;
  std::vector<Eigen::Vector3f> directions;
  for (int row = 0; row < model.rays_elevation; ++row) {
    const double elevation_rad = inclusive(model.elevation_lo_rad, model.elevation_hi_rad, row, model.rays_elevation);
    for (int column = 0; column < model.rays_azimuth; ++column) {
      const double azimuth_rad = model.panoramic() ? -kPi + 2.0 * kPi * column / model.rays_azimuth
                                                   : inclusive(-half_rad, half_rad, column, model.rays_azimuth);
      directions.push_back(Eigen::Vector3d(std::cos(elevation_rad) * std::cos(azimuth_rad),
                                           std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad))
                               .cast<float>());
    }
  }
  return directions;
}

std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;  // FNV-1a
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
  return hash;
}

/// Own stream for each scan, so that a scan depends on its number and not on what was drawn before.
Rng scan_rng(std::uint64_t seed, std::uint64_t stream_hash, std::uint64_t scan) {
  Rng mixer(seed ^ std::rotl(stream_hash, 32) ^ (scan * 0xD1342543DE82EF95ULL));
  return Rng(mixer());
}

/// `wanted` of `all` without repetition, in their order (Knuth, TAOCP 2, algorithm 3.4.2 S): neighbours stay
/// neighbours, which keeps ray packets coherent.
std::vector<Eigen::Vector3f> draw(const std::vector<Eigen::Vector3f>& all, std::size_t wanted, Rng& rng) {
  std::vector<Eigen::Vector3f> chosen;
  chosen.reserve(wanted);
  for (std::size_t i = 0; i < all.size() && chosen.size() < wanted; ++i) {
    const auto left = static_cast<double>(all.size() - i);
    if (rng.uniform() * left < static_cast<double>(wanted - chosen.size())) chosen.push_back(all[i]);
  }
  return chosen;
}

/// Distance along the unit `direction` to a sphere at `center_m` (seen from the origin); 0 inside it.
float sphere_distance_m(const Eigen::Vector3f& direction, const Eigen::Vector3f& center_m, float radius_m) {
  const float outside = center_m.squaredNorm() - radius_m * radius_m;
  if (outside <= 0.0f) return 0.0f;
  const float along = direction.dot(center_m);
  const float discriminant = along * along - outside;
  if (along <= 0.0f || discriminant < 0.0f) return std::numeric_limits<float>::infinity();
  return along - std::sqrt(discriminant);
}

/// Stereo error on a range: quantised in disparity (1/depth), then Gaussian with sigma growing with depth squared.
/// @param forward cosine between the ray and the optical axis (1 for a lidar)
double noisy_range_m(double range_m, double forward, const SensorNoise& noise, Rng& rng) {
  double depth_m = range_m * forward;
  if (noise.disparity_step_m > 0.0) {
    const double steps = std::max(1.0, std::round(1.0 / (depth_m * noise.disparity_step_m)));
    depth_m = 1.0 / (steps * noise.disparity_step_m);
  }
  depth_m += rng.normal(0.0, noise.sigma_at_1m_m * depth_m * depth_m);
  return depth_m / forward;
}

}  // namespace

SimulatedSensor::SimulatedSensor(std::shared_ptr<const RayCaster> caster, const SensorModel& model,
                                 const SensorNoise& noise, std::uint64_t seed, std::string_view stream)
    : caster_(std::move(caster)), model_(model), noise_(noise), seed_(seed), stream_hash_(hash_of(stream)) {
  if (caster_ == nullptr) throw std::invalid_argument("a simulated sensor needs a ray caster");
  if (const auto found = model_.problems(); !found.empty()) throw InputError("sensor: " + found.front());
  if (!(noise_.sigma_at_1m_m >= 0.0) || !(noise_.disparity_step_m >= 0.0) || !(noise_.dropout >= 0.0) ||
      noise_.dropout > 1.0) {
    throw InputError("sensor noise: sigma and step must not be negative, drop-outs within 0..1");
  }
  directions_ = model_.kind == SensorKind::kDepthCamera ? camera_lattice(model_) : lidar_lattice(model_);
}

void SimulatedSensor::set_fellows(std::vector<Eigen::Vector3d> centers_m, double radius_m) {
  fellows_m_ = std::move(centers_m);
  fellow_radius_m_ = radius_m;
}

std::vector<float> SimulatedSensor::ranges_m(const Pose& T_world_sensor,
                                             const std::vector<Eigen::Vector3f>& directions_sensor) const {
  const Eigen::Matrix3f R_world_sensor = T_world_sensor.linear().cast<float>();
  std::vector<Eigen::Vector3f> directions_world;
  directions_world.reserve(directions_sensor.size());
  for (const Eigen::Vector3f& direction : directions_sensor) directions_world.push_back(R_world_sensor * direction);
  const Eigen::Vector3f origin_m = T_world_sensor.translation().cast<float>();
  const auto range_m = static_cast<float>(model_.max_range_m);
  std::vector<float> found_m(directions_sensor.size());
  if (directions_sensor.size() == directions_.size()) {
    caster_->cast_lattice(origin_m, directions_world, model_.rays_azimuth, range_m, found_m);
  } else {
    caster_->cast_from(origin_m, directions_world, range_m, found_m);  // drawn ones, as they come
  }
  const Pose T_sensor_world = T_world_sensor.inverse();
  for (const Eigen::Vector3d& center_world_m : fellows_m_) {
    const Eigen::Vector3f center_m = (T_sensor_world * center_world_m).cast<float>();
    if (static_cast<double>(center_m.norm()) > model_.max_range_m + fellow_radius_m_) continue;
    for (std::size_t i = 0; i < found_m.size(); ++i) {
      found_m[i] =
          std::min(found_m[i], sphere_distance_m(directions_sensor[i], center_m, static_cast<float>(fellow_radius_m_)));
    }
  }
  return found_m;
}

Scan SimulatedSensor::capture(const Pose& T_world_sensor, double time_s) {
  Rng rng = scan_rng(seed_, stream_hash_, scans_taken_++);
  const auto samples = static_cast<std::size_t>(model_.samples_per_scan);
  const bool sampled = model_.kind == SensorKind::kLidar && samples > 0 && samples < directions_.size();
  const std::vector<Eigen::Vector3f> drawn = sampled ? draw(directions_, samples, rng) : std::vector<Eigen::Vector3f>{};
  const std::vector<Eigen::Vector3f>& directions = sampled ? drawn : directions_;
  const std::vector<float> found_m = ranges_m(T_world_sensor, directions);

  Scan scan;
  scan.T_world_sensor = T_world_sensor;
  scan.time_s = time_s;
  scan.max_range_m = model_.max_range_m;
  scan.points_m.reserve(directions.size());
  const float beyond_m = static_cast<float>(model_.max_range_m) + kBeyond_m;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    if (noise_.enabled && rng.uniform() < noise_.dropout) continue;
    double range_m = static_cast<double>(found_m[i]);
    if (range_m < model_.min_range_m) continue;
    if (noise_.enabled && std::isfinite(range_m)) {
      const double forward = model_.kind == SensorKind::kDepthCamera ? static_cast<double>(directions[i].x()) : 1.0;
      range_m = noisy_range_m(range_m, forward, noise_, rng);
      if (range_m < model_.min_range_m) continue;
    }
    range_m += kSurfaceBias_m;
    const float length_m = range_m > model_.max_range_m ? beyond_m : static_cast<float>(range_m);
    scan.points_m.emplace_back(directions[i] * length_m);
  }
  return scan;
}

}  // namespace stairwell::sim3d
