#pragma once

#include "explore/fleet.hpp"
#include "mapping/occupancy_map.hpp"

#include <cstdint>
#include <map>
#include <optional>

namespace stairwell::apps {

/// All that a fleet has seen: its map, or where the radio limits the exchange, the union of its maps. Made outside the
/// agents, for metrics and files.
class FleetMap {
 public:
  /// Takes in what changed since the last call. @returns valid until the fleet's next step
  const mapping::OccupancyMap& update(const explore::Fleet& fleet);

 private:
  std::optional<mapping::OccupancyMap> united_;
  std::map<std::uint64_t, std::uint64_t> taken_;  ///< revision up to which each map has been taken in, by its id
};

}  // namespace stairwell::apps
