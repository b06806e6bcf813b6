#include "perception/storeys.hpp"

#include "core/errors.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

namespace stairwell::perception {
namespace {

constexpr double kViewDistance_m = 1.5;
constexpr double kCeilingShare = 0.1;  ///< of the floor's columns must show a ceiling for it to count

/// An up-facing voxel and what is above it in its column; heights are voxel counts from the grid's bottom.
struct FloorCell {
  int column = 0;
  int floor = 0;             ///< upper face
  int free_top = 0;          ///< upper face of the free run that starts on the floor
  bool has_ceiling = false;  ///< the free run ends at an occupied voxel
};

int voxels(double length_m, const GridSpec& grid) {
  return static_cast<int>(std::lround(length_m / grid.resolution_m()));
}

std::vector<FloorCell> floor_cells(std::span<const Occupancy> cells, const GridSpec& grid, int headroom) {
  const auto [nx, ny, nz] = grid.size();
  const std::size_t layer = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  std::vector<FloorCell> found;
  for (int column = 0; column < nx * ny; ++column) {
    const auto at = [&](int z) {
      return cells[layer * static_cast<std::size_t>(z) + static_cast<std::size_t>(column)];
    };
    for (int z = 0; z + 1 < nz; ++z) {
      if (at(z) != Occupancy::kOccupied || at(z + 1) != Occupancy::kFree) {
        continue;
      }
      int top = z + 1;
      while (top < nz && at(top) == Occupancy::kFree) {
        ++top;
      }
      int solid = top;
      while (solid < nz && solid <= z + headroom && at(solid) != Occupancy::kOccupied) {
        ++solid;
      }
      if (solid > z + headroom || solid == nz) {
        found.push_back({column, z + 1, top, top < nz && at(top) == Occupancy::kOccupied});
      }
      z = top - 1;
    }
  }
  return found;
}

struct Peak {
  int level = 0;  ///< middle of the window, upper face
  std::size_t count = 0;
};

/// Free voxels of every horizontal layer.
std::vector<std::size_t> free_counts(std::span<const Occupancy> cells, const GridSpec& grid) {
  std::vector<std::size_t> counts;
  const std::size_t layer = cells.size() / static_cast<std::size_t>(grid.size()[2]);
  for (std::size_t begin = 0; begin < cells.size(); begin += layer) {
    const auto slice = cells.subspan(begin, layer);
    counts.push_back(static_cast<std::size_t>(std::count(slice.begin(), slice.end(), Occupancy::kFree)));
  }
  return counts;
}

/// Levels with the most floor cells within a window, none nearer than `apart` to a larger one, and with enough floor
/// for the free space just above the window.
std::vector<int> peak_levels(const std::vector<FloorCell>& cells, const std::vector<std::size_t>& free_in_layer,
                             int window, int apart, std::size_t min_count, double min_share) {
  const auto levels = static_cast<int>(free_in_layer.size());
  std::vector<std::size_t> below(static_cast<std::size_t>(levels) + 1, 0);
  for (const FloorCell& cell : cells) {
    ++below[static_cast<std::size_t>(cell.floor) + 1];
  }
  std::partial_sum(below.begin(), below.end(), below.begin());
  const auto count_between = [&](int lo, int hi) {
    const auto clamp = [&](int level) { return static_cast<std::size_t>(std::clamp(level, 0, levels)); };
    return below[clamp(hi + 1)] - below[clamp(lo)];
  };
  std::vector<Peak> peaks;
  for (int level = 0; level < levels; ++level) {
    const std::size_t count = count_between(level - window, level + window);
    const auto above = static_cast<std::size_t>(std::min(level + window, levels - 1));
    if (count >= min_count && static_cast<double>(count) >= min_share * static_cast<double>(free_in_layer[above])) {
      peaks.push_back({level, count});
    }
  }
  // Among windows with the same cells the one centred on them: the level itself has the most.
  std::stable_sort(peaks.begin(), peaks.end(), [&](const Peak& a, const Peak& b) {
    return a.count != b.count ? a.count > b.count : count_between(a.level, a.level) > count_between(b.level, b.level);
  });
  std::vector<int> kept;
  for (const Peak& peak : peaks) {
    const bool alone =
        std::none_of(kept.begin(), kept.end(), [&](int level) { return std::abs(level - peak.level) < apart; });
    if (alone) {
      kept.push_back(peak.level);
    }
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

int median(std::vector<int> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The value with the most others within `window` of it (median of those).
int mode(std::vector<int> values, int window) {
  std::sort(values.begin(), values.end());
  std::size_t best = 0, best_begin = 0, best_end = 0;
  std::size_t begin = 0, end = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    while (values[begin] < values[i] - window) {
      ++begin;
    }
    while (end < values.size() && values[end] <= values[i] + window) {
      ++end;
    }
    if (end - begin > best) {
      best = end - begin;
      best_begin = begin;
      best_end = end;
    }
  }
  return values[(best_begin + best_end) / 2];
}

Storey describe(const std::vector<FloorCell>& cells, int level, std::optional<int> next_level, const GridSpec& grid,
                int window, int apart) {
  std::vector<int> floors, ceilings, tops, columns;
  for (const FloorCell& cell : cells) {
    if (cell.floor < level - window || cell.floor >= level + apart ||
        (next_level && cell.floor >= *next_level - window)) {
      continue;
    }
    columns.push_back(cell.column);
    if (cell.floor <= level + window) {
      floors.push_back(cell.floor);
      tops.push_back(cell.free_top);
      if (cell.has_ceiling) {
        ceilings.push_back(cell.free_top);
      }
    }
  }
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  const bool seen = static_cast<double>(ceilings.size()) >= kCeilingShare * static_cast<double>(floors.size());
  int floor = median(std::move(floors));
  int ceiling = seen ? mode(std::move(ceilings), window) : median(std::move(tops));
  if (next_level) {
    ceiling = std::min(ceiling, *next_level);
  }
  const auto height_m = [&grid](int faces) { return (grid.first_cell()[2] + faces) * grid.resolution_m(); };
  Storey storey;
  storey.floor_z_m = height_m(floor);
  storey.ceiling_z_m = height_m(ceiling);
  storey.area_m2 = static_cast<double>(columns.size()) * grid.resolution_m() * grid.resolution_m();
  return storey;
}

}  // namespace

std::vector<std::string> StoreyConfig::problems() const {
  std::vector<std::string> found;
  const auto check = [&found](const char* name, double value, bool good, const char* rule) {
    if (!good || !std::isfinite(value)) {
      found.push_back(std::string(name) + " must be " + rule + ", not " + std::to_string(value));
    }
  };
  check("min_area_m2", min_area_m2, min_area_m2 >= 0.0, "finite and not negative");
  check("min_share", min_share, min_share >= 0.0 && min_share <= 1.0, "between 0 and 1");
  check("min_height_m", min_height_m, min_height_m > 0.0, "finite and above 0");
  check("merge_m", merge_m, merge_m >= 0.0 && merge_m < min_height_m, "not negative and below min_height_m");
  return found;
}

std::vector<Storey> detect_storeys(std::span<const Occupancy> cells, const GridSpec& grid, const StoreyConfig& config) {
  std::string message;
  for (const std::string& problem : config.problems()) {
    message += (message.empty() ? "storey detection: " : "; ") + problem;
  }
  if (cells.size() != grid.voxel_count()) {
    message += "storey detection: " + std::to_string(cells.size()) + " cells for a grid of " +
               std::to_string(grid.voxel_count());
  }
  if (!message.empty()) {
    throw InputError(message);
  }
  if (cells.empty()) {
    return {};
  }
  const int apart = std::max(1, voxels(config.min_height_m, grid));
  const int window = voxels(0.5 * config.merge_m, grid);
  const std::vector<FloorCell> floors = floor_cells(cells, grid, apart);
  const double cell_area_m2 = grid.resolution_m() * grid.resolution_m();
  const auto min_count = static_cast<std::size_t>(std::max(1.0, std::ceil(config.min_area_m2 / cell_area_m2 - 1e-9)));
  const std::vector<int> levels =
      peak_levels(floors, free_counts(cells, grid), window, apart, min_count, config.min_share);
  std::vector<Storey> storeys;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const std::optional<int> next = i + 1 < levels.size() ? std::optional<int>(levels[i + 1]) : std::nullopt;
    storeys.push_back(describe(floors, levels[i], next, grid, window, apart));
  }
  return storeys;
}

std::vector<Storey> detect_storeys(const std::function<Occupancy(const VoxelIndex&)>& at, const GridSpec& grid,
                                   const StoreyConfig& config) {
  std::vector<Occupancy> cells;
  cells.reserve(grid.voxel_count());
  const auto [nx, ny, nz] = grid.size();
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        cells.push_back(at({x, y, z}));
      }
    }
  }
  return detect_storeys(cells, grid, config);
}

std::vector<double> layer_heights(std::span<const Storey> storeys, double vertical_fov_rad, double spacing_m,
                                  double clearance_m) {
  if (!(vertical_fov_rad > 0.0) || !(spacing_m > 0.0) || !std::isfinite(clearance_m)) {
    throw InputError("layer heights need a vertical field of view and a spacing above 0, and a finite clearance");
  }
  const double half_fov_rad = std::min(0.5 * vertical_fov_rad, rad_from_deg(89.0));
  const double band_m = std::min(spacing_m, 2.0 * kViewDistance_m * std::tan(half_fov_rad));
  std::vector<double> heights_m;
  for (const Storey& storey : storeys) {
    const double usable_m = std::max(0.0, storey.ceiling_z_m - storey.floor_z_m - 2.0 * clearance_m);
    const int layers = std::max(1, static_cast<int>(std::ceil(usable_m / band_m - 1e-9)));
    const double middle_m = 0.5 * (storey.floor_z_m + storey.ceiling_z_m);
    for (int i = 0; i < layers; ++i) {
      heights_m.push_back(middle_m + usable_m * ((i + 0.5) / layers - 0.5));
    }
  }
  std::sort(heights_m.begin(), heights_m.end());
  return heights_m;
}

}  // namespace stairwell::perception
