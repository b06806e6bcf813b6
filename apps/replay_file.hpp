/// `replay.bin` of a run folder: what a replay needs beside the CSV files (docs/file_formats.md).
#pragma once

#include "core/grid_spec.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::apps {

enum class ReplayRecord : char {
  kHeader = 'H',      ///< JSON: grid, sensor, UAVs
  kVoxels = 'V',      ///< voxels that became occupied, and no longer are, by one UAV's scans
  kKnown = 'K',       ///< newly known voxels per UAV
  kFrontier = 'F',    ///< frontier cells that came and went
  kPlan = 'P',        ///< commanded motion of a UAV
  kDifference = 'D',  ///< voxels that the finished map has otherwise than the world
  kOpenSides = 'O',   ///< sides of the finished map's occupied voxels towards known free space
  kStoreys = 'S',     ///< JSON: floor and ceiling of each storey of the finished map
};

/// Cells of a lattice counted with z fastest, then y: along walls and floors of a building the numbers grow in small
/// steps.
struct CellOrder {
  std::array<int, 3> size{0, 0, 0};

  std::uint64_t cell(const VoxelIndex& v) const {
    return (static_cast<std::uint64_t>(v.x) * static_cast<std::uint64_t>(size[1]) + static_cast<std::uint64_t>(v.y)) *
               static_cast<std::uint64_t>(size[2]) +
           static_cast<std::uint64_t>(v.z);
  }
  VoxelIndex voxel(std::uint64_t cell) const;
};

/// The count, then the steps from one cell to the next. @pre cells are sorted
void put_cells(std::string& bytes, const std::vector<std::uint64_t>& cells);

/// Appends kind, length and payload.
void put_record(std::string& records, ReplayRecord kind, std::string_view payload);

/// What a replay file begins with.
inline constexpr std::string_view kReplayMagic = "STWREPL1";

/// Records with their length and checksum in front, as they stand in the file.
std::string replay_chunk(std::string_view records);

/// All records of a file, without the chunks around them.
/// @throws InputError naming the file: missing, not a replay, truncated, damaged.
std::string read_replay(const std::filesystem::path& file);

/// @throws InputError when the records are damaged.
void for_each_record(std::string_view records, const std::function<void(ReplayRecord, std::string_view)>& visit);

}  // namespace stairwell::apps
