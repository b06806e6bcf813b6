#include "coverage3d/slab_finish.hpp"

#include "core/units.hpp"
#include "coverage3d/voxel_walk.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>

namespace stairwell::coverage3d {
namespace {

constexpr std::size_t kLargestIgnored = 60;  // voxels of a region
constexpr double kInflation_m = 0.199;
constexpr double kPieceRadius_m = 3.0;
constexpr std::array<double, 3> kRadii_m{0.5, 0.75, 1.0};
constexpr double kAzimuthStep_deg = 15.0;
constexpr std::size_t kMostUnseen = 10;  // a pose that sees no more voxels than this does not count
constexpr double kFarthest_m = 22.0;
constexpr double kLowest_deg = -5.0;
constexpr double kHighest_deg = 50.0;

using Cells = std::vector<VoxelIndex>;

bool solid(const mapping::OccupancyMap& map, const VoxelIndex& v) {
  return map.at(v) == Occupancy::kOccupied || map.ever_hit(v);
}

template <typename Visit>
bool all_around(const VoxelIndex& center, int reach, const Visit& visit) {
  for (int z = -reach; z <= reach; ++z)
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x)
        if (!visit(center + VoxelIndex{x, y, z})) return false;
  return true;
}

/// Clusters that touch each other, by the smallest id among them.
std::map<std::uint32_t, std::uint32_t> regions_of(const FrontierFinder& finder) {
  std::map<std::uint32_t, std::uint32_t> parent;
  for (const auto& entry : finder.clusters()) parent[entry.first] = entry.first;
  const auto root = [&](std::uint32_t id) {
    while (parent.at(id) != id) id = parent.at(id);
    return id;
  };
  for (const auto& [id, cluster] : finder.clusters()) {
    for (const VoxelIndex& v : cluster.cells) {
      all_around(v, 1, [&](const VoxelIndex& beside) {
        const std::uint32_t other = finder.cluster_at(beside);
        if (other == 0 || other == id) return true;
        const std::uint32_t a = root(id);
        const std::uint32_t b = root(other);
        parent[std::max(a, b)] = std::min(a, b);
        return true;
      });
    }
  }
  for (auto& entry : parent) entry.second = root(entry.first);
  return parent;
}

Eigen::Vector3d mean_m(const GridSpec& grid, const Cells& cells) {
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (const VoxelIndex& v : cells) sum_m += grid.center_of(v);
  return sum_m / static_cast<double>(cells.size());
}

/// Cuts across the longer horizontal axis until every voxel is near the mean of its piece.
void cut_into_pieces(const GridSpec& grid, Cells cells, std::vector<Cells>& pieces) {
  const Eigen::Vector2d mean = mean_m(grid, cells).head<2>();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  double farthest_m = 0.0;
  for (const VoxelIndex& v : cells) {
    const Eigen::Vector2d d = grid.center_of(v).head<2>() - mean;
    spread += d * d.transpose();
    farthest_m = std::max(farthest_m, d.norm());
  }
  if (farthest_m <= kPieceRadius_m) {
    pieces.push_back(std::move(cells));
    return;
  }
  const Eigen::Vector2d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(1);
  const auto middle = std::stable_partition(cells.begin(), cells.end(), [&](const VoxelIndex& v) {
    return axis.dot(grid.center_of(v).head<2>() - mean) < 0.0;
  });
  Cells upper(middle, cells.end());
  cells.erase(middle, cells.end());
  cut_into_pieces(grid, std::move(cells), pieces);
  cut_into_pieces(grid, std::move(upper), pieces);
}

/// Looks at frontier voxels from poses beside them.
class Looker {
 public:
  /// @param clearance voxels around an obstacle that a pose keeps away
  /// @param hiding    voxels around an obstacle that hide what is in or behind them
  Looker(const mapping::OccupancyMap& map, int clearance, int hiding)
      : map_(map), clearance_(clearance), hiding_(hiding) {}

  /// Whether some pose beside the middle of the piece sees enough of it.
  bool open(const Cells& piece) {
    Cells visible;
    for (const VoxelIndex& v : piece)
      if (!hides(v)) visible.push_back(v);
    if (visible.size() <= kMostUnseen) return false;
    const Eigen::Vector3d middle_m = mean_m(map_.grid(), piece);
    for (const double radius_m : kRadii_m) {
      for (double azimuth_deg = 0.0; azimuth_deg < 360.0; azimuth_deg += kAzimuthStep_deg) {
        const double azimuth = rad_from_deg(azimuth_deg);
        const Eigen::Vector3d aside_m(radius_m * std::cos(azimuth), radius_m * std::sin(azimuth), 0.0);
        if (good_pose(middle_m + aside_m, visible)) return true;
      }
    }
    return false;
  }

 private:
  bool good_pose(const Eigen::Vector3d& at_m, const Cells& visible) {
    const VoxelIndex v = map_.grid().index_of(at_m);
    const auto known = [&](const VoxelIndex& n) { return map_.at(n) != Occupancy::kUnknown; };
    const auto clear = [&](const VoxelIndex& n) { return !solid(map_, n); };
    if (!all_around(v, 1, known) || !all_around(v, clearance_, clear)) return false;
    std::size_t seen = 0;
    return std::any_of(visible.begin(), visible.end(), [&](const VoxelIndex& cell) {
      seen += sees(at_m, cell) ? 1 : 0;
      return seen > kMostUnseen;
    });
  }

  bool sees(const Eigen::Vector3d& from_m, const VoxelIndex& cell) {
    const Eigen::Vector3d offset_m = map_.grid().center_of(cell) - from_m;
    const double up_deg = deg_from_rad(std::atan2(offset_m.z(), offset_m.head<2>().norm()));
    if (offset_m.norm() > kFarthest_m || up_deg < kLowest_deg || up_deg > kHighest_deg) return false;
    return walk_voxels(map_.grid(), from_m, map_.grid().center_of(cell),
                       [&](const VoxelIndex& v) { return !hides(v); });
  }

  bool hides(const VoxelIndex& v) {
    if (map_.at(v) == Occupancy::kUnknown) return true;
    const auto [entry, is_new] = hidden_.try_emplace(map_.grid().linear(v), false);
    if (is_new) entry->second = !all_around(v, hiding_, [&](const VoxelIndex& n) { return !solid(map_, n); });
    return entry->second;
  }

  const mapping::OccupancyMap& map_;
  int clearance_;
  int hiding_;
  std::unordered_map<std::size_t, bool> hidden_;
};

}  // namespace

void SlabFinish::update(const mapping::OccupancyMap& map, const FrontierFinder& finder) {
  open_pieces_ = 0;
  counted_.clear();
  std::map<std::uint32_t, Cells> regions;
  for (const auto& [id, region] : regions_of(finder)) {
    const Cells& cells = finder.clusters().find(id)->cells;
    regions[region].insert(regions[region].end(), cells.begin(), cells.end());
  }
  const int clearance = static_cast<int>(std::ceil(kInflation_m / map.grid().resolution_m()));
  Looker looker(map, clearance, past_walls_ ? 0 : clearance);
  for (auto& [id, cells] : regions) {
    if (cells.size() <= kLargestIgnored) continue;
    std::vector<Cells> pieces;
    cut_into_pieces(map.grid(), std::move(cells), pieces);
    for (const Cells& piece : pieces) {
      if (!looker.open(piece)) continue;
      ++open_pieces_;
      for (const VoxelIndex& v : piece) counted_.insert(finder.cluster_at(v));
    }
  }
}

FrontierConfig slab_frontiers(const Aabb& task_box, double lo_m, double hi_m) {
  FrontierConfig frontiers;
  frontiers.box = task_box;
  frontiers.box.min_m.z() = std::max(task_box.min_m.z(), lo_m);
  frontiers.box.max_m.z() = std::min(task_box.max_m.z(), hi_m);
  frontiers.planar = true;
  return frontiers;
}

}  // namespace stairwell::coverage3d
