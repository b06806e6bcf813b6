#include "apps/cli.hpp"
#include "core/version.hpp"
#include "run_words.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace stairwell::apps {

using Catch::Contains;
using testing::fresh_folder;
using testing::Outcome;
using testing::run;
using testing::write_text;

namespace {

/// Exit code 2 and exactly one line that holds the text.
void require_refused(const std::vector<std::string>& words, const std::string& text) {
  const Outcome outcome = run(words);
  CAPTURE(words, outcome.err);
  CHECK(outcome.code == kExitBadInput);
  CHECK(outcome.out.empty());
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK_THAT(outcome.err, Contains(text));
}

}  // namespace

TEST_CASE("help and version") {
  CHECK(run({"--version"}).code == 0);
  CHECK_THAT(run({"--version"}).out, Contains(kVersion));
  using Words = std::vector<std::string>;
  for (const Words& command : {Words{},
                               {"explore"},
                               {"plan"},
                               {"train"},
                               {"evaluate"},
                               {"world"},
                               {"world", "info"},
                               {"world", "convert"},
                               {"world", "generate"},
                               {"map"},
                               {"map", "info"},
                               {"map", "compare"},
                               {"map", "convert"},
                               {"map", "render"},
                               {"report"},
                               {"completion"},
                               {"man"}}) {
    Words words = command;
    words.emplace_back("--help");
    CAPTURE(words);
    const Outcome outcome = run(words);
    CHECK(outcome.code == 0);
    CHECK_THAT(outcome.out, Contains("Example") && Contains("  stairwell "));
  }
  CHECK_THAT(run({"completion"}).out, Contains("complete -o filenames -F _stairwell stairwell"));
}

TEST_CASE("the manual page and the completion know every command and option") {
  const std::string page = run({"man"}).out;
  const std::string completion = run({"completion"}).out;
  CHECK(page.starts_with(".TH STAIRWELL 1"));
  for (const char* section : {".SH NAME", ".SH SYNOPSIS", ".SS stairwell explore", ".SS stairwell map render"})
    CHECK_THAT(page, Contains(section));
  CHECK_THAT(page, Contains("\\fB\\-\\-view\\fR"));
  std::size_t options = 0;
  const std::string begin = "\\-\\-";  // as man(7) wants two hyphens
  for (auto at = page.find(begin); at != std::string::npos; at = page.find(begin, at + 1)) {
    if (at < 3 || (page.substr(at - 3, 3) != "\\fB" && page[at - 1] != ',')) continue;
    std::string name = page.substr(at, page.find("\\fR", at) - at);
    std::erase(name, '\\');
    CAPTURE(name);
    CHECK(completion.find(name) != std::string::npos);
    ++options;
  }
  CHECK(options > 80);
  const std::string zsh = run({"completion", "--shell", "zsh"}).out;
  CHECK(zsh.starts_with("#compdef stairwell\n"));
  CHECK(zsh.find(completion) != std::string::npos);
  require_refused({"completion", "--shell", "fish"}, "fish");
}

TEST_CASE("bad usage is one line and exit code 2") {
  require_refused({}, "subcommand");
  require_refused({"fly"}, "fly");
  require_refused({"explore", "a.sdf", "--nonsense"}, "--nonsense");
  require_refused({"explore"}, "no world given");
  require_refused({"explore", "a.sdf", "--uavs"}, "--uavs");
  require_refused({"map", "info"}, "FILE");
}

TEST_CASE("commands that read clouds as worlds close their gaps, or leave them") {
  const auto folder = fresh_folder("gaps");
  const std::string cloud = write_text(folder / "gap.pcd",
                                       "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\n"
                                       "HEIGHT 1\nPOINTS 2\nDATA ascii\n0.05 0.05 0.05\n0.25 0.05 0.05\n")
                                .string();
  const auto area_m2 = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"world", "info", cloud, "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return nlohmann::json::parse(run(words).out).at("area_m2").get<double>();
  };
  CHECK(area_m2({}) == Approx(0.14));  // three voxels in a row
  CHECK(area_m2({"--close-gaps", "off"}) == Approx(0.12));
  const std::string bt = (folder / "gap.bt").string();
  for (const std::string close_gaps : {"on", "off"}) {
    REQUIRE(run({"world", "convert", cloud, bt, "--close-gaps", close_gaps}).code == 0);
    const auto same =
        nlohmann::json::parse(run({"map", "compare", bt, cloud, "--close-gaps", close_gaps, "--json"}).out);
    CHECK(same.at("correct_fraction") == 1.0);
  }
}

TEST_CASE("bad inputs are named, exit code 2, and leave nothing") {
  const auto folder = fresh_folder("bad_input");
  const std::string room = testing::write_room(folder).string();
  const std::string out = (folder / "out").string();
  const auto explore = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"explore", room, "--out", out, "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  require_refused({"explore", (folder / "no.sdf").string()}, "no.sdf");
  require_refused({"explore", write_text(folder / "empty.sdf", "").string()}, "empty.sdf");
  require_refused({"explore", write_text(folder / "bad.sdf", "<sdf version='1.9'><world").string()}, "bad.sdf");
  require_refused({"explore", write_text(folder / "cut.stl", "solid x\nfacet nor").string()}, "cut.stl");
  require_refused({"explore", write_text(folder / "nan.pcd",
                                         "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\n"
                                         "HEIGHT 1\nPOINTS 1\nDATA ascii\nnan nan nan\n")
                                  .string()},
                  "nan.pcd");
  require_refused(explore({"--uavs", "0"}), "--uavs 0");
  require_refused(explore({"--uavs", "100"}), "--uavs 100");
  require_refused(explore({"--uavs", "-1"}), "--uavs");
  require_refused(explore({"--uavs", "60", "--box", testing::kRoomBox}), "UAVs fit");
  require_refused(explore({"--start", "0,0,1"}), "--start 0,0,1");
  require_refused(explore({"--start", "-1.9,0,1"}), "--start -1.9,0,1");
  require_refused(explore({"--start", "9,0,1"}), "outside the box");
  require_refused(explore({"--start", "1,0,1", "--start", "1.3,0,1"}), "another start");
  require_refused(explore({"--start", "1,0"}), "'1,0'");
  require_refused(explore({"--start", "1,0,nan"}), "nan");
  require_refused(explore({"--start", "1,0,1", "--start", "1,1,1", "--uavs", "1"}), "--uavs");
  require_refused(explore({"--box", "0,0,0,0,1,1"}), "no volume");
  require_refused(explore({"--box", "1,1,1,0,0,0"}), "box");
  require_refused(explore({"--box", "0,0,0,1,1"}), "--box");
  require_refused(explore({"--box", "100,100,100,101,101,101"}), "outside");
  require_refused(explore({"--box", "-0.1,-1.4,0.1,0.1,0.2,1.9"}), "free space");
  require_refused(explore({"--mode", "sideways"}), "slice, volume");
  require_refused(explore({"--planner", "magic"}), "astar");
  require_refused(explore({"--coverage", "magic"}), "frontiers");
  require_refused(explore({"--fov-deg", "wide"}), "--fov-deg");
  require_refused(explore({"--fov-deg", "200x50"}), "180");
  require_refused(explore({"--range", "0"}), "range");
  require_refused(explore({"--vmax", "0"}), "speed");
  require_refused(explore({"--resolution", "0"}), "resolution");
  require_refused(explore({"--resolution", "0.0001"}), "--resolution");
  require_refused(explore({"--target-coverage", "2"}), "--target-coverage");
  require_refused(explore({"--time-limit", "-5"}), "time limit");
  require_refused(explore({"--set", "nonsense=1"}), "nonsense");
  require_refused(explore({"--set", "seed"}), "key=value");
  require_refused(explore({"--config", (folder / "no.yaml").string()}), "no.yaml");
  require_refused(explore({"--config", write_text(folder / "b.yaml", "seed: [").string()}), "b.yaml");
  require_refused({"explore", "--resume", out}, "--resume");
  require_refused({"explore", "--resume", folder.string()}, "not a run folder");
  require_refused({"explore", room, "--resume", folder.string()}, "remove");
  CHECK_FALSE(std::filesystem::exists(out));
}

TEST_CASE("an output folder that holds something is refused, an unwritable one is a failed run") {
  const auto folder = fresh_folder("out_folder");
  const std::string room = testing::write_room(folder).string();
  require_refused({"explore", room, "--out", folder.string()}, "not an empty folder");
  const Outcome outcome = run({"explore", room, "--out", "/proc/none/run", "--quiet"});
  CAPTURE(outcome.err);
  CHECK(outcome.code == kExitRunFailed);
  CHECK_THAT(outcome.err, Contains("/proc/none/run"));
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
}

TEST_CASE("world and map commands") {
  const auto folder = fresh_folder("commands");
  const std::string room = testing::write_room(folder).string();
  const auto info = nlohmann::json::parse(run({"world", "info", room, "--json"}).out);
  CHECK(info.at("triangles") == 84);
  CHECK(info.at("min_m").at(0).get<double>() == Approx(-2.2));

  const std::string bt = (folder / "room.bt").string();
  REQUIRE(run({"world", "convert", room, bt, "--resolution", "0.1"}).code == 0);
  REQUIRE(run({"world", "convert", room, (folder / "room.stl").string()}).code == 0);
  const auto map = nlohmann::json::parse(run({"map", "info", bt, "--json"}).out);
  CHECK(map.at("resolution_m").get<double>() == Approx(0.1));
  CHECK(map.at("occupied_volume_m3").get<double>() > 1.0);

  const std::string pcd = (folder / "room.pcd").string();
  REQUIRE(run({"map", "convert", bt, pcd}).code == 0);
  const auto cloud = nlohmann::json::parse(run({"world", "info", pcd, "--json"}).out);
  CHECK(cloud.at("min_m").at(0).get<double>() == Approx(map.at("min_m").at(0).get<double>()).margin(1e-3));

  const auto same = nlohmann::json::parse(run({"map", "compare", bt, bt, "--json"}).out);
  CHECK(same.at("correct_fraction") == 1.0);
  CHECK(same.at("missing_fraction") == 0.0);
  const auto world = nlohmann::json::parse(run({"map", "compare", bt, room, "--json"}).out);
  CHECK(world.at("correct_fraction") == 1.0);
  CHECK(world.at("observed_voxels").get<int>() > 1000);

  const std::string png = (folder / "room.png").string();
  CHECK(run({"map", "render", bt, "--view", "top", "--size", "400x300", "-o", png}).code == 0);
  CHECK(std::filesystem::file_size(png) > 100);
  CHECK(run({"map", "render", room, "--view", "storey:1", "--resolution", "0.2", "-o", png}).code == 0);
  require_refused({"map", "render", room, "--view", "storey:2", "-o", png}, "storey:2: the map has 1 storey");
  require_refused({"map", "render", room, "--view", "attic", "-o", png}, "attic");
  require_refused({"map", "render", (folder / "no.sdf").string(), "-o", png}, "no.sdf");
  const std::string sdf = (folder / "g.sdf").string();
  CHECK(run({"world", "generate", "--storeys", "2", "--seed", "5", "-o", sdf}).code == 0);
  CHECK(run({"world", "generate", "--storeys", "2", "--seed", "5"}).out == testing::read_text(sdf));
}

TEST_CASE("bad maps are named") {
  const auto folder = fresh_folder("bad_maps");
  const std::string empty = write_text(folder / "empty.bt", "").string();
  const std::string text = write_text(folder / "text.ot", "hello\n").string();
  for (const std::string& bad : {empty, text, (folder / "missing.bt").string()}) {
    require_refused({"map", "info", bad}, bad);
    require_refused({"map", "convert", bad, (folder / "o.ot").string()}, bad);
    require_refused({"map", "compare", bad, bad}, bad);
  }
  require_refused({"map", "convert", empty, (folder / "o.xyz").string()}, "o.xyz");
  require_refused({"world", "info", (folder / "a.txt").string()}, "a.txt");
  require_refused({"world", "generate", "--storeys", "0"}, "storeys");
}

}  // namespace stairwell::apps
