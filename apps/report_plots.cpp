#include "apps/report_plots.hpp"

#include "apps/byte_codec.hpp"
#include "apps/replay_file.hpp"
#include "apps/svg_plot.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

namespace stairwell::apps {
namespace {

using Json = ReportJson;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double number_in(const Json& metrics, const char* key) {
  const auto found = metrics.find(key);
  return found != metrics.end() && found->is_number() ? found->get<double>() : kNaN;
}

std::string text_of(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_null()) return "-";
  if (!value.is_number_float()) return value.dump();
  char text[64];
  std::snprintf(text, sizeof text, "%.6g", value.get<double>());
  return text;
}

/// Metrics flat: `plan_ms p50`, lists joined.
std::vector<std::pair<std::string, std::string>> flat(const Json& metrics) {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const auto& [key, value] : metrics.items()) {
    if (value.is_object()) {
      for (const auto& [inner, part] : value.items()) rows.emplace_back(key + " " + inner, text_of(part));
    } else if (value.is_array()) {
      std::string joined;
      for (const auto& part : value) joined += (joined.empty() ? "" : ", ") + text_of(part);
      rows.emplace_back(key, joined);
    } else {
      rows.emplace_back(key, text_of(value));
    }
  }
  return rows;
}

std::string uav_name(std::size_t uav) { return "UAV " + std::to_string(uav); }

Series uav_series(std::size_t uav) { return {uav_name(uav), {}, {}, static_cast<int>(uav)}; }

struct Positions {
  std::vector<double> x, y, z;
};

std::vector<Positions> uav_positions(const CsvTable& steps) {
  std::vector<Positions> uavs;
  for (std::size_t i = 0; steps.has("uav" + std::to_string(i) + "_x_m"); ++i) {
    const std::string prefix = "uav" + std::to_string(i);
    uavs.push_back({steps.numbers(prefix + "_x_m"), steps.numbers(prefix + "_y_m"), steps.numbers(prefix + "_z_m")});
  }
  return uavs;
}

/// Distance from each UAV to the nearest other one; with two UAVs there is only one line.
std::string distance_plot(const CsvTable& steps) {
  const std::vector<double> time_s = steps.numbers("time_s");
  const std::vector<Positions> uavs = uav_positions(steps);
  if (uavs.size() < 2) return "";
  std::vector<Series> series;
  for (std::size_t a = 0; a < uavs.size(); ++a) {
    Series one{uav_name(a), time_s, std::vector<double>(time_s.size(), kNaN), static_cast<int>(a)};
    for (std::size_t k = 0; k < time_s.size(); ++k)
      for (std::size_t b = 0; b < uavs.size(); ++b) {
        if (a == b) continue;
        const double d =
            std::hypot(uavs[a].x[k] - uavs[b].x[k], uavs[a].y[k] - uavs[b].y[k], uavs[a].z[k] - uavs[b].z[k]);
        one.y[k] = std::fmin(one.y[k], d);
      }
    series.push_back(std::move(one));
    if (uavs.size() == 2) break;
  }
  return line_plot({"Distance to the nearest fellow UAV", "time (s)", "distance (m)"}, series);
}

struct Track {
  Series plan, height, speed;
};

std::map<int, Track> read_tracks(const CsvTable& table) {
  const auto time_s = table.numbers("time_s"), uav = table.numbers("uav"), x = table.numbers("x_m"),
             y = table.numbers("y_m"), z = table.numbers("z_m"), speed = table.numbers("speed_mps");
  std::map<int, Track> tracks;
  for (std::size_t k = 0; k < time_s.size(); ++k) {
    if (!(uav[k] >= 0.0 && uav[k] < 10000.0)) continue;
    const int id = static_cast<int>(uav[k]);
    Track& track = tracks[id];
    for (Series* one : {&track.plan, &track.height, &track.speed}) {
      one->name = uav_name(static_cast<std::size_t>(id));
      one->colour = id;
      one->x.push_back(one == &track.plan ? x[k] : time_s[k]);
    }
    track.plan.y.push_back(y[k]);
    track.height.y.push_back(z[k]);
    track.speed.y.push_back(speed[k]);
  }
  return tracks;
}

/// The mean of each stretch of two seconds: what changes faster hides the other lines.
Series averaged(const Series& one) {
  constexpr double kStretch_s = 2.0;
  Series mean{one.name, {}, {}, one.colour};
  for (std::size_t k = 0; k < one.x.size();) {
    const double until_s = one.x[k] + kStretch_s;
    double sum = 0.0;
    const std::size_t first = k;
    while (k < one.x.size() && one.x[k] < until_s) sum += one.y[k++];
    if (k == first) break;
    mean.x.push_back(0.5 * (one.x[first] + one.x[k - 1]));
    mean.y.push_back(sum / static_cast<double>(k - first));
  }
  return mean;
}

/// Who made how much of the map known, from the replay.
std::vector<Series> known_by_uav(const RunData& run) {
  std::vector<Series> series;
  double voxel_m3 = 0.0;
  for_each_record(run.replay, [&](ReplayRecord kind, std::string_view payload) {
    if (kind == ReplayRecord::kHeader) {
      const Json header = Json::parse(payload);
      voxel_m3 = std::pow(header.value("resolution_m", 0.0), 3);
      for (std::size_t i = 0; i < header.value("uavs", std::size_t{0}); ++i) series.push_back(uav_series(i));
    }
    if (kind != ReplayRecord::kKnown) return;
    ByteReader reader(payload);
    const double time_s = static_cast<double>(reader.varint()) * 1e-3;
    for (Series& one : series) {
      one.x.push_back(time_s);
      const double before_m3 = one.y.empty() ? 0.0 : one.y.back();
      one.y.push_back(before_m3 + static_cast<double>(reader.varint()) * voxel_m3);
    }
  });
  return series;
}

/// How often each thing that went another way than planned had happened by then.
std::string trouble_plot(const RunData& run) {
  const std::vector<double> time_s = run.steps.numbers("time_s");
  const double end_s = time_s.empty() ? 0.0 : time_s.back();
  std::map<std::string, Series> by_event;
  for (const Json& entry : run.log) {
    const std::string event = entry["event"];
    if (event == "state" || event == "goal" || event == "trajectory" || event == "winding_down") continue;
    Series& one =
        by_event.try_emplace(event, Series{event, {0.0}, {0.0}, static_cast<int>(by_event.size())}).first->second;
    const double at_s = entry["time_s"], count = one.y.back();
    one.x.insert(one.x.end(), {at_s, at_s});
    one.y.insert(one.y.end(), {count, count + 1.0});
  }
  std::vector<Series> series;
  for (auto& [event, one] : by_event) {
    one.x.push_back(end_s);
    one.y.push_back(one.y.back());
    std::ranges::replace(one.name, '_', ' ');
    series.push_back(one);
  }
  if (series.empty()) series.push_back({"none", {0.0, end_s}, {0.0, 0.0}, 0});
  const std::string only = series.size() == 1 ? ": " + series[0].name : "";
  return line_plot({"Fallbacks and other troubles so far" + only, "time (s)", "count"}, series);
}

std::string timing_plots(const RunData& run) {
  const std::vector<double> time_s = run.timings.numbers("time_s");
  std::string html;
  for (const auto& [what, title] : {std::pair{"plan", "Planning time: a decision of a UAV, per half second"},
                                    std::pair{"integrate", "Integration time: a scan, per half second"}}) {
    const std::string name(what);
    html += line_plot({title, "time (s)", "time (ms)"}, {{"largest", time_s, run.timings.numbers(name + "_ms_max"), 0},
                                                         {"mean", time_s, run.timings.numbers(name + "_ms_mean"), 1}});
  }
  std::vector<Bar> bars;
  for (const char* what : {"plan", "integrate"}) {
    const auto found = run.metrics.find(std::string(what) + "_ms");
    if (found == run.metrics.end() || !found->is_object()) continue;
    for (const char* part : {"p50", "p99", "max"})
      bars.push_back({std::string(what) + " " + part, number_in(*found, part)});
  }
  if (!bars.empty()) html += bar_plot("Computing times: one decision of a UAV, one scan", "ms, logarithmic", bars);
  return html;
}

}  // namespace

std::string key_numbers(const Json& metrics) {
  std::string html = "<div class=\"key\">";
  const auto card = [&](const char* name, const std::string& value) {
    html += "<div><span>" + std::string(name) + "</span><b>" + escape_html(value) + "</b></div>";
  };
  const auto measured = [&](const char* key, const char* pattern, double scale = 1.0, const char* absent = "-") {
    char text[64];
    const double value = number_in(metrics, key);
    if (!std::isfinite(value)) return std::string(absent);
    std::snprintf(text, sizeof text, pattern, scale * value);
    return std::string(text);
  };
  card("coverage", measured("coverage", "%.1f %%", 100.0));
  card("90 % covered after", measured("t90_s", "%.0f s", 1.0, "never"));
  card("finished after", measured("finish_s", "%.0f s"));
  card("path, all UAVs", measured("path_length_m", "%.0f m"));
  card("least distance", measured("min_uav_distance_m", "%.2f m"));
  card("collisions", measured("collisions", "%.0f"));
  if (metrics.contains("stop_reason")) card("ended", text_of(metrics["stop_reason"]));
  return html + "</div>\n";
}

std::string joint_plots(const std::vector<RunData>& runs) {
  std::vector<Series> coverage, volume;
  for (const RunData& run : runs) {
    const int colour = static_cast<int>(coverage.size());
    Series one{run.name, run.steps.numbers("time_s"), run.steps.numbers("coverage"), colour};
    for (double& value : one.y) value *= 100.0;
    coverage.push_back(std::move(one));
    volume.push_back({run.name, run.steps.numbers("time_s"), run.steps.numbers("known_volume_m3"), colour});
  }
  return line_plot({"Coverage of what can be seen", "time (s)", "coverage (%)"}, coverage) +
         line_plot({"Known volume", "time (s)", "volume (m\u00b3)"}, volume);
}

std::string run_plots(const RunData& run) {
  std::vector<Series> plan, height, speed;
  for (const auto& [id, track] : read_tracks(run.trajectories)) {
    plan.push_back(track.plan);
    height.push_back(track.height);
    speed.push_back(averaged(track.speed));
  }
  return line_plot({"Volume first seen by each UAV", "time (s)", "volume (m\u00b3)"}, known_by_uav(run)) +
         line_plot({"Trajectories from above", "x (m)", "y (m)", true, false, false}, plan) +
         line_plot({"Height", "time (s)", "z (m)", false, false}, height) +
         line_plot({"Speed, mean of two seconds", "time (s)", "speed (m/s)"}, speed) + distance_plot(run.steps) +
         timing_plots(run) + trouble_plot(run);
}

std::string metrics_table(const std::vector<RunData>& runs) {
  std::vector<std::map<std::string, std::string>> columns;
  for (const RunData& run : runs) {
    const auto rows = flat(run.metrics);
    columns.emplace_back(rows.begin(), rows.end());
  }
  std::string html =
      "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Metrics\"><table><thead><tr><th "
      "scope=\"col\">metric</th>";
  for (const RunData& run : runs) html += "<th scope=\"col\">" + escape_html(run.name) + "</th>";
  html += "</tr></thead><tbody>";
  for (const auto& [key, first] : flat(runs.front().metrics)) {
    html += "<tr><th scope=\"row\">" + escape_html(key) + "</th>";
    for (const auto& column : columns) {
      const auto found = column.find(key);
      html += "<td>" + escape_html(found == column.end() ? "-" : found->second) + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>";
}

}  // namespace stairwell::apps
