#include "learning/nn/model_file.hpp"

#include "core/errors.hpp"
#include "learning/random_network.hpp"
#include "tests/test_folder.hpp"

#include <catch2/catch.hpp>

#include <fstream>
#include <string>

using namespace stairwell;
using namespace stairwell::nn;
using Catch::Contains;

namespace {

std::filesystem::path written(const std::string& bytes) {
  const auto file = testing::test_folder() / "some.model";
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return file;
}

Model some_model() {
  Model model = testing::random_agent(planning3d::AgentInput::slice());
  model.command = "stairwell train path2d --seed 5";
  model.seed = 5;
  model.steps = 77;
  return model;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace

TEST_CASE("a model comes back from its file", "[model]") {
  const Model model = some_model();
  const Model read = read_model(written(model_bytes(model)), "path2d");
  CHECK(read.agent == model.agent);
  CHECK(read.input == model.input);
  CHECK(read.network == model.network);
  CHECK(read.command == model.command);
  CHECK(read.seed == 5);
  CHECK(read.steps == 77);
  CHECK(read.parameters == model.parameters);
}

TEST_CASE("wrong model files are refused by name and reason", "[model]") {
  const std::string good = model_bytes(some_model());
  const auto refused = [](const std::string& bytes, const std::string& why) {
    CHECK_THROWS_WITH(read_model(written(bytes)), Contains("some.model") && Contains(why));
  };
  refused("", "not a model");
  refused("PNG....", "not a model");
  refused(replaced(good, "stairwell-model 1", "stairwell-model 2"), "format");
  refused(good.substr(0, good.find("steps:")), "truncated header");
  refused(good.substr(0, good.size() - 5), "truncated");
  refused(good + "x", "too long");
  std::string damaged = good;
  damaged[damaged.size() - 100] = static_cast<char>(damaged[damaged.size() - 100] ^ 16);
  refused(damaged, "damaged");
  refused(replaced(good, "hidden 16", "hidden 17"), "do not fit");
  refused(replaced(good, "commit: none\n", ""), "'commit'");
  refused(replaced(good, "seed: 5", "seed: five"), "not a number");
  refused(replaced(good, "seed: 5", "seed 5"), "damaged header");
  CHECK_THROWS_WITH(read_model(written(good), "path3d"), Contains("some.model") && Contains("path3d"));
  CHECK_THROWS_WITH(read_model(testing::test_folder() / "absent.model"), Contains("absent.model"));
}

TEST_CASE("every truncation of a model is refused", "[model]") {
  const std::string good = model_bytes(some_model());
  const std::size_t header = good.find("\nend\n") + 5;
  for (std::size_t length = 0; length < header + 16; ++length) {
    CHECK_THROWS_AS(read_model(written(good.substr(0, length))), InputError);
  }
}

TEST_CASE("the hash is FNV-1a", "[model]") {
  CHECK(fnv1a64("") == 0xcbf29ce484222325ULL);
  CHECK(fnv1a64("foobar") == 0x85944171f73967e8ULL);
}
