#include "apps/render.hpp"
#include "apps/voxel_faces.hpp"
#include "apps/voxel_scene.hpp"
#include "building.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

namespace stairwell::apps {
namespace {

namespace fs = std::filesystem;

fs::path out(const std::string& name) { return fs::path(STAIRWELL_TEST_TMP) / name; }

std::string bytes_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

Image read_png(const fs::path& file) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&header, file.c_str()) != 0);
  header.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(header.width), static_cast<int>(header.height), {}};
  image.rgb.resize(PNG_IMAGE_SIZE(header));
  REQUIRE(png_image_finish_read(&header, nullptr, image.rgb.data(), 0, nullptr) != 0);
  return image;
}

Image draw(const mapping::OccupancyMap& map, const RenderOptions& options, const std::string& name) {
  render_map_png(map, options, out(name));
  return read_png(out(name));
}

RenderOptions small_options() {
  RenderOptions options;
  options.width = 480;
  options.height = 360;
  return options;
}

std::size_t different_pixels(const Image& a, const Image& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 < a.rgb.size(); i += 3)
    if (!std::equal(&a.rgb[i], &a.rgb[i] + 3, &b.rgb[i])) ++count;
  return count;
}

/// Depth at which a ray from far away first enters a solid voxel; infinity when it misses all.
double nearest_depth(const VoxelScene& scene, const Eigen::Vector3d& through, const Eigen::Vector3d& away) {
  double nearest = INFINITY;
  for (int z = 0; z < scene.size[2]; ++z)
    for (int y = 0; y < scene.size[1]; ++y)
      for (int x = 0; x < scene.size[0]; ++x) {
        if (scene.at(x, y, z) != Occupancy::kOccupied) continue;
        const Eigen::Vector3d lo = scene.origin_m + scene.resolution_m * Eigen::Vector3d(x, y, z);
        const Eigen::Vector3d a = (lo - through).cwiseQuotient(away);
        const Eigen::Vector3d b = ((lo.array() + scene.resolution_m).matrix() - through).cwiseQuotient(away);
        const double enter = a.cwiseMin(b).maxCoeff(), leave = a.cwiseMax(b).minCoeff();
        if (enter < leave - 1e-9) nearest = std::min(nearest, enter);
      }
  return nearest;
}

VoxelScene random_scene(Rng& rng) {
  VoxelScene scene;
  scene.size = {7, 6, 5};
  for (int z = 0; z < 5; ++z)
    for (int y = 0; y < 6; ++y)
      for (int x = 0; x < 7; ++x) {
        const bool rim = x == 0 || y == 0 || z == 0 || x == 6 || y == 5 || z == 4;
        scene.cells.push_back(!rim && rng.uniform() < 0.4 ? Occupancy::kOccupied : Occupancy::kFree);
      }
  return scene;
}

}  // namespace

TEST_CASE("drawn faces lie where rays meet the voxels") {
  Rng rng = make_rng(7, "faces");
  for (int round = 0; round < 20; ++round) {
    const VoxelScene scene = random_scene(rng);
    Projection view = Projection::looking(rng.uniform(0.2, 1.3), rng.uniform(0.3, 1.2));
    view.samples_per_m = 100.0;
    view.offset = {80.0, 100.0};
    Canvas canvas(100, 80);
    draw_storey(canvas, view, scene, {0, 0, 4, 0.0, 0.5}, Eigen::Vector3d::Zero(),
                std::vector<Colour>(5, Colour::Ones()));
    int wrong = 0, hits = 0;
    for (int y = 0; y < canvas.height(); ++y)
      for (int x = 0; x < canvas.width(); ++x) {
        const Eigen::Vector2d flat = (Eigen::Vector2d(x + 0.5, y + 0.5) - view.offset) / view.samples_per_m;
        const double expected = nearest_depth(scene, flat.x() * view.right - flat.y() * view.up, view.away);
        const double drawn = canvas.depth(x, y);
        if (std::isfinite(expected)) ++hits;
        if (std::isfinite(expected) != std::isfinite(drawn) ||
            (std::isfinite(expected) && std::abs(expected - drawn) > 1e-4))
          ++wrong;
      }
    CHECK(hits > 1000);
    CHECK(wrong <= hits / 200);  // rays that graze an edge may fall on either side of it
  }
}

TEST_CASE("storeys are found by their floors, not by the furniture") {
  for (int count = 1; count <= 4; ++count) {
    const VoxelScene scene = make_scene(test::explored_building(count));
    const auto storeys = find_storeys(scene, 0.6);
    REQUIRE(storeys.size() == static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) {
      const Storey& storey = storeys[static_cast<std::size_t>(k)];
      CHECK(storey.floor_m == Approx(3.2 * k + 0.2).margin(0.101));
      CHECK(storey.lo <= storey.floor);
      CHECK(storey.floor < storey.cut);
      if (k + 1 < count) CHECK(storey.cut < storeys[static_cast<std::size_t>(k) + 1].lo);
    }
  }
}

TEST_CASE("the same map gives the same picture, in every view and size") {
  const auto map = test::explored_building(2, 9.0, 7.0);
  for (const char* view : {"iso", "top", "slice:1.5"}) {
    RenderOptions options = small_options();
    parse_view(view, options);
    options.trajectories_m = {{{2.0, 2.0, 1.0}, {5.0, 2.0, 1.0}, {5.0, 2.0, 4.5}}};
    const Image image = draw(map, options, "same_a.png");
    CHECK(image.width == 480);
    CHECK(image.height == 360);
    draw(map, options, "same_b.png");
    CHECK(bytes_of(out("same_a.png")) == bytes_of(out("same_b.png")));
    std::set<std::array<int, 3>> colours;
    for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3)
      colours.insert({image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]});
    CHECK(colours.size() > 60);
  }
}

TEST_CASE("trajectories show; points that are not finite do no harm") {
  const auto map = test::explored_building(1, 9.0, 7.0);
  RenderOptions options = small_options();
  const Image without = draw(map, options, "track.png");
  const double nan = std::nan("");
  options.trajectories_m = {
      {{nan, nan, nan}, {2.0, 2.0, 1.0}, {4.5, 2.0, 1.0}, {4.0, INFINITY, 1.0}}, {}, {{nan, 0.0, 0.0}}};
  const Image with = draw(map, options, "track.png");
  CHECK(different_pixels(without, with) > 150);
}

TEST_CASE("near outer walls are left out, so that the inside shows") {
  // Same building once seen from inside only, once with free space all around.
  auto map = test::explored_building(1, 9.0, 7.0);
  const Image inside = draw(map, small_options(), "walls.png");
  for (std::size_t i = 0; i < map.grid().voxel_count(); ++i)
    if (const VoxelIndex v = map.grid().voxel(i); map.at(v) == Occupancy::kUnknown) map.update(v, false);
  CHECK(different_pixels(inside, draw(map, small_options(), "walls.png")) > 2000);
}

TEST_CASE("an empty map is an empty picture, not a failure") {
  const mapping::OccupancyMap map(GridSpec(Aabb{{0, 0, 0}, {1, 1, 1}}, 0.1));
  const Image image = draw(map, small_options(), "empty.png");
  CHECK(image.width == 480);
}

TEST_CASE("views are read from text") {
  RenderOptions options;
  parse_view("slice:-1.25", options);
  CHECK(options.view == RenderOptions::View::kSlice);
  CHECK(options.slice_z_m == -1.25);
  parse_view("top", options);
  CHECK(options.view == RenderOptions::View::kTop);
  parse_view("iso", options);
  CHECK(options.view == RenderOptions::View::kIso);
  for (const char* text : {"", "Iso", "slice", "slice:", "slice:x", "slice:1m", "slice:nan", "slice:inf", "side"})
    CHECK_THROWS_AS(parse_view(text, options), InputError);
}

TEST_CASE("what cannot be drawn or written is refused, and nothing is left behind") {
  const auto map = test::explored_building(1, 9.0, 7.0);
  RenderOptions options = small_options();
  CHECK_THROWS_AS(render_map_png(map, options, out("no_such_folder/a.png")), RunError);
  fs::create_directories(out("folder.png"));
  CHECK_THROWS_AS(render_map_png(map, options, out("folder.png")), RunError);
  CHECK_FALSE(fs::exists(out("folder.png.tmp")));
  const auto refused = [&](auto change) {
    RenderOptions bad = small_options();
    change(bad);
    CHECK_THROWS_AS(render_map_png(map, bad, out("refused.png")), InputError);
  };
  refused([](RenderOptions& o) { o.width = 0; });
  refused([](RenderOptions& o) { o.height = 100000; });
  refused([](RenderOptions& o) { o.keep_height = 0.0; });
  refused([](RenderOptions& o) { o.keep_height = std::nan(""); });
  refused([](RenderOptions& o) { o.view = RenderOptions::View::kSlice; });
  refused([](RenderOptions& o) { parse_view("slice:99", o); });
  CHECK_FALSE(fs::exists(out("refused.png")));
}

}  // namespace stairwell::apps
