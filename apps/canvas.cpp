#include "apps/canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace stairwell::apps {
namespace {

float linear_of(double srgb) {
  return static_cast<float>(srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4));
}

std::uint8_t srgb_of(float linear) {
  static const auto table = [] {
    std::array<std::uint8_t, 4096> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double v = static_cast<double>(i) / 4095.0;
      const double s = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
      values[i] = static_cast<std::uint8_t>(std::lround(255.0 * s));
    }
    return values;
  }();
  // Once per pixel, and never negative: no need for std::lround.
  // NOLINTNEXTLINE(bugprone-incorrect-roundings)
  return table[static_cast<std::size_t>(std::clamp(linear, 0.0f, 1.0f) * 4095.0f + 0.5f)];
}

void blend(std::uint8_t* pixel, const Colour& colour, float opacity) {
  for (int c = 0; c < 3; ++c) {
    const float below = linear_of(pixel[c] / 255.0);
    pixel[c] = srgb_of(below + opacity * (colour[c] - below));
  }
}

}  // namespace

Colour from_srgb(int r, int g, int b) { return {linear_of(r / 255.0), linear_of(g / 255.0), linear_of(b / 255.0)}; }

Colour height_colour(double t) {
  static const std::array<Colour, 7> stops = {
      from_srgb(84, 116, 190),  from_srgb(66, 143, 184),  from_srgb(70, 167, 168), from_srgb(108, 191, 147),
      from_srgb(150, 203, 116), from_srgb(207, 218, 104), from_srgb(250, 226, 120)};
  const double at = std::clamp(t, 0.0, 1.0) * static_cast<double>(stops.size() - 1);
  const std::size_t below = std::min(stops.size() - 2, static_cast<std::size_t>(at));
  const auto part = static_cast<float>(at - static_cast<double>(below));
  return stops[below] + part * (stops[below + 1] - stops[below]);
}

Colour track_colour(std::size_t index) {
  static const std::array<Colour, 7> colours = {from_srgb(213, 94, 0),  from_srgb(0, 90, 181),  from_srgb(204, 60, 140),
                                                from_srgb(20, 20, 30),  from_srgb(230, 159, 0), from_srgb(0, 135, 100),
                                                from_srgb(86, 180, 233)};
  return colours[index % colours.size()];
}

Canvas::Canvas(int width, int height) : width_(kSamples * width), height_(kSamples * height) {
  const auto count = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  depth_.assign(count, std::numeric_limits<float>::infinity());
  colour_.reserve(count);
  const Colour top = from_srgb(252, 253, 255), bottom = from_srgb(232, 237, 244);
  for (int y = 0; y < height_; ++y) {
    const float t = static_cast<float>(y) / static_cast<float>(height_);
    colour_.insert(colour_.end(), static_cast<std::size_t>(width_), top + t * (bottom - top));
  }
}

void Canvas::draw_outlines(float step_m, float strength) {
  std::vector<std::size_t> edges;
  for (int y = 1; y + 1 < height_; ++y)
    for (int x = 1; x + 1 < width_; ++x) {
      const float here = depth_[index(x, y)];
      const float nearest = std::min(std::min(depth_[index(x - 1, y)], depth_[index(x + 1, y)]),
                                     std::min(depth_[index(x, y - 1)], depth_[index(x, y + 1)]));
      if (nearest + step_m < here) edges.push_back(index(x, y));
    }
  for (const std::size_t i : edges) colour_[i] *= 1.0f - strength;
}

void Canvas::ball(const Eigen::Vector2d& centre, double radius, float depth, float depth_per_sample,
                  const Colour& colour) {
  const int x0 = static_cast<int>(std::floor(centre.x() - radius)),
            x1 = static_cast<int>(std::ceil(centre.x() + radius));
  const int y0 = static_cast<int>(std::floor(centre.y() - radius)),
            y1 = static_cast<int>(std::ceil(centre.y() + radius));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const double dx = (x + 0.5 - centre.x()) / radius, dy = (y + 0.5 - centre.y()) / radius;
      const double r2 = dx * dx + dy * dy;
      if (r2 > 1.0) continue;
      const double out = std::sqrt(1.0 - r2);
      const double light = 0.55 + 0.5 * std::max(0.0, -0.45 * dx - 0.6 * dy + 0.66 * out);
      set(x, y, depth - static_cast<float>(out * radius) * depth_per_sample, static_cast<float>(light) * colour);
    }
}

Image Canvas::resolve() const {
  Image image{width_ / kSamples, height_ / kSamples, {}};
  image.rgb.reserve(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (int y = 0; y < height_; y += kSamples)
    for (int x = 0; x < width_; x += kSamples) {
      Colour sum = Colour::Zero();
      for (int j = 0; j < kSamples; ++j)
        for (int i = 0; i < kSamples; ++i) sum += colour_[index(x + i, y + j)];
      sum /= static_cast<float>(kSamples * kSamples);
      for (int c = 0; c < 3; ++c) image.rgb.push_back(srgb_of(sum[c]));
    }
  return image;
}

void fill_rect(Image& image, int x, int y, int width, int height, const Colour& colour, float opacity) {
  for (int j = std::max(0, y); j < std::min(image.height, y + height); ++j)
    for (int i = std::max(0, x); i < std::min(image.width, x + width); ++i) blend(image.pixel(i, j), colour, opacity);
}

void fill_disc(Image& image, double x, double y, double radius, const Colour& colour) {
  const int reach = static_cast<int>(std::ceil(radius)) + 1;
  const int cx = static_cast<int>(std::lround(x)), cy = static_cast<int>(std::lround(y));
  for (int j = std::max(0, cy - reach); j <= std::min(image.height - 1, cy + reach); ++j)
    for (int i = std::max(0, cx - reach); i <= std::min(image.width - 1, cx + reach); ++i) {
      const double inside = radius - std::hypot(i + 0.5 - x, j + 0.5 - y) + 0.5;
      if (inside > 0.0) blend(image.pixel(i, j), colour, static_cast<float>(std::min(1.0, inside)));
    }
}

}  // namespace stairwell::apps
