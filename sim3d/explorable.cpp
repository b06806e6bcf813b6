#include "sim3d/flood.hpp"
#include "sim3d/ground_truth.hpp"
#include "sim3d/sensors.hpp"
#include "sim3d/triangle_geometry.hpp"
#include "sim3d/view_poses.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>
#include <thread>
#include <utility>

namespace stairwell::sim3d {

namespace {

constexpr std::size_t kBatch = 16;
constexpr std::size_t kMaxTargets = 12;
constexpr double kTowardsCorner = 0.7;
/// A voxel is given up after this many poses per ray allowed, whether or not they were in view.
constexpr int kPosesPerRay = 4;

constexpr std::uint8_t kOpen = 1;      // free space around the reachable voxels, from face to face
constexpr std::uint8_t kTouching = 2;  // surface next to it
constexpr std::uint8_t kAlmost = 3;    // the same, but only touched by the surface: what is behind counts as well
constexpr std::uint8_t kBehind = 4;

bool touches(const GridSpec& grid, const VoxelIndex& v, const std::vector<std::uint8_t>& marks, std::uint8_t mark) {
  for (int n = 0; n < 27; ++n) {
    const VoxelIndex to = v + VoxelIndex{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    if (grid.contains(to) && marks[grid.linear(to)] == mark) return true;
  }
  return false;
}

void flood_free(const GroundTruth& truth, std::vector<std::uint8_t>& marks) {
  const GridSpec& grid = truth.grid();
  const auto enter = [&](const VoxelIndex&, std::size_t index) {
    if (truth.at(index) != TruthClass::kFree || marks[index] != 0) return false;
    marks[index] = kOpen;
    return true;
  };
  std::vector<VoxelIndex> beside;  // the reachable voxels themselves would be too many to list
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] == kOpen) enter_neighbours(grid, grid.voxel(i), enter, beside);
  }
  flood(grid, std::move(beside), enter);
}

/// Marks every voxel that is worth a look.
std::vector<std::uint8_t> view_candidates(const GroundTruth& truth, const std::vector<std::uint8_t>& reachable) {
  std::vector<std::uint8_t> marks = reachable;
  flood_free(truth, marks);
  const auto unmarked_surface = [&](std::size_t i) { return marks[i] == 0 && truth.at(i) != TruthClass::kFree; };
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (unmarked_surface(i) && touches(truth.grid(), truth.grid().voxel(i), marks, kOpen)) {
      marks[i] = truth.at(i) == TruthClass::kBoundary ? kAlmost : kTouching;
    }
  }
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (unmarked_surface(i) && touches(truth.grid(), truth.grid().voxel(i), marks, kAlmost)) marks[i] = kBehind;
  }
  return marks;
}

/// A place in a voxel to look at.
struct Target {
  Eigen::Vector3d point_m;
  bool surface = false;  ///< the return must fall into the voxel; otherwise the point must be seen unobstructed
  Eigen::Vector3d side = Eigen::Vector3d::Zero();  ///< normal towards the poses that may see it; zero: any
};

/// Asks for one voxel after the other whether some pose of a list sees it.
class Viewer {
 public:
  Viewer(const GridSpec& grid, const RayCaster& caster, const SensorModel& sensor, int rays_per_voxel)
      : grid_(grid), caster_(caster), sensor_(sensor), window_(sensor), rays_per_voxel_(rays_per_voxel) {}

  /// Moves the pose that saw the voxel to the front of `poses`: it likely sees the next voxel as well.
  bool sees(const VoxelIndex& v, std::span<const Target> targets, PosesAround& poses) {
    if (targets.empty()) return false;
    int rays = 0;
    std::size_t batch = 1;  // most voxels are seen at once; the others are worth whole packets
    std::size_t next = 0;
    const std::size_t most = static_cast<std::size_t>(kPosesPerRay) * static_cast<std::size_t>(rays_per_voxel_);
    const auto considered = [&](std::size_t i) { return i < most && poses.has(i); };
    while (rays < rays_per_voxel_ && considered(next)) {
      pending_.clear();
      const std::size_t wanted = std::min(batch, static_cast<std::size_t>(rays_per_voxel_ - rays));
      for (; pending_.size() < wanted && considered(next); ++next) propose(v, targets, poses[next], next);
      rays += static_cast<int>(pending_.size());
      if (const auto seen = cast_pending(v)) {
        poses.move_to_front(*seen);
        return true;
      }
      batch = kBatch;
    }
    return false;
  }

 private:
  struct Ray {
    Eigen::Vector3d origin_m;
    Eigen::Vector3d direction;
    double target_m = 0.0;
    bool surface = false;
    std::size_t pose = 0;
  };

  void propose(const VoxelIndex& v, std::span<const Target> targets, const Eigen::Vector3d& pose_m, std::size_t pose) {
    for (std::size_t k = 0; k < targets.size(); ++k) {
      const Target& target = targets[(pose + k) % targets.size()];
      const Eigen::Vector3d offset_m = target.point_m - pose_m;
      if (target.side.dot(offset_m) > 0.0) continue;
      const double distance_m = offset_m.norm();
      const double nearest_m = target.surface ? sensor_.min_range_m : 1e-6;
      const double bias_m = target.surface ? kSurfaceBias_m : 0.0;
      if (distance_m < nearest_m || distance_m + bias_m > sensor_.max_range_m || !window_.contains(offset_m)) continue;
      const Eigen::Vector3d direction = offset_m / distance_m;
      if (!(grid_.index_of(target.point_m + bias_m * direction) == v)) continue;
      pending_.push_back({pose_m, direction, distance_m, target.surface, pose});
      return;
    }
  }

  /// Position in the list of the pose that sees the voxel.
  std::optional<std::size_t> cast_pending(const VoxelIndex& v) {
    const std::size_t count = pending_.size();
    const double overshoot_m = grid_.resolution_m();
    for (std::size_t i = 0; i < count; ++i) {
      const Ray& ray = pending_[i];
      origins_[i] = ray.origin_m.cast<float>();
      directions_[i] = ray.direction.cast<float>();
      ranges_[i] = static_cast<float>(ray.surface ? ray.target_m + overshoot_m : ray.target_m);
    }
    if (count == 1) {
      distances_[0] = caster_.cast(origins_[0], directions_[0], ranges_[0]).distance_m;
    } else if (count > 1) {
      caster_.cast_many({origins_.data(), count}, {directions_.data(), count}, {ranges_.data(), count},
                        {distances_.data(), count});
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Ray& ray = pending_[i];
      const auto hit_m = static_cast<double>(distances_[i]);
      if (!ray.surface && std::isinf(hit_m)) return ray.pose;
      if (!ray.surface || std::isinf(hit_m) || hit_m < sensor_.min_range_m) continue;
      const double return_m = hit_m + kSurfaceBias_m;
      if (return_m <= sensor_.max_range_m && grid_.index_of(ray.origin_m + return_m * ray.direction) == v) {
        return ray.pose;
      }
    }
    return std::nullopt;
  }

  const GridSpec& grid_;
  const RayCaster& caster_;
  const SensorModel& sensor_;
  ElevationWindow window_;
  int rays_per_voxel_;
  std::vector<Ray> pending_;
  std::array<Eigen::Vector3f, kBatch> origins_;
  std::array<Eigen::Vector3f, kBatch> directions_;
  std::array<float, kBatch> ranges_;
  std::array<float, kBatch> distances_;
};

/// Visits the voxels of the block that the grid has.
template <typename Visit>
void for_each_in_block(const GridSpec& grid, const VoxelIndex& corner, int edge, const Visit& visit) {
  for (int z = corner.z; z < std::min(corner.z + edge, grid.size()[2]); ++z) {
    for (int y = corner.y; y < std::min(corner.y + edge, grid.size()[1]); ++y) {
      for (int x = corner.x; x < std::min(corner.x + edge, grid.size()[0]); ++x) visit(VoxelIndex{x, y, z});
    }
  }
}

/// Lists places in a voxel to look at: the centre of a free one, points of the surface in the others.
class TargetFinder {
 public:
  TargetFinder(const GroundTruth& truth, const std::vector<std::uint8_t>& marks) : truth_(truth), marks_(marks) {}

  const std::vector<Target>& find(const VoxelIndex& v) {
    targets_.clear();
    const Eigen::Vector3d center_m = truth_.grid().center_of(v);
    const TruthClass found = truth_.at(v);
    if (found == TruthClass::kFree) {
      targets_.push_back({center_m, false});
      return targets_;
    }
    const double half_m =
        0.5 * truth_.grid().resolution_m() + (found == TruthClass::kBoundary ? truth_.face_tolerance_m() : 0.0);
    const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(half_m);
    triangles_.clear();
    truth_.triangles_near(center_m, half_m, triangles_);
    for (const std::uint32_t i : triangles_) {
      if (targets_.size() < kMaxTargets) {
        add(triangle_of(truth_.mesh(), i), {center_m - reach_m, center_m + reach_m}, v);
      }
    }
    return targets_;
  }

 private:
  void add(const Triangle& triangle, const Aabb& box, const VoxelIndex& v) {
    const std::vector<Eigen::Vector3d> polygon = clip_to_box(triangle, box);
    if (polygon.empty()) return;
    const Eigen::Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
    Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& corner_m : polygon) middle_m += corner_m;
    middle_m /= static_cast<double>(polygon.size());
    const bool front = seen_along(middle_m, normal, v);
    const bool back = seen_along(middle_m, -normal, v);
    if (!front && !back) return;
    Eigen::Vector3d side = Eigen::Vector3d::Zero();
    if (!back) side = normal;
    if (!front) side = -normal;
    targets_.push_back({middle_m, true, side});
    for (const std::size_t corner : {std::size_t{0}, polygon.size() / 2}) {
      targets_.push_back({middle_m + kTowardsCorner * (polygon[corner] - middle_m), true, side});
    }
  }

  /// Whether a return from this side falls into the voxel and comes through space that can be open.
  bool seen_along(const Eigen::Vector3d& point_m, const Eigen::Vector3d& side, const VoxelIndex& v) const {
    const GridSpec& grid = truth_.grid();
    if (!(grid.index_of(point_m - kSurfaceBias_m * side) == v)) return false;
    const VoxelIndex before = grid.index_of(point_m + 0.2 * grid.resolution_m() * side);
    if (before == v) return true;
    if (!grid.contains(before)) return false;
    const std::uint8_t mark = marks_[grid.linear(before)];
    return mark == kOpen || mark == kTouching || mark == kAlmost;
  }

  const GroundTruth& truth_;
  const std::vector<std::uint8_t>& marks_;
  std::vector<Target> targets_;
  std::vector<std::uint32_t> triangles_;
};

/// Looks at the voxels of one block after the other, from poses around it.
class BlockViewer {
 public:
  BlockViewer(const GroundTruth& truth, const std::vector<std::uint8_t>& reachable,
              const std::vector<std::uint8_t>& candidates, const ViewPoses& view_poses, const RayCaster& caster,
              const SensorModel& sensor, const Aabb& task_box, int rays_per_voxel)
      : grid_(truth.grid()),
        reachable_(reachable),
        candidates_(candidates),
        edge_(view_poses.block_edge()),
        poses_(view_poses),
        task_box_(task_box),
        viewer_(truth.grid(), caster, sensor, rays_per_voxel),
        targets_(truth, candidates) {}

  /// Marks what is seen of the block.
  void look(const VoxelIndex& corner, std::vector<std::uint8_t>& seen) {
    poses_.move_to(corner);
    for_each_in_block(grid_, corner, edge_, [&](const VoxelIndex& v) {
      const std::size_t index = grid_.linear(v);
      if (candidates_[index] == 0 || !task_box_.contains(grid_.center_of(v))) return;
      if (reachable_[index] != 0) {
        seen[index] = 1;
        return;
      }
      seen[index] = viewer_.sees(v, targets_.find(v), poses_) ? 1 : 0;
    });
  }

 private:
  const GridSpec& grid_;
  const std::vector<std::uint8_t>& reachable_;
  const std::vector<std::uint8_t>& candidates_;
  int edge_;  ///< of a block, voxels
  PosesAround poses_;
  const Aabb& task_box_;
  Viewer viewer_;
  TargetFinder targets_;
};

}  // namespace

std::vector<std::uint8_t> GroundTruth::explorable(const std::vector<std::uint8_t>& reachable, const RayCaster& caster,
                                                  const SensorModel& sensor, const Aabb& task_box,
                                                  int rays_per_voxel) const {
  if (reachable.size() != grid_.voxel_count()) throw std::invalid_argument("explorable: one byte per voxel is needed");
  std::vector<std::uint8_t> seen(reachable.size(), 0);
  if (rays_per_voxel < 1 || std::find(reachable.begin(), reachable.end(), 1) == reachable.end()) return seen;
  const std::vector<std::uint8_t> candidates = view_candidates(*this, reachable);
  const ViewPoses view_poses(grid_, reachable, sensor);
  const int edge = view_poses.block_edge();
  // Blocks do not depend on each other: threads take layers of them, and the result is the same for any number.
  std::atomic<int> next_z{0};
  const auto look_at_layers = [&] {
    BlockViewer viewer(*this, reachable, candidates, view_poses, caster, sensor, task_box, rays_per_voxel);
    for (int z = next_z.fetch_add(edge); z < grid_.size()[2]; z = next_z.fetch_add(edge)) {
      for (int y = 0; y < grid_.size()[1]; y += edge) {
        for (int x = 0; x < grid_.size()[0]; x += edge) viewer.look({x, y, z}, seen);
      }
    }
  };
  {
    std::vector<std::jthread> helpers(std::max(1U, std::thread::hardware_concurrency()) - 1);
    for (std::jthread& helper : helpers) helper = std::jthread(look_at_layers);
    look_at_layers();
  }
  return seen;
}

}  // namespace stairwell::sim3d
