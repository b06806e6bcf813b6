#include "coverage3d/frontier_finder.hpp"

#include "core/errors.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace stairwell::coverage3d {
namespace {

constexpr std::array<VoxelIndex, 6> kFaces{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

/// A free voxel in which a return once fell lies at a surface: the unknown behind it is the inside of something solid.
Occupancy seen_as(const mapping::OccupancyMap& map, const VoxelIndex& v) {
  const Occupancy there = map.at(v);
  return there == Occupancy::kFree && map.ever_hit(v) ? Occupancy::kOccupied : there;
}

/// Classes of a block and `kRing` voxels around it; what lies outside the task box reads as occupied, so that it is
/// neither free nor unknown.
class Window {
 public:
  Window(const mapping::OccupancyMap& map, const mapping::VoxelBox& task, const mapping::VoxelBox& range)
      : lo_(range.lo - VoxelIndex{1, 1, 1}) {
    const VoxelIndex hi = range.hi + VoxelIndex{1, 1, 1};
    nx_ = hi.x - lo_.x + 1;
    ny_ = hi.y - lo_.y + 1;
    const int nz = hi.z - lo_.z + 1;
    cells_.resize(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz));
    std::size_t i = 0;
    for (int z = lo_.z; z <= hi.z; ++z)
      for (int y = lo_.y; y <= hi.y; ++y)
        for (int x = lo_.x; x <= hi.x; ++x) {
          const bool in =
              x >= task.lo.x && y >= task.lo.y && z >= task.lo.z && x <= task.hi.x && y <= task.hi.y && z <= task.hi.z;
          cells_[i++] = in ? seen_as(map, {x, y, z}) : Occupancy::kOccupied;
        }
  }

  bool frontier(const VoxelIndex& v, const FrontierConfig& config) const {
    if (at(v) != Occupancy::kFree) return false;
    if (std::none_of(kFaces.begin(), kFaces.end(),
                     [&](const VoxelIndex& face) { return at(v + face) == Occupancy::kUnknown; }))
      return false;
    int free = -1;  // the voxel itself
    int unknown = 0;
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const Occupancy there = at(v + VoxelIndex{x, y, z});
          free += there == Occupancy::kFree;
          unknown += there == Occupancy::kUnknown;
        }
    return free >= config.min_free_neighbours && unknown >= config.min_unknown_neighbours;
  }

 private:
  Occupancy at(const VoxelIndex& v) const {
    return cells_[static_cast<std::size_t>(((v.z - lo_.z) * ny_ + (v.y - lo_.y)) * nx_ + (v.x - lo_.x))];
  }
  VoxelIndex lo_;
  int nx_ = 0;
  int ny_ = 0;
  std::vector<Occupancy> cells_;
};

mapping::VoxelBox clipped(const mapping::VoxelBox& a, const mapping::VoxelBox& b) {
  return {{std::max(a.lo.x, b.lo.x), std::max(a.lo.y, b.lo.y), std::max(a.lo.z, b.lo.z)},
          {std::min(a.hi.x, b.hi.x), std::min(a.hi.y, b.hi.y), std::min(a.hi.z, b.hi.z)}};
}

bool empty(const mapping::VoxelBox& box) { return box.lo.x > box.hi.x || box.lo.y > box.hi.y || box.lo.z > box.hi.z; }

/// Voxels whose centres lie inside the box.
mapping::VoxelBox voxels_inside(const GridSpec& grid, const Aabb& box) {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid.resolution_m() - 1e-9);
  const Aabb within = box.intersection(grid.box());
  return clipped({grid.index_of(within.min_m + half), grid.index_of(within.max_m - half)},
                 {{0, 0, 0}, {grid.size()[0] - 1, grid.size()[1] - 1, grid.size()[2] - 1}});
}

}  // namespace

std::vector<std::string> FrontierConfig::problems() const {
  std::vector<std::string> found;
  if (box.empty()) found.emplace_back("the task box is empty");
  if (min_free_neighbours < 0 || min_free_neighbours > 26) found.emplace_back("min_free_neighbours is not in 0..26");
  if (min_unknown_neighbours < 0 || min_unknown_neighbours > 26)
    found.emplace_back("min_unknown_neighbours is not in 0..26");
  if (!(split_size_m > 0.0)) found.emplace_back("split_size_m is not positive");
  if (!(min_area_m2 >= 0.0)) found.emplace_back("min_area_m2 is negative");
  return found;
}

bool is_frontier(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierConfig& config,
                 const VoxelIndex& v) {
  if (map.at(v) != Occupancy::kFree || empty(clipped(box, {v, v}))) return false;
  return Window(map, box, {v, v}).frontier(v, config);
}

FrontierFinder::FrontierFinder(const GridSpec& grid, const FrontierConfig& config) : grid_(grid), config_(config) {
  const std::vector<std::string> problems = config.problems();
  if (!problems.empty()) throw InputError("frontiers: " + problems.front());
  if (config.box.intersection(grid.box()).empty()) throw InputError("frontiers: the task box lies outside the map");
  box_ = voxels_inside(grid, config.box);
  if (empty(box_)) throw InputError("frontiers: the task box holds no voxel centre of the map");
  const VoxelIndex extent = box_.hi - box_.lo;
  label_ = mapping::SparseGrid<std::uint32_t>({extent.x + 1, extent.y + 1, extent.z + 1});
}

void FrontierFinder::switch_on(const VoxelIndex& v) {
  label_.set(offset(v), kLoose);
  ++voxel_count_;
  switched_on_.push_back(v);
}

void FrontierFinder::switch_off(const VoxelIndex& v) {
  const std::uint32_t label = label_.get(offset(v));
  if (label > kLoose) touched_.push_back(label);
  label_.set(offset(v), kNone);
  --voxel_count_;
}

void FrontierFinder::examine(const mapping::OccupancyMap& map, const mapping::VoxelBox& block) {
  const mapping::VoxelBox range = clipped({block.lo - VoxelIndex{1, 1, 1}, block.hi + VoxelIndex{1, 1, 1}}, box_);
  if (empty(range)) return;
  const Window window(map, box_, range);
  for (int z = range.lo.z; z <= range.hi.z; ++z)
    for (int y = range.lo.y; y <= range.hi.y; ++y)
      for (int x = range.lo.x; x <= range.hi.x; ++x) {
        const VoxelIndex v{x, y, z};
        const bool now = window.frontier(v, config_);
        const bool before = label_.get(offset(v)) != kNone;
        if (now && !before) switch_on(v);
        if (!now && before) switch_off(v);
      }
}

void FrontierFinder::dissolve(std::uint32_t id, std::vector<VoxelIndex>& loose) {
  const auto found = clusters_.find(id);
  if (found == clusters_.end()) return;
  for (const VoxelIndex& v : found->second.cells) {
    if (label_.get(offset(v)) != id) continue;
    label_.set(offset(v), kLoose);
    loose.push_back(v);
  }
  clusters_.erase(found);
}

std::vector<VoxelIndex> FrontierFinder::grow(const VoxelIndex& seed, std::vector<VoxelIndex>& loose) {
  const double crumb_m2 = 4.0 * config_.min_area_m2;
  std::vector<VoxelIndex> cells{seed};
  const std::uint32_t growing = next_id_;
  label_.set(offset(seed), growing);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const VoxelIndex center = cells[i];
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const VoxelIndex v = center + VoxelIndex{x, y, z};
          if (!inside(v)) continue;
          const std::uint32_t label = label_.get(offset(v));
          if (label == kNone || label == growing) continue;
          if (label != kLoose) {  // a crumb beside a cluster that is rebuilt anyway joins it
            const auto neighbour = clusters_.find(label);
            if (neighbour == clusters_.end() || neighbour->second.area_m2 > crumb_m2) continue;
            dissolve(label, loose);
          }
          label_.set(offset(v), growing);
          cells.push_back(v);
        }
  }
  ++next_id_;
  return cells;
}

void FrontierFinder::store(std::vector<VoxelIndex> cells) {
  FrontierCluster cluster;
  cluster.id = next_id_++;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid_.resolution_m());
  for (const VoxelIndex& v : cells) {
    const Eigen::Vector3d center_m = grid_.center_of(v);
    cluster.center_m += center_m;
    cluster.bounds_m.extend(center_m - half);
    cluster.bounds_m.extend(center_m + half);
    label_.set(offset(v), cluster.id);
  }
  cluster.center_m /= static_cast<double>(cells.size());
  cluster.area_m2 = static_cast<double>(cells.size()) * grid_.resolution_m() * grid_.resolution_m();
  cluster.cells = std::move(cells);
  stored_.push_back(cluster.id);
  clusters_.emplace(cluster.id, std::move(cluster));
}

void FrontierFinder::store_split(std::vector<VoxelIndex> cells) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const VoxelIndex& v : cells) mean += grid_.center_of(v);
  mean /= static_cast<double>(cells.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const VoxelIndex& v : cells) {
    const Eigen::Vector3d d = grid_.center_of(v) - mean;
    spread += d * d.transpose();
  }
  const Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  double least = 0.0;
  double most = 0.0;
  for (const VoxelIndex& v : cells) {
    const double along = axis.dot(grid_.center_of(v) - mean);
    least = std::min(least, along);
    most = std::max(most, along);
  }
  if (most - least <= config_.split_size_m || cells.size() < 2) return store(std::move(cells));
  const auto middle = std::stable_partition(
      cells.begin(), cells.end(), [&](const VoxelIndex& v) { return axis.dot(grid_.center_of(v) - mean) < 0.0; });
  std::vector<VoxelIndex> upper(middle, cells.end());
  cells.erase(middle, cells.end());
  store_split(std::move(cells));
  store_split(std::move(upper));
}

void FrontierFinder::update(const mapping::OccupancyMap& map) {
  changed_.clear();
  switched_on_.clear();
  touched_.clear();
  stored_.clear();
  map.for_each_block_changed_since(revision_, [&](const mapping::VoxelBox& block) { changed_.push_back(block); });
  revision_ = map.revision();
  for (const mapping::VoxelBox& block : changed_) examine(map, block);

  for (const VoxelIndex& center : switched_on_)
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const VoxelIndex v = center + VoxelIndex{x, y, z};
          const std::uint32_t label = inside(v) ? label_.get(offset(v)) : kNone;
          if (label > kLoose) touched_.push_back(label);
        }
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  std::vector<VoxelIndex> loose;
  for (const std::uint32_t id : touched_) dissolve(id, loose);
  loose.insert(loose.end(), switched_on_.begin(), switched_on_.end());
  for (std::size_t i = 0; i < loose.size(); ++i) {
    const VoxelIndex seed = loose[i];
    if (label_.get(offset(seed)) == kLoose) store_split(grow(seed, loose));
  }
  for (const std::uint32_t id : stored_) {
    const auto found = clusters_.find(id);
    if (found != clusters_.end()) found->second.pocket_m3 = pocket_behind_m3(map, found->second);
  }
}

double FrontierFinder::pocket_behind_m3(const mapping::OccupancyMap& map, const FrontierCluster& cluster) const {
  // Lumps: a hole of one voxel between the rays does not connect what lies before a wall with what lies in it.
  constexpr int kLump = 2;
  const auto lump_of = [](const VoxelIndex& v) { return VoxelIndex{v.x / kLump, v.y / kLump, v.z / kLump}; };
  const auto unknown = [&](const VoxelIndex& lump) {
    for (int i = 0; i < kLump * kLump * kLump; ++i) {
      const VoxelIndex v = VoxelIndex{kLump * lump.x, kLump * lump.y, kLump * lump.z} +
                           VoxelIndex{i % kLump, i / kLump % kLump, i / (kLump * kLump)};
      if (!inside(v) || map.at(v) != Occupancy::kUnknown) return false;
    }
    return true;
  };
  const double lump_m3 = kLump * kLump * kLump * grid_.voxel_volume_m3();
  const auto most = static_cast<std::size_t>(std::ceil(config_.deep_m3 / lump_m3));
  std::set<std::array<int, 3>> seen;
  std::vector<VoxelIndex> open;
  const auto visit = [&](const VoxelIndex& lump) {
    if (open.size() < most && seen.insert({lump.x, lump.y, lump.z}).second && unknown(lump)) open.push_back(lump);
  };
  constexpr std::array<VoxelIndex, 6> kFaces{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  for (const VoxelIndex& v : cluster.cells) {
    for (const VoxelIndex& face : kFaces)
      visit(lump_of(v + VoxelIndex{kLump * face.x, kLump * face.y, kLump * face.z}));
  }
  for (std::size_t i = 0; i < open.size() && open.size() < most; ++i) {
    const VoxelIndex at = open[i];
    for (const VoxelIndex& face : kFaces) visit(at + face);
  }
  return static_cast<double>(open.size()) * lump_m3;
}

}  // namespace stairwell::coverage3d
