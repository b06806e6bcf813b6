/// Whole runs of the program on a small room: run folder, repeatability, kill and resume, disk errors.
#include "apps/append_file.hpp"
#include "apps/checkpoint.hpp"
#include "apps/cli.hpp"
#include "apps/map_files.hpp"
#include "apps/run_folder.hpp"
#include "core/errors.hpp"
#include "replay_state.hpp"
#include "run_words.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <sstream>
#include <thread>

namespace stairwell::apps {

using Catch::Contains;
using testing::fresh_folder;
using testing::Outcome;
using testing::read_text;
using testing::run;
using testing::Words;
namespace fs = std::filesystem;

namespace {

Words explore_words(const fs::path& room, const fs::path& out) {
  return {"explore",
          room.string(),
          "--box",
          testing::kRoomBox,
          "--start",
          "-1.2,0,1",
          "--start",
          "1.2,-0.5,0,90",
          "--charge-planning",
          "off",
          "--set",
          "checkpoint_period_s=0",
          "--resolution",
          "0.1",
          "--rays",
          "64x48",
          "--time-limit",
          "90",
          "--out",
          out.string(),
          "--json",
          "--quiet"};
}

/// The program as a process of its own.
pid_t start_process(const Words& words) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  std::vector<char*> arguments{const_cast<char*>(STAIRWELL_PROGRAM)};
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  if (std::freopen("/dev/null", "w", stdout) == nullptr || std::freopen("/dev/null", "w", stderr) == nullptr) _exit(99);
  ::execv(STAIRWELL_PROGRAM, arguments.data());
  _exit(98);
}

int wait_for(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// Waits until the run has saved a checkpoint and `more_ms` have passed, then sends the signal.
int signal_after_checkpoint(pid_t child, const fs::path& folder, int signal, int more_ms) {
  using namespace std::chrono_literals;
  for (int i = 0; i < 2000 && !CheckpointFolder(folder).exists() && !fs::exists(folder / "metrics.json"); ++i) {
    std::this_thread::sleep_for(5ms);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(more_ms));
  ::kill(child, signal);
  return wait_for(child);
}

/// The replay ends with what the map holds.
void check_replay(const fs::path& folder) {
  const testing::ReplayState state = testing::replayed(folder / "replay.bin");
  const nlohmann::json info = map_info(folder / "map.ot");
  const double voxel_m3 = std::pow(info.at("resolution_m").get<double>(), 3);
  CHECK(static_cast<double>(state.occupied.size()) * voxel_m3 == Approx(info.at("occupied_volume_m3").get<double>()));
  CHECK(static_cast<double>(state.known) * voxel_m3 == Approx(info.at("known_volume_m3").get<double>()));
  CHECK(state.open_sides == state.occupied.size());
  CHECK(state.plans > 0);
}

nlohmann::json metrics_of(const fs::path& folder) { return nlohmann::json::parse(read_text(folder / "metrics.json")); }

/// Files may grow no further than this while it lives: a full disk for one process.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limited = before_;
    limited.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limited);
  }
  ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

}  // namespace

TEST_CASE("a run leaves the whole folder, and its configuration gives the same run again") {
  const fs::path folder = fresh_folder("whole_run");
  const fs::path room = testing::write_room(folder);
  Words words = explore_words(room, folder / "a");
  words.insert(words.end(), {"--start-spread", "0.2"});  // moved starts are not moved again
  const Outcome outcome = run(words);
  CAPTURE(outcome.err);
  REQUIRE(outcome.code == 0);
  CHECK(outcome.err.empty());
  CHECK(outcome.out == read_text(folder / "a" / "metrics.json"));
  for (const char* name : {"config.yaml", "map.bt", "map.ot", "metrics.json", "steps.csv", "log.jsonl",
                           "trajectories.csv", "timings.csv", "replay.bin", "snapshot.png", "report.html"}) {
    CAPTURE(name);
    CHECK(fs::exists(folder / "a" / name));
  }
  CHECK(std::distance(fs::directory_iterator(folder / "a"), {}) == 11);
  const nlohmann::json metrics = nlohmann::json::parse(outcome.out);
  for (const char* key : {"world",
                          "mode",
                          "planner",
                          "coverage_strategy",
                          "uavs",
                          "seed",
                          "stop_reason",
                          "coverage",
                          "known_volume_m3",
                          "explorable_volume_m3",
                          "t50_s",
                          "t70_s",
                          "t80_s",
                          "t90_s",
                          "t95_s",
                          "t99_s",
                          "finish_s",
                          "path_length_m",
                          "path_length_per_uav_m",
                          "mean_uav_distance_m",
                          "std_uav_distance_m",
                          "min_uav_distance_m",
                          "collisions",
                          "fallbacks",
                          "plan_ms",
                          "integrate_ms",
                          "realtime_factor",
                          "wall_s",
                          "peak_rss_mib",
                          "version"}) {
    CAPTURE(key);
    CHECK(metrics.contains(key));
  }
  CHECK(metrics.at("uavs") == 2);
  CHECK(metrics.at("collisions") == 0);
  CHECK(metrics.at("coverage").get<double>() > 0.9);
  CHECK(map_info(folder / "a" / "map.bt").at("leaves").get<int>() > 100);

  check_replay(folder / "a");
  const Outcome again = run({"explore", "--config", (folder / "a" / "config.yaml").string(), "--out",
                             (folder / "b").string(), "--json", "--quiet"});
  REQUIRE(again.code == 0);
  CHECK(read_text(folder / "a" / "trajectories.csv") == read_text(folder / "b" / "trajectories.csv"));
  CHECK(read_text(folder / "a" / "map.ot") == read_text(folder / "b" / "map.ot"));

  const Outcome complete = run({"explore", "--resume", (folder / "a").string()});
  CHECK(complete.code == 0);
  CHECK_THAT(complete.out, Contains("complete"));
}

TEST_CASE("the learned agent explores a room to the end") {
  const fs::path folder = fresh_folder("run_agent");
  const fs::path room = testing::write_room(folder);
  Words words = explore_words(room, folder / "run");
  words.insert(words.end(), {"--coverage", "agent", "--return", "stay"});
  const Outcome outcome = run(words);
  CAPTURE(outcome.err);
  REQUIRE(outcome.code == 0);
  const auto metrics = nlohmann::json::parse(outcome.out);
  CHECK(metrics.at("coverage").get<double>() > 0.98);
  CHECK(metrics.at("collisions") == 0);
  CHECK(metrics.at("stop_reason") == "nothing reachable left");
  CHECK_THAT(read_text(folder / "run" / "config.yaml"), Contains("coverage: agent"));
}

TEST_CASE("a run killed at any moment and resumed ends like one that was not") {
  const fs::path folder = fresh_folder("killed");
  const fs::path room = testing::write_room(folder);
  REQUIRE(run(explore_words(room, folder / "whole")).code == 0);
  const double whole = metrics_of(folder / "whole").at("coverage").get<double>();
  const fs::path killed = folder / "killed";
  int code = signal_after_checkpoint(start_process(explore_words(room, killed)), killed, SIGKILL, 0);
  const Words resume{"explore", "--resume", killed.string(), "--quiet"};
  for (const int more_ms : {3, 17, 60}) {
    code = signal_after_checkpoint(start_process(resume), killed, SIGKILL, more_ms);
  }
  const Outcome last = run(resume);
  CAPTURE(code, last.err);
  REQUIRE(last.code == 0);
  const nlohmann::json metrics = metrics_of(killed);
  CHECK(metrics.at("coverage").get<double>() == Approx(whole).margin(0.01));
  CHECK(metrics.at("collisions") == 0);
  CHECK_FALSE(fs::exists(killed / "checkpoint"));
  check_replay(killed);
  // Each moment is logged once, in order.
  std::istringstream rows(read_text(killed / "steps.csv"));
  std::string row;
  double last_time_s = -1.0;
  std::getline(rows, row);
  while (std::getline(rows, row)) {
    const double time_s = std::stod(row);
    CHECK(time_s > last_time_s);
    last_time_s = time_s;
  }
}

TEST_CASE("an interrupted run is saved, says so, and can be resumed") {
  const fs::path folder = fresh_folder("interrupted");
  const fs::path room = testing::write_room(folder);
  const volatile std::sig_atomic_t at_once = 1;
  std::ostringstream out, err;
  CHECK(run_program(explore_words(room, folder / "run"), out, err, at_once) == kExitRunFailed);
  CHECK(nlohmann::json::parse(out.str()).at("stop_reason") == "interrupted");
  CHECK(fs::exists(folder / "run" / "checkpoint" / "state.json"));
  CHECK(fs::exists(folder / "run" / "report.html"));
  const Outcome resumed = run({"explore", "--resume", (folder / "run").string(), "--json", "--quiet"});
  CAPTURE(resumed.err);
  REQUIRE(resumed.code == 0);
  CHECK(nlohmann::json::parse(resumed.out).at("stop_reason") != "interrupted");
}

TEST_CASE("a damaged checkpoint is refused in one line") {
  const fs::path folder = fresh_folder("damaged");
  const fs::path room = testing::write_room(folder);
  const fs::path killed = folder / "run";
  signal_after_checkpoint(start_process(explore_words(room, killed)), killed, SIGINT, 20);
  REQUIRE(CheckpointFolder(killed).exists());
  const std::string good = read_text(killed / "checkpoint" / "state.json");
  const auto refused = [&] {
    const Outcome outcome = run({"explore", "--resume", killed.string(), "--quiet"});
    CAPTURE(outcome.err);
    CHECK(outcome.code == kExitBadInput);
    CHECK_THAT(outcome.err, Contains("checkpoint"));
    CHECK(std::ranges::count(outcome.err, '\n') == 1);
  };
  testing::write_text(killed / "checkpoint" / "state.json", good.substr(0, good.size() / 2));
  refused();
  testing::write_text(killed / "checkpoint" / "state.json", "{}");
  refused();
  testing::write_text(killed / "checkpoint" / "state.json", good);
  const fs::path map = killed / "checkpoint" / nlohmann::json::parse(good).at("maps").at(0).get<std::string>();
  const std::string bytes = read_text(map);
  testing::write_text(map, bytes.substr(0, bytes.size() / 2));
  refused();
  std::string changed = bytes;
  changed[bytes.size() - 2] = static_cast<char>(changed[bytes.size() - 2] ^ 1);  // well formed, and not what was saved
  testing::write_text(map, changed);
  refused();
  fs::remove(map);
  refused();
}

TEST_CASE("a disk that fills up is a failed run, named in one line, and the checkpoint before it survives") {
  const fs::path folder = fresh_folder("full_disk");
  const fs::path room = testing::write_room(folder);
  Outcome outcome;
  {
    const FileSizeLimit limit(20'000);
    outcome = run(explore_words(room, folder / "run"));
  }
  CAPTURE(outcome.err);
  CHECK(outcome.code == kExitRunFailed);
  CHECK(outcome.out.empty());
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK_THAT(outcome.err, Contains((folder / "run").string()));
  CHECK_FALSE(fs::exists(folder / "run" / "metrics.json"));
  const Outcome resumed = run({"explore", "--resume", (folder / "run").string(), "--quiet"});
  CAPTURE(resumed.err);
  CHECK(resumed.code == 0);
}

TEST_CASE("append files keep what a checkpoint knows of and drop the rest") {
  const fs::path folder = fresh_folder("append");
  {
    AppendFile file(folder / "log", 0);
    file.append("first\n");
    CHECK(file.flush() == 6);
    file.append("second\n");
    file.flush();
  }
  CHECK(read_text(folder / "log.part") == "first\nsecond\n");
  {
    AppendFile file(folder / "log", 6);
    file.append("third\n");
    file.publish();
  }
  CHECK(read_text(folder / "log") == "first\nthird\n");
  CHECK_FALSE(fs::exists(folder / "log.part"));
  {
    AppendFile file(folder / "log", 6);  // published files are taken up again
    file.publish();
  }
  CHECK(read_text(folder / "log") == "first\n");
  CHECK_THROWS_AS(AppendFile(folder / "log", 100), InputError);
  CHECK_THROWS_AS(AppendFile("/proc/none/log", 0), RunError);
  const FileSizeLimit limit(1000);
  AppendFile file(folder / "big", 0);
  file.append(std::string(5000, 'x'));
  CHECK_THROWS_AS(file.flush(), RunError);
}

TEST_CASE("run folders get the next free number") {
  const fs::path before = fs::current_path();
  fs::current_path(fresh_folder("numbers"));
  RunConfig config;
  config.world = "w.sdf";
  CHECK(choose_run_folder(config) == "runs/w-volume-1");
  make_run_folder("runs/w-volume-1");
  CHECK(choose_run_folder(config) == "runs/w-volume-1");
  testing::write_text("runs/w-volume-1/x", "");
  CHECK(choose_run_folder(config) == "runs/w-volume-1-2");
  fs::current_path(before);
}

}  // namespace stairwell::apps
