#include "core/grid_spec.hpp"

#include "core/errors.hpp"

#include <cmath>
#include <sstream>

namespace stairwell {

namespace {
constexpr double kFaceTolerance = 1e-6;
constexpr double kKeyLimit = 32768.0;  // OctoMap: 16 bits per axis, origin in the middle
}  // namespace

GridSpec::GridSpec(const Aabb& box, double resolution_m) : resolution_m_(resolution_m) {
  if (!(resolution_m > 0.0) || !std::isfinite(resolution_m)) {
    throw InputError("resolution must be a positive number of metres, got " + std::to_string(resolution_m));
  }
  per_m_ = 1.0 / resolution_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double lo = box.min_m[axis] / resolution_m;
    const double hi = box.max_m[axis] / resolution_m;
    if (!std::isfinite(lo) || !std::isfinite(hi) || !(lo < hi)) {
      std::ostringstream message;
      message << "box is empty or not finite along axis "
              << "xyz"[axis] << ": " << box.min_m[axis] << " to " << box.max_m[axis] << " m";
      throw InputError(message.str());
    }
    const double first = std::floor(lo + kFaceTolerance);
    const double last = std::ceil(hi - kFaceTolerance);
    if (first < -kKeyLimit || last > kKeyLimit) {
      std::ostringstream message;
      message << "box reaches beyond OctoMap's key space along axis "
              << "xyz"[axis] << " (" << box.min_m[axis] << " to " << box.max_m[axis] << " m at " << resolution_m
              << " m): use a coarser resolution";
      throw InputError(message.str());
    }
    first_cell_[static_cast<std::size_t>(axis)] = static_cast<int>(first);
    size_[static_cast<std::size_t>(axis)] = std::max(1, static_cast<int>(last - first));
  }
}

Aabb GridSpec::box() const {
  const Eigen::Vector3d lo(first_cell_[0], first_cell_[1], first_cell_[2]);
  const Eigen::Vector3d cells(size_[0], size_[1], size_[2]);
  return {lo * resolution_m_, (lo + cells) * resolution_m_};
}

VoxelIndex GridSpec::voxel(std::size_t linear_index) const {
  const auto nx = static_cast<std::size_t>(size_[0]);
  const auto ny = static_cast<std::size_t>(size_[1]);
  return {static_cast<int>(linear_index % nx), static_cast<int>(linear_index / nx % ny),
          static_cast<int>(linear_index / (nx * ny))};
}

}  // namespace stairwell
