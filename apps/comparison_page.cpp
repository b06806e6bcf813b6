/// A comparison as one self-contained page.
#include "apps/comparison.hpp"
#include "apps/csv_table.hpp"
#include "apps/page.hpp"
#include "apps/svg_plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace stairwell::apps {

namespace {

constexpr std::size_t kCurvePoints = 240;
constexpr int kPercent[] = {50, 70, 80, 90, 95, 99};

/// Rows that one plot shows together.
struct Group {
  std::string title;
  std::vector<const ComparisonRow*> rows;
};

std::vector<Group> groups_of(const Comparison& comparison) {
  std::vector<Group> groups;
  for (const ComparisonRow& row : comparison.rows) {
    const std::string title = row.world + ", " + std::to_string(row.uavs) + (row.uavs == 1 ? " UAV" : " UAVs");
    auto group = std::ranges::find_if(groups, [&](const Group& g) { return g.title == title; });
    if (group == groups.end()) group = groups.insert(group, {title, {}});
    group->rows.push_back(&row);
  }
  return groups;
}

std::string short_name(const ComparisonRow& row) { return row.mode + ", " + row.planner + ", " + row.strategy(); }

struct Curve {
  std::vector<double> time_s, coverage;
  double at(double when_s) const {
    const auto after = std::ranges::upper_bound(time_s, when_s) - time_s.begin();
    return after == 0 ? 0.0 : coverage[static_cast<std::size_t>(after) - 1];
  }
};

/// Mean of a row's runs, with the least and greatest of them as its band.
Series coverage_series(const ComparisonRow& row, int colour) {
  std::vector<Curve> curves;
  double end_s = 0.0;
  for (const auto& folder : row.folders) {
    const CsvTable steps = CsvTable::read(folder / "steps.csv");
    curves.push_back({steps.numbers("time_s"), steps.numbers("coverage")});
    if (!curves.back().time_s.empty()) end_s = std::max(end_s, curves.back().time_s.back());
  }
  Series series{short_name(row), {}, {}, colour};
  for (std::size_t i = 0; i <= kCurvePoints; ++i) {
    const double time_s = end_s * static_cast<double>(i) / kCurvePoints;
    double sum = 0.0, least = 1.0, most = 0.0;
    for (const Curve& curve : curves) {
      const double value = curve.at(time_s);
      sum += value;
      least = std::min(least, value);
      most = std::max(most, value);
    }
    series.x.push_back(time_s);
    series.y.push_back(100.0 * sum / static_cast<double>(curves.size()));
    series.low.push_back(100.0 * least);
    series.high.push_back(100.0 * most);
  }
  return series;
}

const Estimate* found(const ComparisonRow& row, const std::string& metric) {
  const auto entry = row.estimates.find(metric);
  return entry == row.estimates.end() ? nullptr : &entry->second;
}

Series time_series(const ComparisonRow& row, int colour) {
  Series series{short_name(row), {}, {}, colour};
  for (const int percent : kPercent) {
    const Estimate* e = found(row, "t" + std::to_string(percent) + "_s");
    if (e == nullptr || !std::isfinite(e->mean)) continue;
    series.x.push_back(percent);
    series.y.push_back(e->mean);
    series.low.push_back(e->low);
    series.high.push_back(e->high);
  }
  return series;
}

std::string intervals(const Group& group, const char* metric, const std::string& title, const char* unit) {
  std::vector<Interval> bars;
  for (const ComparisonRow* row : group.rows)
    if (const Estimate* e = found(*row, metric)) bars.push_back({short_name(*row), e->mean, e->low, e->high});
  return bars.empty() ? "" : interval_plot(title, unit, bars);
}

std::string plots(const Group& group) {
  std::vector<Series> coverage, times;
  int colour = 0;
  for (const ComparisonRow* row : group.rows) {
    coverage.push_back(coverage_series(*row, colour));
    times.push_back(time_series(*row, colour++));
  }
  std::string html = "<h2>" + escape_html(group.title) + "</h2><div class=\"plots\">";
  html += line_plot({"Coverage: mean, least and most over the seeds", "time (s)", "coverage (%)"}, coverage);
  html += line_plot({"Time to a share of what is explorable, with 95 % intervals", "coverage (%)", "time (s)"}, times);
  html += intervals(group, "finish_s", "Exploration finished", "s, simulated");
  html += intervals(group, "finish_over_bound", "Finished, over the reference that knows the world", "ratio");
  html += intervals(group, "path_length_m", "Path, all UAVs", "m");
  html += intervals(group, "energy_hover_s", "Energy, all UAVs", "s of hovering");
  html += intervals(group, "plan_ms.p50", "Planning, median of the decisions", "ms");
  html += intervals(group, "plan_ms.p99", "Planning, 99th percentile of the decisions", "ms");
  return html + "</div>\n";
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return std::isfinite(value) ? text : "-";
}

std::string differences_table(const Comparison& comparison) {
  if (comparison.differences.empty()) return "";
  std::string html =
      "<h2>Differences</h2><p>Second minus first, paired by seed, with the 95 % interval of the mean.</p><div "
      "class=\"scroll\"><table><tr><th>world, UAVs</th><th>first</th><th>second</th><th>metric</th><th>pairs</th>"
      "<th>difference</th><th>interval</th><th>verdict</th></tr>";
  for (const ComparisonDifference& d : comparison.differences) {
    const ComparisonRow &first = comparison.rows[d.first], &second = comparison.rows[d.second];
    const Estimate& e = d.found.difference;
    html += "<tr>";
    for (const std::string& text : {first.world + ", " + std::to_string(first.uavs), short_name(first),
                                    short_name(second), d.metric, std::to_string(d.pairs), number(e.mean),
                                    number(e.low) + " to " + number(e.high), std::string(to_string(d.found.verdict))})
      html += "<td>" + escape_html(text) + "</td>";
    html += "</tr>";
  }
  return html + "</table></div>\n";
}

}  // namespace

std::string comparison_page(const Comparison& comparison) {
  std::string html = open_page("Comparison");
  for (const Group& group : groups_of(comparison)) html += plots(group);
  html += differences_table(comparison);
  if (!comparison.missing.empty()) html += "<h2>Missing</h2><ul>";
  for (const std::string& name : comparison.missing) html += "<li>" + escape_html(name) + "</li>";
  if (!comparison.missing.empty()) html += "</ul>";
  return html + "</body></html>\n";
}

}  // namespace stairwell::apps
