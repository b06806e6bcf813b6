#include "apps/render.hpp"

#include "apps/canvas.hpp"
#include "apps/cast_storey.hpp"
#include "apps/png_writer.hpp"
#include "apps/voxel_scene.hpp"
#include "core/errors.hpp"
#include "core/units.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <functional>

namespace stairwell::apps {
namespace {

constexpr double kAzimuth_rad = 0.68;  // a little off 45 degrees, so that no two walls fall on one line
constexpr double kElevation_rad = 0.72;
constexpr int kMargin = 28;           // pixels
constexpr int kFooter = 58;           // pixels kept for scale bar and legend
constexpr double kNearSlice_m = 1.0;  // tracks within this distance of a slice are drawn

/// A storey and where it is put on the table.
struct Tile {
  Storey storey;
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
};

using Place = std::array<int, 2>;
using PlaceOf = std::function<Place(int)>;

struct ScreenBox {
  Eigen::Vector2d lo = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d hi = -Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  void extend(const Eigen::Vector2d& p) {
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
  }
  Eigen::Vector2d size() const { return hi - lo; }
};

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f m", std::abs(value) < 0.05 ? 0.0 : value);
  return text;
}

Colour ink() { return from_srgb(52, 60, 74); }

/// Corners of a tile's box, moved to its place.
std::array<Eigen::Vector3d, 8> corners_of(const VoxelScene& scene, const Tile& tile) {
  std::array<Eigen::Vector3d, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    const Eigen::Vector3d cell((i & 1) != 0 ? scene.size[0] - 1 : 1, (i & 2) != 0 ? scene.size[1] - 1 : 1,
                               (i & 4) != 0 ? tile.storey.cut + 1 : tile.storey.lo);
    corners[i] = scene.origin_m + scene.resolution_m * cell + tile.shift_m;
  }
  return corners;
}

ScreenBox box_of(const VoxelScene& scene, const Projection& view, const std::vector<Tile>& tiles) {
  ScreenBox box;
  for (const Tile& tile : tiles)
    for (const Eigen::Vector3d& corner : corners_of(scene, tile)) box.extend(view.flat_m(corner));
  return box;
}

/// Tiles at lattice places on the table; the place decides how the picture fills its frame.
std::vector<Tile> place(const VoxelScene& scene, const std::vector<Storey>& storeys, bool flat,
                        const PlaceOf& place_of) {
  std::vector<Tile> tiles;
  double tallest_m = 0.0;
  for (const Storey& storey : storeys)
    tallest_m = std::max(tallest_m, scene.resolution_m * (storey.cut - storey.floor));
  const double gap_m = flat ? 1.5 : 1.0 + 0.9 * tallest_m;
  for (std::size_t k = 0; k < storeys.size(); ++k) {
    const auto at = place_of(static_cast<int>(k));
    Tile tile;
    tile.storey = storeys[k];
    tile.shift_m = {at[0] * (scene.resolution_m * scene.size[0] + gap_m),
                    at[1] * (scene.resolution_m * scene.size[1] + gap_m), storeys.front().floor_m - storeys[k].floor_m};
    tiles.push_back(tile);
  }
  return tiles;
}

/// The arrangement of the storeys that gives the largest picture; sets the projection's scale and offset.
std::vector<Tile> arrange(const VoxelScene& scene, const std::vector<Storey>& storeys, const RenderOptions& options,
                          Projection& view) {
  const bool flat = options.view == RenderOptions::View::kTop;
  std::vector<PlaceOf> choices;
  const int columns_most = flat ? static_cast<int>(storeys.size()) : 0;
  for (int columns = 1; columns <= columns_most; ++columns)
    choices.emplace_back([columns](int k) { return Place{k % columns, k / columns}; });
  if (!flat) {
    choices.emplace_back([](int k) { return Place{(k + 1) / 2, k / 2}; });  // zigzag, first to the right
    choices.emplace_back([](int k) { return Place{k / 2, (k + 1) / 2}; });  // zigzag, first to the left
    choices.emplace_back([](int k) { return Place{k, 0}; });                // stairs to the right
    choices.emplace_back([](int k) { return Place{0, k}; });                // stairs to the left
    choices.emplace_back([](int k) { return Place{k, -k}; });               // row
    choices.emplace_back([](int k) { return Place{k, k}; });                // stack
  }
  const double frame_x = Canvas::kSamples * (options.width - 2.0 * kMargin);
  const double frame_y = Canvas::kSamples * (options.height - 2.0 * kMargin - kFooter);
  std::vector<Tile> best;
  double best_scale = 0.0;
  for (const auto& choice : choices) {
    std::vector<Tile> tiles = place(scene, storeys, flat, choice);
    const Eigen::Vector2d size = box_of(scene, view, tiles).size();
    const double scale = std::min(frame_x / size.x(), frame_y / size.y());
    if (scale <= best_scale) continue;
    best_scale = scale;
    best = std::move(tiles);
  }
  const ScreenBox box = box_of(scene, view, best);
  view.samples_per_m = best_scale;
  view.offset =
      Eigen::Vector2d(Canvas::kSamples * kMargin + 0.5 * frame_x, Canvas::kSamples * kMargin + 0.5 * frame_y) -
      best_scale * 0.5 * (box.lo + box.hi);
  return best;
}

std::size_t storey_of(const std::vector<Tile>& tiles, double z_m) {
  std::size_t found = 0;
  for (std::size_t k = 1; k < tiles.size(); ++k)
    if (z_m >= tiles[k].storey.floor_m) found = k;
  return found;
}

/// A tube along the polyline; each point is drawn in its storey's tile. Points that are not finite break it.
void draw_track(Canvas& canvas, const Projection& view, const std::vector<Tile>& tiles,
                const std::vector<Eigen::Vector3d>& track_m, const Colour& colour) {
  const double radius = std::max(0.055 * view.samples_per_m, 1.5 * Canvas::kSamples);
  const auto depth_per_sample = static_cast<float>(1.0 / view.samples_per_m);
  const auto ball = [&](const Eigen::Vector3d& p, double size, const Colour& paint) {
    const Eigen::Vector3d at = p + tiles[storey_of(tiles, p.z())].shift_m;
    canvas.ball(view.screen(at), size, view.depth(at), depth_per_sample, paint);
  };
  const Eigen::Vector3d* last = nullptr;
  const Eigen::Vector3d* first = nullptr;
  for (const Eigen::Vector3d& p : track_m) {
    if (!p.allFinite()) {
      last = nullptr;
      continue;
    }
    if (first == nullptr) first = &p;
    const double length_m = last == nullptr ? 0.0 : (p - *last).norm();
    const int pieces = std::clamp(static_cast<int>(std::ceil(length_m * view.samples_per_m / (0.4 * radius))), 1, 4000);
    for (int i = 1; i <= pieces; ++i) {
      const double part = static_cast<double>(i) / pieces;
      ball(last == nullptr ? p : Eigen::Vector3d(*last + part * (p - *last)), radius, colour);
    }
    last = &p;
  }
  if (first != nullptr) ball(*first, 2.2 * radius, 0.35f * colour + Colour::Constant(0.65f));
  if (last != nullptr) ball(*last, 2.9 * radius, colour);
}

/// Length that is round (1, 2 or 5 times a power of ten) and at most `most_m`.
double round_length_m(double most_m) {
  const double power = std::pow(10.0, std::floor(std::log10(most_m)));
  for (const double step : {5.0, 2.0})
    if (step * power <= most_m) return step * power;
  return power;
}

void draw_scale_bar(Image& image, double pixels_per_m) {
  const double length_m = round_length_m(0.16 * image.width / pixels_per_m);
  const int length = static_cast<int>(std::lround(length_m * pixels_per_m));
  const int y = image.height - kMargin;
  fill_rect(image, kMargin, y, length, 3, ink());
  fill_rect(image, kMargin, y - 5, 3, 8, ink());
  fill_rect(image, kMargin + length - 3, y - 5, 3, 8, ink());
  char text[32];
  std::snprintf(text, sizeof text, "%g m", length_m);
  draw_text(image, kMargin + (length - text_width(text, 2)) / 2, y - 22, text, ink(), 2);
}

void draw_height_legend(Image& image, double low_m, double high_m) {
  const int length = image.width / 6, y = image.height - kMargin - 4;
  const std::string low = metres(low_m), high = "z = " + metres(high_m);
  const int x = image.width - kMargin - text_width(high, 2) - 10 - length;
  for (int i = 0; i < length; ++i) fill_rect(image, x + i, y - 5, 1, 14, height_colour(double(i) / length));
  draw_text(image, x - 10 - text_width(low, 2), y - 5, low, ink(), 2);
  draw_text(image, x + length + 10, y - 5, high, ink(), 2);
}

void draw_track_legend(Image& image, std::size_t count) {
  int x = kMargin + image.width / 5;
  const int y = image.height - kMargin - 9;
  const int room = image.width - image.width / 6 - 2 * kMargin - 280;
  for (std::size_t i = 0; i < count && x + 90 < room; ++i) {
    const std::string name = "UAV " + std::to_string(i);
    fill_disc(image, x + 7, y + 7, 6.5, track_colour(i));
    draw_text(image, x + 18, y, name, ink(), 2);
    x += 18 + text_width(name, 2) + 16;
  }
}

/// Name and height of each storey on a light plate, at the lower corner of its tile that is farther from the others.
void draw_labels(Image& image, const VoxelScene& scene, const Projection& view, const std::vector<Tile>& tiles) {
  std::vector<ScreenBox> boxes(tiles.size());
  for (std::size_t k = 0; k < tiles.size(); ++k)
    for (const auto& corner : corners_of(scene, tiles[k])) boxes[k].extend(view.screen(corner) / Canvas::kSamples);
  const auto room = [&](const Eigen::Vector2d& p, std::size_t self) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < boxes.size(); ++k)
      if (k != self) least = std::min(least, (0.5 * (boxes[k].lo + boxes[k].hi) - p).norm());
    return least;
  };
  const bool flat = view.away.z() < -0.999;
  for (std::size_t k = 0; k < tiles.size() && tiles.size() > 1; ++k) {
    const bool on_left = flat || room({boxes[k].lo.x(), boxes[k].hi.y()}, k) >= room(boxes[k].hi, k);
    const std::string text = "storey " + std::to_string(k + 1) + "  z " + metres(tiles[k].storey.floor_m);
    const int width = text_width(text, 2);
    const int y = static_cast<int>(boxes[k].hi.y()) + (flat ? 10 : -text_height(2) - 10);
    const int edge = static_cast<int>(on_left ? boxes[k].lo.x() : boxes[k].hi.x());
    const int x = std::clamp(on_left ? edge : edge - width, 10, std::max(10, image.width - width - 10));
    fill_rect(image, x - 6, y - 5, width + 12, text_height(2) + 10, from_srgb(255, 255, 255), 0.6f);
    draw_text(image, x, y, text, ink(), 2);
  }
}

Colour height_colour_of(const VoxelScene& scene, int layer, double low_m, double high_m) {
  const double height_m = scene.origin_m.z() + scene.resolution_m * (layer + 1);
  return height_colour((height_m - low_m) / std::max(0.1, high_m - low_m));
}

/// The whole text as a number.
template <typename Number>
bool read_all(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

/// All storeys, or the one that was asked for.
std::vector<Storey> storeys_to_draw(const VoxelScene& scene, const RenderOptions& options) {
  std::vector<Storey> storeys = find_storeys(scene, options.keep_height);
  if (options.view != RenderOptions::View::kStorey) return storeys;
  const int count = static_cast<int>(storeys.size());
  if (options.storey < 1 || options.storey > count)
    throw InputError("storey:" + std::to_string(options.storey) + ": the map has " + std::to_string(count) +
                     (count == 1 ? " storey" : " storeys") + ", counted from 1");
  return {storeys[static_cast<std::size_t>(options.storey - 1)]};
}

/// One layer of the map as a plan: dark solid, white free, grey unknown.
void draw_slice(Canvas& canvas, Projection& view, const mapping::OccupancyMap& map, const RenderOptions& options) {
  const Aabb box = map.grid().box();
  if (options.slice_z_m < box.min_m.z() || options.slice_z_m >= box.max_m.z())
    throw InputError("slice:" + metres(options.slice_z_m) + " lies outside the map, which reaches from " +
                     metres(box.min_m.z()) + " to " + metres(box.max_m.z()));
  const double frame_x = Canvas::kSamples * (options.width - 2.0 * kMargin);
  const double frame_y = Canvas::kSamples * (options.height - 2.0 * kMargin - kFooter);
  view.samples_per_m = std::min(frame_x / box.size_m().x(), frame_y / box.size_m().y());
  view.offset =
      Eigen::Vector2d(Canvas::kSamples * kMargin + 0.5 * frame_x, Canvas::kSamples * kMargin + 0.5 * frame_y) -
      view.samples_per_m * view.flat_m(box.center_m());
  const Colour solid = from_srgb(44, 62, 92), open = from_srgb(255, 255, 255), unknown = from_srgb(205, 211, 220);
  for (int y = 0; y < canvas.height(); ++y)
    for (int x = 0; x < canvas.width(); ++x) {
      const Eigen::Vector2d at = (Eigen::Vector2d(x + 0.5, y + 0.5) - view.offset) / view.samples_per_m;
      const Eigen::Vector3d p(at.x(), -at.y(), options.slice_z_m);
      if (!map.grid().contains(p)) continue;
      const Occupancy cell = map.at(p);
      canvas.set(x, y, 1e6f, cell == Occupancy::kOccupied ? solid : cell == Occupancy::kFree ? open : unknown);
    }
}

}  // namespace

struct MapPicture::Impl {
  explicit Impl(const RenderOptions& render_options) : options(render_options), canvas(options.width, options.height) {}

  void draw_storeys() {
    const bool flat = options.view == RenderOptions::View::kTop;
    view = Projection::looking(flat ? 0.5 * kPi : kAzimuth_rad, flat ? 0.5 * kPi : kElevation_rad);
    if (flat)
      view.right = Eigen::Vector3d::UnitX(), view.up = Eigen::Vector3d::UnitY(), view.away = -Eigen::Vector3d::UnitZ();
    tiles = arrange(scene, storeys_to_draw(scene, options), options, view);
    low_m = tiles.front().storey.floor_m;
    high_m = scene.origin_m.z() + scene.resolution_m * (tiles.back().storey.cut + 1);
    std::vector<Colour> colours;
    for (int z = 0; z < scene.size[2]; ++z) colours.push_back(height_colour_of(scene, z, low_m, high_m));
    for (const Tile& tile : tiles) draw_storey(canvas, view, scene, tile.storey, tile.shift_m, colours);
    canvas.draw_outlines(static_cast<float>(4.0 * scene.resolution_m), 0.45f);
  }

  /// What of a track is in the picture; the rest is not finite.
  std::vector<Eigen::Vector3d> visible(std::vector<Eigen::Vector3d> track_m) const {
    double least_m = -std::numeric_limits<double>::infinity(), most_m = -least_m;
    if (options.view == RenderOptions::View::kSlice)
      least_m = options.slice_z_m - kNearSlice_m, most_m = options.slice_z_m + kNearSlice_m;
    if (options.view == RenderOptions::View::kStorey)
      least_m = tiles.front().storey.floor_m, most_m = tiles.front().storey.ceiling_m;
    for (Eigen::Vector3d& p : track_m)
      if (p.z() < least_m || p.z() > most_m) p.setConstant(std::numeric_limits<double>::quiet_NaN());
    return track_m;
  }

  void annotate(Image& image) const {
    draw_scale_bar(image, view.samples_per_m / Canvas::kSamples);
    if (options.view == RenderOptions::View::kSlice) {
      const std::string text = "z = " + metres(options.slice_z_m);
      draw_text(image, image.width - kMargin - text_width(text, 2), image.height - kMargin - 9, text, ink(), 2);
      return;
    }
    draw_labels(image, scene, view, tiles);
    draw_height_legend(image, low_m, high_m);
  }

  RenderOptions options;
  Canvas canvas;
  Projection view;
  VoxelScene scene;
  std::vector<Tile> tiles;  ///< empty: nothing solid yet, and a picture that says so
  double low_m = 0.0, high_m = 0.0;
};

std::vector<std::string> RenderOptions::problems() const {
  std::vector<std::string> found;
  if (width < 320 || width > 8192)
    found.push_back("width is " + std::to_string(width) + ", expected 320 to 8192 pixels");
  if (height < 240 || height > 8192)
    found.push_back("height is " + std::to_string(height) + ", expected 240 to 8192 pixels");
  if (!(keep_height > 0.0 && keep_height <= 1.0)) found.push_back("keep_height must lie above 0 and at most at 1");
  if (view == View::kSlice && !std::isfinite(slice_z_m)) found.push_back("the slice has no height");
  if (view == View::kStorey && storey < 1) found.push_back("storeys are counted from 1");
  return found;
}

void parse_view(std::string_view text, RenderOptions& options) {
  if (text == "iso") {
    options.view = RenderOptions::View::kIso;
    return;
  }
  if (text == "top") {
    options.view = RenderOptions::View::kTop;
    return;
  }
  constexpr std::string_view kSlice = "slice:", kStorey = "storey:";
  if (text.starts_with(kSlice) && read_all(text.substr(kSlice.size()), options.slice_z_m) &&
      std::isfinite(options.slice_z_m)) {
    options.view = RenderOptions::View::kSlice;
    return;
  }
  if (text.starts_with(kStorey) && read_all(text.substr(kStorey.size()), options.storey) && options.storey >= 1) {
    options.view = RenderOptions::View::kStorey;
    return;
  }
  throw InputError("unknown view '" + std::string(text) +
                   "': expected iso, top, slice:Z with Z in metres, or storey:K with K from 1");
}

MapPicture::MapPicture(const mapping::OccupancyMap& map, const RenderOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw InputError("the map cannot be drawn: " + problems.front());
  impl_ = std::make_unique<Impl>(options);
  if (options.view == RenderOptions::View::kSlice) {
    impl_->tiles.resize(1);
    draw_slice(impl_->canvas, impl_->view, map, options);
    return;
  }
  impl_->scene = make_scene(map);
  if (!impl_->scene.empty()) impl_->draw_storeys();
}

MapPicture::~MapPicture() = default;
MapPicture::MapPicture(MapPicture&&) noexcept = default;

Image MapPicture::with(const std::vector<std::vector<Eigen::Vector3d>>& tracks_m, std::string_view caption) const {
  Canvas canvas = impl_->canvas;
  const bool any = !impl_->tiles.empty();
  for (std::size_t i = 0; any && i < tracks_m.size(); ++i)
    draw_track(canvas, impl_->view, impl_->tiles, impl_->visible(tracks_m[i]), track_colour(i));
  Image image = canvas.resolve();
  if (any) impl_->annotate(image);
  if (any) draw_track_legend(image, tracks_m.size());
  draw_text(image, kMargin, 7, caption, ink(), 2);  // in the margin, beside nothing
  return image;
}

void render_map_png(const mapping::OccupancyMap& map, const RenderOptions& options, const std::filesystem::path& file) {
  write_png(MapPicture(map, options).with(options.trajectories_m), file);
}

}  // namespace stairwell::apps
