#include "perception/solid_completion.hpp"

#include "core/errors.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace stairwell::perception {
namespace {

enum Mark : std::uint8_t { kNothing = 0, kOpen = 1, kSolid = 2 };

struct Axis {
  std::size_t stride = 1;
  int size = 0;
};

std::array<Axis, 3> axes_of(const GridSpec& grid) {
  const auto& size = grid.size();
  return {Axis{1, size[0]}, Axis{static_cast<std::size_t>(size[0]), size[1]},
          Axis{static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]), size[2]}};
}

int coordinate(std::size_t cell, const Axis& axis) {
  return static_cast<int>(cell / axis.stride % static_cast<std::size_t>(axis.size));
}

/// Calls visit(neighbour cell) for every face neighbour inside the grid.
template <typename Visit>
void for_each_neighbour(std::size_t cell, const std::array<Axis, 3>& axes, Visit&& visit) {
  for (const Axis& axis : axes) {
    const int at = coordinate(cell, axis);
    if (at > 0) {
      visit(cell - axis.stride);
    }
    if (at + 1 < axis.size) {
      visit(cell + axis.stride);
    }
  }
}

bool on_border(std::size_t cell, const std::array<Axis, 3>& axes) {
  for (const Axis& axis : axes) {
    const int at = coordinate(cell, axis);
    if (at == 0 || at + 1 == axis.size) {
      return true;
    }
  }
  return false;
}

/// Marks unknown voxels that free space (or the border) reaches through unknown voxels as kOpen, the others as kSolid.
std::vector<std::uint8_t> enclosed(std::span<const Occupancy> cells, const std::array<Axis, 3>& axes,
                                   bool through_border) {
  std::vector<std::uint8_t> marks(cells.size(), kNothing);
  std::vector<std::size_t> open;
  const auto reach = [&](std::size_t cell) {
    if (cells[cell] == Occupancy::kUnknown && marks[cell] == kNothing) {
      marks[cell] = kOpen;
      open.push_back(cell);
    }
  };
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    if (cells[cell] == Occupancy::kFree) {
      for_each_neighbour(cell, axes, reach);
    } else if (!through_border && cells[cell] == Occupancy::kUnknown && on_border(cell, axes)) {
      reach(cell);
    }
    while (!open.empty()) {
      const std::size_t next = open.back();
      open.pop_back();
      for_each_neighbour(next, axes, reach);
    }
  }
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    if (cells[cell] == Occupancy::kUnknown && marks[cell] == kNothing) {
      marks[cell] = kSolid;
    }
  }
  return marks;
}

bool touches_free(std::size_t cell, std::span<const Occupancy> cells, const std::array<Axis, 3>& axes) {
  bool touches = false;
  for_each_neighbour(cell, axes, [&](std::size_t other) { touches = touches || cells[other] == Occupancy::kFree; });
  return touches;
}

/// Marks the insides of walls across one axis.
void fill_walls(std::span<const Occupancy> cells, const std::array<Axis, 3>& axes, const Axis& across, int longest,
                std::vector<std::uint8_t>& marks) {
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const int start = coordinate(cell, across);
    if (cells[cell] != Occupancy::kOccupied || start + 2 >= across.size ||
        cells[cell + across.stride] != Occupancy::kUnknown) {
      continue;
    }
    int length = 0;
    std::size_t inside = cell + across.stride;
    bool hidden = true;
    while (hidden && length <= longest && start + 1 + length < across.size && cells[inside] == Occupancy::kUnknown) {
      hidden = !touches_free(inside, cells, axes);
      inside += across.stride;
      ++length;
    }
    const bool closed = start + 1 + length < across.size && cells[inside] == Occupancy::kOccupied;
    if (hidden && length <= longest && closed) {
      for (int i = 1; i <= length; ++i) {
        marks[cell + across.stride * static_cast<std::size_t>(i)] = kSolid;
      }
    }
  }
}

}  // namespace

std::vector<std::string> SolidConfig::problems() const {
  if (!(max_wall_m >= 0.0) || !std::isfinite(max_wall_m)) {
    return {"max_wall_m must be finite and not negative, not " + std::to_string(max_wall_m)};
  }
  return {};
}

std::vector<VoxelIndex> complete_solids(std::span<const Occupancy> cells, const GridSpec& grid,
                                        const SolidConfig& config) {
  if (const std::vector<std::string> found = config.problems(); !found.empty()) {
    throw InputError("solid completion: " + found.front());
  }
  if (cells.size() != grid.voxel_count()) {
    throw InputError("solid completion: " + std::to_string(cells.size()) + " cells for a grid of " +
                     std::to_string(grid.voxel_count()));
  }
  if (cells.empty()) {
    return {};
  }
  const std::array<Axis, 3> axes = axes_of(grid);
  std::vector<std::uint8_t> marks = enclosed(cells, axes, config.through_border);
  const double longest = std::floor(config.max_wall_m / grid.resolution_m() + 1e-6);
  if (longest >= 1.0) {
    for (const Axis& axis : axes) {
      fill_walls(cells, axes, axis, static_cast<int>(std::min(longest, 32768.0)), marks);
    }
  }
  std::vector<VoxelIndex> solid;
  for (std::size_t cell = 0; cell < marks.size(); ++cell) {
    if (marks[cell] == kSolid) {
      solid.push_back(grid.voxel(cell));
    }
  }
  return solid;
}

}  // namespace stairwell::perception
