#include "apps/comparison.hpp"

#include "apps/csv_table.hpp"
#include "apps/run_folder.hpp"
#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace stairwell::apps {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kGravity_mps2 = 9.81;
/// What differences are looked for in.
constexpr const char* kJudged[] = {"t50_s",         "t90_s",          "t99_s",      "finish_s",
                                   "path_length_m", "energy_hover_s", "plan_ms.p50"};
constexpr const char* kNoMetrics[] = {"uavs", "seed"};

Json read_json(const fs::path& file) {
  Json json = Json::parse(read_whole_file(file), nullptr, false);
  if (!json.is_object()) throw InputError(file.string() + ": is damaged; remove its folder to run it again");
  return json;
}

double number_of(const Json& value) { return value.is_number() ? value.get<double>() : kNan; }

RunNumbers numbers_of(const Json& metrics) {
  RunNumbers numbers;
  for (const auto& [key, value] : metrics.items()) {
    if (std::ranges::find(kNoMetrics, key) != std::end(kNoMetrics)) continue;
    if (value.is_number() || value.is_null()) numbers[key] = number_of(value);
    if (!value.is_object() || key == "fallback_reasons") continue;
    for (const auto& [part, inner] : value.items()) numbers[key + "." + part] = number_of(inner);
  }
  return numbers;
}

RunNumbers read_run(const SweepRun& run) {
  RunNumbers numbers = numbers_of(read_json(run.folder / "metrics.json"));
  numbers["energy_hover_s"] = energy_hover_s(run.folder / "trajectories.csv");
  std::error_code ignored;
  if (run.bound.empty() || !fs::exists(run.bound, ignored)) return numbers;
  const Json bound = read_json(run.bound);
  const double bound_s = bound.contains("finish_s") ? number_of(bound["finish_s"]) : kNan;
  const auto over_bound = [&](const char* key) {
    return numbers.contains(key) && bound_s > 0.0 ? numbers[key] / bound_s : kNan;
  };
  numbers["finish_over_bound"] = over_bound("finish_s");
  numbers["t99_over_bound"] = over_bound("t99_s");
  return numbers;
}

void summarise(ComparisonRow& row) {
  std::set<std::pair<double, double>> outcomes;
  for (const RunNumbers& run : row.runs) {
    const auto value = [&](const char* key) { return run.contains(key) ? run.at(key) : kNan; };
    outcomes.emplace(value("finish_s"), value("path_length_m"));
  }
  row.distinct = outcomes.size();
  for (const auto& [metric, unused] : row.runs.front()) {
    std::vector<double> values;
    for (const RunNumbers& run : row.runs) values.push_back(run.contains(metric) ? run.at(metric) : kNan);
    row.estimates[metric] = estimate(values, make_rng(1, "compare/" + row.name() + "/" + metric));
  }
}

/// Values of both rows for the seeds that both have.
std::pair<std::vector<double>, std::vector<double>> paired(const ComparisonRow& a, const ComparisonRow& b,
                                                           const std::string& metric) {
  std::pair<std::vector<double>, std::vector<double>> values;
  for (std::size_t i = 0; i < a.seeds.size(); ++i) {
    const auto same = std::ranges::find(b.seeds, a.seeds[i]) - b.seeds.begin();
    if (static_cast<std::size_t>(same) == b.seeds.size()) continue;
    const RunNumbers& other = b.runs[static_cast<std::size_t>(same)];
    values.first.push_back(a.runs[i].contains(metric) ? a.runs[i].at(metric) : kNan);
    values.second.push_back(other.contains(metric) ? other.at(metric) : kNan);
  }
  return values;
}

void find_differences(Comparison& comparison) {
  for (std::size_t a = 0; a < comparison.rows.size(); ++a)
    for (std::size_t b = a + 1; b < comparison.rows.size(); ++b) {
      const ComparisonRow &first = comparison.rows[a], &second = comparison.rows[b];
      if (first.world != second.world || first.uavs != second.uavs) continue;
      for (const char* metric : kJudged) {
        const auto [x, y] = paired(first, second, metric);
        ComparisonDifference difference{a, b, metric, x.size(), {}};
        difference.found = compare_pairs(x, y, make_rng(1, "compare/" + first.name() + "/" + second.name() + metric));
        // Runs that the seed does not change are one run, however often it is repeated.
        const bool repeated = first.distinct <= 1 && second.distinct <= 1;
        if (repeated && difference.found.verdict == Difference::kSignificant)
          difference.found.verdict = Difference::kTooFew;
        comparison.differences.push_back(difference);
      }
    }
}

}  // namespace

std::string ComparisonRow::name() const {
  return world + " " + mode + " " + planner + " " + strategy() + " " + std::to_string(uavs);
}

Comparison read_comparison(const std::vector<SweepRun>& runs) {
  Comparison comparison;
  for (const SweepRun& run : runs) {
    if (!is_complete(run.folder)) {
      comparison.missing.push_back(run.name);
      continue;
    }
    ComparisonRow key{fs::path(run.world).stem().string(),
                      run.mode,
                      run.planner,
                      run.coverage,
                      run.uavs,
                      run.variant,
                      {},
                      {},
                      {},
                      {},
                      0};
    auto row = std::ranges::find_if(comparison.rows, [&](const ComparisonRow& r) { return r.name() == key.name(); });
    if (row == comparison.rows.end()) row = comparison.rows.insert(row, std::move(key));
    row->seeds.push_back(run.seed);
    row->folders.push_back(run.folder);
    row->runs.push_back(read_run(run));
  }
  for (ComparisonRow& row : comparison.rows) summarise(row);
  find_differences(comparison);
  return comparison;
}

double energy_hover_s(const fs::path& trajectories) {
  const CsvTable table = CsvTable::read(trajectories);
  const auto time_s = table.numbers("time_s"), uav = table.numbers("uav");
  const auto x = table.numbers("x_m"), y = table.numbers("y_m"), z = table.numbers("z_m");
  std::map<int, std::vector<std::size_t>> rows;
  for (std::size_t i = 0; i < table.rows(); ++i) rows[static_cast<int>(uav[i])].push_back(i);
  double energy_s = 0.0;
  for (const auto& [id, of] : rows) {
    const auto at = [&](std::size_t k) { return Eigen::Vector3d(x[of[k]], y[of[k]], z[of[k]]); };
    std::size_t first = 0, last = of.size() - 1;
    while (first < last && (at(first + 1) - at(first)).norm() < 1e-4) ++first;
    while (last > first && (at(last) - at(last - 1)).norm() < 1e-4) --last;
    for (std::size_t k = first; k < last; ++k) {
      const double step_s = time_s[of[k + 1]] - time_s[of[k]];
      Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
      if (k > 0 && step_s > 0.0) {
        const double before_s = time_s[of[k]] - time_s[of[k - 1]];
        if (before_s > 0.0)
          acceleration = ((at(k + 1) - at(k)) / step_s - (at(k) - at(k - 1)) / before_s) / (0.5 * (step_s + before_s));
      }
      const double thrust = (acceleration + kGravity_mps2 * Eigen::Vector3d::UnitZ()).norm() / kGravity_mps2;
      energy_s += step_s * std::pow(thrust, 1.5);
    }
  }
  return energy_s;
}

std::vector<std::string> metric_names(const Comparison& comparison) {
  std::vector<std::string> names{
      "coverage",          "t50_s",          "t70_s",         "t80_s",         "t90_s", "t95_s", "t99_s", "finish_s",
      "finish_over_bound", "t99_over_bound", "path_length_m", "energy_hover_s"};
  std::set<std::string> there;
  for (const ComparisonRow& row : comparison.rows)
    for (const auto& [metric, unused] : row.estimates) there.insert(metric);
  std::erase_if(names, [&](const std::string& name) { return there.erase(name) == 0; });
  names.insert(names.end(), there.begin(), there.end());
  return names;
}

}  // namespace stairwell::apps
