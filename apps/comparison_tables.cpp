/// A comparison as JSON, CSV and Markdown.
#include "apps/atomic_file.hpp"
#include "apps/comparison.hpp"
#include "apps/option_values.hpp"

#include <cmath>
#include <cstdio>

namespace stairwell::apps {

namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json to_json(const Estimate& e) {
  const Json interval = std::isfinite(e.low) ? Json{e.low, e.high} : Json(nullptr);
  return {{"mean", number(e.mean)}, {"sd", number(e.sd)}, {"ci95", interval}};
}

std::string cell(double value) { return std::isfinite(value) ? format_number(value) : ""; }

std::string rounded(double value) {
  if (!std::isfinite(value)) return "-";
  char text[32];
  const double size = std::abs(value);
  std::snprintf(text, sizeof text,
                size >= 100.0  ? "%.0f"
                : size >= 10.0 ? "%.1f"
                : size >= 1.0  ? "%.2f"
                               : "%.3f",
                value);
  return text;
}

std::string key_cells(const ComparisonRow& row, const char* between) {
  return row.world + between + row.mode + between + row.planner + between + row.coverage + between + row.variant +
         between + std::to_string(row.uavs);
}

std::string with_interval(const ComparisonRow& row, const std::string& metric) {
  const auto found = row.estimates.find(metric);
  if (found == row.estimates.end() || !std::isfinite(found->second.mean)) return "-";
  const Estimate& e = found->second;
  if (!(e.high > e.low)) return rounded(e.mean);
  return rounded(e.mean) + " [" + rounded(e.low) + ", " + rounded(e.high) + "]";
}

std::string markdown_line(const std::vector<std::string>& cells) {
  std::string line = "|";
  for (const std::string& one : cells) line += " " + one + " |";
  return line + "\n";
}

std::string markdown_head(const std::vector<std::string>& cells) {
  return markdown_line(cells) + markdown_line(std::vector<std::string>(cells.size(), "---"));
}

std::string markdown_rows(const Comparison& comparison) {
  std::string text =
      markdown_head({"world", "mode", "planner", "coverage", "UAVs", "seeds", "explored", "t50 s", "t90 s", "t99 s",
                     "finish s", "finish / bound", "path m", "energy (hover s)", "plan p50 ms", "collisions"});
  for (const ComparisonRow& row : comparison.rows) {
    std::vector<std::string> cells{
        row.world, row.mode, row.planner, row.strategy(), std::to_string(row.uavs), std::to_string(row.seeds.size())};
    for (const char* metric : {"coverage", "t50_s", "t90_s", "t99_s", "finish_s", "finish_over_bound", "path_length_m",
                               "energy_hover_s", "plan_ms.p50"})
      cells.push_back(with_interval(row, metric));
    double collisions = 0.0;
    for (const RunNumbers& run : row.runs) collisions += run.contains("collisions") ? run.at("collisions") : 0.0;
    cells.push_back(rounded(collisions).substr(0, rounded(collisions).find('.')));
    text += markdown_line(cells);
  }
  return text;
}

std::string markdown_differences(const Comparison& comparison) {
  if (comparison.differences.empty()) return "";
  std::string text =
      "\n## Differences\n\nSecond minus first, paired by seed, with the 95 % interval of the mean. \"not "
      "significant\": the interval holds 0.\n\n" +
      markdown_head({"world", "UAVs", "first", "second", "metric", "pairs", "difference", "verdict"});
  for (const ComparisonDifference& d : comparison.differences) {
    const ComparisonRow &first = comparison.rows[d.first], &second = comparison.rows[d.second];
    const Estimate& e = d.found.difference;
    text += markdown_line(
        {first.world, std::to_string(first.uavs), first.mode + " " + first.planner + " " + first.strategy(),
         second.mode + " " + second.planner + " " + second.strategy(), d.metric, std::to_string(d.pairs),
         rounded(e.mean) + " [" + rounded(e.low) + ", " + rounded(e.high) + "]", to_string(d.found.verdict)});
  }
  return text;
}

}  // namespace

std::string comparison_json(const Comparison& comparison) {
  Json rows = Json::array();
  for (const ComparisonRow& row : comparison.rows) {
    Json j{
        {"world", row.world}, {"mode", row.mode},   {"planner", row.planner},       {"coverage_strategy", row.coverage},
        {"uavs", row.uavs},   {"seeds", row.seeds}, {"distinct_runs", row.distinct}};
    if (!row.variant.empty()) j["variant"] = row.variant;
    for (const auto& [metric, e] : row.estimates) {
      const std::size_t dot = metric.find('.');
      if (dot == std::string::npos) {
        j[metric] = to_json(e);
      } else {
        j[metric.substr(0, dot)][metric.substr(dot + 1)] = to_json(e);
      }
    }
    rows.push_back(std::move(j));
  }
  return rows.dump(2) + "\n";
}

std::string comparison_csv(const Comparison& comparison) {
  const std::vector<std::string> names = metric_names(comparison);
  std::string text = "world,mode,planner,coverage_strategy,variant,uavs,runs";
  for (const std::string& name : names)
    for (const char* part : {"mean", "sd", "low", "high"}) text += "," + name + "_" + part;
  text += "\n";
  for (const ComparisonRow& row : comparison.rows) {
    text += key_cells(row, ",") + "," + std::to_string(row.seeds.size());
    for (const std::string& name : names) {
      const auto found = row.estimates.find(name);
      const double none = std::nan("");
      const Estimate e = found == row.estimates.end() ? Estimate{none, none, none, none} : found->second;
      text += "," + cell(e.mean) + "," + cell(e.sd) + "," + cell(e.low) + "," + cell(e.high);
    }
    text += "\n";
  }
  return text;
}

std::string runs_csv(const Comparison& comparison) {
  const std::vector<std::string> names = metric_names(comparison);
  std::string text = "world,mode,planner,coverage_strategy,variant,uavs,seed";
  for (const std::string& name : names) text += "," + name;
  text += "\n";
  for (const ComparisonRow& row : comparison.rows)
    for (std::size_t i = 0; i < row.runs.size(); ++i) {
      text += key_cells(row, ",") + "," + std::to_string(row.seeds[i]);
      for (const std::string& name : names)
        text += "," + (row.runs[i].contains(name) ? cell(row.runs[i].at(name)) : "");
      text += "\n";
    }
  return text;
}

std::string comparison_markdown(const Comparison& comparison) {
  std::string text =
      "# Comparison\n\nMeans over the seeds with 95 % bootstrap intervals; times are simulated seconds.\n\n";
  text += markdown_rows(comparison);
  for (const ComparisonRow& row : comparison.rows)
    if (row.distinct == 1 && row.seeds.size() > 1)
      text += "\n" + row.name() + ": the seed changes nothing here, all runs are the same.\n";
  text += markdown_differences(comparison);
  if (!comparison.missing.empty()) text += "\n## Missing\n\n";
  for (const std::string& name : comparison.missing) text += "- " + name + "\n";
  return text;
}

void write_comparison(const Comparison& comparison, const std::filesystem::path& folder) {
  write_file_atomically(folder / "comparison.json", comparison_json(comparison));
  write_file_atomically(folder / "comparison.csv", comparison_csv(comparison));
  write_file_atomically(folder / "runs.csv", runs_csv(comparison));
  write_file_atomically(folder / "comparison.md", comparison_markdown(comparison));
  write_file_atomically(folder / "comparison.html", comparison_page(comparison));
}

}  // namespace stairwell::apps
