#include "apps/cast_storey.hpp"
#include "apps/curve_picture.hpp"
#include "apps/render.hpp"
#include "apps/voxel_scene.hpp"
#include "building.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "tests/test_folder.hpp"

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

fs::path out(const std::string& name) { return testing::test_folder() / name; }

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

TEST_CASE("a wall throws a shadow away from the sun and takes ambient light from the floor beside it") {
  VoxelScene scene;  // a floor of 6 x 4 m, a wall of 1 m across its middle; 0.1 m voxels
  scene.size = {62, 42, 14};
  for (int z = 0; z < 14; ++z)
    for (int y = 0; y < 42; ++y)
      for (int x = 0; x < 62; ++x) {
        const bool inside = x > 0 && y > 0 && x < 61 && y < 41;
        const bool solid = inside && (z == 1 || (z > 1 && z < 12 && x == 31));
        scene.cells.push_back(solid ? Occupancy::kOccupied : Occupancy::kFree);
      }
  Projection view;  // from above
  view.samples_per_m = 10.0 * Canvas::kSamples;
  view.offset = {0.0, 42.0 * Canvas::kSamples};
  Canvas canvas(62, 42);
  draw_storey(canvas, view, scene, {1, 1, 12, 0.2, 1.3}, Eigen::Vector3d::Zero(),
              std::vector<Colour>(14, Colour::Constant(0.5f)));
  const Image image = canvas.resolve();
  const auto light = [&](int x) { return static_cast<int>(image.pixel(x, 21)[1]); };
  for (int x = 2; x < 18; ++x) CHECK(light(x) == light(2));  // farther than ambient occlusion reaches
  CHECK(light(60) == light(2));                              // and than the shadow, too
  for (int x = 23; x < 30; ++x) CHECK(light(x) >= light(x + 1));
  CHECK(light(30) < light(20) - 15);  // sunny side: a corner
  CHECK(light(33) < light(29) - 15);  // the other side: shadow
  CHECK(light(35) < light(27) - 15);
}

/// Averages over squares of 8 pixels: what is where, whatever an edge's exact pixels are.
std::vector<double> squares(const Image& image) {
  constexpr int kEdge = 8;
  std::vector<double> means;
  for (int y = 0; y + kEdge <= image.height; y += kEdge)
    for (int x = 0; x + kEdge <= image.width; x += kEdge)
      for (int c = 0; c < 3; ++c) {
        double sum = 0.0;
        for (int j = 0; j < kEdge; ++j)
          for (int i = 0; i < kEdge; ++i) sum += image.pixel(x + i, y + j)[c];
        means.push_back(sum / (kEdge * kEdge));
      }
  return means;
}

TEST_CASE("the views look as they did") {
  const auto map = test::explored_building(2, 9.0, 7.0);
  const std::vector<std::pair<std::string, std::string>> views = {
      {"iso", "iso"}, {"top", "top"}, {"slice:1.5", "slice"}, {"storey:2", "storey"}};
  for (const auto& [view, name_of_view] : views) {
    CAPTURE(view);
    RenderOptions options;
    options.width = 320, options.height = 240;
    parse_view(view, options);
    options.trajectories_m = {{{2.0, 2.0, 1.0}, {5.0, 2.0, 1.0}, {5.0, 2.0, 4.5}, {7.0, 5.0, 4.5}}};
    const std::string name = name_of_view + ".png";
    const auto drawn = squares(draw(map, options, name));
    const auto golden = squares(read_png(fs::path(STAIRWELL_SOURCE_DIR) / "tests/render/golden" / name));
    REQUIRE(drawn.size() == golden.size());
    double sum = 0.0, most = 0.0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      sum += std::abs(drawn[i] - golden[i]);
      most = std::max(most, std::abs(drawn[i] - golden[i]));
    }
    CHECK(sum / static_cast<double>(drawn.size()) < 0.5);  // of 255
    CHECK(most < 12.0);
  }
}

TEST_CASE("one storey is drawn larger than all of them, with the tracks in it") {
  const auto map = test::explored_building(3, 9.0, 7.0);
  RenderOptions options = small_options();
  parse_view("storey:2", options);
  const Image without = draw(map, options, "storey.png");
  options.trajectories_m = {{{2.0, 2.0, 1.0}, {5.0, 2.0, 1.0}}};  // in the storey below
  const Image below = draw(map, options, "storey.png");
  options.trajectories_m = {{{2.0, 2.0, 4.2}, {5.0, 2.0, 4.2}}};
  const Image inside = draw(map, options, "storey.png");
  CHECK(different_pixels(below, inside) > 150);
  CHECK(different_pixels(without, below) < different_pixels(without, inside));
  for (const char* view : {"storey:4", "storey:99"}) {
    parse_view(view, options);
    CHECK_THROWS_WITH(draw(map, options, "storey.png"), Catch::Contains(view) && Catch::Contains("3 storeys"));
  }
}

TEST_CASE("a picture is drawn on as often as one likes") {
  const auto map = test::explored_building(1, 9.0, 7.0);
  const MapPicture picture(map, small_options());
  const std::vector<std::vector<Eigen::Vector3d>> track_m = {{{2.0, 2.0, 1.0}, {5.0, 2.0, 1.0}}};
  const Image first = picture.with(track_m);
  CHECK(different_pixels(first, picture.with({})) > 150);
  CHECK(different_pixels(first, picture.with(track_m, "12.5 s")) > 50);
  CHECK(different_pixels(first, picture.with(track_m)) == 0);
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
  parse_view("storey:12", options);
  CHECK(options.view == RenderOptions::View::kStorey);
  CHECK(options.storey == 12);
  for (const char* text :
       {"", "Iso", "slice", "slice:", "slice:x", "slice:1m", "slice:nan", "slice:inf", "side", "storey",
        "storey:", "storey:0", "storey:-1", "storey:1.5", "storey:x", "storey:99999999999"})
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

TEST_CASE("a curve goes where its numbers go, and has gaps where there are none") {
  const auto picture = [](const std::string& rows) {
    std::ofstream(out("curve.csv")) << "round,step,loss,wall_s\n" << rows;
    write_curve_picture(CsvTable::read(out("curve.csv")), "a curve", out("curve.png"));
    return read_png(out("curve.png"));
  };
  /// Height of the coloured pixels in a column of the picture, in the mean; NaN: there are none.
  const auto height_at = [](const Image& image, double part) {
    const int x = 90 + static_cast<int>(part * 790);
    double sum = 0.0, count = 0.0;
    for (int y = 0; y < image.height; ++y) {
      const std::uint8_t* p = image.pixel(x, y);
      if (p[0] - p[2] < 60) continue;  // grey or white
      sum += y;
      count += 1.0;
    }
    return sum / count;
  };
  const Image falling = picture("0,0,4,1\n1,100,2,2\n2,200,0,3\n");
  CHECK(height_at(falling, 0.1) < height_at(falling, 0.5) - 30.0);
  CHECK(height_at(falling, 0.5) < height_at(falling, 0.9) - 30.0);
  const Image gap = picture("0,0,4,1\n1,100,,2\n2,200,0,3\n");
  CHECK(std::isnan(height_at(gap, 0.5)));
  CHECK(different_pixels(picture("0,0,,1\n"), falling) > 0);  // nothing to draw is no failure
}

}  // namespace stairwell::apps
