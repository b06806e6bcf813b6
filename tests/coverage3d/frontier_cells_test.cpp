/// The frontier in coarse cells and block by block, against the definition voxel by voxel.
#include "coverage3d/frontier_cells.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <set>
#include <tuple>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;

using Cell = std::tuple<int, int, int>;

std::set<Cell> by_definition(const mapping::OccupancyMap& map, const FrontierConfig& config) {
  const mapping::VoxelBox box = voxels_inside(map.grid(), config.box);
  std::set<Cell> cells;
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i) {
    const VoxelIndex v = map.grid().voxel(i);
    if (!is_frontier(map, box, config, v)) continue;
    cells.emplace(v.x / FrontierCells::kEdge, v.y / FrontierCells::kEdge, v.z / FrontierCells::kEdge);
  }
  return cells;
}

/// Voxels of a random box become free, some of them hit or occupied.
void learn(mapping::OccupancyMap& map, Rng& rng) {
  const auto& size = map.grid().size();
  VoxelIndex lo{rng.uniform_int(0, size[0] - 1), rng.uniform_int(0, size[1] - 1), rng.uniform_int(0, size[2] - 1)};
  for (int z = lo.z; z < lo.z + 9; ++z)
    for (int y = lo.y; y < lo.y + 7; ++y)
      for (int x = lo.x; x < lo.x + 11; ++x) {
        const VoxelIndex v{x, y, z};
        if (!map.grid().contains(v)) continue;
        const double kind = rng.uniform();
        map.update(v, kind < 0.04);
        if (kind > 0.97) map.mark_hit(v);
      }
}

TEST_CASE("frontier cells are those that hold a frontier voxel, whatever changed since", "[frontier_cells]") {
  Rng rng(21);
  for (const bool planar : {false, true}) {
    mapping::OccupancyMap map(GridSpec(Aabb{{-2.1, -1.3, 0.0}, {3.2, 2.9, 2.6}}, 0.1));
    FrontierConfig config;
    config.box = Aabb{{-1.9, -1.3, 0.2}, {3.2, 2.6, 2.3}};
    config.planar = planar;
    FrontierCells cells(map.grid(), config);
    std::set<Cell> followed;
    for (int round = 0; round < 25; ++round) {
      learn(map, rng);
      const FrontierCells::Changes changes = cells.update(map);
      for (const VoxelIndex& c : changes.added) CHECK(followed.emplace(c.x, c.y, c.z).second);
      for (const VoxelIndex& c : changes.removed) CHECK(followed.erase({c.x, c.y, c.z}) == 1);
      CAPTURE(planar, round);
      CHECK(followed == by_definition(map, config));
    }
    CHECK(followed.size() > 20);
    const FrontierCells::Changes none = cells.update(map);
    CHECK(none.added.empty());
    CHECK(none.removed.empty());
  }
}

/// The definition once more, without words of bits.
bool counted_frontier(const mapping::OccupancyMap& map, const mapping::VoxelBox& box, const FrontierConfig& config,
                      const VoxelIndex& v) {
  const auto clear = [&](const VoxelIndex& w) {
    return holds(box, w) && map.at(w) == Occupancy::kFree && !map.ever_hit(w);
  };
  const auto unknown = [&](const VoxelIndex& w) { return holds(box, w) && map.at(w) == Occupancy::kUnknown; };
  int free_count = -1, unknown_count = 0;
  for (int i = 0; i < 27; ++i) {
    const VoxelIndex w = v + VoxelIndex{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    free_count += clear(w) ? 1 : 0;
    unknown_count += unknown(w) ? 1 : 0;
  }
  bool beside = false;
  for (const VoxelIndex& face : kFaceSteps) beside = beside || unknown(v + face);
  return clear(v) && beside && free_count >= config.min_free_neighbours &&
         unknown_count >= config.min_unknown_neighbours;
}

TEST_CASE("a block's frontier is what counting voxel by voxel finds, up to the edges of box and grid",
          "[frontier_cells]") {
  Rng rng(4);
  mapping::OccupancyMap map(GridSpec(Aabb{{0.0, 0.0, 0.0}, {2.7, 2.1, 1.9}}, 0.1));
  for (int i = 0; i < 12; ++i) learn(map, rng);
  for (const Aabb& task : {Aabb{{0.0, 0.0, 0.0}, {2.7, 2.1, 1.9}}, Aabb{{0.3, 0.2, 0.1}, {2.4, 1.0, 1.2}}}) {
    FrontierConfig config;
    config.box = task;
    const mapping::VoxelBox box = voxels_inside(map.grid(), task);
    int found = 0;
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 4; ++x) {
          const BlockBits bits = frontier_bits(map, box, config, {x, y, z});
          for (int i = 0; i < 512; ++i) {
            const VoxelIndex place{i % 8, i / 8 % 8, i / 64};
            const bool is = (bits[static_cast<std::size_t>(place.z)] >> (8 * place.y + place.x) & 1U) != 0;
            CHECK(is == counted_frontier(map, box, config, origin_of({x, y, z}) + place));
            found += is ? 1 : 0;
          }
        }
    CHECK(found > 10);
  }
}

}  // namespace
