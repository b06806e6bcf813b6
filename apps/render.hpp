/// Pictures of a map, drawn on the CPU: no display, no graphics card.
#pragma once

#include "apps/png_writer.hpp"
#include "mapping/occupancy_map.hpp"

#include <Eigen/Core>

#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace stairwell::apps {

struct RenderOptions {
  enum class View {
    kIso,    ///< every storey drawn for itself, its ceiling and the near outer walls cut away
    kTop,    ///< plan of every storey
    kSlice,  ///< one horizontal layer: solid, free and unknown
    kStorey  ///< one storey of kIso
  };
  View view = View::kIso;
  double slice_z_m = std::numeric_limits<double>::quiet_NaN();
  int storey = 1;  ///< for kStorey: counted from 1, the lowest
  int width = 1200;
  int height = 900;
  double keep_height = 0.6;  ///< share of each storey's height that stays, in (0, 1]; at most 1.5 m are cut away
  std::vector<std::vector<Eigen::Vector3d>> trajectories_m;  ///< one polyline per UAV

  std::vector<std::string> problems() const;
};

/// Sets view, slice_z_m and storey from `iso`, `top`, `slice:Z` (metres) or `storey:K`. @throws InputError quoting the
/// text.
void parse_view(std::string_view text, RenderOptions& options);

/// A map drawn once, on which paths are drawn any number of times (the frames of a film).
class MapPicture {
 public:
  /// @throws InputError naming the option that is unusable, and for a slice or storey that the map does not have.
  MapPicture(const mapping::OccupancyMap& map, const RenderOptions& options);
  ~MapPicture();
  MapPicture(MapPicture&&) noexcept;

  /// @param tracks_m one polyline per UAV, which ends where the UAV is; @param caption a line at the upper left, or ""
  Image with(const std::vector<std::vector<Eigen::Vector3d>>& tracks_m, std::string_view caption = "") const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Draws the map with the options' trajectories.
/// @throws InputError for unusable options; RunError naming the file when it cannot be written.
void render_map_png(const mapping::OccupancyMap& map, const RenderOptions& options, const std::filesystem::path& file);

}  // namespace stairwell::apps
