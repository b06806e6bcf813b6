#include "apps/render.hpp"
#include "building.hpp"

#include <catch2/catch.hpp>

namespace stairwell::apps {

TEST_CASE("view a building") {
  const auto map = test::explored_building(3);
  RenderOptions options;
  for (int u = 0; u < 4; ++u) {
    std::vector<Eigen::Vector3d> track;
    for (int i = 0; i < 400; ++i)
      track.emplace_back(8.0 + (2 + u) * std::cos(0.05 * i + u), 6.0 + (1.0 + u) * std::sin(0.05 * i * (1 + u % 2)),
                         0.7 + 0.02 * i);
    options.trajectories_m.push_back(track);
  }
  render_map_png(map, options, STAIRWELL_TEST_TMP "/iso.png");
  options.view = RenderOptions::View::kTop;
  render_map_png(map, options, STAIRWELL_TEST_TMP "/top.png");
  parse_view("slice:1.5", options);
  render_map_png(map, options, STAIRWELL_TEST_TMP "/slice.png");
}

}  // namespace stairwell::apps
