/// The learned agent: what it is told of its options, and that it does what its network chooses.
#include "core/errors.hpp"
#include "core/units.hpp"
#include "coverage3d/agent_strategy.hpp"
#include "half_seen.hpp"
#include "learning/nn/model_file.hpp"
#include "tests/test_folder.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;
using toy::HalfSeen;
namespace fs = std::filesystem;

constexpr auto kWidth = static_cast<std::size_t>(kOptionFeatures);

std::vector<float> row_of(const std::vector<float>& rows, std::size_t option) {
  const auto begin = rows.begin() + static_cast<std::ptrdiff_t>(option * kWidth);
  return {begin, begin + kOptionFeatures};
}

/// A UAV that flies along x at full speed; what is near lies ahead, the rich option a storey higher behind it.
struct HandMade {
  OptionScene scene;
  std::vector<CoverageOption> options;

  HandMade() {
    scene.position_m = {1.0, 0.0, 1.0};
    scene.velocity_mps = {2.0, 0.0, 0.0};
    scene.speed_mps = 2.0;
    scene.known_share = 0.25;
    CoverageOption near, rich;
    near.position_m = {3.0, 0.0, 1.0};
    near.time_s = 1.0;
    near.way_m = 2.0;
    near.tour_s = 9.0;
    near.gain_m3 = 2.0;
    near.area_m2 = 0.6;
    near.seen_fraction = 0.5;
    near.pocket_m3 = 0.2;
    rich.position_m = {-3.0, 0.0, 4.0};
    rich.yaw_rad = kPi;
    rich.time_s = 8.0;
    rich.way_m = 10.0;
    rich.tour_s = 14.0;
    rich.gain_m3 = 20.0;
    rich.area_m2 = 3.0;
    rich.seen_fraction = 1.0;
    rich.pocket_m3 = 1.0;
    rich.pressing = true;
    options = {near, rich};
  }
};

nn::Model tiny_model() {
  nn::Model model;
  model.agent = "coverage";
  model.input = std::string(kOptionInput);
  model.network.features = kOptionFeatures;
  model.parameters.assign(model.network.parameter_count(), 0.0F);
  model.parameters[0] = -1.0F;  // the nearest
  return model;
}

fs::path folder_with(const std::string& name, const std::string& bytes) {
  const fs::path folder = testing::test_folder() / name;
  fs::create_directories(folder);
  std::ofstream(folder / "coverage.model", std::ios::binary) << bytes;
  return folder;
}

}  // namespace

TEST_CASE("an option's row says what it is, how it compares, and what is around it") {
  const HandMade made;
  const std::vector<float> rows = option_rows(made.scene, made.options);
  REQUIRE(rows.size() == 2 * kWidth);
  const float straight = std::sqrt(4.0F * 4.0F + 3.0F * 3.0F);
  const std::vector<float> near{
      // itself: time, way, detour, gain, rate, frontier, of it seen, share seen, pocket, pressing, up, same storey,
      // ahead,
      // speed, facing
      0.1F, 0.2F, 0.0F, 0.2F, 0.2F, 0.2F, 0.1F, 0.5F, 0.2F, 0.0F, 0.0F, 1.0F, 1.0F, 1.0F, 1.0F,
      // compared: later than the soonest, how many are sooner, richer, gain and rate of the best, tour, shortest tour,
      // off the middle, how many options, pressing ones, frontier
      0.0F, 0.0F, 0.5F, 0.1F, 0.8F, 0.0F, 0.09F, std::sqrt(9.0F + 2.25F) / 10.0F, 2.0F / 12.0F, 1.0F / 12.0F, 0.12F,
      // around it in 3, 6, 12 m; around the UAV in 3 m; left behind; alone
      0.0F, 0.0F, 1.0F / 3.0F, 0.0F, 1.0F / 3.0F, std::sqrt(36.0F + 9.0F) / 10.0F,
      // fellows: their goals, their times, how many; known
      3.0F, 3.0F, 0.0F, 0.25F};
  const std::vector<float> rich{0.8F,
                                1.0F,
                                10.0F / straight - 1.0F,
                                2.0F,
                                0.25F,
                                1.0F,
                                1.0F,
                                1.0F,
                                1.0F,
                                1.0F,
                                1.0F,
                                0.0F,
                                -4.0F / straight,
                                1.0F,
                                -1.0F,
                                0.7F,
                                0.5F,
                                0.0F,
                                1.0F,
                                1.0F,
                                0.5F,
                                0.09F,
                                std::sqrt(9.0F + 2.25F) / 10.0F,
                                2.0F / 12.0F,
                                1.0F / 12.0F,
                                0.12F,
                                0.0F,
                                0.0F,
                                0.6F / 9.0F,
                                0.6F / 9.0F,
                                0.6F / 9.0F,
                                std::sqrt(36.0F + 9.0F) / 10.0F,
                                3.0F,
                                3.0F,
                                0.0F,
                                0.25F};
  for (std::size_t i = 0; i < kWidth; ++i) {
    CAPTURE(i);
    CHECK(row_of(rows, 0)[i] == Approx(near.at(i)).margin(1e-6));
    CHECK(row_of(rows, 1)[i] == Approx(rich.at(i)).margin(1e-6));
  }
}

TEST_CASE("fellows show in the rows, and rows do not depend on where the world lies or on the options' order") {
  HandMade made;
  made.scene.fellows_m = {{9.0, 0.0, 1.0}, {9.0, 3.0, 1.0}};
  made.scene.fellow_goals_m = {{3.0, 4.0, 1.0}};
  made.options[0].fellow_s = 3.0;
  made.options[1].fellow_s = 6.0;
  const std::vector<float> rows = option_rows(made.scene, made.options);
  CHECK(row_of(rows, 0)[32] == Approx(0.4));   // a fellow's goal 4 m off
  CHECK(row_of(rows, 0)[33] == Approx(0.2));   // it is there 2 s sooner than a fellow
  CHECK(row_of(rows, 1)[33] == Approx(-0.2));  // a fellow is there 2 s sooner
  CHECK(row_of(rows, 0)[34] == Approx(0.5));

  HandMade moved = made;
  const Eigen::Vector3d offset_m(100.0, -40.0, 7.0);
  moved.scene.position_m += offset_m;
  for (Eigen::Vector3d& p_m : moved.scene.fellows_m) p_m += offset_m;
  for (Eigen::Vector3d& p_m : moved.scene.fellow_goals_m) p_m += offset_m;
  for (CoverageOption& option : moved.options) option.position_m += offset_m;
  std::swap(moved.options[0], moved.options[1]);
  const std::vector<float> others = option_rows(moved.scene, moved.options);
  for (std::size_t i = 0; i < kWidth; ++i) {
    CAPTURE(i);
    CHECK(row_of(others, 1)[i] == Approx(row_of(rows, 0)[i]).margin(1e-6));
    CHECK(row_of(others, 0)[i] == Approx(row_of(rows, 1)[i]).margin(1e-6));
  }
}

TEST_CASE("a tour begins with its option and goes on to the nearest that is left") {
  // On a line at 0, 1, 3, 7; the UAV at 1.5.
  const std::vector<double> at{0.0, 1.0, 3.0, 7.0};
  std::vector<std::vector<double>> between;
  std::vector<double> start;
  for (const double a : at) {
    between.emplace_back();
    for (const double b : at) between.back().push_back(std::abs(a - b));
    start.push_back(std::abs(a - 1.5));
  }
  const std::vector<double> tours = nearest_neighbour_tours_s(start, between);
  CHECK(tours[0] == Approx(1.5 + 1 + 2 + 4));
  CHECK(tours[1] == Approx(0.5 + 1 + 3 + 4));
  CHECK(tours[2] == Approx(1.5 + 2 + 1 + 7));
  CHECK(tours[3] == Approx(5.5 + 4 + 2 + 1));
  CHECK(nearest_neighbour_tours_s({2.0}, {{0.0}}) == std::vector<double>{2.0});
}

TEST_CASE("the short list holds the richest, the soonest and the shortest tour") {
  std::vector<CoverageOption> options(8);
  for (std::size_t i = 0; i < options.size(); ++i) {
    options[i].gain_m3 = i < 5 ? 1.0 + static_cast<double>(i) : 0.1;  // 2, 3 and 4 promise most
    options[i].time_s = i == 6 ? 0.9 : 2.0;
    options[i].tour_s = i == 7 ? 10.0 : 20.0;
  }
  CHECK(short_list(options) == std::vector<std::size_t>{2, 3, 4, 6, 7});
  options[4].time_s = 0.6;  // one may be all of it
  options[4].tour_s = 5.0;
  CHECK(short_list(options) == std::vector<std::size_t>{2, 3, 4});
  options.resize(2);
  CHECK(short_list(options) == std::vector<std::size_t>{0, 1});
}

TEST_CASE("the agent flies where its network says, keeps to it, and leaves it to no fellow") {
  HalfSeen scene(false);
  for (const std::size_t wanted : {0u, 1u, 2u}) {
    std::vector<OptionChoice> asked;
    AgentStrategy agent(scene.config, [&](const OptionChoice& choice) {
      asked.push_back(choice);
      return std::min(wanted, choice.count() - 1);
    });
    AssignmentRequest request = scene.request;
    request.uavs.push_back(request.uavs[0]);
    request.uavs[1].position_m.x() += 0.8;
    request.time_s = 3.0;
    const Assignment given = agent.assign(scene.space(), request);
    REQUIRE(asked.size() == 2);
    REQUIRE(given.goals[0].has_value());
    REQUIRE(given.goals[1].has_value());
    CHECK((given.goals[0]->position_m - given.goals[1]->position_m).norm() > 0.1);
    CHECK(asked[0].uav == 0);
    CHECK(asked[1].uav == 1);
    CHECK(asked[0].time_s == 3.0);
    CHECK(asked[0].count() >= 3);
    CHECK(asked[0].count() <= 5);
    const float way = row_of(asked[0].rows, std::min(wanted, asked[0].count() - 1))[1];
    CHECK(given.goals[0]->travel_m == Approx(10.0 * static_cast<double>(way)).margin(1.0));

    request.uavs[0].goal = given.goals[0];
    request.uavs[1].goal = given.goals[1];
    const Assignment later = agent.assign(scene.space(), request);
    CHECK(asked.size() == 2);
    for (const std::size_t uav : {0u, 1u}) CHECK(later.goals[uav]->target_m == given.goals[uav]->target_m);
  }
}

TEST_CASE("the agent's model is read by name, and refused by name when it is not one") {
  const OptionChooser nearest = load_coverage_agent(folder_with("good", nn::model_bytes(tiny_model())));
  const HandMade made;
  CHECK(nearest({0, 0.0, option_rows(made.scene, made.options)}) == 0);
  nn::Model turned = tiny_model();
  turned.parameters[0] = 1.0F;  // the farthest
  CHECK(load_coverage_agent(folder_with("turned", nn::model_bytes(turned)))(
            {0, 0.0, option_rows(made.scene, made.options)}) == 1);

  const auto refused = [](const std::string& name, const std::string& bytes, const std::string& why) {
    const fs::path folder = folder_with(name, bytes);
    CHECK_THROWS_WITH(load_coverage_agent(folder),
                      Catch::Contains((folder / "coverage.model").string()) && Catch::Contains(why));
  };
  std::string damaged = nn::model_bytes(tiny_model());
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  refused("damaged", damaged, "damaged");
  refused("truncated", damaged.substr(0, damaged.size() - 4), "truncated");
  nn::Model foreign = tiny_model();
  foreign.agent = "path3d";
  refused("foreign", nn::model_bytes(foreign), "path3d");
  nn::Model other_input = tiny_model();
  other_input.input = "coverage options 0";
  refused("input", nn::model_bytes(other_input), "coverage options 0");
  nn::Model narrow = tiny_model();
  narrow.network.features = kOptionFeatures - 1;
  narrow.parameters.assign(narrow.network.parameter_count(), 0.0F);
  refused("narrow", nn::model_bytes(narrow), "another shape");
  CHECK_THROWS_WITH(load_coverage_agent("/no/such/folder"), Catch::Contains("/no/such/folder/coverage.model"));
  const HalfSeen scene(false);
  CoverageConfig lost = scene.config;
  lost.models_dir = "/no/such/folder";
  CHECK_THROWS_AS(make_strategy("agent", lost), InputError);
}
