/// Pictures of a map, drawn on the CPU: no display, no graphics card.
#pragma once

#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::apps {

struct RenderOptions {
  enum class View {
    kIso,   ///< every storey drawn for itself, its ceiling and the near outer walls cut away
    kTop,   ///< plan of every storey
    kSlice  ///< one horizontal layer: solid, free and unknown
  };
  View view = View::kIso;
  double slice_z_m = std::numeric_limits<double>::quiet_NaN();
  int width = 1200;
  int height = 900;
  double keep_height = 0.6;  ///< share of each storey's height that stays, in (0, 1]; at most 1.5 m are cut away
  std::vector<std::vector<Eigen::Vector3d>> trajectories_m;  ///< one polyline per UAV

  std::vector<std::string> problems() const;
};

/// Sets view and slice_z_m from `iso`, `top` or `slice:Z` (metres). @throws InputError quoting the text.
void parse_view(std::string_view text, RenderOptions& options);

/// @throws InputError for unusable options; RunError naming the file when it cannot be written.
void render_map_png(const mapping::OccupancyMap& map, const RenderOptions& options, const std::filesystem::path& file);

}  // namespace stairwell::apps
