#include "mapping/map_compare.hpp"

#include "mapping/octomap_io.hpp"

namespace stairwell::mapping {

namespace {

void count(Occupancy found, ExpectedOccupancy expected, MapComparison& result) {
  if (expected == ExpectedOccupancy::kIgnore) {
    result.unjudged_voxels += found != Occupancy::kUnknown ? 1U : 0U;
    return;
  }
  ++result.expected_voxels;
  if (found == Occupancy::kUnknown) {
    ++result.missing_voxels;
    return;
  }
  ++result.observed_voxels;
  if (found == Occupancy::kOccupied && expected == ExpectedOccupancy::kFree) {
    ++result.false_occupied;
  } else if (found == Occupancy::kFree && expected == ExpectedOccupancy::kOccupied) {
    ++result.false_free;
  } else {
    ++result.correct_voxels;
  }
}

void finish(MapComparison& result) {
  if (result.observed_voxels > 0) {
    result.correct_fraction = static_cast<double>(result.correct_voxels) / static_cast<double>(result.observed_voxels);
  }
  if (result.expected_voxels > 0) {
    result.missing_fraction = static_cast<double>(result.missing_voxels) / static_cast<double>(result.expected_voxels);
  }
}

ExpectedOccupancy expected_of(Occupancy occupancy) {
  switch (occupancy) {
    case Occupancy::kFree:
      return ExpectedOccupancy::kFree;
    case Occupancy::kOccupied:
      return ExpectedOccupancy::kOccupied;
    case Occupancy::kUnknown:
      break;
  }
  return ExpectedOccupancy::kIgnore;
}

template <typename Visit>
void for_each_voxel(const GridSpec& grid, const Visit& visit) {
  VoxelIndex v;
  for (v.z = 0; v.z < grid.size()[2]; ++v.z) {
    for (v.y = 0; v.y < grid.size()[1]; ++v.y) {
      for (v.x = 0; v.x < grid.size()[0]; ++v.x) {
        visit(v);
      }
    }
  }
}

}  // namespace

MapComparison compare_map(const OccupancyMap& map,
                          const std::function<ExpectedOccupancy(const VoxelIndex&)>& expected) {
  MapComparison result;
  for_each_voxel(map.grid(), [&](const VoxelIndex& v) { count(map.at(v), expected(v), result); });
  finish(result);
  return result;
}

MapComparison compare_maps(const OccupancyMap& map, const OccupancyMap& reference) {
  Aabb box = map.grid().box();
  box.extend(reference.grid().box());
  const GridSpec both(box, map.grid().resolution_m());
  MapComparison result;
  for_each_voxel(both, [&](const VoxelIndex& v) {
    const Eigen::Vector3d center_m = both.center_of(v);
    count(map.at(center_m), expected_of(reference.at(center_m)), result);
  });
  finish(result);
  return result;
}

MapComparison compare_maps(const octomap::OcTree& map, const octomap::OcTree& reference) {
  return compare_maps(map_from_octree(map), map_from_octree(reference));
}

}  // namespace stairwell::mapping
