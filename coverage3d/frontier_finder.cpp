#include "coverage3d/frontier_finder.hpp"

#include "core/errors.hpp"
#include "mapping/worker_pool.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace stairwell::coverage3d {
namespace {

/// Voxels that were looked at; as many as announced, and not more.
class VisitedVoxels {
 public:
  explicit VisitedVoxels(std::size_t most) : slots_(std::bit_ceil(2 * most + 1), kFree) {}

  /// True the first time.
  bool insert(const VoxelIndex& v) {
    const std::uint64_t key = part(v.x) | part(v.y) << 21 | part(v.z) << 42;
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = (key * 0x9E3779B97F4A7C15ULL >> 32) & mask;
    while (slots_[slot] != kFree) {
      if (slots_[slot] == key) return false;
      slot = (slot + 1) & mask;
    }
    slots_[slot] = key;
    return true;
  }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  static std::uint64_t part(int coordinate) { return static_cast<std::uint64_t>(coordinate + 1) & 0x1FFFFFU; }
  std::vector<std::uint64_t> slots_;
};

}  // namespace

FrontierFinder::FrontierFinder(const GridSpec& grid, const FrontierConfig& config) : grid_(grid), config_(config) {
  const std::vector<std::string> problems = config.problems();
  if (!problems.empty()) throw InputError("frontiers: " + problems.front());
  box_ = voxels_inside(grid, config.box);
  const int longest = static_cast<int>(0.5 * config.split_size_m / grid.resolution_m());
  patches_ = FrontierPatches(grid.size(), std::max(1, longest));
}

void FrontierFinder::dissolve(std::uint32_t id, std::vector<std::uint32_t>& loose) {
  const FrontierCluster* const cluster = clusters_.find(id);
  if (cluster == nullptr) return;
  for (const std::uint32_t patch : cluster->patches) {
    if (patches_[patch].cluster != id) continue;  // it is another one since
    patches_[patch].cluster = kLoose;
    loose.push_back(patch);
  }
  clusters_.erase(id);
}

std::vector<std::uint32_t> FrontierFinder::grow(std::uint32_t seed, std::vector<std::uint32_t>& loose) {
  const double crumb_m2 = 4.0 * config_.min_area_m2;
  const std::uint32_t growing = next_id_++;
  std::vector<std::uint32_t> grown{seed};
  patches_[seed].cluster = growing;
  for (std::size_t i = 0; i < grown.size(); ++i) {
    for (const std::uint32_t patch : beside(grown[i])) {
      const std::uint32_t cluster = patches_[patch].cluster;
      if (cluster == growing) continue;
      if (cluster != kLoose) {  // a crumb beside a cluster that is rebuilt anyway joins it
        const FrontierCluster* const neighbour = clusters_.find(cluster);
        if (neighbour == nullptr || neighbour->area_m2 > crumb_m2) continue;
        dissolve(cluster, loose);
      }
      patches_[patch].cluster = growing;
      grown.push_back(patch);
    }
  }
  return grown;
}

void FrontierFinder::store(std::vector<std::uint32_t> patches) {
  const std::uint32_t new_id = next_id_++;
  FrontierCluster& cluster = clusters_[new_id];
  cluster.id = new_id;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * grid_.resolution_m());
  for (const std::uint32_t id : patches) {
    FrontierPatch& patch = patches_[id];
    patch.cluster = cluster.id;
    cluster.bounds_m.extend(grid_.center_of(patch.bounds.lo) - half);
    cluster.bounds_m.extend(grid_.center_of(patch.bounds.hi) + half);
    const VoxelIndex origin = origin_of(patch.block);
    for_each_voxel(patch.bits, [&](const VoxelIndex& place) { cluster.cells.push_back(origin + place); });
    cluster.center_m += patch.voxels * patch.center;
  }
  const auto voxels = static_cast<double>(cluster.cells.size());
  cluster.center_m = grid_.center_of({0, 0, 0}) + cluster.center_m * (grid_.resolution_m() / voxels);
  cluster.area_m2 = voxels * grid_.resolution_m() * grid_.resolution_m();
  cluster.patches = std::move(patches);
  stored_.push_back(cluster.id);
}

void FrontierFinder::store_split(std::vector<std::uint32_t> patches) {
  if (patches.size() < 2) return store(std::move(patches));
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double voxels = 0.0;
  for (const std::uint32_t id : patches) {
    mean += patches_[id].voxels * patches_[id].center;
    voxels += patches_[id].voxels;
  }
  mean /= voxels;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const std::uint32_t id : patches) {
    const Eigen::Vector3d d = patches_[id].center - mean;
    spread += patches_[id].voxels * d * d.transpose();
  }
  const Eigen::Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  double least = 0.0;
  double most = 0.0;
  for (const std::uint32_t id : patches) {
    const VoxelIndex extent = patches_[id].bounds.hi - patches_[id].bounds.lo;
    const double half = 0.5 * axis.cwiseAbs().dot(Eigen::Vector3d(extent.x, extent.y, extent.z));
    const double along = axis.dot(patches_[id].center - mean);
    least = std::min(least, along - half);
    most = std::max(most, along + half);
  }
  if ((most - least) * grid_.resolution_m() <= config_.split_size_m) return store(std::move(patches));
  const auto middle = std::stable_partition(
      patches.begin(), patches.end(), [&](std::uint32_t id) { return axis.dot(patches_[id].center - mean) < 0.0; });
  std::vector<std::uint32_t> upper(middle, patches.end());
  patches.erase(middle, patches.end());
  if (patches.empty() || upper.empty()) return store(patches.empty() ? std::move(upper) : std::move(patches));
  store_split(std::move(patches));
  store_split(std::move(upper));
}

void FrontierFinder::find_beside(const std::vector<std::uint32_t>& patches, mapping::WorkerPool* workers) {
  std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>*>> asked;
  for (const std::uint32_t patch : patches) {
    const auto [entry, is_new] = beside_.try_emplace(patch);
    if (is_new) asked.emplace_back(patch, &entry->second);
  }
  mapping::for_each_index_in_parts(workers, asked.size(),
                                   [&](std::size_t i) { patches_.neighbours(asked[i].first, *asked[i].second); });
}

const std::vector<std::uint32_t>& FrontierFinder::beside(std::uint32_t patch) {
  const auto [entry, is_new] = beside_.try_emplace(patch);
  if (is_new) patches_.neighbours(patch, entry->second);
  return entry->second;
}

std::vector<std::uint32_t> FrontierFinder::loosen(const mapping::OccupancyMap& map, mapping::WorkerPool* workers) {
  FrontierPatches::Replaced replaced;
  const std::vector<VoxelIndex> blocks = blocks_to_examine(changed_, box_);
  std::vector<BlockBits> bits(blocks.size());
  mapping::for_each_index(workers, blocks.size(),
                          [&](std::size_t i) { bits[i] = frontier_bits(map, box_, config_, blocks[i]); });
  for (std::size_t i = 0; i < blocks.size(); ++i) patches_.replace(blocks[i], bits[i], replaced);

  beside_.clear();
  find_beside(replaced.added, workers);
  std::vector<std::uint32_t> touched = std::move(replaced.bereaved);
  for (const std::uint32_t added : replaced.added) {
    for (const std::uint32_t patch : beside(added)) touched.push_back(patches_[patch].cluster);
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  std::vector<std::uint32_t> loose;
  for (const std::uint32_t id : touched) dissolve(id, loose);
  loose.insert(loose.end(), replaced.added.begin(), replaced.added.end());
  return loose;
}

void FrontierFinder::update(const mapping::OccupancyMap& map, mapping::WorkerPool* workers) {
  changed_.clear();
  stored_.clear();
  map.for_each_block_changed_since(revision_, [&](const mapping::VoxelBox& block) { changed_.push_back(block); });
  revision_ = map.revision();
  std::vector<std::uint32_t> loose = loosen(map, workers);
  find_beside(loose, workers);
  for (std::size_t i = 0; i < loose.size(); ++i) {
    const std::uint32_t seed = loose[i];
    if (patches_[seed].cluster == kLoose) store_split(grow(seed, loose));
  }
  mapping::for_each_index(workers, stored_.size(), [&](std::size_t i) {
    FrontierCluster* const cluster = clusters_.find(stored_[i]);
    if (cluster != nullptr && worth_a_visit(*cluster)) cluster->pocket_m3 = pocket_behind_m3(map, *cluster);
  });
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
  VisitedVoxels seen(kFaceSteps.size() * (cluster.cells.size() + most));
  std::vector<VoxelIndex> open;
  const auto visit = [&](const VoxelIndex& lump) {
    if (open.size() < most && seen.insert(lump) && unknown(lump)) open.push_back(lump);
  };
  for (const VoxelIndex& v : cluster.cells) {
    for (const VoxelIndex& face : kFaceSteps)
      visit(lump_of(v + VoxelIndex{kLump * face.x, kLump * face.y, kLump * face.z}));
  }
  for (std::size_t i = 0; i < open.size() && open.size() < most; ++i) {
    const VoxelIndex at = open[i];
    for (const VoxelIndex& face : kFaceSteps) visit(at + face);
  }
  return static_cast<double>(open.size()) * lump_m3;
}

}  // namespace stairwell::coverage3d
