#include "apps/fleet_map.hpp"

#include "mapping/map_merge.hpp"

namespace stairwell::apps {

const mapping::OccupancyMap& FleetMap::update(const explore::Fleet& fleet) {
  if (fleet.shares_one_map()) return fleet.map();
  if (!united_) united_.emplace(fleet.map().grid(), fleet.map().params());
  for (std::size_t i = 0; i < fleet.map_count(); ++i) {
    const mapping::OccupancyMap& map = fleet.map(i);
    std::uint64_t& taken = taken_[fleet.map_id(i)];
    mapping::merge_changes(map, taken, *united_);
    taken = map.revision();
  }
  return *united_;
}

}  // namespace stairwell::apps
