#include "apps/curve_picture.hpp"

#include "apps/canvas.hpp"
#include "apps/png_writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace stairwell::apps {

namespace {

constexpr int kWidth = 900, kPanel = 170, kTop = 30, kBottom = 30, kLeft = 90, kRight = 20, kGap = 30;

struct Range {
  double least = 0.0, most = 1.0;
  double part(double value) const { return (value - least) / (most - least); }
};

Range range_of(const std::vector<double>& values) {
  Range range{INFINITY, -INFINITY};
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    range.least = std::min(range.least, value);
    range.most = std::max(range.most, value);
  }
  if (!(range.least <= range.most)) return {};
  if (range.least == range.most) return {range.least - 0.5, range.most + 0.5};
  return range;
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

void draw_line(Image& image, const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Colour& colour) {
  const int count = std::max(1, static_cast<int>(std::ceil((b - a).norm())));
  for (int i = 0; i <= count; ++i) {
    const Eigen::Vector2d p = a + (b - a) * (static_cast<double>(i) / count);
    fill_disc(image, p.x(), p.y(), 0.9, colour);
  }
}

void draw_panel(Image& image, int top, std::string_view name, const std::vector<double>& x,
                const std::vector<double>& y, std::size_t index) {
  const Colour grey = from_srgb(200, 205, 212), ink = from_srgb(40, 44, 52);
  const int wide = kWidth - kLeft - kRight, high = kPanel - kGap;
  for (const int line : {top, top + high / 2, top + high}) fill_rect(image, kLeft, line, wide, 1, grey);
  draw_text(image, kLeft, top - 12, name, ink, 1);
  const Range across = range_of(x), up = range_of(y);
  const std::string most = number_text(up.most), least = number_text(up.least);
  draw_text(image, kLeft - 8 - text_width(most, 1), top - 3, most, ink, 1);
  draw_text(image, kLeft - 8 - text_width(least, 1), top + high - 3, least, ink, 1);
  const auto place = [&](std::size_t i) {
    return Eigen::Vector2d(kLeft + across.part(x[i]) * wide, top + (1.0 - up.part(y[i])) * high);
  };
  for (std::size_t i = 0; i < y.size(); ++i) {
    if (!std::isfinite(y[i])) continue;
    const std::size_t before = i > 0 && std::isfinite(y[i - 1]) ? i - 1 : i;
    draw_line(image, place(before), place(i), track_colour(index));
  }
}

}  // namespace

void write_curve_picture(const CsvTable& curves, std::string_view title, const std::filesystem::path& file) {
  std::vector<std::string> shown;
  for (std::size_t i = 1; i < curves.names().size(); ++i) {
    if (const std::string& name = curves.names()[i]; name != "step" && name != "wall_s") shown.push_back(name);
  }
  const int height = kTop + kGap + static_cast<int>(shown.size()) * kPanel + kBottom;
  Image image{kWidth, height, {}};
  image.rgb.assign(3 * static_cast<std::size_t>(kWidth) * static_cast<std::size_t>(height), 255);
  const Colour ink = from_srgb(40, 44, 52);
  draw_text(image, kLeft, 12, title, ink, 1);
  const std::vector<double> steps = curves.numbers("step");
  for (std::size_t i = 0; i < shown.size(); ++i) {
    draw_panel(image, kTop + kGap + static_cast<int>(i) * kPanel, shown[i], steps, curves.numbers(shown[i]), i);
  }
  const Range across = range_of(steps);
  const std::string first = number_text(across.least), last = "step " + number_text(across.most);
  draw_text(image, kLeft, height - 24, first, ink, 1);
  draw_text(image, kWidth - kRight - text_width(last, 1), height - 24, last, ink, 1);
  write_png(image, file);
}

}  // namespace stairwell::apps
