#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stairwell::sim3d {

/// The building that is wanted.
struct GeneratorConfig {
  int storeys = 3;
  std::uint64_t seed = 1;
  double width_m = 16.0;
  double depth_m = 12.0;
  double storey_height_m = 3.0;

  std::vector<std::string> problems() const;
};

/// SDFormat text of a random multi-storey building: slabs with stair openings, rooms with doors, clutter; every room
/// and storey connected for a robot of 0.3 m radius. The same config gives the same text. The ground floor's surface is
/// at z = -0.05; the point (0, 0, 0.95) is always free. @throws InputError naming every problem of the config
std::string generate_building(const GeneratorConfig& config);

}  // namespace stairwell::sim3d
