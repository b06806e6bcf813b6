#include "apps/png_writer.hpp"
#include "apps/report.hpp"
#include "apps/svg_plot.hpp"
#include "core/errors.hpp"

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

/// A run folder of two UAVs with the columns that a run writes.
fs::path make_run(const std::string& name, int rows = 300) {
  const fs::path dir = fs::path(STAIRWELL_TEST_TMP) / name;
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
  write_png({4, 2, std::vector<std::uint8_t>(24, 200)}, dir / "snapshot.png");
  return dir;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("a report holds everything in one file") {
  const fs::path dir = make_run("report_good");
  write_report(dir);
  const std::string html = get(dir / "report.html");
  CHECK(html.starts_with("<!doctype html>"));
  CHECK(html.ends_with("</html>\n"));
  CHECK(count(html, "<svg") == 7);
  CHECK(count(html, "</svg>") == 7);
  CHECK(html.find("data:image/png;base64,iVBORw0KGgo") != std::string::npos);
  CHECK(html.find("98.1 %") != std::string::npos);
  CHECK(html.find("prefers-color-scheme:dark") != std::string::npos);
  CHECK(html.find("nan") == std::string::npos);
  for (const char* outside : {"http://", "https://", "src=\"/", "<link", "@import", "<script"})
    CHECK(html.find(outside) == std::string::npos);
  CHECK_FALSE(fs::exists(dir / "report.html.tmp"));
}

TEST_CASE("text from the run is escaped") {
  CHECK(escape_html("<a href=\"x\">&'") == "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  const fs::path dir = make_run("report_escape");
  write_report(dir);
  const std::string html = get(dir / "report.html");
  CHECK(html.find("<b>&amp.sdf") == std::string::npos);
  CHECK(html.find("&lt;script&gt;alert(&#39;x&#39;)") != std::string::npos);
}

TEST_CASE("long runs make no long reports, and short ones are no trouble") {
  const fs::path lengthy = make_run("report_long", 40000), brief = make_run("report_brief", 0);
  write_report(lengthy);
  write_report(brief);
  CHECK(fs::file_size(lengthy / "report.html") < 400'000);
  CHECK(get(brief / "report.html").find("nan") == std::string::npos);
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
  for (const char* file : {"metrics.json", "config.yaml", "steps.csv", "trajectories.csv", "snapshot.png"}) {
    const fs::path dir = make_run("report_bad");
    fs::remove(dir / file);
    refuses(dir, file);
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
  refuses(dir / "no_such_run", "no_such_run");
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
