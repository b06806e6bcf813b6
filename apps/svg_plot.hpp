#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace stairwell::apps {

/// `& < > " '` as entities.
std::string escape_html(std::string_view text);

struct Series {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;              ///< NaN breaks the line
  int colour = 0;                     ///< index of a CSS class `s<colour>`
  std::vector<double> low{}, high{};  ///< a band around the line, as long as `x`; empty: none
};

struct PlotOptions {
  std::string title;
  std::string x_label;       ///< with unit
  std::string y_label;       ///< with unit
  bool equal_scale = false;  ///< one metre is as long along x as along y
  bool y_from_zero = true;
  bool over_time = true;  ///< x is the run's time: a replay on the same page shows its moment here
};

/// One inline SVG line plot with axes, round ticks and a legend; lines differ in dashes as well as colour. Long series
/// are thinned to what a screen shows, keeping each stretch's least and greatest value.
std::string line_plot(const PlotOptions& options, const std::vector<Series>& series);

struct Bar {
  std::string name;
  double value = 0.0;
};
/// Horizontal bars on a logarithmic axis (values that are not positive are left out).
std::string bar_plot(const std::string& title, const std::string& unit, const std::vector<Bar>& bars);

struct Interval {
  std::string name;
  double value, low, high;
};
/// A dot with its interval per line, on an axis from 0 (values that are not finite are left out).
std::string interval_plot(const std::string& title, const std::string& unit, const std::vector<Interval>& intervals);

}  // namespace stairwell::apps
