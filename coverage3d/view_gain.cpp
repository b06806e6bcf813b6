#include "coverage3d/view_gain.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace stairwell::coverage3d {
namespace {

constexpr double kStep_m = 0.2;
constexpr double kSteps = 40.0;     // per ray, where the range is so long that steps of that size would be more
constexpr double kDepthPart = 0.6;  // space behind a frontier counts as deep as this part of the sensor's range

constexpr double kCell_m = 0.4;  // of what is foreseen

/// @param up sine of the elevation
Eigen::Vector3d direction_of(double azimuth_rad, double up) {
  const double level = std::sqrt(1.0 - up * up);
  return {level * std::cos(azimuth_rad), level * std::sin(azimuth_rad), up};
}

/// How far along a ray every point surely lies in the box, whatever the rounding.
double surely_within_m(const Aabb& box, const Eigen::Vector3d& from_m, const Eigen::Vector3d& direction) {
  constexpr double kRounding_m = 1e-6;
  double reach_m = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double wall_m = direction[axis] > 0.0 ? box.max_m[axis] : box.min_m[axis];
    if (!(std::abs(direction[axis]) > kRounding_m)) {
      if (!(from_m[axis] > box.min_m[axis] + 1e3 * kRounding_m && from_m[axis] < box.max_m[axis] - 1e3 * kRounding_m))
        return 0.0;
      continue;
    }
    reach_m = std::min(reach_m, (wall_m - from_m[axis]) / direction[axis]);
  }
  return reach_m - 1e3 * kRounding_m;
}

}  // namespace

Foreseen::Foreseen(const GridSpec& grid)
    : step_(std::max(1, static_cast<int>(std::lround(kCell_m / grid.resolution_m())))),
      cell_m_(step_ * grid.resolution_m()) {
  for (std::size_t axis = 0; axis < 3; ++axis) size_[axis] = static_cast<std::size_t>(grid.size()[axis] / step_ + 1);
  cells_.assign(size_[0] * size_[1] * size_[2], false);
}

ViewGain::ViewGain(const ViewGainConfig& config, bool one_by_one)
    : config_(config), bundled_(!one_by_one && config.kind == GainKind::kVolume) {
  if (config.kind == GainKind::kEntropy) information_.emplace(config.occupancy);
  const double sin_lo = std::sin(config.sensor.elevation_lo_rad);
  const double sin_hi = std::sin(config.sensor.elevation_hi_rad);
  for (std::size_t sector = 0; sector < kSectors; ++sector) {
    for (std::size_t row = 0; row < kRows; ++row) {
      const double up = sin_lo + (sin_hi - sin_lo) * (static_cast<double>(row) + 0.5) / static_cast<double>(kRows);
      directions_[sector][row] = direction_of(2.0 * kPi * (static_cast<double>(sector) + 0.5) / kSectors, up);
    }
  }
  static_assert(kSectors % (2 * gain_rays::kLanes) == 0, "bundles are full, whatever the stride");
  const auto every = static_cast<std::size_t>(stride());
  for (std::size_t sector = 0; sector < kSectors; sector += every * gain_rays::kLanes) {
    gain_rays::Bundle& bundle = bundles_.emplace_back();
    for (std::size_t row = 0; row < kRows; ++row) {
      gain_rays::Bundle::Row& rays = bundle.rows.emplace_back();
      for (std::size_t lane = 0; lane < gain_rays::kLanes; ++lane) {
        const Eigen::Vector3d& direction = directions_[sector + every * lane][row];
        rays.x[lane] = direction.x();
        rays.y[lane] = direction.y();
        rays.z[lane] = direction.z();
      }
    }
  }
  solid_angle_ = stride() * (2.0 * kPi / kSectors) * (sin_hi - sin_lo) / kRows;
}

double ViewGain::step_m(const mapping::OccupancyMap& map) const {
  return std::max({kStep_m, map.grid().resolution_m(), config_.sensor.max_range_m / kSteps});
}

/// What `follow` and `sector_m3` do along every ray, in numbers.
gain_rays::Steps ViewGain::steps(double step_m) const {
  gain_rays::Steps all;
  for (double r_m = step_m; r_m < config_.sensor.max_range_m; r_m += step_m) {
    all.r_m.push_back(r_m);
    const double value_m3 = r_m * r_m * step_m * solid_angle_;
    all.value_m3.push_back(r_m >= config_.sensor.min_range_m ? value_m3 : 0.0);
  }
  const double deepest_m = kDepthPart * config_.sensor.max_range_m;
  for (double depth_m = 0.0; depth_m < deepest_m; depth_m += step_m) ++all.most_unknown;
  return all;
}

template <typename Each>
void ViewGain::follow(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, const Eigen::Vector3d& direction,
                      double step_m, const Each& each) const {
  const double deepest_m = kDepthPart * config_.sensor.max_range_m;
  const double within_m = surely_within_m(config_.box, from_m, direction);
  double depth_m = 0.0;
  for (double r_m = step_m; r_m < config_.sensor.max_range_m && depth_m < deepest_m; r_m += step_m) {
    const Eigen::Vector3d point_m = from_m + r_m * direction;
    if (r_m > within_m && !config_.box.contains(point_m)) return;
    const VoxelIndex v = map.grid().index_of(point_m);
    if (!map.grid().contains(v)) {
      depth_m += step_m;
      continue;
    }
    const std::size_t index = map.grid().linear(v);
    const Occupancy there = map.at(index);
    const bool unknown = there == Occupancy::kUnknown;
    if (unknown) depth_m += step_m;
    if (r_m >= config_.sensor.min_range_m) each(v, r_m, unknown);
    if (there == Occupancy::kOccupied || (!unknown && map.ever_hit(index))) return;
  }
}

double ViewGain::sector_m3(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, std::size_t sector,
                           const Foreseen* foreseen) const {
  const double step = step_m(map);
  double sum_m3 = 0.0;
  for (const Eigen::Vector3d& direction : directions_[sector]) {
    follow(map, from_m, direction, step, [&](const VoxelIndex& v, double r_m, bool unknown) {
      if (!unknown && !information_) return;
      if (foreseen != nullptr && foreseen->has(v)) return;
      const double part = unknown ? 1.0 : information_->part_of_unknown(map.log_odds(v));
      sum_m3 += part * r_m * r_m * step * solid_angle_;
    });
  }
  return sum_m3;
}

ViewGain::Panorama ViewGain::panorama(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m,
                                      const Foreseen* foreseen) const {
  Panorama sectors{};
  const auto every = static_cast<std::size_t>(stride());
  if (bundled_ && foreseen == nullptr && gain_rays::usable(map, config_.box)) {
    const gain_rays::Steps all = steps(step_m(map));
    for (std::size_t i = 0; i < bundles_.size(); ++i) {
      const auto sums_m3 = gain_rays::sum(map, config_.box, from_m, all, bundles_[i]);
      for (std::size_t lane = 0; lane < gain_rays::kLanes; ++lane)
        sectors[every * (i * gain_rays::kLanes + lane)] = sums_m3[lane];
    }
    return sectors;
  }
  for (std::size_t sector = 0; sector < kSectors; sector += every) {
    sectors[sector] = sector_m3(map, from_m, sector, foreseen);
  }
  return sectors;
}

double ViewGain::gain_m3(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, double yaw_rad,
                         const Foreseen* foreseen) const {
  if (config_.sensor.panoramic()) return in_view_m3(panorama(map, from_m, foreseen), yaw_rad);
  double sum_m3 = 0.0;
  for_each_in_view(yaw_rad, [&](std::size_t sector) { sum_m3 += sector_m3(map, from_m, sector, foreseen); });
  return sum_m3;
}

void ViewGain::foresee(const mapping::OccupancyMap& map, const Eigen::Vector3d& from_m, double yaw_rad,
                       Foreseen& foreseen) const {
  const SensorModel& sensor = config_.sensor;
  const double spacing_rad = foreseen.cell_m() / sensor.max_range_m;
  const double sin_lo = std::sin(sensor.elevation_lo_rad);
  const double sin_hi = std::sin(sensor.elevation_hi_rad);
  const int columns = static_cast<int>(std::ceil(sensor.azimuth_fov_rad / spacing_rad));
  const int rows = static_cast<int>(std::ceil((sin_hi - sin_lo) / spacing_rad));
  const double step = step_m(map);
  for (int column = 0; column < columns; ++column) {
    const double azimuth_rad = yaw_rad + sensor.azimuth_fov_rad * ((column + 0.5) / columns - 0.5);
    for (int row = 0; row < rows; ++row) {
      const double up = sin_lo + (sin_hi - sin_lo) * (row + 0.5) / rows;
      follow(map, from_m, direction_of(azimuth_rad, up), step,
             [&](const VoxelIndex& v, double, bool) { foreseen.mark(v); });
    }
  }
}

template <typename Each>
void ViewGain::for_each_in_view(double yaw_rad, const Each& each) const {
  constexpr double kPerRad = kSectors / (2.0 * kPi);
  const double half = 0.5 * config_.sensor.azimuth_fov_rad * kPerRad;
  const double middle = yaw_rad * kPerRad - 0.5;  // sector i is centred at i + 1/2
  for (int i = static_cast<int>(std::ceil(middle - half)); i <= static_cast<int>(std::floor(middle + half)); ++i) {
    each(static_cast<std::size_t>(((i % kSectors) + kSectors) % kSectors));
  }
}

double ViewGain::in_view_m3(const Panorama& sectors, double yaw_rad) const {
  if (config_.sensor.panoramic()) return std::accumulate(sectors.begin(), sectors.end(), 0.0);
  double sum_m3 = 0.0;
  for_each_in_view(yaw_rad, [&](std::size_t sector) { sum_m3 += sectors[sector]; });
  return sum_m3;
}

}  // namespace stairwell::coverage3d
