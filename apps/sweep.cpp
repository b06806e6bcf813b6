#include "apps/sweep.hpp"

#include "apps/atomic_file.hpp"
#include "apps/child_process.hpp"
#include "apps/csv_table.hpp"
#include "apps/option_values.hpp"
#include "apps/run_config.hpp"
#include "apps/run_folder.hpp"
#include "core/errors.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <optional>
#include <set>
#include <sstream>
#include <thread>

namespace stairwell::apps {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kMostCounts = 10'000;
constexpr auto kPoll = std::chrono::milliseconds(50);

double clock_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

std::string text_in(const Settings& settings, const char* key) {
  const auto found = settings.find(key);
  return found == settings.end() ? "" : found->second.text;
}

std::vector<std::string> or_base(const std::vector<std::string>& given, const Settings& base, const char* key) {
  return given.empty() ? std::vector<std::string>{text_in(base, key)} : given;
}

/// As many of the starts as there are UAVs.
void limit_starts(Settings& settings, std::uint64_t uavs) {
  const auto starts = settings.find("starts");
  if (starts == settings.end()) return;
  std::istringstream all(starts->second.text);
  std::string kept, one;
  for (std::uint64_t i = 0; i < uavs && std::getline(all, one, ';'); ++i) kept += (kept.empty() ? "" : ";") + one;
  starts->second.text = kept;
}

Settings settings_of(const SweepConfig& config, const SweepRun& run) {
  Settings settings = config.base;
  const auto set = [&](const char* key, const std::string& text, const char* origin) {
    if (!text.empty()) settings[key] = {text, origin};
  };
  set("world", fs::absolute(run.world).lexically_normal().string(), "WORLD");
  set("uavs", std::to_string(run.uavs), "--uavs");
  set("mode", run.mode, "--modes");
  set("planner", run.planner, "--planners");
  set("coverage", run.coverage, "--coverage");
  set("seed", std::to_string(run.seed), "--seeds");
  std::istringstream varied(run.variant);
  for (std::string assignment; varied >> assignment;) add_assignment(settings, assignment);
  limit_starts(settings, run.uavs);
  return settings;
}

/// Checks the run and completes what its settings leave to defaults.
void resolve_run(const SweepConfig& config, SweepRun& run) {
  Settings settings = settings_of(config, run);
  require_usable(resolve(settings));
  run.mode = text_in(settings, "mode");
  run.planner = text_in(settings, "planner");
  run.coverage = text_in(settings, "coverage");
  const std::string world = fs::path(run.world).stem().string();
  const std::string uavs = std::to_string(run.uavs);
  run.name = world + "-" + run.mode + "-" + run.planner + "-" + run.coverage + "-";
  std::istringstream varied(run.variant);
  for (std::string assignment; varied >> assignment;) run.name += assignment + "-";
  run.name += uavs + "-" + std::to_string(run.seed);
  run.folder = config.out / "runs" / run.name;
  if (config.bound) run.bound = config.out / "bounds" / (world + "-" + uavs + ".json");
}

/// Every combination of the varied settings' values, the last one's changing first.
std::vector<std::string> variants_of(const std::vector<VariedSetting>& varied) {
  std::vector<std::string> variants{""};
  for (const VariedSetting& setting : varied) {
    std::vector<std::string> longer;
    for (const std::string& before : variants)
      for (const std::string& value : setting.values)
        longer.push_back(before + (before.empty() ? "" : " ") + setting.key + "=" + value);
    variants = std::move(longer);
  }
  return variants;
}

void check_worlds(const std::vector<std::string>& worlds) {
  if (worlds.empty()) throw InputError("no world given: name at least one world file");
  std::set<std::string> stems;
  for (const std::string& world : worlds) {
    std::error_code ignored;
    if (!fs::exists(world, ignored)) throw InputError(world + ": no such world file");
    if (!stems.insert(fs::path(world).stem().string()).second)
      throw InputError(world + ": another world of the sweep has the same name: rename one, or compare them apart");
  }
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw RunError(folder.string() + ": cannot be made: " + error.message());
}

/// The settings that a run or reference was made with must be the ones wanted now.
void keep_settings(const fs::path& file, const Settings& settings) {
  const std::string text = to_yaml(settings, "settings of this part of a comparison");
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    write_file_atomically(file, text);
  } else if (read_whole_file(file) != text) {
    throw InputError(file.string() + ": was made with other options: give the same ones, or another --out");
  }
}

std::string last_line(const fs::path& log) {
  std::error_code ignored;
  if (!fs::is_regular_file(log, ignored)) return log.string() + " cannot be written";
  if (fs::file_size(log, ignored) == 0) return "no message";
  std::istringstream lines(read_whole_file(log));
  std::string last, line;
  while (std::getline(lines, line))
    if (!line.empty()) last = line;
  return last;
}

/// One process to be run.
struct Task {
  std::string name;
  std::vector<std::string> words;  ///< of the program
  fs::path log;
  fs::path output;  ///< what it prints becomes this file when it succeeds; empty: nothing
};

class Sweep {
 public:
  Sweep(const SweepConfig& config, Progress::Style style) : config_(config), progress_(style) {}

  void add(const SweepRun& run) {
    if (!run.bound.empty() && bounds_.insert(run.bound).second) add_bound(run);
    const fs::path settings_file = run.folder.string() + ".yaml";
    keep_settings(settings_file, settings_of(config_, run));
    if (is_complete(run.folder)) return;
    std::error_code error;
    fs::remove_all(run.folder, error);  // a run that was killed
    if (error) throw RunError(run.folder.string() + ": cannot be removed: " + error.message());
    tasks_.push_back({run.name,
                      {"explore", "--config", settings_file.string(), "--out", run.folder.string(), "--quiet"},
                      run.folder.string() + ".log",
                      {}});
  }

  SweepResult work(const volatile std::sig_atomic_t& interrupted) {
    const std::size_t all = tasks_.size();
    if (all > 0) progress_.note(std::to_string(all) + " processes to run in " + config_.out.string());
    const double begin_s = clock_s();
    std::size_t done = 0;
    while (!tasks_.empty() || !running_.empty()) {
      if (interrupted != 0 && !result_.interrupted) stop();
      while (!tasks_.empty() && running_.size() < config_.jobs) start();
      std::this_thread::sleep_for(kPoll);
      if (!collect()) continue;
      ++done;
      const double left_s = (clock_s() - begin_s) / static_cast<double>(done) * static_cast<double>(all - done);
      char text[160];
      std::snprintf(text, sizeof text, "%zu of %zu done, %zu failed, about %.0f min left", done, all,
                    result_.failed.size(), left_s / 60.0);
      progress_.note(text);
    }
    return result_;
  }

 private:
  struct Running {
    Task task;
    ChildProcess process;
  };

  void add_bound(const SweepRun& run) {
    SweepRun any = run;
    any.mode = any.planner = any.coverage = any.variant = "";
    any.seed = 1;
    fs::path settings_file = run.bound;
    settings_file.replace_extension(".yaml");
    Settings settings = settings_of(config_, any);
    for (const char* key : {"mode", "planner", "coverage"}) settings.erase(key);
    keep_settings(settings_file, settings);
    std::error_code ignored;
    if (fs::exists(run.bound, ignored)) return;
    fs::path log = run.bound;
    log.replace_extension(".log");
    const std::string name = "bound of " + run.bound.stem().string();
    tasks_.push_front({name, {"bound", "--config", settings_file.string(), "--json"}, log, run.bound});
  }

  void start() {
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    const fs::path output = task.output.empty() ? fs::path("/dev/null") : fs::path(task.output.string() + ".part");
    ChildProcess process(config_.program, task.words, output, task.log);
    running_.push_back({std::move(task), std::move(process)});
  }

  void stop() {
    result_.interrupted = true;
    tasks_.clear();
    for (const Running& one : running_) one.process.interrupt();
  }

  /// Takes one process that has ended off the list.
  bool collect() {
    for (auto one = running_.begin(); one != running_.end(); ++one) {
      const std::optional<int> code = one->process.exit_code();
      if (!code) continue;
      const Task& task = one->task;
      if (*code == 0 && !task.output.empty()) fs::rename(task.output.string() + ".part", task.output);
      if (*code != 0 && !result_.interrupted) {
        result_.failed.push_back(task.name + ": " + last_line(task.log));
        progress_.note("failed: " + result_.failed.back());
      }
      running_.erase(one);
      return true;
    }
    return false;
  }

  const SweepConfig& config_;
  Progress progress_;
  std::set<fs::path> bounds_;
  std::deque<Task> tasks_;
  std::vector<Running> running_;
  SweepResult result_;
};

}  // namespace

std::vector<std::uint64_t> parse_counts(std::string_view text) {
  std::vector<std::uint64_t> counts;
  for (const std::string& part : parse_words(text)) {
    const std::size_t dots = part.find("..");
    const std::uint64_t first = parse_count(part.substr(0, dots));
    const std::uint64_t last = dots == std::string::npos ? first : parse_count(part.substr(dots + 2));
    if (last < first) throw InputError("'" + part + "' counts backwards");
    if (last - first >= kMostCounts) throw InputError("'" + part + "' are too many");
    for (std::uint64_t i = first; i <= last; ++i)
      if (std::ranges::find(counts, i) == counts.end()) counts.push_back(i);
  }
  return counts;
}

std::vector<std::string> parse_words(std::string_view text) {
  std::vector<std::string> words;
  for (std::string_view rest = text;;) {
    const std::size_t comma = rest.find(',');
    words.emplace_back(rest.substr(0, comma));
    if (words.back().empty())
      throw InputError("'" + std::string(text) + "' is not a list of values with commas between");
    if (comma == std::string_view::npos) return words;
    rest.remove_prefix(comma + 1);
  }
}

VariedSetting parse_varied(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos) throw InputError("'" + std::string(text) + "' is not KEY=VALUE,VALUE..");
  const std::string_view key = text.substr(0, equals);
  if (!is_setting_key(key) || key == "world" || key == "uavs" || key == "seed" || key == "mode" || key == "planner" ||
      key == "coverage")
    throw InputError("'" + std::string(key) + "' cannot be varied: give a key of config.yaml without an option here");
  for (const char c : text.substr(equals + 1))
    if (c == ' ' || c == '/') throw InputError("'" + std::string(text) + "': values hold neither blanks nor slashes");
  return {std::string(key), parse_words(text.substr(equals + 1))};
}

std::vector<SweepRun> plan_sweep(const SweepConfig& config) {
  check_worlds(config.worlds);
  if (config.seeds.empty()) throw InputError("--seeds is empty: give at least one, as in --seeds 1..10");
  if (config.uavs.empty()) throw InputError("--uavs is empty: give at least one number, as in --uavs 1,2,4");
  if (config.jobs < 1) throw InputError("--jobs must be at least 1");
  std::vector<SweepRun> runs;
  std::set<std::string> names;
  for (const std::uint64_t seed : config.seeds)
    for (const std::string& world : config.worlds)
      for (const std::uint64_t uavs : config.uavs)
        for (const std::string& mode : or_base(config.modes, config.base, "mode"))
          for (const std::string& planner : or_base(config.planners, config.base, "planner"))
            for (const std::string& coverage : or_base(config.coverages, config.base, "coverage"))
              for (const std::string& variant : variants_of(config.varied)) {
                SweepRun run{world, mode, planner, coverage, uavs, seed, variant, {}, {}, {}};
                resolve_run(config, run);
                if (names.insert(run.name).second) runs.push_back(std::move(run));
              }
  return runs;
}

SweepResult run_sweep(const SweepConfig& config, const std::vector<SweepRun>& runs, Progress::Style progress,
                      const volatile std::sig_atomic_t& interrupted) {
  make_folder(config.out / "runs");
  if (config.bound) make_folder(config.out / "bounds");
  Sweep sweep(config, progress);
  for (const SweepRun& run : runs) sweep.add(run);
  return sweep.work(interrupted);
}

}  // namespace stairwell::apps
