#include "mapping/map_merge.hpp"

#include <algorithm>
#include <cmath>

namespace stairwell::mapping {

namespace {

/// The surer of two log-odds; the occupied one where both are as sure.
float surer(float mine, float theirs) {
  const float mine_size = std::abs(mine);
  const float their_size = std::abs(theirs);
  if (mine_size == their_size) return std::max(mine, theirs);
  return mine_size > their_size ? mine : theirs;
}

}  // namespace

MergeEffect merge_changes(const OccupancyMap& from, std::uint64_t since, OccupancyMap& into) {
  MergeEffect effect;
  from.for_each_block_changed_since(since, [&](const VoxelBox& box) {
    VoxelIndex v;
    for (v.z = box.lo.z; v.z <= box.hi.z; ++v.z) {
      for (v.y = box.lo.y; v.y <= box.hi.y; ++v.y) {
        for (v.x = box.lo.x; v.x <= box.hi.x; ++v.x) {
          const Occupancy theirs = from.at(v);
          if (theirs == Occupancy::kUnknown) continue;
          ++effect.sent;
          const Occupancy before = into.at(v);
          const float value = from.log_odds(v);
          into.set_log_odds(v, before == Occupancy::kUnknown ? value : surer(into.log_odds(v), value));
          if (from.ever_hit(v)) into.mark_hit(v);
          if (into.at(v) != before) ++effect.changed;
        }
      }
    }
  });
  return effect;
}

}  // namespace stairwell::mapping
