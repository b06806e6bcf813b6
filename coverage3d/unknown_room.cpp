#include "coverage3d/unknown_room.hpp"

#include "coverage3d/frontier_voxels.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace stairwell::coverage3d {
namespace {

constexpr double kLattice_m = 0.4;
constexpr int kSteps = 10;

/// Points of the lattice around one of them, marked once each.
class Marks {
 public:
  explicit Marks(const VoxelIndex& center) : center_(center), marks_(kEdge * kEdge * kEdge, false) {}
  /// Also said of points too far away.
  bool marked(const VoxelIndex& point) const {
    const VoxelIndex at = point - center_ + VoxelIndex{kReach, kReach, kReach};
    return std::min({at.x, at.y, at.z}) < 0 || std::max({at.x, at.y, at.z}) >= kEdge || marks_[index_of(at)];
  }
  void mark(const VoxelIndex& point) { marks_[index_of(point - center_ + VoxelIndex{kReach, kReach, kReach})] = true; }

 private:
  static std::size_t index_of(const VoxelIndex& at) {
    return static_cast<std::size_t>((at.z * kEdge + at.y) * kEdge + at.x);
  }
  static constexpr int kReach = kSteps + 3;  // the cluster is no point
  static constexpr int kEdge = 2 * kReach + 1;
  VoxelIndex center_;
  std::vector<bool> marks_;
};

}  // namespace

double unknown_beyond_m3(const mapping::OccupancyMap& map, const mapping::VoxelBox& box,
                         const FrontierCluster& cluster) {
  const int step = std::max(1, static_cast<int>(std::lround(kLattice_m / map.grid().resolution_m())));
  const auto unknown = [&](const VoxelIndex& v) { return holds(box, v) && map.at(v) == Occupancy::kUnknown; };
  const auto point_at = [&](const VoxelIndex& v) { return VoxelIndex{v.x / step, v.y / step, v.z / step}; };
  const auto voxel_of = [&](const VoxelIndex& p) {
    return VoxelIndex{step * p.x + step / 2, step * p.y + step / 2, step * p.z + step / 2};
  };
  const auto open_between = [&](const VoxelIndex& point, const VoxelIndex& along) {
    VoxelIndex v = voxel_of(point);
    for (int i = 0; i < step; ++i) {
      v = v + along;
      if (!unknown(v)) return false;
    }
    return true;
  };
  Marks marks(point_at(map.grid().index_of(cluster.center_m)));
  std::vector<VoxelIndex> open;
  const auto add = [&](const VoxelIndex& point) {
    marks.mark(point);
    open.push_back(point);
  };
  for (const VoxelIndex& cell : cluster.cells) {
    for (const VoxelIndex& along : kFaceSteps) {
      const VoxelIndex beside = cell + along;
      if (!unknown(beside) || marks.marked(point_at(beside))) continue;
      if (unknown(voxel_of(point_at(beside)))) add(point_at(beside));
    }
  }
  std::size_t last = open.size();  // of those that so many steps led to
  std::size_t i = 0;
  for (int steps = 0; steps < kSteps && i < open.size(); ++steps) {
    for (; i < last; ++i) {
      const VoxelIndex point = open[i];
      for (const VoxelIndex& along : kFaceSteps)
        if (!marks.marked(point + along) && open_between(point, along)) add(point + along);
    }
    last = open.size();
  }
  return static_cast<double>(open.size()) * std::pow(step * map.grid().resolution_m(), 3);
}

}  // namespace stairwell::coverage3d
