#pragma once

#include "core/grid_spec.hpp"
#include "core/occupancy.hpp"

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace stairwell::perception {

/// What counts as a floor.
struct StoreyConfig {
  double min_area_m2 = 4.0;   ///< floors smaller than this are furniture or steps
  double min_share = 0.2;     ///< floor area over free area seen just above it: less is shelves or ledges in a hall
  double min_height_m = 1.5;  ///< two floors are at least this far apart, and this much above a floor is not solid
  double merge_m = 0.4;       ///< floor voxels within this height belong to one floor (noise, slight tilt)

  std::vector<std::string> problems() const;
};

/// A level that one can fly on. World heights.
struct Storey {
  double floor_z_m = std::numeric_limits<double>::quiet_NaN();    ///< upper face of the floor's voxels (median)
  double ceiling_z_m = std::numeric_limits<double>::quiet_NaN();  ///< most frequent ceiling above it
  double area_m2 = 0.0;                                           ///< of the floor seen so far
};

/// The storeys that a map shows, from below. Floors are peaks, over height, of the area of up-facing surfaces
/// (occupied below, free above, nothing solid within min_height_m above). A ceiling is the most frequent height of the
/// next down-facing surface above the floor; where none has been seen, the top of the free space seen above the floor;
/// never above the next floor.
/// @param cells one per voxel of `grid`, x fastest. @throws InputError for a bad config or another number of cells
std::vector<Storey> detect_storeys(std::span<const Occupancy> cells, const GridSpec& grid,
                                   const StoreyConfig& config = {});
/// Asks once per voxel.
std::vector<Storey> detect_storeys(const std::function<Occupancy(const VoxelIndex&)>& at, const GridSpec& grid,
                                   const StoreyConfig& config = {});

/// Heights for flying in slices, ascending: every storey, less clearance_m at floor and ceiling, is cut into equal
/// bands with a layer in the middle of each. A band is at most spacing_m high, and at most what a sensor of this
/// vertical field of view (centred on the horizon) sees at 1.5 m, so that walls are seen without gaps.
/// @throws InputError unless vertical_fov_rad > 0 and spacing_m > 0
std::vector<double> layer_heights(std::span<const Storey> storeys, double vertical_fov_rad, double spacing_m,
                                  double clearance_m = 0.4);

}  // namespace stairwell::perception
