/// What the records of a replay add up to.
#pragma once

#include "apps/byte_codec.hpp"
#include "apps/replay_file.hpp"
#include "mapping/occupancy_map.hpp"

#include <nlohmann/json.hpp>

#include <catch2/catch.hpp>

#include <filesystem>
#include <set>
#include <string_view>

namespace stairwell::apps::testing {

struct ReplayState {
  std::set<std::uint64_t> occupied, frontier;
  std::size_t known = 0, plans = 0, false_occupied = 0, open_sides = 0;
  std::uint64_t last_ms = 0;
};

inline void apply_cells(ByteReader& reader, std::set<std::uint64_t>& cells, bool on) {
  std::uint64_t cell = 0;
  for (std::uint64_t left = reader.varint(); left > 0; --left) {
    cell += reader.varint();
    // Each change is one: nothing appears twice or vanishes unseen.
    if (on)
      CHECK(cells.insert(cell).second);
    else
      CHECK(cells.erase(cell) == 1);
  }
}

inline ReplayState replayed(const std::filesystem::path& file) {
  ReplayState state;
  std::size_t uavs = 0;
  for_each_record(read_replay(file), [&](ReplayRecord kind, std::string_view payload) {
    ByteReader reader(payload);
    if (kind == ReplayRecord::kHeader) uavs = nlohmann::json::parse(payload).at("uavs");
    if (kind == ReplayRecord::kPlan) ++state.plans;
    if (kind == ReplayRecord::kDifference) state.false_occupied = reader.varint();
    if (kind == ReplayRecord::kOpenSides) state.open_sides = reader.varint();
    const bool timed = kind == ReplayRecord::kVoxels || kind == ReplayRecord::kKnown || kind == ReplayRecord::kFrontier;
    if (!timed) return;
    const std::uint64_t time_ms = reader.varint();
    CHECK(time_ms >= state.last_ms);
    state.last_ms = time_ms;
    if (kind == ReplayRecord::kVoxels) {
      CHECK(reader.varint() < uavs);
      apply_cells(reader, state.occupied, true);
      apply_cells(reader, state.occupied, false);
    } else if (kind == ReplayRecord::kFrontier) {
      if (reader.varint() == 1) state.frontier.clear();
      apply_cells(reader, state.frontier, true);
      apply_cells(reader, state.frontier, false);
    } else {
      for (std::size_t i = 0; i < uavs; ++i) state.known += reader.varint();
    }
    CHECK(reader.done());
  });
  return state;
}

inline std::set<std::uint64_t> occupied_cells(const mapping::OccupancyMap& map) {
  const CellOrder order{map.grid().size()};
  std::set<std::uint64_t> cells;
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i)
    if (map.at(map.grid().voxel(i)) == Occupancy::kOccupied) cells.insert(order.cell(map.grid().voxel(i)));
  return cells;
}

}  // namespace stairwell::apps::testing
