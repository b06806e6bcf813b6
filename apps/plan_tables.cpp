#include "apps/plan_run.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>

namespace stairwell::apps {

using nlohmann::ordered_json;

namespace {

constexpr double kSameCost_m = 1e-4;
constexpr double kDetour = 1.05;  // tasks on which any-angle planners are compared
constexpr std::size_t kMostTableRows = 60;

ordered_json number(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

double mean(const std::vector<double>& values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Nearest rank. @pre sorted
double percentile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

void add_times(ordered_json& values, const std::string& prefix, std::vector<double> times_ms) {
  std::ranges::sort(times_ms);
  values[prefix + "median_ms"] = number(percentile(times_ms, 0.5));
  values[prefix + "p95_ms"] = number(percentile(times_ms, 0.95));
  values[prefix + "max_ms"] = number(percentile(times_ms, 1.0));
}

void add_statuses(ordered_json& values, const PlannerRows& rows) {
  ordered_json statuses = ordered_json::object();
  std::map<std::string, std::size_t> reasons;
  std::size_t fell_back = 0;
  for (const PlanRow& row : rows.rows) {
    ordered_json& count = statuses[planning3d::to_string(row.status)];
    count = count.is_null() ? 1 : count.get<std::size_t>() + 1;
    fell_back += row.fell_back ? 1 : 0;
    if (!row.reason.empty()) ++reasons[row.reason];
  }
  values["statuses"] = statuses;
  values["fell_back"] = fell_back;
  values["fallback_reasons"] = reasons;
}

/// On tasks that both answered themselves.
void add_length_over(ordered_json& values, const PlannerRows& rows, const PlannerRows& first) {
  std::vector<double> over;
  for (std::size_t i = 0; i < std::min(rows.rows.size(), first.rows.size()); ++i) {
    const PlanRow& row = rows.rows[i];
    const PlanRow& other = first.rows[i];
    if (!row.reached() || !other.reached() || row.fell_back || other.fell_back) continue;
    if (other.measures.length_m > 0.0) over.push_back(row.measures.length_m / other.measures.length_m);
  }
  std::ranges::sort(over);
  values["length_over"] = first.planner;
  values["median_length_over"] = number(percentile(over, 0.5));
  values["p95_length_over"] = number(percentile(over, 0.95));
  values["max_length_over"] = number(percentile(over, 1.0));
}

std::string shown(const char* format, double value) {
  if (!std::isfinite(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

std::string line_of(const std::vector<std::string>& cells, const std::vector<int>& widths) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    char text[96];
    std::snprintf(text, sizeof(text), i < 2 ? "%-*.64s  " : "%*.64s  ", widths[i], cells[i].c_str());
    line += text;
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line + "\n";
}

double number_at(const ordered_json& values, const char* key) {
  return values.at(key).is_null() ? std::numeric_limits<double>::quiet_NaN() : values.at(key).get<double>();
}

}  // namespace

ordered_json summary_of(const PlanTasks& tasks, const PlannerRows& rows, const PlannerRows& first) {
  std::vector<double> ms, cpu_ms, over, over_on_detours, clearance_m, turn_deg;
  std::size_t reached = 0, matches = 0, known = 0, nodes = 0;
  for (const PlanRow& row : rows.rows) {
    const PlanTask& task = tasks.tasks[row.task];
    ms.push_back(row.ms);
    cpu_ms.push_back(row.cpu_ms);
    nodes += row.nodes;
    known += std::isfinite(task.optimum_m) ? 1 : 0;
    if (!row.reached()) continue;
    ++reached;
    clearance_m.push_back(row.measures.clearance_m);
    turn_deg.push_back(row.measures.turn_deg);
    matches += std::abs(row.measures.length_m - task.optimum_m) <= kSameCost_m ? 1 : 0;
    if (!(task.optimum_m > 0.0)) continue;
    over.push_back(row.measures.length_m / task.optimum_m);
    if (task.detour >= kDetour) over_on_detours.push_back(over.back());
  }
  ordered_json values = {{"planner", rows.planner}, {"tasks", rows.rows.size()}, {"reached", reached}};
  add_statuses(values, rows);
  if (&rows != &first) add_length_over(values, rows, first);
  values["optimal_cost_matches"] = known > 0 ? ordered_json(matches) : ordered_json(nullptr);
  values["mean_length_over_optimum"] = number(mean(over));
  values["detour_tasks"] = over_on_detours.size();
  values["mean_length_over_optimum_detours"] = number(mean(over_on_detours));
  add_times(values, "", ms);
  add_times(values, "cpu_", cpu_ms);
  values["setup_ms"] = rows.setup_ms;
  values["mean_nodes"] = rows.rows.empty() ? 0.0 : static_cast<double>(nodes) / static_cast<double>(rows.rows.size());
  values["mean_clearance_m"] = number(mean(clearance_m));
  values["min_clearance_m"] = clearance_m.empty() ? ordered_json(nullptr) : number(std::ranges::min(clearance_m));
  values["mean_turn_deg"] = number(mean(turn_deg));
  return values;
}

ordered_json row_of(const PlanTasks& tasks, const PlanRow& row, bool with_path) {
  const PlanTask& task = tasks.tasks[row.task];
  ordered_json values = {{"task", task.name},
                         {"status", planning3d::to_string(row.status)},
                         {"reached", row.reached()},
                         {"length_m", number(row.measures.length_m)},
                         {"straight_m", (task.to_m - task.from_m).norm()},
                         {"length_over_optimum", number(row.measures.length_m / task.optimum_m)},
                         {"clearance_m", number(row.measures.clearance_m)},
                         {"turn_deg", number(row.measures.turn_deg)},
                         {"ms", row.ms},
                         {"cpu_ms", row.cpu_ms},
                         {"nodes", row.nodes},
                         {"fell_back", row.fell_back}};
  if (!row.reason.empty()) values["reason"] = row.reason;
  if (!with_path) return values;
  values["path_m"] = ordered_json::array();
  for (const Eigen::Vector3d& at_m : row.path_m) values["path_m"].push_back({at_m.x(), at_m.y(), at_m.z()});
  return values;
}

std::string plan_table(const PlanTasks& tasks, const std::vector<PlannerRows>& planners) {
  std::size_t count = 0, longest = 4;
  for (const PlannerRows& rows : planners) count += rows.rows.size();
  for (const PlanTask& task : tasks.tasks) longest = std::max(longest, task.name.size());
  const std::vector<int> widths{static_cast<int>(std::min<std::size_t>(longest, 40)), 16, 13, 9, 7, 7, 7, 9, 9};
  std::string text;
  if (count <= kMostTableRows) {
    text += line_of({"task", "planner", "status", "length m", "/opt.", "eps m", "turn", "ms", "nodes"}, widths);
    for (std::size_t t = 0; t < tasks.tasks.size(); ++t) {
      for (const PlannerRows& rows : planners) {
        for (const PlanRow& row : rows.rows) {
          if (row.task != t) continue;
          text += line_of(
              {tasks.tasks[t].name, rows.planner, planning3d::to_string(row.status),
               shown("%.2f", row.measures.length_m), shown("%.3f", row.measures.length_m / tasks.tasks[t].optimum_m),
               shown("%.2f", row.measures.clearance_m), shown("%.2f", row.measures.turn_deg), shown("%.3f", row.ms),
               std::to_string(row.nodes)},
              widths);
        }
      }
    }
  }
  if (count <= planners.size()) return text;
  for (const PlannerRows& rows : planners) {
    const ordered_json sum = summary_of(tasks, rows, planners.front());
    text += rows.planner + ": " + sum.at("reached").dump() + " of " + sum.at("tasks").dump() + " reached";
    for (const auto& [status, n] : sum.at("statuses").items()) {
      if (status != "reached") text += ", " + n.dump() + " " + status;
    }
    for (const auto& [reason, n] : sum.at("fallback_reasons").items()) text += ", " + n.dump() + " x " + reason;
    if (sum.contains("length_over")) {
      text += ", length over " + sum.at("length_over").get<std::string>() + "'s: median " +
              shown("%.3f", number_at(sum, "median_length_over")) + ", p95 " +
              shown("%.3f", number_at(sum, "p95_length_over"));
    }
    if (!sum.at("optimal_cost_matches").is_null()) {
      text += ", " + sum.at("optimal_cost_matches").dump() + " at the optimum, length over optimum " +
              shown("%.4f", number_at(sum, "mean_length_over_optimum"));
      if (sum.at("detour_tasks") > 0) {
        text += " (" + shown("%.4f", number_at(sum, "mean_length_over_optimum_detours")) + " on " +
                sum.at("detour_tasks").dump() + " tasks with a detour of 1.05 or more)";
      }
    }
    text += "\n  ms: cpu median " + shown("%.3f", number_at(sum, "cpu_median_ms")) + ", max " +
            shown("%.3f", number_at(sum, "cpu_max_ms")) + ", wall median " +
            shown("%.3f", number_at(sum, "median_ms")) + ", p95 " + shown("%.3f", number_at(sum, "p95_ms")) + ", max " +
            shown("%.3f", number_at(sum, "max_ms")) + ", set-up " + shown("%.0f", number_at(sum, "setup_ms")) +
            "; clearance m: mean " + shown("%.3f", number_at(sum, "mean_clearance_m")) + ", least " +
            shown("%.3f", number_at(sum, "min_clearance_m")) + "; turn deg: mean " +
            shown("%.2f", number_at(sum, "mean_turn_deg")) + "\n";
  }
  return text;
}

}  // namespace stairwell::apps
