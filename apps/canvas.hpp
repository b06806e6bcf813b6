#pragma once

#include "apps/png_writer.hpp"

#include <Eigen/Core>

#include <limits>
#include <string_view>
#include <vector>

namespace stairwell::apps {

/// Linear light, 0 to 1 per channel.
using Colour = Eigen::Vector3f;

Colour from_srgb(int r, int g, int b);
/// Height colours: dark blue over teal and green to warm yellow, lightness growing steadily. @param t 0 to 1
Colour height_colour(double t);
/// Easily told apart, also by the colour-blind (Okabe and Ito 2008); repeats after seven.
Colour track_colour(std::size_t index);

/// Colour and depth at twice the final resolution, averaged down at the end.
class Canvas {
 public:
  static constexpr int kSamples = 2;

  Canvas(int width, int height);

  int width() const { return width_; }    ///< in samples
  int height() const { return height_; }  ///< in samples

  void set(int x, int y, float depth, const Colour& colour) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    const std::size_t i = index(x, y);
    if (depth > depth_[i]) return;
    depth_[i] = depth;
    colour_[i] = colour;
  }
  /// Infinity where nothing was drawn.
  float depth(int x, int y) const { return depth_[index(x, y)]; }
  /// Darkens samples that lie more than `step_m` behind a neighbour.
  void draw_outlines(float step_m, float strength);
  /// A shaded ball at a screen point, `radius` and position in samples.
  void ball(const Eigen::Vector2d& centre, double radius, float depth, float depth_per_sample, const Colour& colour);
  Image resolve() const;

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  int width_;
  int height_;
  std::vector<Colour> colour_;
  std::vector<float> depth_;
};

/// Drawing on the finished picture, sRGB, pixels.
void fill_rect(Image& image, int x, int y, int width, int height, const Colour& colour, float opacity = 1.0f);
void fill_disc(Image& image, double x, double y, double radius, const Colour& colour);

/// Small built-in letters, 5 x 7 dots each. Unknown characters show as blanks.
int text_width(std::string_view text, int dot);
inline int text_height(int dot) { return 7 * dot; }
void draw_text(Image& image, int x, int y, std::string_view text, const Colour& colour, int dot);

}  // namespace stairwell::apps
