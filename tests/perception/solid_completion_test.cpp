#include "perception/solid_completion.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <limits>

namespace {

using stairwell::Aabb;
using stairwell::GridSpec;
using stairwell::InputError;
using stairwell::make_rng;
using stairwell::Occupancy;
using stairwell::Rng;
using stairwell::VoxelIndex;
using stairwell::perception::complete_solids;
using stairwell::perception::SolidConfig;

constexpr auto kUnknown = Occupancy::kUnknown;
constexpr auto kFree = Occupancy::kFree;
constexpr auto kOccupied = Occupancy::kOccupied;

constexpr std::array<VoxelIndex, 6> kNeighbours{VoxelIndex{1, 0, 0},  VoxelIndex{-1, 0, 0}, VoxelIndex{0, 1, 0},
                                                VoxelIndex{0, -1, 0}, VoxelIndex{0, 0, 1},  VoxelIndex{0, 0, -1}};

struct Cells {
  GridSpec grid;
  std::vector<Occupancy> values;

  Cells(int nx, int ny, int nz, Occupancy fill)
      : grid(Aabb{{0, 0, 0}, {0.1 * nx, 0.1 * ny, 0.1 * nz}}, 0.1), values(grid.voxel_count(), fill) {}
  Occupancy& at(const VoxelIndex& v) { return values[grid.linear(v)]; }
  Occupancy at(const VoxelIndex& v) const { return values[grid.linear(v)]; }
  void fill(const VoxelIndex& lo, const VoxelIndex& hi, Occupancy value) {
    for (int z = lo.z; z <= hi.z; ++z) {
      for (int y = lo.y; y <= hi.y; ++y) {
        for (int x = lo.x; x <= hi.x; ++x) {
          at({x, y, z}) = value;
        }
      }
    }
  }
  std::vector<VoxelIndex> solids(const SolidConfig& config = {}) const { return complete_solids(values, grid, config); }
};

bool holds(const std::vector<VoxelIndex>& list, const VoxelIndex& v) {
  return std::find(list.begin(), list.end(), v) != list.end();
}

/// Slow reference: repeats the definitions until nothing changes.
std::vector<VoxelIndex> reference(const Cells& cells, const SolidConfig& config, int longest) {
  const GridSpec& grid = cells.grid;
  std::vector<bool> open(grid.voxel_count(), false);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (open[i] || cells.values[i] != kUnknown) {
        continue;
      }
      for (const VoxelIndex& step : kNeighbours) {
        const VoxelIndex other = grid.voxel(i) + step;
        const bool reached =
            grid.contains(other) ? cells.at(other) == kFree || open[grid.linear(other)] : !config.through_border;
        if (reached) {
          open[i] = changed = true;
        }
      }
    }
  }
  const auto hidden = [&](const VoxelIndex& v) {
    return cells.at(v) == kUnknown && std::none_of(kNeighbours.begin(), kNeighbours.end(), [&](const VoxelIndex& s) {
             return grid.contains(v + s) && cells.at(v + s) == kFree;
           });
  };
  std::vector<VoxelIndex> solid;
  for (std::size_t i = 0; i < open.size(); ++i) {
    const VoxelIndex v = grid.voxel(i);
    bool wall = false;
    for (std::size_t k = 0; k < 6 && cells.at(v) == kUnknown; k += 2) {
      int length = 1;
      bool closed = hidden(v);
      for (const std::size_t side : {k, k + 1}) {
        VoxelIndex at = v + kNeighbours[side];
        while (closed && grid.contains(at) && cells.at(at) == kUnknown) {
          closed = hidden(at);
          ++length;
          at = at + kNeighbours[side];
        }
        closed = closed && grid.contains(at) && cells.at(at) == kOccupied;
      }
      wall = wall || (closed && length <= longest);
    }
    if (cells.values[i] == kUnknown && (!open[i] || wall)) {
      solid.push_back(v);
    }
  }
  return solid;
}

}  // namespace

TEST_CASE("the inside of a closed box is solid, the unseen corner of a room is not") {
  Cells cells(20, 20, 20, kFree);
  cells.fill({5, 5, 5}, {11, 11, 11}, kOccupied);
  cells.fill({6, 6, 6}, {10, 10, 10}, kUnknown);
  cells.fill({0, 0, 0}, {3, 3, 3}, kUnknown);
  const std::vector<VoxelIndex> solids = cells.solids();
  CHECK(solids.size() == 125);
  CHECK(holds(solids, {8, 8, 8}));
  CHECK_FALSE(holds(solids, {1, 1, 1}));
}

TEST_CASE("a hole opens a thick solid, but not the inside of a thin wall") {
  SolidConfig config;
  config.max_wall_m = 0.3;
  Cells cells(20, 20, 20, kFree);
  cells.fill({5, 5, 5}, {11, 11, 11}, kOccupied);
  cells.fill({6, 6, 6}, {10, 10, 10}, kUnknown);
  cells.at({8, 8, 11}) = kUnknown;  // the unseen part of the upper face
  CHECK(cells.solids(config).empty());

  cells.fill({5, 5, 5}, {11, 11, 11}, kOccupied);
  cells.fill({6, 5, 5}, {8, 11, 11}, kUnknown);  // faces across x seen, ends not; they touch free space
  const std::vector<VoxelIndex> solids = cells.solids(config);
  CHECK(solids.size() == 3 * 5 * 5);
  CHECK(holds(solids, {7, 8, 8}));
  CHECK_FALSE(holds(solids, {7, 5, 8}));
  config.max_wall_m = 0.2;
  CHECK(cells.solids(config).empty());
}

TEST_CASE("what lies outside of closed outer walls counts only when the border may be crossed") {
  Cells cells(16, 16, 16, kUnknown);
  cells.fill({3, 3, 3}, {12, 12, 12}, kOccupied);
  cells.fill({4, 4, 4}, {11, 11, 11}, kFree);
  SolidConfig config;
  config.max_wall_m = 0.0;
  CHECK(cells.solids(config).size() == 16u * 16u * 16u - 1000u);
  config.through_border = false;
  CHECK(cells.solids(config).empty());
}

TEST_CASE("same answer as the slow reference on random maps") {
  Rng rng = make_rng(6, "test");
  std::size_t found = 0;
  for (int round = 0; round < 150; ++round) {
    Cells cells(rng.uniform_int(1, 12), rng.uniform_int(1, 12), rng.uniform_int(1, 12), kUnknown);
    const double free_share = rng.uniform(0.0, 0.2);
    const double occupied_share = rng.uniform(0.1, 0.7);
    for (Occupancy& value : cells.values) {
      const double draw = rng.uniform();
      value = draw < free_share ? kFree : draw < free_share + occupied_share ? kOccupied : kUnknown;
    }
    SolidConfig config;
    config.through_border = rng.uniform() < 0.5;
    const int longest = rng.uniform_int(0, 5);
    config.max_wall_m = 0.1 * longest;
    const std::vector<VoxelIndex> expected = reference(cells, config, longest);
    CHECK(cells.solids(config) == expected);
    found += expected.size();
  }
  CHECK(found > 3000);
}

TEST_CASE("maps without unknown, free or occupied voxels") {
  CHECK(Cells(5, 5, 5, kFree).solids().empty());
  CHECK(Cells(5, 5, 5, kOccupied).solids().empty());
  CHECK(complete_solids(std::vector<Occupancy>{}, GridSpec{}).empty());
  SolidConfig config;
  config.through_border = false;
  CHECK(Cells(5, 5, 5, kUnknown).solids(config).empty());
}

TEST_CASE("a map of two million voxels") {
  Cells cells(200, 200, 50, kUnknown);
  cells.fill({10, 10, 10}, {189, 189, 39}, kOccupied);
  cells.fill({11, 11, 11}, {188, 188, 38}, kFree);
  cells.fill({50, 50, 11}, {99, 99, 30}, kOccupied);
  cells.fill({51, 51, 11}, {98, 98, 29}, kUnknown);
  SolidConfig config;
  config.through_border = false;
  CHECK(cells.solids(config).size() == 48u * 48u * 19u);
}

TEST_CASE("solid completion validates its input") {
  SolidConfig config;
  config.max_wall_m = std::numeric_limits<double>::quiet_NaN();
  const Cells cells(3, 3, 3, kFree);
  CHECK_THROWS_AS(cells.solids(config), InputError);
  CHECK_THROWS_AS(complete_solids(std::vector<Occupancy>(5), cells.grid), InputError);
}
