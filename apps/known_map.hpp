/// A map file or world as planning sees it when everything is known: what is solid is occupied, the rest is free.
#pragma once

#include "core/aabb.hpp"
#include "core/robot.hpp"
#include "mapping/distance_field.hpp"
#include "mapping/occupancy_map.hpp"
#include "mapping/occupancy_words.hpp"
#include "planning3d/free_space.hpp"
#include "sim3d/world.hpp"

#include <filesystem>
#include <limits>
#include <vector>

namespace stairwell::apps {

struct KnownMapOptions {
  sim3d::WorldOptions world;
  /// NaN: an OctoMap's own, the cells of a .3dmap, else 0.1 m.
  double resolution_m = std::numeric_limits<double>::quiet_NaN();
  Aabb box;  ///< empty: the file's; what lies outside the file's is free
};

class KnownMap {
 public:
  explicit KnownMap(mapping::OccupancyMap solid_and_free);

  const mapping::OccupancyMap& map() const { return map_; }
  Aabb box() const { return map_.grid().box(); }
  planning3d::FreeSpace space(const Robot& robot) const { return {map_, blocked_, robot, box(), &words_}; }
  planning3d::FreeSpace space(const Robot& robot, const Aabb& flight_box) const {
    return {map_, blocked_, robot, flight_box, &words_};
  }
  /// From a point to the nearest solid voxel, exact up to about `clearance_cap_m()`, which stands for "farther".
  double clearance_m(const Eigen::Vector3d& at_m) const;
  double clearance_cap_m() const { return solid_.truncation_m(); }

 private:
  mapping::OccupancyMap map_;
  mapping::DistanceField blocked_, solid_;
  mapping::OccupancyWords words_;
};

/// `.bt`, `.ot`, or any world file. Voxel inputs keep exactly their solid voxels when the resolution is theirs; of
/// meshes the voxels that a surface passes through or touches, and those inside, are solid.
/// @throws InputError naming the file.
KnownMap load_known_map(const std::filesystem::path& file, const KnownMapOptions& options);

/// A byte per voxel (x fastest): 1 where the surface's winding number is not 0 as seen along all three axes.
std::vector<std::uint8_t> inside_of(const sim3d::TriangleMesh& mesh, const GridSpec& grid);

}  // namespace stairwell::apps
