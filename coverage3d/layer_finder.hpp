#pragma once

#include "core/aabb.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace stairwell::coverage3d {

/// How flying heights are found.
struct LayerConfig {
  Aabb box;                      ///< task box
  double above_floor_m = 1.2;    ///< first layer of a storey
  double spacing_m = 1.5;        ///< further layers of a high storey, and of unknown height
  double high_storey_m = 3.0;    ///< storeys above this height get more than one layer
  double margin_m = 0.3;         ///< least distance of a layer from floor, ceiling and box
  double min_floor_m2 = 4.0;     ///< horizontal surfaces smaller than this are furniture
  double min_floor_part = 0.25;  ///< and so are those below this part of the largest
};

/// Heights for slice mode (SPEC A16): a layer above every floor that the map shows, more in high storeys, and evenly
/// spaced ones where no floor is known. Kept up to date from the blocks that changed.
class LayerFinder {
 public:
  LayerFinder(const GridSpec& grid, const LayerConfig& config);

  /// Counts the upward surfaces of changed blocks again; true when the layers became others.
  bool update(const mapping::OccupancyMap& map, const std::vector<mapping::VoxelBox>& changed);
  void set_start_height(double height_m);

  const std::vector<double>& layers_m() const { return layers_m_; }
  const std::vector<double>& floors_m() const { return floors_m_; }
  /// Nearest layer. @pre there is one
  std::size_t layer_of(double height_m) const;

 private:
  void recount(const mapping::OccupancyMap& map, const mapping::VoxelBox& box);
  void find_floors();
  void place_layers();

  GridSpec grid_;
  LayerConfig config_;
  std::optional<double> start_height_m_;
  std::map<std::size_t, std::vector<std::uint16_t>> per_block_;  ///< upward faces per z of the block
  std::vector<std::int64_t> faces_;                              ///< upward faces per z of the grid
  std::vector<double> floors_m_;
  std::vector<double> layers_m_;
};

}  // namespace stairwell::coverage3d
