#include "apps/map_files.hpp"

#include "apps/atomic_file.hpp"
#include "apps/option_values.hpp"
#include "core/errors.hpp"
#include "mapping/octomap_io.hpp"
#include "sim3d/ground_truth.hpp"

#include <octomap/OcTree.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <queue>
#include <vector>

namespace stairwell::apps {

using nlohmann::ordered_json;

namespace {

ordered_json to_json(const Eigen::Vector3d& v) { return ordered_json::array({v.x(), v.y(), v.z()}); }

ordered_json number(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

/// Voxels that the map should have seen: open space connected to the map's own free voxels, and what bounds it.
std::vector<std::uint8_t> observable(const mapping::OccupancyMap& map, const sim3d::GroundTruth& truth) {
  const GridSpec& grid = map.grid();
  std::vector<std::uint8_t> seen(grid.voxel_count(), 0);
  std::queue<std::size_t> open;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    if (map.at(v) != Occupancy::kFree || truth.at(v) != sim3d::TruthClass::kFree) continue;
    seen[i] = 1;
    open.push(i);
  }
  while (!open.empty()) {
    const VoxelIndex v = grid.voxel(open.front());
    open.pop();
    for (const VoxelIndex step : {VoxelIndex{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
      const VoxelIndex neighbour = v + step;
      if (!grid.contains(neighbour) || seen[grid.linear(neighbour)] != 0) continue;
      seen[grid.linear(neighbour)] = 1;
      if (truth.at(neighbour) == sim3d::TruthClass::kFree) open.push(grid.linear(neighbour));
    }
  }
  return seen;
}

std::vector<octomap::point3d> occupied_centers(const octomap::OcTree& tree) {
  std::vector<octomap::point3d> centers;
  const double resolution_m = tree.getResolution();
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    if (!tree.isNodeOccupied(*leaf)) continue;
    const auto count = static_cast<int>(std::lround(leaf.getSize() / resolution_m));
    const double first = 0.5 * (1 - count) * resolution_m;
    for (int z = 0; z < count; ++z) {
      for (int y = 0; y < count; ++y) {
        for (int x = 0; x < count; ++x) {
          centers.emplace_back(static_cast<float>(leaf.getX() + first + x * resolution_m),
                               static_cast<float>(leaf.getY() + first + y * resolution_m),
                               static_cast<float>(leaf.getZ() + first + z * resolution_m));
        }
      }
    }
  }
  return centers;
}

std::string pcd_header(const std::string& count) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + count +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA ascii\n";
}

std::string ply_header(const std::string& count) {
  return "ply\nformat ascii 1.0\nelement vertex " + count +
         "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
}

void write_cloud(const octomap::OcTree& tree, const std::filesystem::path& file, bool pcd) {
  const std::vector<octomap::point3d> centers = occupied_centers(tree);
  const std::string count = std::to_string(centers.size());
  std::string text = pcd ? pcd_header(count) : ply_header(count);
  char row[96];
  for (const octomap::point3d& p : centers) {
    const int length = std::snprintf(row, sizeof(row), "%.4f %.4f %.4f\n", static_cast<double>(p.x()),
                                     static_cast<double>(p.y()), static_cast<double>(p.z()));
    text.append(row, static_cast<std::size_t>(length));
  }
  write_file_atomically(file, text);
}

}  // namespace

bool is_octomap_file(const std::filesystem::path& file) {
  return file.extension() == ".bt" || file.extension() == ".ot";
}

ordered_json map_info(const std::filesystem::path& file) {
  const auto tree = mapping::load_octree(file);
  double occupied_m3 = 0.0, free_m3 = 0.0;
  std::size_t leaves = 0;
  Aabb bounds;
  for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf) {
    ++leaves;
    (tree->isNodeOccupied(*leaf) ? occupied_m3 : free_m3) += std::pow(leaf.getSize(), 3);
    const Eigen::Vector3d center_m(leaf.getX(), leaf.getY(), leaf.getZ());
    bounds.extend(Aabb{center_m, center_m}.inflated(0.5 * leaf.getSize()));
  }
  return {{"file", file.string()},
          {"resolution_m", tree->getResolution()},
          {"leaves", leaves},
          {"nodes", tree->size()},
          {"known_volume_m3", occupied_m3 + free_m3},
          {"occupied_volume_m3", occupied_m3},
          {"free_volume_m3", free_m3},
          {"min_m", bounds.empty() ? ordered_json(nullptr) : to_json(bounds.min_m)},
          {"max_m", bounds.empty() ? ordered_json(nullptr) : to_json(bounds.max_m)},
          {"memory_bytes", tree->memoryUsage()}};
}

mapping::ExpectedOccupancy expected_occupancy(const sim3d::GroundTruth& truth, const VoxelIndex& v) {
  switch (truth.at(v)) {
    case sim3d::TruthClass::kFree:
      return mapping::ExpectedOccupancy::kFree;
    case sim3d::TruthClass::kSurface:
      return mapping::ExpectedOccupancy::kOccupied;
    case sim3d::TruthClass::kBoundary:
      break;
  }
  return mapping::ExpectedOccupancy::kEither;
}

mapping::MapComparison compare_with_world(const mapping::OccupancyMap& map, const sim3d::World& world) {
  using mapping::ExpectedOccupancy;
  const sim3d::GroundTruth truth(world, map.grid());
  const std::vector<std::uint8_t> seen = observable(map, truth);
  return mapping::compare_map(map, [&](const VoxelIndex& v) {
    if (map.at(v) == Occupancy::kUnknown && seen[map.grid().linear(v)] == 0) return ExpectedOccupancy::kIgnore;
    return expected_occupancy(truth, v);
  });
}

mapping::MapComparison compare_with(const std::filesystem::path& map, const std::filesystem::path& reference,
                                    const sim3d::WorldOptions& options) {
  const mapping::OccupancyMap observed = mapping::map_from_octree(*mapping::load_octree(map));
  if (is_octomap_file(reference)) {
    return mapping::compare_maps(observed, mapping::map_from_octree(*mapping::load_octree(reference)));
  }
  return compare_with_world(observed, sim3d::load_world(reference, options));
}

ordered_json to_json(const mapping::MapComparison& comparison) {
  return {{"observed_voxels", comparison.observed_voxels},
          {"correct_fraction", number(comparison.correct_fraction)},
          {"missing_fraction", number(comparison.missing_fraction)},
          {"false_occupied", comparison.false_occupied},
          {"false_free", comparison.false_free}};
}

void convert_map(const std::filesystem::path& from, const std::filesystem::path& to) {
  const std::string extension = to.extension().string();
  if (extension != ".bt" && extension != ".ot" && extension != ".pcd" && extension != ".ply") {
    throw InputError(to.string() + ": a map can be written as .bt, .ot, .pcd or .ply");
  }
  const auto tree = mapping::load_octree(from);
  if (is_octomap_file(to)) {
    mapping::save_octomap(*tree, to);
  } else {
    write_cloud(*tree, to, extension == ".pcd");
  }
}

mapping::OccupancyMap voxelised(const sim3d::World& world, double resolution_m) {
  const GridSpec grid(world.bounds, resolution_m);
  const sim3d::GroundTruth truth(world, grid);
  mapping::OccupancyMap map(grid);
  const double p = map.params().clamp_max;
  const auto occupied = static_cast<float>(std::log(p / (1.0 - p)));
  for (std::size_t i = 0; i < grid.voxel_count(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    if (truth.at(v) != sim3d::TruthClass::kFree) map.set_log_odds(v, occupied);
  }
  return map;
}

}  // namespace stairwell::apps
