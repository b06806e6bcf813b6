#include "apps/byte_codec.hpp"
#include "apps/png_writer.hpp"
#include "apps/replay_file.hpp"
#include "apps/report.hpp"
#include "apps/report_data.hpp"
#include "apps/svg_plot.hpp"
#include "core/errors.hpp"
#include "tests/test_folder.hpp"

#include <zlib.h>
#include <catch2/catch.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace stairwell::apps {
namespace {

namespace fs = std::filesystem;

void put(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }

std::string get(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// A wall that two UAVs see column by column, a frontier before it, and a plan each second.
std::string make_replay(int rows) {
  std::string records, payload;
  put_record(
      records, ReplayRecord::kHeader,
      R"({"resolution_m":0.1,"first_cell":[0,0,0],"size":[400,8,20],"uavs":2,"robot_radius_m":0.2,"frontier_cell":2,
                 "sensor":{"azimuth_fov_rad":1.5,"elevation_lo_rad":-0.6,"elevation_hi_rad":0.6,"max_range_m":5.0}})");
  const CellOrder order{{400, 8, 20}}, coarse{{200, 4, 10}};
  for (int i = 0; i < std::min(rows, 400); ++i) {
    const auto time_ms = static_cast<std::uint64_t>(400 * i);
    std::vector<std::uint64_t> column;
    for (int z = 0; z < 20; ++z) column.push_back(order.cell({i, 3, z}));
    payload.clear();
    put_varint(payload, time_ms);
    put_varint(payload, static_cast<std::uint64_t>(i % 2));
    put_cells(payload, column);
    put_cells(payload, {});
    put_record(records, ReplayRecord::kVoxels, payload);
    payload.clear();
    put_varint(payload, time_ms);
    put_varint(payload, 20);
    put_varint(payload, 5);
    put_record(records, ReplayRecord::kKnown, payload);
    payload.clear();
    put_varint(payload, time_ms);
    put_varint(payload, i == 0 ? 1 : 0);
    put_cells(payload, {coarse.cell({i / 2, 1, 1})});
    put_cells(payload, {});
    put_record(records, ReplayRecord::kFrontier, payload);
  }
  return std::string(kReplayMagic) + replay_chunk(records);
}

/// What stands in the page's data: plain bytes of the n-th run.
std::string unpacked(const std::string& html) {
  const auto at = html.find("class=\"run\" data-bytes=\"");
  REQUIRE(at != std::string::npos);
  const std::size_t size = std::stoul(html.substr(at + 24));
  const auto begin = html.find('>', at) + 1, end = html.find("</script>", begin);
  const std::string text = html.substr(begin, end - begin);
  const auto crc_at = html.find("data-crc=\"", at) + 10;
  CHECK(std::stoul(html.substr(crc_at)) == crc32_of(text));
  std::string bytes;
  std::uint32_t block = 0;
  int bits = 0;
  for (const char c : text) {
    constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto value = kLetters.find(c);
    if (value == std::string_view::npos) continue;
    block = (block << 6) | static_cast<std::uint32_t>(value);
    if ((bits += 6) >= 8) bytes += static_cast<char>((block >> (bits -= 8)) & 0xFF);
  }
  std::string plain(size, '\0');
  uLongf length = size;
  REQUIRE(uncompress(reinterpret_cast<Bytef*>(plain.data()), &length, reinterpret_cast<const Bytef*>(bytes.data()),
                     bytes.size()) == Z_OK);
  REQUIRE(length == size);
  return plain;
}

nlohmann::json about(const std::string& plain) {
  ByteReader reader(plain);
  return nlohmann::json::parse(reader.take(reader.u32()));
}

/// A run folder of two UAVs with the files that a run writes.
fs::path make_run(const std::string& name, int rows = 300) {
  const fs::path dir = testing::test_folder() / name;
  fs::remove_all(dir);
  fs::create_directories(dir);
  put(dir / "metrics.json",
      R"({"world":"worlds/<b>&amp.sdf","mode":"volume","coverage":0.981,"t90_s":81.5,"t99_s":null,"finish_s":120,
          "path_length_m":210.5,"path_length_per_uav_m":[100.2,110.3],"min_uav_distance_m":0.91,"collisions":0,
          "plan_ms":{"p50":2.5,"p99":31,"max":77},"integrate_ms":{"p50":1.1,"p99":2,"max":3},"stop_reason":"target reached"})");
  put(dir / "config.yaml", "world: \"<script>alert('x')</script>\"\nseed: 1\n");
  std::ostringstream steps, tracks;
  steps << "time_s,coverage,known_volume_m3,uav0_x_m,uav0_y_m,uav0_z_m,uav0_yaw_rad,uav0_state,"
           "uav1_x_m,uav1_y_m,uav1_z_m,uav1_yaw_rad,uav1_state\n";
  tracks << "time_s,uav,x_m,y_m,z_m,yaw_rad,speed_mps\n";
  for (int i = 0; i < rows; ++i) {
    const double t = 0.4 * i, c = 1.0 - std::exp(-t / 30.0);
    steps << t << ',' << (i % 10 == 0 ? std::to_string(c) : "") << ',' << 500 * c << ',' << std::cos(t) << ','
          << std::sin(t) << ",1,0,travel," << 3 + std::cos(t) << ',' << -std::sin(t) << ",2,0,find_goal\n";
    for (int u = 0; u < 2; ++u)
      tracks << t << ',' << u << ',' << 3 * u + std::cos(t) << ',' << std::sin(t) << ',' << 1 + u << ",0,1.0\n";
  }
  put(dir / "steps.csv", steps.str());
  put(dir / "trajectories.csv", tracks.str());
  put(dir / "timings.csv",
      "time_s,plans,plan_ms_mean,plan_ms_max,scans,integrate_ms_mean,integrate_ms_max\n"
      "0.5,0,,,10,1.1,1.5\n1.0,2,20.5,31,10,1.0,1.2\n");
  put(dir / "log.jsonl", R"({"time_s":0.1,"uav":0,"event":"state","state":"travel"}
{"time_s":0.1,"uav":0,"event":"goal","goal_m":[1,2,1.5],"gain_m3":3.5,"planner":"astar"}
{"time_s":0.1,"uav":0,"event":"trajectory","start_s":0.1,"end_s":2.0,"length_m":1.5}
{"time_s":2.5,"uav":1,"event":"fallback","reason":"apf: local minimum; used astar"}
)");
  put(dir / "replay.bin", make_replay(rows));
  write_png({4, 2, std::vector<std::uint8_t>(24, 200)}, dir / "snapshot.png");
  return dir;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

/// The page without its scripts: three.js names what no report may fetch.
std::string without_scripts(std::string html) {
  for (auto at = html.find("<script"); at != std::string::npos; at = html.find("<script"))
    html.erase(at, html.find("</script>", at) + 9 - at);
  return html;
}

}  // namespace

TEST_CASE("a report holds everything in one file") {
  const fs::path dir = make_run("report_good");
  write_report(dir);
  const std::string html = get(dir / "report.html");
  CHECK(html.starts_with("<!doctype html>"));
  CHECK(html.ends_with("</html>\n"));
  CHECK(count(html, "<figure>") == 11);
  CHECK(count(html, "<svg") == count(html, "</svg>"));
  CHECK(html.find("data:image/png;base64,iVBORw0KGgo") != std::string::npos);
  CHECK(html.find("98.1 %") != std::string::npos);
  CHECK(html.find("prefers-color-scheme:dark") != std::string::npos);
  const std::string page = without_scripts(html);
  CHECK(page.find("nan") == std::string::npos);
  for (const char* outside : {"http://", "https://", "src=\"/", "<link", "@import", "url("})
    CHECK(page.find(outside) == std::string::npos);
  CHECK(html.find("default-src 'none'") != std::string::npos);
  CHECK(html.find("troubles so far: fallback<") != std::string::npos);
  CHECK(html.find("stairwell explore --config /dev/stdin") != std::string::npos);
  CHECK_FALSE(fs::exists(dir / "report.html.tmp"));
}

TEST_CASE("text from the run is escaped") {
  CHECK(escape_html("<a href=\"x\">&'") == "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  const fs::path dir = make_run("report_escape");
  write_report(dir);
  const std::string html = get(dir / "report.html");
  CHECK(html.find("<b>&amp.sdf") == std::string::npos);
  CHECK(html.find("&lt;script&gt;alert(&#39;x&#39;)") != std::string::npos);
  CHECK(about(unpacked(html)).at("world") == "worlds/<b>&amp.sdf");
}

TEST_CASE("long runs make no long reports, and short ones are no trouble") {
  const fs::path lengthy = make_run("report_long", 40000), brief = make_run("report_brief", 0);
  write_report(lengthy);
  write_report(brief);
  CHECK(fs::file_size(lengthy / "report.html") < 2'000'000);
  CHECK(without_scripts(get(brief / "report.html")).find("nan") == std::string::npos);
}

TEST_CASE("a missing or damaged part of the run is named") {
  const auto refuses = [](const fs::path& dir, const std::string& part) {
    try {
      write_report(dir);
    } catch (const InputError& error) {
      INFO(error.what());
      CHECK(std::string(error.what()).find(part) != std::string::npos);
      CHECK(std::string(error.what()).find('\n') == std::string::npos);
      CHECK_FALSE(fs::exists(dir / "report.html"));
      return;
    }
    FAIL("accepted: " << part);
  };
  for (const char* file : {"metrics.json", "config.yaml", "steps.csv", "trajectories.csv", "timings.csv", "log.jsonl",
                           "replay.bin", "snapshot.png"}) {
    const fs::path dir = make_run("report_bad");
    fs::remove(dir / file);
    refuses(dir, file);
    if (std::string(file) == "log.jsonl") continue;  // may be empty
    put(dir / file, "");
    refuses(dir, file);
  }
  const fs::path dir = make_run("report_bad");
  put(dir / "metrics.json", "{\"coverage\": 0.9");
  refuses(dir, "metrics.json");
  put(dir / "metrics.json", "[1]");
  refuses(dir, "metrics.json");
  put(dir / "metrics.json", "{}");
  put(dir / "steps.csv", "time_s,coverage,known_volume_m3\n1,0.5\n");
  refuses(dir, "steps.csv:2");
  put(dir / "steps.csv", "time_s,coverage,known_volume_m3\n1,0.5,x\n");
  refuses(dir, "steps.csv:2");
  put(dir / "steps.csv", "time_s,known_volume_m3\n1,0.5\n");
  refuses(dir, "coverage");
  put(dir / "snapshot.png", "GIF89a");
  refuses(dir, "snapshot.png");
  write_png({4, 2, std::vector<std::uint8_t>(24, 200)}, dir / "snapshot.png");
  put(dir / "steps.csv", "time_s,coverage,known_volume_m3\n1,0.5,1\n");
  put(dir / "log.jsonl", "{\"time_s\":1,\"uav\":0,\"event\":\"state\"}\n{\"time_s\":1,\"uav\":\n");
  refuses(dir, "log.jsonl:2");
  refuses(dir / "no_such_run", "no_such_run");
}

TEST_CASE("what the viewer gets is what the run folder holds") {
  const fs::path dir = make_run("report_data");
  const RunData run = read_run(dir);
  CHECK(run.name == "report_data");
  const std::string plain = unpacked(packed_run(run, 1'000'000));
  const nlohmann::json told = about(plain);
  CHECK(told.at("goals") == nlohmann::json::parse("[[0.1,0,[1,2,1.5],3.5,\"astar\"]]"));
  CHECK(told.at("states") == nlohmann::json::parse("[[0.1,0,\"travel\"]]"));
  CHECK(told.at("events").size() == 1);
  CHECK(told.at("left_out").empty());
  CHECK(plain.ends_with(run.replay));
  ByteReader reader(plain);
  reader.take(reader.u32());
  ByteReader tracks(reader.take(told.at("tracks_bytes").get<std::size_t>()));
  const std::vector<double> x_m = run.trajectories.numbers("x_m");
  for (std::size_t uav = 0; uav < 2; ++uav) {
    REQUIRE(tracks.varint() == 300);
    std::array<std::int64_t, 5> at{};
    for (std::size_t k = 0; k < 300; ++k) {
      for (std::int64_t& value : at) value += tracks.signed_varint();
      CHECK(at[0] == std::llround(400.0 * static_cast<double>(k)));
      CHECK(static_cast<double>(at[1]) == Approx(1e3 * x_m[2 * k + uav]).margin(0.51));
    }
  }
  CHECK(tracks.done());
}

TEST_CASE("what would make a report too large is left out, and the page is told") {
  const RunData run = read_run(make_run("report_size"));
  const std::string whole = packed_run(run, 1'000'000), less = packed_run(run, whole.size() - 1000);
  CHECK(less.size() < whole.size());
  CHECK(about(unpacked(less)).at("left_out") == nlohmann::json::parse("[\"frontiers\"]"));
  std::size_t frontiers = 0, voxels = 0;
  const std::string plain = unpacked(less);
  ByteReader reader(plain);
  reader.take(reader.u32());
  reader.take(about(plain).at("tracks_bytes").get<std::size_t>());
  for_each_record(reader.take(reader.left()), [&](ReplayRecord kind, std::string_view) {
    frontiers += kind == ReplayRecord::kFrontier ? 1 : 0;
    voxels += kind == ReplayRecord::kVoxels ? 1 : 0;
  });
  CHECK(frontiers == 0);
  CHECK(voxels == 300);
}

TEST_CASE("two runs share a page") {
  const fs::path one = make_run("report_one"), other = make_run("report_other");
  const fs::path file = one / "both.html";
  write_report({one, other}, file);
  const std::string html = get(file);
  CHECK(count(html, "class=\"run\"") == 2);
  CHECK(count(html, "<figure>") == 2 + 2 * 9);
  CHECK(html.find("<th scope=\"col\">report_other</th>") != std::string::npos);
  CHECK_THROWS_AS(write_report({one, one / "none"}, file), InputError);
}

TEST_CASE("a report that cannot be written says so") {
  const fs::path dir = make_run("report_blocked");
  fs::create_directory(dir / "report.html");
  CHECK_THROWS_AS(write_report(dir), RunError);
  CHECK_FALSE(fs::exists(dir / "report.html.tmp"));
}

TEST_CASE("plots survive odd numbers") {
  const double nan = std::nan(""), inf = INFINITY;
  for (const auto& y : std::vector<std::vector<double>>{{}, {1.0}, {nan, nan}, {inf, 1.0}, {5.0, 5.0}, {-1e9, 1e9}}) {
    const Series one{"a", std::vector<double>(y.size(), 1.0), y, 0};
    const std::string html = line_plot({"t", "x", "y"}, {one});
    CHECK(html.find("nan") == std::string::npos);
    CHECK(html.find("inf") == std::string::npos);
  }
  CHECK(bar_plot("t", "ms", {{"a", 0.0}, {"b", nan}}).find("nan") == std::string::npos);
}

}  // namespace stairwell::apps
