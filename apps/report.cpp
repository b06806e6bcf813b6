#include "apps/report.hpp"

#include "apps/atomic_file.hpp"
#include "apps/csv_table.hpp"
#include "apps/svg_plot.hpp"
#include "core/errors.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace stairwell::apps {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr const char* kStyle = R"(<style>
:root{--paper:#fbfcfe;--ink:#222b38;--soft:#5c6878;--rule:#dde3ec;--card:#fff;--bar:#3f7fbf;
--c0:#d55e00;--c1:#1667b8;--c2:#c23c8b;--c3:#4b5563;--c4:#c98a00;--c5:#00855f;--c6:#3fa7d6;--c7:#7a5cc0}
@media (prefers-color-scheme:dark){:root{--paper:#12161c;--ink:#e3e8ef;--soft:#9aa6b5;--rule:#2b333e;--card:#1a2029;--bar:#5b9bd9;
--c0:#ff8a3d;--c1:#5aa6f0;--c2:#ef7fbd;--c3:#c3cad4;--c4:#f0bb45;--c5:#3cc79c;--c6:#7fd0f2;--c7:#b49cf0}}
*{box-sizing:border-box}body{margin:0 auto;max-width:1320px;padding:1rem;background:var(--paper);color:var(--ink);
font:16px/1.5 system-ui,sans-serif}h1{font-size:1.5rem;margin:.4rem 0}h2{font-size:1.15rem;margin:1.6rem 0 .6rem}
.key{display:flex;flex-wrap:wrap;gap:.6rem}.key div{background:var(--card);border:1px solid var(--rule);border-radius:.5rem;
padding:.5rem .9rem;min-width:8rem;flex:1}.key b{display:block;font-size:1.25rem}.key span,figcaption,.legend{color:var(--soft)}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,26rem),1fr));gap:1rem}
figure{margin:0;background:var(--card);border:1px solid var(--rule);border-radius:.5rem;padding:.6rem}
svg,img{width:100%;height:auto;display:block}svg text{fill:var(--soft);font:12px system-ui,sans-serif}
.grid{stroke:var(--rule)}.line{fill:none;stroke-width:1.6;stroke-linejoin:round}.bar{fill:var(--bar)}
.legend{margin:.3rem 0 0;font-size:.9rem}.legend i{display:inline-block;width:1.1em;height:.28em;margin:0 .35em .2em .6em}
.scroll{overflow-x:auto}table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:.25rem .6rem;
border-bottom:1px solid var(--rule);vertical-align:top;overflow-wrap:anywhere}td+td{font-variant-numeric:tabular-nums}
.two{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,24rem),1fr));gap:1rem}
pre{background:var(--card);border:1px solid var(--rule);border-radius:.5rem;padding:.7rem;overflow-x:auto;font-size:.85rem;margin:0}
path.s0{stroke:var(--c0)}path.s1{stroke:var(--c1)}path.s2{stroke:var(--c2)}path.s3{stroke:var(--c3)}
path.s4{stroke:var(--c4)}path.s5{stroke:var(--c5)}path.s6{stroke:var(--c6)}path.s7{stroke:var(--c7)}
i.s0{background:var(--c0)}i.s1{background:var(--c1)}i.s2{background:var(--c2)}i.s3{background:var(--c3)}
i.s4{background:var(--c4)}i.s5{background:var(--c5)}i.s6{background:var(--c6)}i.s7{background:var(--c7)}
</style>)";

std::string base64(std::string_view bytes) {
  constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t block = 0;
    for (std::size_t j = 0; j < 3; ++j)
      block = (block << 8) | (i + j < bytes.size() ? static_cast<std::uint8_t>(bytes[i + j]) : 0u);
    for (std::size_t j = 0; j < 4; ++j) text += i + j > bytes.size() ? '=' : kLetters[(block >> (18 - 6 * j)) & 63u];
  }
  return text;
}

Json read_metrics(const std::filesystem::path& file) {
  try {
    Json metrics = Json::parse(read_whole_file(file));
    if (!metrics.is_object()) throw InputError(file.string() + ": is not a JSON object");
    return metrics;
  } catch (const Json::parse_error& error) {
    throw InputError(file.string() + ": damaged JSON at byte " + std::to_string(error.byte));
  }
}

std::string read_snapshot(const std::filesystem::path& file) {
  std::string bytes = read_whole_file(file);
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n")) throw InputError(file.string() + ": is not a PNG picture");
  return bytes;
}

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

std::string metrics_table(const Json& metrics) {
  std::string html = "<div class=\"scroll\"><table>";
  const auto row = [&](const std::string& key, const std::string& value) {
    html += "<tr><td>" + escape_html(key) + "</td><td>" + escape_html(value) + "</td></tr>\n";
  };
  for (const auto& [key, value] : metrics.items()) {
    if (value.is_object()) {
      for (const auto& [inner, part] : value.items()) row(key + " " + inner, text_of(part));
    } else if (value.is_array()) {
      std::string joined;
      for (const auto& part : value) joined += (joined.empty() ? "" : ", ") + text_of(part);
      row(key, joined);
    } else {
      row(key, text_of(value));
    }
  }
  return html + "</table></div>";
}

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

std::string uav_name(std::size_t uav) { return "UAV " + std::to_string(uav); }

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

std::string plots(const Json& metrics, const CsvTable& steps, const CsvTable& trajectories) {
  Series coverage{"coverage", steps.numbers("time_s"), steps.numbers("coverage"), 1};
  for (double& value : coverage.y) value *= 100.0;
  const Series volume{"known volume", steps.numbers("time_s"), steps.numbers("known_volume_m3"), 5};
  std::vector<Series> plan, height, speed;
  for (const auto& [id, track] : read_tracks(trajectories)) {
    plan.push_back(track.plan);
    height.push_back(track.height);
    speed.push_back(track.speed);
  }
  std::string html = "<div class=\"plots\">";
  html += line_plot({"Coverage", "time (s)", "coverage (%)"}, {coverage});
  html += line_plot({"Known volume", "time (s)", "volume (m\u00b3)"}, {volume});
  html += line_plot({"Trajectories from above", "x (m)", "y (m)", true, false}, plan);
  html += line_plot({"Height", "time (s)", "z (m)", false, false}, height);
  html += line_plot({"Speed", "time (s)", "speed (m/s)"}, speed);
  html += distance_plot(steps);
  std::vector<Bar> bars;
  for (const char* what : {"plan", "integrate"}) {
    const auto found = metrics.find(std::string(what) + "_ms");
    if (found == metrics.end() || !found->is_object()) continue;
    for (const char* part : {"p50", "p99", "max"})
      bars.push_back({std::string(what) + " " + part, number_in(*found, part)});
  }
  if (!bars.empty()) html += bar_plot("Computing times: one decision of a UAV, one scan", "ms, logarithmic", bars);
  return html + "</div>\n";
}

}  // namespace

void write_report(const std::filesystem::path& run_dir) {
  if (!std::filesystem::is_directory(run_dir)) throw InputError(run_dir.string() + ": no such run folder");
  const Json metrics = read_metrics(run_dir / "metrics.json");
  const std::string config = read_whole_file(run_dir / "config.yaml");
  const CsvTable steps = CsvTable::read(run_dir / "steps.csv");
  const CsvTable trajectories = CsvTable::read(run_dir / "trajectories.csv");
  const std::string snapshot = read_snapshot(run_dir / "snapshot.png");
  const std::string world = metrics.contains("world") ? text_of(metrics["world"]) : "run";
  const std::string title = escape_html("Exploration of " + std::filesystem::path(world).stem().string());
  std::string html =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<meta name=\"color-scheme\" content=\"light dark\"><title>" +
      title + "</title>";
  html += kStyle;
  html += "</head><body><h1>" + title + "</h1>\n" + key_numbers(metrics);
  html +=
      "<h2>Map</h2><figure><img alt=\"The explored map, storeys cut open, with the UAVs' paths\" "
      "src=\"data:image/png;base64," +
      base64(snapshot) + "\"></figure>\n";
  html += "<h2>Plots</h2>" + plots(metrics, steps, trajectories);
  html += "<div class=\"two\"><section><h2>Metrics</h2>" + metrics_table(metrics) + "</section>";
  html += "<section><h2>Configuration</h2><pre>" + escape_html(config) + "</pre></section></div></body></html>\n";
  write_file_atomically(run_dir / "report.html", html);
}

}  // namespace stairwell::apps
