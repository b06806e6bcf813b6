#include "apps/report_data.hpp"

#include "apps/byte_codec.hpp"
#include "apps/replay_file.hpp"
#include "core/errors.hpp"

#include <array>
#include <cmath>
#include <map>
#include <string_view>

namespace stairwell::apps {
namespace {

using Json = ReportJson;

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

bool usable(const Json& entry) {
  const auto number = [&](const char* key) { return entry.contains(key) && entry[key].is_number(); };
  return entry.is_object() && number("time_s") && number("uav") && entry.contains("event") &&
         entry["event"].is_string();
}

std::vector<Json> read_log(const std::filesystem::path& file) {
  std::vector<Json> entries;
  std::error_code missing;
  if (std::filesystem::file_size(file, missing) == 0 && !missing) return entries;  // broken off before its first tick
  const std::string text = read_whole_file(file);
  std::size_t line = 1;
  for (std::string_view rest = text; !rest.empty(); ++line) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    Json entry = Json::parse(rest.substr(0, end), nullptr, false);
    if (!usable(entry))
      throw InputError(file.string() + ":" + std::to_string(line) + ": is not an entry of a run's log");
    entries.push_back(std::move(entry));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return entries;
}

/// Per UAV the count, then time (ms), position (mm) and yaw (mrad) as steps from row to row.
std::string packed_tracks(const CsvTable& table, std::size_t uavs) {
  const std::array<std::vector<double>, 5> columns{table.numbers("time_s"), table.numbers("x_m"), table.numbers("y_m"),
                                                   table.numbers("z_m"), table.numbers("yaw_rad")};
  const std::vector<double> uav = table.numbers("uav");
  std::string bytes;
  for (std::size_t id = 0; id < uavs; ++id) {
    std::string rows;
    std::size_t count = 0;
    std::array<std::int64_t, 5> last{};
    for (std::size_t k = 0; k < uav.size(); ++k) {
      if (uav[k] != static_cast<double>(id)) continue;
      ++count;
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const std::int64_t value = std::isfinite(columns[c][k]) ? std::llround(columns[c][k] * 1e3) : last[c];
        put_signed(rows, value - last[c]);
        last[c] = value;
      }
    }
    put_varint(bytes, count);
    bytes += rows;
  }
  return bytes;
}

Json numbers_json(const std::vector<double>& values, double per_unit) {
  Json list = Json::array();
  for (const double value : values) {
    list.push_back(std::isfinite(value) ? Json(std::round(value * per_unit) / per_unit) : Json(nullptr));
  }
  return list;
}

/// Goals, states and other events as short lists.
void add_log(Json& about, const std::vector<Json>& log) {
  about["goals"] = about["states"] = about["events"] = Json::array();
  for (const Json& entry : log) {
    const std::string event = entry["event"];
    Json row = Json::array({entry["time_s"], entry["uav"]});
    if (event == "trajectory") continue;
    if (event == "goal") {
      row.push_back(entry.value("goal_m", Json::array({0, 0, 0})));
      row.push_back(entry.value("gain_m3", 0.0));
      row.push_back(entry.value("planner", ""));
      about["goals"].push_back(std::move(row));
    } else if (event == "state") {
      row.push_back(entry.value("state", ""));
      about["states"].push_back(std::move(row));
    } else {
      row.push_back(event);
      row.push_back(entry.value("reason", ""));
      about["events"].push_back(std::move(row));
    }
  }
}

std::string without(std::string_view records, ReplayRecord dropped) {
  std::string kept;
  for_each_record(records, [&](ReplayRecord kind, std::string_view payload) {
    if (kind != dropped) put_record(kept, kind, payload);
  });
  return kept;
}

Json description(const RunData& run) {
  Json about;
  about["name"] = run.name;
  for (const char* key : {"world", "mode", "planner", "uavs", "seed", "finish_s", "stop_reason"}) {
    if (run.metrics.contains(key)) about[key] = run.metrics[key];
  }
  about["coverage"] = {numbers_json(run.steps.numbers("time_s"), 1e3),
                       numbers_json(run.steps.numbers("coverage"), 1e5)};
  add_log(about, run.log);
  return about;
}

std::size_t uavs_of(const RunData& run, const std::string& where) {
  std::size_t uavs = 0;
  for_each_record(run.replay, [&](ReplayRecord kind, std::string_view payload) {
    if (kind != ReplayRecord::kHeader) return;
    const Json header = Json::parse(payload, nullptr, false);
    if (!header.is_object() || !header.contains("uavs") || !header["uavs"].is_number_unsigned())
      throw InputError(where + ": the replay's header is damaged");
    uavs = header["uavs"];
  });
  return uavs;
}

}  // namespace

RunData read_run(const std::filesystem::path& run_dir) {
  if (!std::filesystem::is_directory(run_dir)) throw InputError(run_dir.string() + ": no such run folder");
  RunData run;
  run.name = std::filesystem::absolute(run_dir / ".").lexically_normal().parent_path().filename().string();
  run.metrics = read_metrics(run_dir / "metrics.json");
  run.config = read_whole_file(run_dir / "config.yaml");
  run.steps = CsvTable::read(run_dir / "steps.csv");
  run.trajectories = CsvTable::read(run_dir / "trajectories.csv");
  run.timings = CsvTable::read(run_dir / "timings.csv");
  run.log = read_log(run_dir / "log.jsonl");
  run.snapshot = read_snapshot(run_dir / "snapshot.png");
  run.replay = read_replay(run_dir / "replay.bin");
  return run;
}

std::string packed_run(const RunData& run, std::size_t most_bytes) {
  const std::string tracks = packed_tracks(run.trajectories, uavs_of(run, run.name));
  Json about = description(run);
  about["left_out"] = Json::array();
  std::string records = run.replay, packed;
  std::size_t plain_size = 0;
  const std::array<std::pair<ReplayRecord, const char*>, 2> spare{
      {{ReplayRecord::kFrontier, "frontiers"}, {ReplayRecord::kPlan, "plans"}}};
  for (std::size_t dropped = 0;; ++dropped) {
    about["tracks_bytes"] = tracks.size();
    const std::string text = about.dump();
    std::string plain;
    put_u32(plain, static_cast<std::uint32_t>(text.size()));
    plain += text + tracks + records;
    plain_size = plain.size();
    packed = base64(deflated(plain));
    if (packed.size() <= most_bytes || dropped == spare.size()) break;
    records = without(records, spare[dropped].first);
    about["left_out"].push_back(spare[dropped].second);
  }
  return "<script type=\"text/plain\" class=\"run\" data-bytes=\"" + std::to_string(plain_size) + "\" data-crc=\"" +
         std::to_string(crc32_of(packed)) + "\">" + packed + "</script>\n";
}

}  // namespace stairwell::apps
