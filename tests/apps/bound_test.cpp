/// `stairwell bound`: small worlds whose answer is known, and the parts of the search against slow references.
#include "apps/bound.hpp"
#include "apps/cli.hpp"
#include "apps/known_map.hpp"
#include "apps/run_config.hpp"
#include "apps/simulation.hpp"
#include "apps/tour_flight.hpp"
#include "apps/tour_search.hpp"
#include "planning3d/astar_planner.hpp"
#include "planning3d/segment_check.hpp"
#include "run_words.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>

namespace stairwell::apps {

using Catch::Contains;
using testing::Outcome;
using testing::run;
using testing::Words;
namespace fs = std::filesystem;

namespace {

nlohmann::json bound_of(Words words) {
  words.insert(words.begin(), "bound");
  words.insert(words.end(), {"--json", "--quiet"});
  const Outcome outcome = run(words);
  CAPTURE(outcome.err);
  REQUIRE(outcome.code == 0);
  return nlohmann::json::parse(outcome.out);
}

/// A closed box, inside from the origin to here.
fs::path write_box(const fs::path& folder, double x, double y, double z) {
  int vertices = 0;
  std::string text;
  text += testing::obj_box({-0.2, -0.2, -0.2}, {x + 0.2, y + 0.2, 0.0}, vertices);
  text += testing::obj_box({-0.2, -0.2, z}, {x + 0.2, y + 0.2, z + 0.2}, vertices);
  text += testing::obj_box({-0.2, -0.2, 0.0}, {0.0, y + 0.2, z}, vertices);
  text += testing::obj_box({x, -0.2, 0.0}, {x + 0.2, y + 0.2, z}, vertices);
  text += testing::obj_box({0.0, -0.2, 0.0}, {x, 0.0, z}, vertices);
  text += testing::obj_box({0.0, y, 0.0}, {x, y + 0.2, z}, vertices);
  return testing::write_text(folder / "box.obj", text);
}

/// The room of test_world.hpp and a fleet in it, as find_bound sets them up.
struct KnownRoom {
  explicit KnownRoom(const std::string& folder)
      : simulation(config(testing::write_room(testing::fresh_folder(folder)))),
        reachable(simulation.reachable()),
        explorable(simulation.explorable(reachable)),
        known(fully_known_map(simulation, reachable)),
        space(known.space(simulation.config().fleet.robot, simulation.config().fleet.task_box)),
        views(simulation, space, explorable) {}

  /// Made once: what a case changes has to be its own.
  static const KnownRoom& shared() {
    static const KnownRoom room("bound-shared");
    return room;
  }

  static RunConfig config(const fs::path& file) {
    Settings settings;
    settings["world"] = {file.string(), "test"};
    settings["box"] = {"-2,-1.5,0,2,1.5,2", "test"};
    settings["start"] = {"-1.2,0,1", "test"};
    return resolve(settings);
  }

  KnownRoads roads() const {
    std::vector<Eigen::Vector3d> points_m = views.places_m();
    points_m.push_back(simulation.airborne_starts_m()[0]);
    return {space, simulation.config().fleet.limits, points_m, 1};
  }

  Simulation simulation;
  std::vector<std::uint8_t> reachable, explorable;
  KnownMap known;
  planning3d::FreeSpace space;
  TrueViews views;
};

}  // namespace

TEST_CASE("one view of a small room is enough: nothing has to be flown") {
  const fs::path folder = testing::fresh_folder("bound-room");
  const auto bound = bound_of({write_box(folder, 2, 2, 2).string(), "--box", "0,0,0,2,2,2", "--start=1,1,1", "--sensor",
                               "lidar", "--fov-deg", "360x-90..90", "--rays", "180x90"});
  CHECK(bound["finish_s"] == 0.0);
  CHECK(bound["path_length_m"] == 0.0);
  CHECK(bound["viewpoints"] == 0);
  CHECK(bound["coverage"].get<double>() >= 0.99);
}

TEST_CASE("a corridor takes one straight flight to where its end is in range") {
  const fs::path folder = testing::fresh_folder("bound-corridor");
  constexpr double kLength_m = 14.0, kRange_m = 4.0, kSpeed_mps = 2.0, kAcceleration_mps2 = 2.0, kStart_m = 0.6;
  const auto bound = bound_of({write_box(folder, kLength_m, 1.2, 1.2).string(), "--box", "0,0,0,14,1.2,1.2",
                               "--start=0.6,0.6,0.6", "--sensor", "lidar", "--fov-deg", "360x-90..90", "--rays",
                               "180x90", "--range", "4", "--vmax", "2", "--amax", "2", "--rounds", "2"});
  // At most a hundredth of the corridor stays unseen, and the last voxel may be seen in part only.
  const double way_m = 0.99 * kLength_m - 0.1 - kRange_m - kStart_m;
  const double least_s = way_m / kSpeed_mps + 0.5 * kSpeed_mps / kAcceleration_mps2;
  CHECK(bound["finish_s"].get<double>() >= least_s);
  CHECK(bound["finish_s"].get<double>() <= 1.15 * least_s + 0.1);  // walls seen at a slant, scans at 10 Hz
}

TEST_CASE("the reference is repeatable, keeps its target, and neither rounds nor UAVs make it worse") {
  const fs::path room = testing::write_room(testing::fresh_folder("bound-rounds"));
  const Words words{room.string(), "--box", testing::kRoomBox, "--start=-1.2,0,1",
                    "--rays",      "64x48", "--resolution",    "0.2"};
  const auto with = [&](const Words& more) {
    Words all = words;
    all.insert(all.end(), more.begin(), more.end());
    return bound_of(all);
  };
  const auto one = with({"--rounds", "1", "--target-coverage", "0.97"});
  CHECK(with({"--rounds", "1", "--target-coverage", "0.97"}) == one);
  CHECK(one["coverage"].get<double>() >= 0.97);
  CHECK(one["viewpoints"].get<int>() >= 1);
  CHECK(one["path_length_m"].get<double>() > 0.5);
  CHECK(one["path_length_m"].get<double>() <= 2.0 * one["finish_s"].get<double>());
  const auto three = with({"--rounds", "3", "--target-coverage", "0.97"});
  CHECK(three["finish_s"].get<double>() <= one["finish_s"].get<double>());
  const auto two_uavs = with({"--rounds", "3", "--target-coverage", "0.97", "--start=1.2,-0.5,0.2", "--uavs", "2"});
  CHECK(two_uavs["finish_s"].get<double>() < three["finish_s"].get<double>());
}

TEST_CASE("bad words of bound are refused in one line") {
  const fs::path folder = testing::fresh_folder("bound-bad");
  const fs::path room = testing::write_room(folder);
  const auto refused = [&](const Words& words, const std::string& names) {
    const Outcome outcome = run(words);
    CAPTURE(outcome.err);
    CHECK(outcome.code == 2);
    CHECK_THAT(outcome.err, Contains(names));
  };
  refused({"bound", (folder / "nowhere.sdf").string()}, "nowhere.sdf");
  refused({"bound", room.string(), "--rounds", "0"}, "--rounds");
  refused({"bound", room.string(), "--box", testing::kRoomBox, "--start=-1.2,0,1", "--target-coverage", "1.5"},
          "--target-coverage");
}

TEST_CASE("what is in sight from a place has nothing in front of it") {
  const KnownRoom& room = KnownRoom::shared();
  const TrueViews& views = room.views;
  const SensorModel& sensor = room.simulation.config().fleet.sensor;
  REQUIRE(views.places() > 20);
  std::size_t in_sight = 0;
  for (std::uint32_t place = 0; place < views.places(); place += 7) {
    for (std::size_t target = 0; target < views.targets(); target += 5) {
      const VoxelIndex v = views.target_voxels()[target];
      if (room.simulation.truth().at(v) != sim3d::TruthClass::kFree) continue;
      const Eigen::Vector3d offset_m = room.space.grid().center_of(v) - views.places_m()[place];
      const double away_m = offset_m.norm();
      const bool clear = !room.simulation.caster().occluded(
          views.places_m()[place].cast<float>(), (offset_m / away_m).cast<float>(), static_cast<float>(away_m - 2e-3));
      for (int yaw = 0; yaw < views.yaws(); yaw += 5) {
        const bool seen = views.sees({place, yaw}, target);
        const Eigen::AngleAxisd to_sensor(-TrueViews::yaw_rad(yaw), Eigen::Vector3d::UnitZ());
        if (seen != (clear && sensor.sees(to_sensor * offset_m))) FAIL("place " << place << " target " << target);
        in_sight += seen ? 1 : 0;
      }
    }
  }
  CHECK(in_sight > 100);
}

TEST_CASE("what rays pass by is not seen from as far any more") {
  KnownRoom room("bound-forget");
  constexpr std::size_t kTarget = 100;
  const auto before = room.views.viewers(kTarget);
  const auto other = room.views.viewers(kTarget + 1);
  constexpr double kFrom_m = 1.0;
  room.views.forget(kTarget, kFrom_m);
  std::size_t left = 0;
  for (const TrueViews::Viewer& viewer : before) {
    const bool near = room.views.distance_m(viewer.place, kTarget) < kFrom_m;
    left += near ? 1 : 0;
    for (int yaw = 0; yaw < room.views.yaws(); ++yaw)
      CHECK(room.views.sees({viewer.place, yaw}, kTarget) == (near && (viewer.yaws >> yaw & 1u) != 0));
  }
  CHECK(left < before.size());
  CHECK(room.views.viewers(kTarget).size() == left);
  for (const TrueViews::Viewer& viewer : other)
    for (int yaw = 0; yaw < room.views.yaws(); ++yaw)
      CHECK(room.views.sees({viewer.place, yaw}, kTarget + 1) == ((viewer.yaws >> yaw & 1u) != 0));
}

TEST_CASE("roads are free, and not much longer than the shortest path") {
  const KnownRoom& room = KnownRoom::shared();
  const KnownRoads roads = room.roads();
  const planning3d::SegmentCheck check(room.space, {}, Eigen::Vector3d::Zero());
  planning3d::AstarPlanner planner;
  std::vector<std::uint32_t> way;
  for (std::size_t from = 0; from < roads.points(); from += 11) {
    for (std::size_t to = 0; to < roads.points(); to += 13) {
      roads.way(from, to, way);
      REQUIRE(way.size() >= 2);
      CHECK(way.front() == from);
      CHECK(way.back() == to);
      double along_s = 0.0;
      for (std::size_t i = 1; i < way.size(); ++i) {
        along_s += roads.straight_s(roads.point_m(way[i - 1]), roads.point_m(way[i]));
        if (way[i] != way[i - 1] && !check.sweep_free(roads.point_m(way[i - 1]), roads.point_m(way[i])))
          FAIL("from " << from << " to " << to);
      }
      CHECK(along_s == Approx(roads.cruise_s(from, to)).margin(1e-4));
      planning3d::PlanRequest request;
      request.start_m = roads.point_m(from);
      request.goal_m = roads.point_m(to);
      request.clearance_weight = 0.0;
      const auto shortest = planner.plan(room.space, request);
      if (from == to || shortest.status != planning3d::PlanStatus::kReached) continue;
      const double speed_mps = room.simulation.config().fleet.limits.speed_mps;
      CHECK(roads.cruise_s(from, to) <= 1.15 * shortest.length_m / speed_mps + 0.05);
    }
  }
}

TEST_CASE("annealing shortens tours that see as much, and its figures are those of the model") {
  const KnownRoom& room = KnownRoom::shared();
  const KnownRoads roads = room.roads();
  const MotionLimits& limits = room.simulation.config().fleet.limits;
  TourModel model(room.views, roads, limits, {0.0});
  TourSearch search(model, make_rng(1, "test"));
  const auto poses = cover_greedily(room.views, 0.95);
  const Tours greedy = search.order(poses);
  REQUIRE(greedy[0].size() == poses.size());
  const auto wanted = static_cast<std::size_t>(0.95 * static_cast<double>(room.views.targets()));
  REQUIRE(search.seen(greedy) >= wanted);
  Annealing annealing;
  annealing.evaluations = 50'000;
  const Tours better = search.anneal(greedy, wanted, annealing);
  CHECK(search.longest_s(better) < search.longest_s(greedy));
  CHECK(static_cast<double>(search.seen(better)) > 0.99 * static_cast<double>(wanted));

  std::vector<std::uint64_t> seen(room.views.words(), 0), again(room.views.words(), 0);
  model.see(0, better[0], seen.data());
  TourModel fresh(room.views, roads, limits, {0.0});
  fresh.see(0, better[0], again.data());
  CHECK(seen == again);
  CHECK(fresh.tour_s(0, better[0]) == Approx(model.tour_s(0, better[0])));

  fresh.distrust(better, seen);  // all that the way between the poses shows
  std::vector<std::uint64_t> at_poses(room.views.words(), 0), trusted(room.views.words(), 0);
  for (const TrueViews::Pose& pose : better[0]) room.views.sight(pose).add_to(at_poses.data());
  room.views.sight({room.views.around(roads.point_m(fresh.start(0).place)).nearest, 0}).add_to(at_poses.data());
  fresh.see(0, better[0], trusted.data());
  CHECK(trusted == at_poses);
  CHECK(trusted != seen);
}

TEST_CASE("half a turn goes the same way round wherever it begins") {
  MotionLimits limits;
  for (int step = 0; step < 24; ++step) {
    const double from_rad = TrueViews::yaw_rad(step);
    const auto turn = tour_turn(limits, from_rad, TrueViews::yaw_rad((step + 12) % 24));
    CHECK(turn.at(turn.duration_s()).turned_rad > 3.0);
  }
}

}  // namespace stairwell::apps
