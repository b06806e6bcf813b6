#include "mapping/potential_volume.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::mapping {

namespace {

double kernel(double gain, double sigma_m, double distance_m) {
  const double ratio = distance_m / sigma_m;
  return gain / (sigma_m * std::sqrt(2.0 * kPi)) * std::exp(-0.5 * ratio * ratio);
}

}  // namespace

std::vector<std::string> PotentialConfig::problems() const {
  std::vector<std::string> found;
  const auto require = [&](bool good, const char* name, const char* rule, double value) {
    if (!good || !std::isfinite(value)) {
      found.push_back(std::string(name) + " must be " + rule + ", got " + std::to_string(value));
    }
  };
  require(k_attr >= 0.0, "k_attr", "at least 0", k_attr);
  require(k_rep >= 0.0, "k_rep", "at least 0", k_rep);
  require(sigma_m > 0.0, "sigma_m", "positive", sigma_m);
  require(reach_m > 0.0, "reach_m", "positive", reach_m);
  require(k_exp >= 0.0, "k_exp", "at least 0", k_exp);
  require(k_mobile >= 0.0, "k_mobile", "at least 0", k_mobile);
  require(sigma_mobile_m > 0.0, "sigma_mobile_m", "positive", sigma_mobile_m);
  require(reach_mobile_m > 0.0, "reach_mobile_m", "positive", reach_mobile_m);
  return found;
}

/// The voxel layers at the eight centres around a point (bit 0 of the corner: x, 1: y, 2: z), and where it lies
/// between them.
struct PotentialVolume::Cell {
  std::array<double, 8> corner;
  std::array<double, 3> fraction;
  std::array<bool, 3> clamped;
};

PotentialVolume::PotentialVolume(const OccupancyMap& map, const DistanceField& field, const PotentialConfig& config)
    : map_(&map), field_(&field), config_(config) {
  const std::vector<std::string> problems = config.problems();
  if (!problems.empty()) {
    throw InputError("unusable potential: " + problems.front());
  }
  const double resolution_m = field.grid().resolution_m();
  if (!(field.grid() == map.grid())) {
    throw InputError("potential: map and distance field cover different grids");
  }
  if (field.truncation_cells() * resolution_m < config.reach_m * (1.0 - 1e-9)) {
    throw InputError("potential: reach_m " + std::to_string(config.reach_m) + " is beyond the distance field's " +
                     std::to_string(field.truncation_m()) + " m");
  }
  const int cap = field.truncation_cells() * field.truncation_cells();
  repulsion_of_squared_cells_.assign(static_cast<std::size_t>(cap) + 1, 0.0F);
  for (int squared = 0; squared < cap; ++squared) {  // the cap itself stands for everything farther away
    const double distance_m = resolution_m * std::sqrt(static_cast<double>(squared));
    if (distance_m < config.reach_m) {
      repulsion_of_squared_cells_[static_cast<std::size_t>(squared)] =
          static_cast<float>(kernel(config.k_rep, config.sigma_m, distance_m));
    }
  }
}

double PotentialVolume::attractive(const Eigen::Vector3d& point_m) const {
  return config_.k_attr * (point_m - goal_m_).norm();
}

double PotentialVolume::mobile(const Eigen::Vector3d& point_m) const {
  double sum = 0.0;
  for (const Eigen::Vector3d& position_m : mobile_m_) {
    const double distance_m = (point_m - position_m).norm();
    if (distance_m < config_.reach_mobile_m) {
      sum += kernel(config_.k_mobile, config_.sigma_mobile_m, distance_m);
    }
  }
  return sum;
}

double PotentialVolume::repulsive(const VoxelIndex& v) const {
  return static_cast<double>(repulsion_of_squared_cells_[field_->squared_cells(v)]);
}

double PotentialVolume::exploration(const VoxelIndex& v) const {
  return config_.k_exp > 0.0 && map_->at(v) != Occupancy::kUnknown ? config_.k_exp : 0.0;
}

PotentialVolume::Cell PotentialVolume::cell_at(const Eigen::Vector3d& point_m) const {
  const GridSpec& spec = grid();
  const Eigen::Vector3d lattice = (point_m - spec.center_of({0, 0, 0})) / spec.resolution_m();
  Cell cell{};
  std::array<int, 3> lo{};
  std::array<int, 3> hi{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int last = spec.size()[axis] - 1;
    const double wanted = lattice[static_cast<Eigen::Index>(axis)];
    const double along = std::clamp(wanted, 0.0, static_cast<double>(last));
    cell.clamped[axis] = along != wanted;
    lo[axis] = std::min(static_cast<int>(along), std::max(last - 1, 0));
    hi[axis] = std::min(lo[axis] + 1, last);
    cell.fraction[axis] = along - lo[axis];
  }
  for (unsigned corner = 0; corner < 8; ++corner) {
    const VoxelIndex v{(corner & 1U) != 0 ? hi[0] : lo[0], (corner & 2U) != 0 ? hi[1] : lo[1],
                       (corner & 4U) != 0 ? hi[2] : lo[2]};
    cell.corner[corner] = repulsive(v) + exploration(v);
  }
  return cell;
}

double PotentialVolume::value(const Eigen::Vector3d& point_m) const {
  const Cell cell = cell_at(point_m);
  double sum = attractive(point_m) + mobile(point_m);
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    for (unsigned axis = 0; axis < 3; ++axis) {
      weight *= ((corner >> axis) & 1U) != 0 ? cell.fraction[axis] : 1.0 - cell.fraction[axis];
    }
    sum += weight * cell.corner[corner];
  }
  return sum;
}

Eigen::Vector3d PotentialVolume::gradient(const Eigen::Vector3d& point_m) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const Eigen::Vector3d to_goal_m = point_m - goal_m_;
  if (to_goal_m.norm() > 0.0) {
    sum += config_.k_attr * to_goal_m.normalized();
  }
  for (const Eigen::Vector3d& position_m : mobile_m_) {
    const Eigen::Vector3d away_m = point_m - position_m;
    const double sigma_m = config_.sigma_mobile_m;
    if (away_m.norm() < config_.reach_mobile_m) {
      sum -= kernel(config_.k_mobile, sigma_m, away_m.norm()) / (sigma_m * sigma_m) * away_m;
    }
  }
  const Cell cell = cell_at(point_m);
  for (unsigned along = 0; along < 3; ++along) {
    if (cell.clamped[along]) {
      continue;
    }
    double slope = 0.0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      double weight = ((corner >> along) & 1U) != 0 ? 1.0 : -1.0;
      for (unsigned axis = 0; axis < 3; ++axis) {
        if (axis != along) {
          weight *= ((corner >> axis) & 1U) != 0 ? cell.fraction[axis] : 1.0 - cell.fraction[axis];
        }
      }
      slope += weight * cell.corner[corner];
    }
    sum[along] += slope / grid().resolution_m();
  }
  return sum;
}

}  // namespace stairwell::mapping
