#include "sim3d/view_poses.hpp"

#include "core/rng.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stairwell::sim3d {

namespace {
constexpr double kPoseSpacing_m = 0.25;
}

ElevationWindow::ElevationWindow(const SensorModel& model)
    : low_(std::tan(model.elevation_lo_rad)),
      high_(std::tan(model.elevation_hi_rad)),
      nearest_forward_(model.kind == SensorKind::kDepthCamera ? std::cos(0.5 * model.azimuth_fov_rad) : 1.0) {}

bool ElevationWindow::contains(const Eigen::Vector3d& offset_m, double slack_m) const {
  const double across_m = std::max(offset_m.head<2>().norm(), 1e-9);
  return fits(offset_m.z(), across_m, slack_m) || fits(offset_m.z(), across_m * nearest_forward_, slack_m);
}

bool ElevationWindow::fits(double up_m, double forward_m, double slack_m) const {
  const double low_m = low_ < 0.0 ? low_ * (forward_m + slack_m) : low_ * (forward_m - slack_m);
  const double high_m = high_ > 0.0 ? high_ * (forward_m + slack_m) : high_ * (forward_m - slack_m);
  return up_m >= low_m - slack_m && up_m <= high_m + slack_m;
}

ViewPoses::ViewPoses(const GridSpec& grid, const std::vector<std::uint8_t>& reachable, const SensorModel& model)
    : grid_(grid), stride_(std::max(1, static_cast<int>(std::lround(kPoseSpacing_m / grid.resolution_m())))) {
  for (std::size_t axis = 0; axis < 3; ++axis) size_[axis] = (grid.size()[axis] + stride_ - 1) / stride_;
  collect(reachable);
  list_offsets(model);
}

bool ViewPoses::contains(const VoxelIndex& cell) const {
  return cell.x >= 0 && cell.y >= 0 && cell.z >= 0 && cell.x < size_[0] && cell.y < size_[1] && cell.z < size_[2];
}

std::size_t ViewPoses::linear(const VoxelIndex& cell) const {
  return (static_cast<std::size_t>(cell.z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(cell.y)) *
             static_cast<std::size_t>(size_[0]) +
         static_cast<std::size_t>(cell.x);
}

/// Keeps the reachable voxel nearest to each cell's middle.
void ViewPoses::collect(const std::vector<std::uint8_t>& reachable) {
  poses_.assign(linear({0, 0, size_[2]}), kNone);
  std::vector<int> off_middle(poses_.size(), 3 * stride_ * stride_);
  const auto square_off = [&](int x) { return (x % stride_ - stride_ / 2) * (x % stride_ - stride_ / 2); };
  for (std::size_t i = 0; i < reachable.size(); ++i) {
    if (reachable[i] == 0) continue;
    const VoxelIndex v = grid_.voxel(i);
    const std::size_t cell = linear({v.x / stride_, v.y / stride_, v.z / stride_});
    const int off = square_off(v.x) + square_off(v.y) + square_off(v.z);
    if (off >= off_middle[cell]) continue;
    off_middle[cell] = off;
    poses_[cell] = static_cast<std::uint32_t>(i);
  }
}

void ViewPoses::list_offsets(const SensorModel& model) {
  const ElevationWindow window(model);
  const double cell_m = stride_ * grid_.resolution_m();
  const double slack_m = cell_m * (0.5 * kCellsPerBlock + 1.0) * std::sqrt(3.0);
  const int reach = static_cast<int>(std::ceil((model.max_range_m + slack_m) / cell_m));
  const auto within = [&](int axis) { return std::min(reach, size_[static_cast<std::size_t>(axis)]); };
  for (int z = -within(2); z <= within(2); ++z) {
    for (int y = -within(1); y <= within(1); ++y) {
      for (int x = -within(0); x <= within(0); ++x) {
        const Eigen::Vector3d offset_m = cell_m * Eigen::Vector3d(x, y, z);
        if (offset_m.norm() > model.max_range_m + slack_m || !window.contains(-offset_m, slack_m)) continue;
        nearest_.push_back({x, y, z});
      }
    }
  }
  const auto squared = [](const VoxelIndex& v) { return v.x * v.x + v.y * v.y + v.z * v.z; };
  std::stable_sort(nearest_.begin(), nearest_.end(),
                   [&](const VoxelIndex& a, const VoxelIndex& b) { return squared(a) < squared(b); });
  shuffled_ = nearest_;
  Rng rng = make_rng(0, "view poses");
  for (int i = static_cast<int>(shuffled_.size()) - 1; i > 0; --i) {
    std::swap(shuffled_[static_cast<std::size_t>(i)], shuffled_[static_cast<std::size_t>(rng.uniform_int(0, i))]);
  }
}

void PosesAround::move_to(const VoxelIndex& block_corner) {
  const auto middle_of = [&](int corner) { return corner / from_.stride_ + ViewPoses::kCellsPerBlock / 2; };
  middle_ = {middle_of(block_corner.x), middle_of(block_corner.y), middle_of(block_corner.z)};
  // Each block starts elsewhere in the shuffled list (spatial hash of Teschner et al. 2003).
  turn_ = (static_cast<std::size_t>(middle_.x) * 73856093U) ^ (static_cast<std::size_t>(middle_.y) * 19349663U) ^
          (static_cast<std::size_t>(middle_.z) * 83492791U);
  next_ = 0;
  poses_m_.clear();
}

bool PosesAround::has(std::size_t i) {
  const std::size_t count = from_.nearest_.size();
  for (; i >= poses_m_.size() && next_ < count; ++next_) {
    offer(from_.nearest_[next_]);
    offer(from_.shuffled_[(turn_ + next_) % count]);
  }
  return i < poses_m_.size();
}

void PosesAround::offer(const VoxelIndex& offset) {
  const VoxelIndex cell = middle_ + offset;
  if (!from_.contains(cell)) return;
  const std::uint32_t pose = from_.poses_[from_.linear(cell)];
  if (pose != ViewPoses::kNone) poses_m_.push_back(from_.grid_.center_of(from_.grid_.voxel(pose)));
}

void PosesAround::move_to_front(std::size_t i) {
  const auto at = poses_m_.begin() + static_cast<std::ptrdiff_t>(i);
  std::rotate(poses_m_.begin(), at, at + 1);
}

}  // namespace stairwell::sim3d
