/// Statistics of a sweep, and whole sweeps of the program on a small room.
#include "apps/child_process.hpp"
#include "apps/cli.hpp"
#include "apps/comparison.hpp"
#include "apps/run_folder.hpp"
#include "apps/statistics.hpp"
#include "apps/sweep.hpp"
#include "core/errors.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>
#include <thread>

namespace stairwell::apps {

using Catch::Contains;
using testing::fresh_folder;
using testing::read_text;
using testing::write_text;
namespace fs = std::filesystem;

namespace {

using Words = std::vector<std::string>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Outcome {
  int code;
  std::string out, err;
};

/// The program as a process of its own: a sweep starts itself again.
Outcome run(const Words& words, const fs::path& folder) {
  ChildProcess process(STAIRWELL_PROGRAM, words, folder / "out.txt", folder / "err.txt");
  while (!process.exit_code()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return {*process.exit_code(), read_text(folder / "out.txt"), read_text(folder / "err.txt")};
}

Words sweep_words(const fs::path& room, const fs::path& out, const Words& more) {
  Words words{"compare",
              room.string(),
              "--box",
              testing::kRoomBox,
              "--start=-1.2,0,1",
              "--start=1.2,-0.5,0,90",
              "--charge-planning",
              "off",
              "--resolution",
              "0.2",
              "--rays",
              "48x36",
              "--time-limit",
              "40",
              "--out",
              out.string(),
              "--json"};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// A finished run with these numbers, without flying it.
SweepRun fake_run(const fs::path& folder, const std::string& coverage, std::uint64_t seed, double finish_s) {
  SweepRun run;
  run.world = "somewhere/hall.sdf";
  run.mode = "volume";
  run.planner = "astar";
  run.coverage = coverage;
  run.seed = seed;
  run.name = "hall-volume-astar-" + coverage + "-1-" + std::to_string(seed);
  run.folder = folder / run.name;
  run.bound = folder / "hall-1.json";
  fs::create_directories(run.folder);
  nlohmann::json metrics{{"world", "hall"},      {"seed", seed},
                         {"finish_s", finish_s}, {"path_length_m", 3.0 * finish_s},
                         {"t99_s", nullptr},     {"plan_ms", {{"p50", 2.0}, {"p99", finish_s}}}};
  write_text(run.folder / "metrics.json", metrics.dump());
  write_text(run.folder / "steps.csv", "time_s,coverage\n0,0\n1,0.5\n2,1\n");
  write_text(run.folder / "trajectories.csv", "time_s,uav,x_m,y_m,z_m\n0,0,0,0,0\n0.1,0,0,0,0.2\n0.2,0,0,0,0.4\n");
  write_text(run.bound, R"({"finish_s": 20.0})");
  return run;
}

}  // namespace

TEST_CASE("the bootstrap's interval has the textbook's properties") {
  const Estimate one = estimate({4.0}, Rng(1));
  CHECK(one.mean == 4.0);
  CHECK(std::isnan(one.sd));
  CHECK(one.low == 4.0);
  CHECK(std::isnan(estimate({}, Rng(1)).mean));
  CHECK(std::isnan(estimate({1.0, kNan}, Rng(1)).mean));
  const Estimate same = estimate({2.5, 2.5, 2.5}, Rng(1));
  CHECK(same.sd == 0.0);
  CHECK(same.low == 2.5);
  CHECK(same.high == 2.5);
  // Two values: a resample's mean is 0, 1 or 2 with 1/4, 1/2, 1/4; beyond 2.5 % lie the extremes.
  const Estimate two = estimate({0.0, 2.0}, Rng(1));
  CHECK(two.mean == 1.0);
  CHECK(two.sd == Approx(std::sqrt(2.0)));
  CHECK(two.low == 0.0);
  CHECK(two.high == 2.0);
  Rng rng(3);
  std::vector<double> values;
  for (int i = 0; i < 400; ++i) values.push_back(rng.normal(10.0, 2.0));
  const Estimate many = estimate(values, Rng(1));
  const double half = 1.96 * many.sd / std::sqrt(400.0);  // where the normal approximation holds
  CHECK(many.low == Approx(many.mean - half).margin(0.02));
  CHECK(many.high == Approx(many.mean + half).margin(0.02));
  const Estimate again = estimate(values, Rng(1));
  CHECK(again.low == many.low);
  CHECK(estimate(values, Rng(2)).low != many.low);
}

TEST_CASE("the interval holds the true mean about as often as it says") {
  Rng rng(11);
  int held = 0;
  for (int round = 0; round < 200; ++round) {
    std::vector<double> values;
    for (int i = 0; i < 30; ++i) values.push_back(rng.normal(5.0, 1.0));
    const Estimate e = estimate(values, make_rng(static_cast<std::uint64_t>(round), "test"));
    held += e.low <= 5.0 && e.high >= 5.0 ? 1 : 0;
  }
  CHECK(held >= 178);  // 190 expected, a little fewer for 30 values; sd 3
  CHECK(held <= 198);
}

TEST_CASE("pairs tell what the means do not") {
  // Seeds differ by far more than the two ways do, but the second is always 1 s slower.
  const std::vector<double> first{10, 50, 90, 130, 170};
  std::vector<double> second;
  for (const double v : first) second.push_back(v + (v < 60 ? 0.9 : 1.1));
  const PairedDifference paired = compare_pairs(first, second, Rng(1));
  CHECK(paired.verdict == Difference::kSignificant);
  CHECK(paired.difference.mean == Approx(1.02));
  std::vector<double> shuffled{second[1], second[2], second[3], second[4], second[0]};
  CHECK(compare_pairs(first, shuffled, Rng(1)).verdict == Difference::kNotSignificant);
  CHECK(compare_pairs(first, first, Rng(1)).verdict == Difference::kSame);
  CHECK(compare_pairs({1, 2, 3}, {2, 3, 4}, Rng(1)).verdict == Difference::kTooFew);
  CHECK(compare_pairs({1, 2, kNan, 4}, {2, 3, 4, 5}, Rng(1)).verdict == Difference::kTooFew);  // three are left
}

TEST_CASE("rows, ratios and differences of finished runs") {
  const fs::path folder = fresh_folder("fake_sweep");
  std::vector<SweepRun> runs;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    runs.push_back(fake_run(folder, "frontiers", seed, 20.0 + static_cast<double>(seed)));
    runs.push_back(fake_run(folder, "nearest", seed, 30.0 + 2.0 * static_cast<double>(seed)));
  }
  runs.push_back(fake_run(folder, "nearest", 6, 100.0));
  runs.push_back(runs.front());
  runs.back().folder = folder / "never-run";
  runs.back().name = "never-run";
  const Comparison comparison = read_comparison(runs);
  REQUIRE(comparison.rows.size() == 2);
  CHECK(comparison.missing == std::vector<std::string>{"never-run"});
  const ComparisonRow& frontiers = comparison.rows[0];
  CHECK(frontiers.estimates.at("finish_s").mean == Approx(23.0));
  CHECK(frontiers.estimates.at("finish_s").sd == Approx(std::sqrt(2.5)));
  CHECK(frontiers.estimates.at("finish_over_bound").mean == Approx(23.0 / 20.0));
  CHECK(std::isnan(frontiers.estimates.at("t99_s").mean));
  CHECK(frontiers.estimates.at("energy_hover_s").mean == Approx(0.2));  // straight up at constant speed
  const auto finish = std::find_if(comparison.differences.begin(), comparison.differences.end(),
                                   [](const ComparisonDifference& d) { return d.metric == "finish_s"; });
  REQUIRE(finish != comparison.differences.end());
  CHECK(finish->pairs == 5);  // seed 6 has no partner
  CHECK(finish->found.difference.mean == Approx(13.0));
  CHECK(finish->found.verdict == Difference::kSignificant);

  const auto json = nlohmann::json::parse(comparison_json(comparison));
  REQUIRE(json.size() == 2);
  CHECK(json[0]["seeds"] == nlohmann::json({1, 2, 3, 4, 5}));
  std::string keys;
  for (const auto& [key, value] : json[0].items()) keys += key + " ";
  CHECK(keys ==
        "coverage_strategy distinct_runs energy_hover_s finish_over_bound finish_s mode path_length_m plan_ms "
        "planner seeds t99_over_bound t99_s uavs world ");
  for (const char* key : {"finish_s", "path_length_m", "energy_hover_s", "finish_over_bound"}) {
    CHECK(json[0][key].size() == 3);
    CHECK(json[0][key]["mean"].is_number());
    CHECK(json[0][key]["sd"].is_number());
    CHECK(json[0][key]["ci95"].size() == 2);
  }
  CHECK(json[0]["plan_ms"]["p50"]["mean"] == 2.0);
  CHECK(json[0]["t99_s"]["mean"].is_null());
  const std::string csv = comparison_csv(comparison);
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 3);
  const std::string lines = runs_csv(comparison);
  CHECK(std::count(lines.begin(), lines.end(), '\n') == 12);
  CHECK_THAT(comparison_markdown(comparison), Contains("significant") && Contains("never-run"));
  const std::string page = comparison_page(comparison);
  CHECK_THAT(page, Contains("</html>") && Contains("class=\"band s0\"") && Contains("never-run"));
  CHECK_THAT(page, !Contains("http://") && !Contains("nan"));

  write_text(runs[0].folder / "metrics.json", "{broken");
  CHECK_THROWS_WITH(read_comparison(runs), Contains("metrics.json"));
}

TEST_CASE("runs that no seed changes are not called significant") {
  const fs::path folder = fresh_folder("repeated_sweep");
  std::vector<SweepRun> runs;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    runs.push_back(fake_run(folder, "frontiers", seed, 20.0));
    runs.push_back(fake_run(folder, "nearest", seed, 30.0));
  }
  const Comparison comparison = read_comparison(runs);
  CHECK(comparison.rows[0].distinct == 1);
  for (const ComparisonDifference& d : comparison.differences) CHECK(d.found.verdict != Difference::kSignificant);
}

TEST_CASE("lists of counts and words") {
  CHECK(parse_counts("1..4") == std::vector<std::uint64_t>{1, 2, 3, 4});
  CHECK(parse_counts("7,1..3,2") == std::vector<std::uint64_t>{7, 1, 2, 3});
  CHECK(parse_words("a,b") == Words{"a", "b"});
  for (const char* bad : {"", ",", "1,", "4..1", "a", "1..", "..3", "-1", "1...3", "0..99999999999"}) {
    INFO(bad);
    CHECK_THROWS_AS(parse_counts(bad), InputError);
  }
}

TEST_CASE("what is varied is run in every combination and compared") {
  const fs::path folder = fresh_folder("varied_sweep");
  SweepConfig config;
  config.worlds = {testing::write_room(folder).string()};
  config.seeds = {1, 2};
  config.uavs = {1};
  config.coverages = {"frontiers", "nearest"};
  config.out = folder / "sweep";
  config.varied = {parse_varied("gain=volume,entropy"), parse_varied("limits_norm=euclidean,per-axis")};
  const std::vector<SweepRun> runs = plan_sweep(config);
  REQUIRE(runs.size() == 16);
  CHECK(runs[0].name == "room-volume-astar-frontiers-gain=volume-limits_norm=euclidean-1-1");
  CHECK(runs[1].variant == "gain=volume limits_norm=per-axis");
  CHECK(runs[2].variant == "gain=entropy limits_norm=euclidean");
  for (const char* bad : {"gain", "gain=", "gain=a,,b", "gains=1", "seed=1,2", "coverage=nearest", "gain=a b", "=1"}) {
    INFO(bad);
    CHECK_THROWS_AS(parse_varied(bad), InputError);
  }
  config.varied = {parse_varied("gain=volume,charm")};
  CHECK_THROWS_WITH(plan_sweep(config), Contains("charm"));

  std::vector<SweepRun> flown;
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    for (const char* variant : {"gain=volume", "gain=entropy"}) {
      const bool entropy = std::string(variant) == "gain=entropy";
      flown.push_back(
          fake_run(folder / variant, "frontiers", seed, (entropy ? 30.0 : 20.0) + static_cast<double>(seed)));
      flown.back().variant = variant;
    }
  const Comparison comparison = read_comparison(flown);
  REQUIRE(comparison.rows.size() == 2);
  CHECK(comparison.differences.front().pairs == 5);
  CHECK(nlohmann::json::parse(comparison_json(comparison))[1]["variant"] == "gain=entropy");
  CHECK_THAT(comparison_markdown(comparison), Contains("frontiers gain=entropy"));
  CHECK_THAT(runs_csv(comparison), Contains("frontiers,gain=entropy,1,"));
}

TEST_CASE("a sweep refuses what cannot be run before anything runs") {
  const fs::path folder = fresh_folder("bad_sweep");
  const fs::path room = testing::write_room(folder);
  const fs::path out = folder / "sweep";
  const auto refused = [&](const Words& more, const char* message) {
    const Outcome outcome = run(sweep_words(room, out, more), folder);
    INFO(outcome.err);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Contains(message));
    CHECK(outcome.out.empty());
    CHECK_FALSE(fs::exists(out));
  };
  refused({"--uavs", "0"}, "--uavs 0");
  refused({"--uavs", "1,,2"}, "--uavs");
  refused({"--seeds", ""}, "--seeds");
  refused({"--seeds", "5..1"}, "--seeds");
  refused({"--jobs", "0"}, "--jobs");
  refused({"--modes", "volume,sliced"}, "sliced");
  refused({"--planners", "astar,bird"}, "bird");
  refused({"--coverage", "frontiers,psychic"}, "psychic");
  refused({"--bound", "maybe"}, "--bound");
  refused({(folder / "nowhere.sdf").string()}, "nowhere.sdf");
  refused({room.string()}, "same name");
  write_text(folder / "file", "not a folder");
  const Outcome outcome = run(sweep_words(room, folder / "file" / "sweep", {"--seeds", "1"}), folder);
  CHECK(outcome.code == 1);
  CHECK_THAT(outcome.err, Contains("cannot be made"));
}

TEST_CASE("a sweep goes on where it stopped, names what failed and compares the rest") {
  const fs::path folder = fresh_folder("sweep");
  const fs::path room = testing::write_room(folder);
  const fs::path out = folder / "sweep";
  const Words words = sweep_words(
      room, out,
      {"--coverage", "frontiers,nearest", "--seeds", "1", "--uavs", "2", "--bound", "off", "--jobs", "2", "--quiet"});
  const Outcome first = run(words, folder);
  CAPTURE(first.err);
  REQUIRE(first.code == 0);
  CHECK(first.err.empty());
  CHECK(first.out == read_text(out / "comparison.json"));
  REQUIRE(nlohmann::json::parse(first.out).size() == 2);
  for (const char* name : {"comparison.csv", "comparison.md", "comparison.html", "runs.csv"})
    CHECK(fs::exists(out / name));

  // A run that was killed is done again, a finished one is not.
  const fs::path done = out / "runs" / "room-volume-astar-frontiers-2-1";
  const fs::path killed = out / "runs" / "room-volume-astar-nearest-2-1";
  REQUIRE(is_complete(done));
  const auto before = fs::last_write_time(done / "metrics.json");
  fs::remove(killed / "metrics.json");
  REQUIRE(run(words, folder).code == 0);
  CHECK(fs::last_write_time(done / "metrics.json") == before);
  CHECK(is_complete(killed));

  // With other options the folder's runs are not what was asked for.
  Words other = words;
  other.insert(other.end(), {"--vmax", "1"});
  const Outcome refused = run(other, folder);
  CHECK(refused.code == 2);
  CHECK_THAT(refused.err, Contains("other options"));

  // The second seed cannot be run: its folder is taken by a file.
  Words more = words;
  more[static_cast<std::size_t>(std::find(more.begin(), more.end(), "--seeds") - more.begin()) + 1] = "1,2";
  fs::create_directories(out / "runs" / "room-volume-astar-nearest-2-2.log");
  const Outcome failed = run(more, folder);
  CHECK(failed.code == 1);
  CHECK_THAT(failed.err, Contains("room-volume-astar-nearest-2-2"));
  CHECK(nlohmann::json::parse(failed.out)[0]["seeds"] == nlohmann::json({1, 2}));
  CHECK_THAT(read_text(out / "comparison.md"), Contains("room-volume-astar-nearest-2-2"));
}

TEST_CASE("no fleet that has to find out is quicker than the reference") {
  const fs::path folder = fresh_folder("bound");
  const fs::path room = testing::write_room(folder);
  const Outcome known = run({"bound", room.string(), "--box", testing::kRoomBox, "--start=-1.2,0,1", "--rays", "64x48",
                             "--rounds", "3", "--json"},
                            folder);
  CAPTURE(known.err);
  REQUIRE(known.code == 0);
  CHECK_THAT(known.err, Contains("round 3 of 3"));
  const Outcome explored = run(
      {"explore", room.string(), "--box", testing::kRoomBox, "--start=-1.2,0,1", "--charge-planning", "off", "--rays",
       "64x48", "--target-coverage", "0.99", "--quiet", "--out", (folder / "explored").string(), "--json"},
      folder);
  REQUIRE(explored.code == 0);
  CHECK(nlohmann::json::parse(known.out)["finish_s"].get<double>() <
        nlohmann::json::parse(explored.out)["t99_s"].get<double>());
}

}  // namespace stairwell::apps
