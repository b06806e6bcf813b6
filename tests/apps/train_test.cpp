#include "apps/cli.hpp"
#include "core/errors.hpp"
#include "learning/nn/model_file.hpp"
#include "run_words.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace stairwell::apps {

using Catch::Contains;
using testing::fresh_folder;
using testing::Outcome;
using testing::run;

namespace {

namespace fs = std::filesystem;

std::vector<std::string> training(const std::string& algorithm, const fs::path& out,
                                  const std::vector<std::string>& more = {}) {
  std::vector<std::string> words{"train", "path2d",  "--algo", algorithm,   "--steps",
                                 "4",     "--quiet", "--out",  out.string()};
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void require_refused(const std::vector<std::string>& words, const std::string& text) {
  const Outcome outcome = run(words);
  CAPTURE(words, outcome.err);
  CHECK(outcome.code == kExitBadInput);
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK_THAT(outcome.err, Contains(text));
}

}  // namespace

TEST_CASE("a training by trial and error leaves model, curves and checkpoint, and goes on from there") {
  const fs::path folder = fresh_folder("train");
  const fs::path whole = folder / "whole", halted = folder / "halted";
  CHECK(run(training("td3", whole)).code == kExitDone);
  const nn::Model model = nn::read_model(whole / "path2d.model", "path2d");
  CHECK(model.steps == 4);
  CHECK(model.command == "stairwell train path2d --algo td3 --steps 4 --seed 1");
  CHECK_THAT(bytes_of(whole / "curves.csv"), Contains("episode,step,flown_steps,reward,success,loss,value,wall_s"));
  CHECK_THAT(bytes_of(whole / "curves.png"), Contains("PNG"));

  CHECK(run(training("td3", halted), 1).code == kExitRunFailed);  // interrupted before it began
  CHECK(nn::read_model(halted / "path2d.model").steps == 0);
  require_refused(training("td3", halted), "--resume it");
  require_refused(training("sac", halted, {"--resume"}), "checkpoint: of another training");
  CHECK(run(training("td3", halted, {"--resume"})).code == kExitDone);
  CHECK(bytes_of(halted / "path2d.model") == bytes_of(whole / "path2d.model"));

  std::string damaged = bytes_of(halted / "checkpoint");
  damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
  std::ofstream(halted / "checkpoint", std::ios::binary) << damaged;
  require_refused(training("td3", halted, {"--resume"}), "halted/checkpoint: damaged");
  require_refused(training("td3", folder / "nothing", {"--resume"}), "checkpoint: cannot be read");
}

TEST_CASE("a coverage training leaves its agent's model, and refuses what is for path agents") {
  const fs::path folder = fresh_folder("train_coverage");
  const auto words = [&](const fs::path& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> all{"train", "coverage", "--steps", "4", "--quiet", "--out", out.string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  CHECK(run(words(folder / "whole")).code == kExitDone);
  const nn::Model model = nn::read_model(folder / "whole" / "coverage.model", "coverage");
  CHECK(model.steps == 4);
  CHECK(model.command == "stairwell train coverage --algo dqn --steps 4 --seed 1");
  CHECK_THAT(bytes_of(folder / "whole" / "curves.csv"),
             Contains("episode,step,reward,t90_s,finish_s,failures,loss,wall_s"));
  require_refused(words(folder / "whole", {"--resume", "--seed", "2"}), "checkpoint: of another training");
  require_refused(words(folder / "a", {"--algo", "sac"}), "--algo sac: not for coverage");
  require_refused(words(folder / "b", {"--demonstrations", "0.5"}), "--demonstrations");
  require_refused(training("dqn", folder / "c"), "--algo dqn: not for path2d");
}

TEST_CASE("a training starts only from a model that fits") {
  const fs::path folder = fresh_folder("train_from");
  const std::string models = std::string(STAIRWELL_SOURCE_DIR) + "/models/";
  CHECK(run(training("td3bc", folder / "finer", {"--from", models + "path2d.model"})).code == kExitDone);
  require_refused(training("td3bc", folder / "a", {"--from", models + "path3d.model"}), "path3d.model: ");
  require_refused(training("td3bc", folder / "b", {"--from", models + "path2d.model", "--scales", "1"}),
                  "path2d.model: another network");
  require_refused(training("dagger", folder / "c", {"--from", models + "path2d.model"}), "trial and error");
  require_refused(training("ppo", folder / "d"), "ppo");
}

}  // namespace stairwell::apps
