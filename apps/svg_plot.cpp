#include "apps/svg_plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace stairwell::apps {
namespace {

constexpr double kWidth = 640.0, kHeight = 340.0;
constexpr double kLeft = 62.0, kRight = 14.0, kTop = 16.0, kBottom = 46.0;
constexpr std::size_t kMostPoints = 1200;
constexpr int kColours = 8;

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

struct Range {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();
  void extend(double value) {
    if (!std::isfinite(value)) return;
    lo = std::min(lo, value);
    hi = std::max(hi, value);
  }
  void make_usable() {
    if (!(lo <= hi)) lo = 0.0, hi = 1.0;
    if (hi - lo < 1e-9) lo -= 0.5, hi += 0.5;
  }
  double size() const { return hi - lo; }
};

double tick_step(double size) {
  const double power = std::pow(10.0, std::floor(std::log10(size / 4.0)));
  for (const double step : {1.0, 2.0, 5.0})
    if (size / (step * power) <= 6.0) return step * power;
  return 10.0 * power;
}

struct Axes {
  Range x, y;
  double px(double value) const { return kLeft + (value - x.lo) / x.size() * (kWidth - kLeft - kRight); }
  double py(double value) const { return kHeight - kBottom - (value - y.lo) / y.size() * (kHeight - kTop - kBottom); }
};

Axes fit_axes(const PlotOptions& options, const std::vector<Series>& series) {
  Axes axes;
  for (const Series& one : series) {
    for (const double value : one.x) axes.x.extend(value);
    for (const auto* values : {&one.y, &one.low, &one.high})
      for (const double value : *values) axes.y.extend(value);
  }
  if (options.y_from_zero) axes.y.extend(0.0);
  axes.x.make_usable();
  axes.y.make_usable();
  if (options.y_from_zero) axes.y.hi += 0.04 * axes.y.size();
  if (!options.equal_scale) return axes;
  const double unit = std::max(axes.x.size() / (kWidth - kLeft - kRight), axes.y.size() / (kHeight - kTop - kBottom));
  const double grow_x = 0.5 * (1.04 * unit * (kWidth - kLeft - kRight) - axes.x.size());
  const double grow_y = 0.5 * (1.04 * unit * (kHeight - kTop - kBottom) - axes.y.size());
  axes.x = {axes.x.lo - grow_x, axes.x.hi + grow_x};
  axes.y = {axes.y.lo - grow_y, axes.y.hi + grow_y};
  return axes;
}

std::string draw_axes(const PlotOptions& options, const Axes& axes) {
  std::string svg;
  const double step_x = tick_step(axes.x.size()), step_y = tick_step(axes.y.size());
  for (double v = std::ceil(axes.x.lo / step_x) * step_x; v <= axes.x.hi + 1e-9 * step_x; v += step_x) {
    svg += format("<line class=\"grid\" x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\"/>", axes.px(v), axes.px(v),
                  kTop, kHeight - kBottom);
    svg += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>", axes.px(v), kHeight - kBottom + 16,
                  std::abs(v) < 1e-9 * step_x ? 0.0 : v);
  }
  for (double v = std::ceil(axes.y.lo / step_y) * step_y; v <= axes.y.hi + 1e-9 * step_y; v += step_y) {
    svg += format("<line class=\"grid\" x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\"/>", kLeft, kWidth - kRight,
                  axes.py(v), axes.py(v));
    svg += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%g</text>", kLeft - 6, axes.py(v) + 4,
                  std::abs(v) < 1e-9 * step_y ? 0.0 : v);
  }
  svg += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">", 0.5 * (kLeft + kWidth - kRight), kHeight - 8) +
         escape_html(options.x_label) + "</text>";
  const double middle = 0.5 * (kTop + kHeight - kBottom);
  svg += format("<text x=\"14\" y=\"%.1f\" text-anchor=\"middle\" transform=\"rotate(-90 14 %.1f)\">", middle, middle) +
         escape_html(options.y_label) + "</text>";
  return svg;
}

/// Indices worth drawing: all of them, or the least and greatest of each stretch.
std::vector<std::size_t> thinned(const std::vector<double>& y, bool keep_shape) {
  std::vector<std::size_t> kept;
  if (y.size() <= kMostPoints) {
    for (std::size_t i = 0; i < y.size(); ++i) kept.push_back(i);
    return kept;
  }
  const std::size_t stretch = (2 * y.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t begin = 0; begin < y.size(); begin += stretch) {
    const auto first = y.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = y.begin() + static_cast<std::ptrdiff_t>(std::min(y.size(), begin + stretch));
    std::size_t a = begin, b = static_cast<std::size_t>(last - y.begin()) - 1;
    if (!keep_shape) {
      const auto [least, greatest] = std::minmax_element(first, last);
      a = static_cast<std::size_t>(std::min(least, greatest) - y.begin());
      b = static_cast<std::size_t>(std::max(least, greatest) - y.begin());
    }
    kept.push_back(a);
    if (b != a) kept.push_back(b);
  }
  return kept;
}

std::string draw_series(const PlotOptions& options, const Axes& axes, const Series& one) {
  std::string path;
  bool pen_down = false;
  for (const std::size_t i : thinned(one.y, options.equal_scale)) {
    if (i >= one.x.size() || !std::isfinite(one.x[i]) || !std::isfinite(one.y[i])) {
      pen_down = false;
      continue;
    }
    path += format("%c%.1f %.1f", pen_down ? 'L' : 'M', axes.px(one.x[i]), axes.py(one.y[i]));
    pen_down = true;
  }
  return path.empty() ? "" : format("<path class=\"line s%d\" d=\"", one.colour % kColours) + path + "\"/>";
}

std::string draw_band(const Axes& axes, const Series& one) {
  if (one.low.size() != one.x.size() || one.high.size() != one.x.size()) return "";
  std::string path;
  const auto add = [&](double x, double y) {
    if (std::isfinite(x) && std::isfinite(y))
      path += format("%c%.1f %.1f", path.empty() ? 'M' : 'L', axes.px(x), axes.py(y));
  };
  for (std::size_t i = 0; i < one.x.size(); ++i) add(one.x[i], one.high[i]);
  for (std::size_t i = one.x.size(); i-- > 0;) add(one.x[i], one.low[i]);
  return path.empty() ? "" : format("<path class=\"band s%d\" d=\"", one.colour % kColours) + path + "Z\"/>";
}

std::string open_figure(const std::string& title, double height, const std::string& attributes = "") {
  return "<figure><figcaption>" + escape_html(title) + "</figcaption>" +
         format("<svg viewBox=\"0 0 %g %g\" role=\"img\" ", kWidth, height) + attributes + "aria-label=\"" +
         escape_html(title) + "\">";
}

/// Where the time axis lies, for the replay's cursor: times and pixels of its two ends.
std::string time_axis(const Axes& axes) {
  return format(
      "class=\"time\" data-t0=\"%g\" data-t1=\"%g\" data-x0=\"%g\" data-x1=\"%g\" data-y0=\"%g\" data-y1=\"%g\" ",
      axes.x.lo, axes.x.hi, kLeft, kWidth - kRight, kTop, kHeight - kBottom);
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      case '\'':
        safe += "&#39;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string line_plot(const PlotOptions& options, const std::vector<Series>& series) {
  const Axes axes = fit_axes(options, series);
  std::string html =
      open_figure(options.title, kHeight, options.over_time ? time_axis(axes) : "") + draw_axes(options, axes);
  for (const Series& one : series) html += draw_band(axes, one);
  for (const Series& one : series) html += draw_series(options, axes, one);
  html += "</svg>";
  if (series.size() > 1) {
    html += "<p class=\"legend\">";
    for (const Series& one : series)
      html +=
          format("<span><svg viewBox=\"0 0 28 8\" aria-hidden=\"true\"><path class=\"line s%d\" d=\"M0 4H28\"/></svg>",
                 one.colour % kColours) +
          escape_html(one.name) + "</span> ";
    html += "</p>";
  }
  return html + "</figure>\n";
}

std::string bar_plot(const std::string& title, const std::string& unit, const std::vector<Bar>& bars) {
  Range range;
  for (const Bar& bar : bars)
    if (bar.value > 0.0) range.extend(std::log10(bar.value));
  range.make_usable();
  const double lo = std::floor(range.lo - 0.3), hi = std::ceil(range.hi);
  const double left = 150.0, right = 80.0, row = 30.0;
  const double height = row * static_cast<double>(bars.size()) + 44.0;
  const auto px = [&](double decade) { return left + (decade - lo) / (hi - lo) * (kWidth - left - right); };
  std::string html = open_figure(title, height);
  for (double decade = lo; decade <= hi; decade += 1.0) {
    html += format("<line class=\"grid\" x1=\"%.1f\" x2=\"%.1f\" y1=\"4\" y2=\"%.1f\"/>", px(decade), px(decade),
                   height - 40.0);
    html += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>", px(decade), height - 24.0,
                   std::pow(10.0, decade));
  }
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const double y = row * static_cast<double>(i) + 8.0;
    html += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">", left - 8.0, y + 14.0) +
            escape_html(bars[i].name) + "</text>";
    if (!(bars[i].value > 0.0)) continue;
    const double end = px(std::log10(bars[i].value));
    html += format("<rect class=\"bar\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"18\"/>", left, y, end - left);
    html += format("<text x=\"%.1f\" y=\"%.1f\">%.3g</text>", end + 6.0, y + 14.0, bars[i].value);
  }
  html += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">", 0.5 * (left + kWidth - right), height - 6.0) +
          escape_html(unit) + "</text>";
  return html + "</svg></figure>\n";
}

std::string interval_plot(const std::string& title, const std::string& unit, const std::vector<Interval>& intervals) {
  Range range;
  range.extend(0.0);
  for (const Interval& one : intervals)
    for (const double value : {one.value, one.low, one.high}) range.extend(value);
  range.make_usable();
  const double left = 230.0, right = 60.0, row = 24.0;
  const double height = row * static_cast<double>(intervals.size()) + 48.0;
  const auto px = [&](double value) { return left + (value - range.lo) / range.size() * (kWidth - left - right); };
  std::string html = open_figure(title, height);
  const double step = tick_step(range.size());
  for (double v = std::ceil(range.lo / step) * step; v <= range.hi + 1e-9 * step; v += step) {
    html += format("<line class=\"grid\" x1=\"%.1f\" x2=\"%.1f\" y1=\"4\" y2=\"%.1f\"/>", px(v), px(v), height - 42.0);
    html += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>", px(v), height - 26.0,
                   std::abs(v) < 1e-9 * step ? 0.0 : v);
  }
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    const Interval& one = intervals[i];
    const double y = row * static_cast<double>(i) + 16.0;
    html += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">", left - 10.0, y + 4.0) + escape_html(one.name) +
            "</text>";
    if (!std::isfinite(one.value)) continue;
    if (std::isfinite(one.low) && std::isfinite(one.high))
      html += format("<line class=\"whisker\" x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\"/>", px(one.low),
                     px(one.high), y, y);
    html += format("<circle class=\"dot\" cx=\"%.1f\" cy=\"%.1f\" r=\"4\"/>", px(one.value), y);
    html +=
        format("<text x=\"%.1f\" y=\"%.1f\">%.3g</text>", px(std::fmax(one.value, one.high)) + 8.0, y + 4.0, one.value);
  }
  html += format("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">", 0.5 * (left + kWidth - right), height - 8.0) +
          escape_html(unit) + "</text>";
  return html + "</svg></figure>\n";
}

}  // namespace stairwell::apps
