#include "coverage3d/layer_finder.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::coverage3d {

LayerFinder::LayerFinder(const GridSpec& grid, const LayerConfig& config)
    : grid_(grid), config_(config), faces_(static_cast<std::size_t>(grid.size()[2]), 0) {
  place_layers();
}

void LayerFinder::set_start_height(double height_m) {
  if (start_height_m_) return;
  start_height_m_ = height_m;
  if (floors_m_.empty()) place_layers();
}

std::size_t LayerFinder::layer_of(double height_m) const {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < layers_m_.size(); ++i)
    if (std::abs(layers_m_[i] - height_m) < std::abs(layers_m_[nearest] - height_m)) nearest = i;
  return nearest;
}

void LayerFinder::recount(const mapping::OccupancyMap& map, const mapping::VoxelBox& box) {
  const int lo_z = std::max(box.lo.z, 0);
  const int hi_z = std::min(box.hi.z, grid_.size()[2] - 1);
  if (lo_z > hi_z || !grid_.contains(VoxelIndex{box.lo.x, box.lo.y, lo_z})) return;
  std::vector<std::uint16_t>& counts = per_block_[grid_.linear({box.lo.x, box.lo.y, lo_z})];
  counts.resize(static_cast<std::size_t>(hi_z - lo_z + 1), 0);
  for (int z = lo_z; z <= hi_z; ++z) {
    std::uint16_t count = 0;
    for (int y = box.lo.y; y <= box.hi.y; ++y)
      for (int x = box.lo.x; x <= box.hi.x; ++x)
        count = static_cast<std::uint16_t>(count + (map.at(VoxelIndex{x, y, z}) == Occupancy::kOccupied &&
                                                    map.at(VoxelIndex{x, y, z + 1}) == Occupancy::kFree));
    std::uint16_t& before = counts[static_cast<std::size_t>(z - lo_z)];
    faces_[static_cast<std::size_t>(z)] += count - before;
    before = count;
  }
}

bool LayerFinder::update(const mapping::OccupancyMap& map, const std::vector<mapping::VoxelBox>& changed) {
  if (changed.empty()) return false;
  std::map<std::size_t, mapping::VoxelBox> todo;
  constexpr int kBlock = mapping::OccupancyMap::kBlock;
  for (const mapping::VoxelBox& box : changed) {  // the block below counts faces against this one's lowest voxels
    todo.emplace(grid_.linear(box.lo), box);
    if (box.lo.z == 0) continue;
    const mapping::VoxelBox below{{box.lo.x, box.lo.y, std::max(0, box.lo.z - kBlock)},
                                  {box.hi.x, box.hi.y, box.lo.z - 1}};
    todo.emplace(grid_.linear(below.lo), below);
  }
  for (const auto& [key, box] : todo) recount(map, box);
  const std::vector<double> before = layers_m_;
  find_floors();
  place_layers();
  return layers_m_ != before;
}

void LayerFinder::find_floors() {
  // A floor may fall on two voxel rows: judge sums of two neighbouring rows.
  const double face_m2 = grid_.resolution_m() * grid_.resolution_m();
  const auto area_m2 = [&](std::size_t z) {
    return face_m2 * static_cast<double>(faces_[z] + (z + 1 < faces_.size() ? faces_[z + 1] : 0));
  };
  double largest_m2 = 0.0;
  for (std::size_t z = 0; z < faces_.size(); ++z) largest_m2 = std::max(largest_m2, area_m2(z));
  const double least_m2 = std::max(config_.min_floor_m2, config_.min_floor_part * largest_m2);
  struct Surface {
    double area_m2;
    double top_m;
  };
  std::vector<Surface> surfaces;
  for (std::size_t z = 0; z < faces_.size(); ++z) {
    if (area_m2(z) < least_m2) continue;
    const double top_m = grid_.box().min_m.z() + static_cast<double>(z + 1) * grid_.resolution_m();
    surfaces.push_back({area_m2(z), top_m});
  }
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const Surface& a, const Surface& b) { return a.area_m2 > b.area_m2; });
  floors_m_.clear();
  for (const Surface& surface : surfaces) {
    const bool near = std::any_of(floors_m_.begin(), floors_m_.end(), [&](double floor_m) {
      return std::abs(floor_m - surface.top_m) < config_.spacing_m;
    });
    if (!near) floors_m_.push_back(surface.top_m);
  }
  std::sort(floors_m_.begin(), floors_m_.end());
}

void LayerFinder::place_layers() {
  std::vector<double> layers;
  const double bottom_m = std::max(config_.box.min_m.z(), grid_.box().min_m.z());
  const double top_m = std::min(config_.box.max_m.z(), grid_.box().max_m.z());
  const auto add_upwards = [&](double from_m, double end_m) {
    for (double z = from_m; z <= end_m - config_.margin_m + 1e-9; z += config_.spacing_m) layers.push_back(z);
  };
  if (floors_m_.empty()) {
    double first = start_height_m_.value_or(bottom_m + config_.above_floor_m);
    while (first - config_.spacing_m >= bottom_m + config_.margin_m) first -= config_.spacing_m;
    add_upwards(first, top_m);
    if (layers.empty()) layers.push_back(std::clamp(first, std::min(bottom_m, top_m), top_m));
  }
  if (!floors_m_.empty() && floors_m_.front() - bottom_m > config_.high_storey_m) {
    double first = floors_m_.front() + config_.above_floor_m - config_.spacing_m;
    std::vector<double> below;
    for (first -= config_.spacing_m; first >= bottom_m + config_.margin_m; first -= config_.spacing_m)
      below.insert(below.begin(), first);
    layers.insert(layers.end(), below.begin(), below.end());
  }
  for (std::size_t i = 0; i < floors_m_.size(); ++i) {
    const double floor_m = floors_m_[i];
    const double end_m = i + 1 < floors_m_.size() ? floors_m_[i + 1] : top_m;
    const double first = std::min(floor_m + config_.above_floor_m, std::max(0.5 * (floor_m + end_m), floor_m));
    layers.push_back(std::clamp(first, std::min(bottom_m, top_m), top_m));
    if (end_m - floor_m > config_.high_storey_m) add_upwards(layers.back() + config_.spacing_m, end_m);
  }
  // Heights at voxel centres, so that a layer is one row of voxels without doubt.
  for (double& z : layers) z = grid_.center_of(grid_.index_of({0.0, 0.0, z})).z();
  layers_m_ = std::move(layers);
}

}  // namespace stairwell::coverage3d
