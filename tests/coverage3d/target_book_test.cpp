#include "coverage3d/target_book.hpp"

#include "coverage3d/frontier_finder.hpp"
#include "mapping/distance_field.hpp"
#include "toy_world.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <set>
#include <tuple>

using namespace stairwell;
using namespace stairwell::coverage3d;

namespace {

constexpr int kKnown = 40;  // voxels of 0.1 m from the hall's end

using Places = std::set<std::tuple<int, int, int>>;

/// A hall, known from one end up to a plane; the frontier there is one cluster.
struct HalfKnownHall {
  HalfKnownHall() : grid({{0.0, 0.0, 0.0}, {8.0, 1.6, 1.6}}, 0.1), map(grid), book(views()), finder(grid, frontier()) {
    robot.radius_m = 0.2;
    for (int x = 0; x < kKnown; ++x) set_plane(x, false);
    places.reachable = [](const VoxelIndex&) { return true; };
  }

  ViewpointConfig views() const {
    ViewpointConfig config;
    config.sensor = toy::lidar();
    config.box = grid.box();
    return config;
  }
  FrontierConfig frontier() const {
    FrontierConfig config;
    config.box = grid.box();
    config.split_size_m = 4.0;
    return config;
  }

  void set_plane(int x, bool hit) {
    for (int z = 0; z < 16; ++z)
      for (int y = 0; y < 16; ++y) map.update({x, y, z}, hit);
  }

  void update(double time_s, const TargetBook::Budget& budget = {}) {
    distance.update(map);
    const planning3d::FreeSpace space(map, distance, robot, grid.box());
    finder.update(map);
    book.refresh(space, finder, places, time_s, nullptr);
    book.look(space, finder, places, budget, {}, nullptr);
  }

  const TargetBook::Target& target() const {
    REQUIRE(book.targets().size() == 1);
    const TargetBook::Target& only = (*book.targets().begin()).second;
    REQUIRE(!only.views.empty());
    return only;
  }
  double gain_now_m3(const Viewpoint& view) const { return book.sampler().gain_m3(map, view.position_m, view.yaw_rad); }
  Places standing() const {
    Places found;
    for (const Viewpoint& view : target().views) found.emplace(view.voxel.x, view.voxel.y, view.voxel.z);
    return found;
  }

  GridSpec grid;
  mapping::OccupancyMap map;
  TargetBook book;
  FrontierFinder finder;
  mapping::DistanceField distance{grid, 1.0, mapping::Obstacles::kBlocked};
  Robot robot;
  ViewpointPlaces places;
};

}  // namespace

TEST_CASE("gains are worked out again when the map changed nearby, but not all the time", "[target_book]") {
  HalfKnownHall hall;
  hall.update(10.0);
  const Viewpoint& view = hall.target().views.front();
  const double before_m3 = view.gain_m3;
  REQUIRE(before_m3 == hall.gain_now_m3(view));
  hall.set_plane(kKnown + 2, true);
  hall.update(10.5);
  CHECK(hall.gain_now_m3(view) < before_m3);
  CHECK(view.gain_m3 == before_m3);
  hall.update(10.8);
  CHECK(view.gain_m3 == before_m3);
  hall.update(11.0);  // nothing changed since, but what did was not looked at yet
  CHECK(view.gain_m3 == hall.gain_now_m3(view));
}

TEST_CASE("views that are handed on keep their gains until these are old", "[target_book]") {
  TargetBook::Budget budget;
  budget.samples = 1;
  HalfKnownHall hall;
  hall.update(10.0);
  const Viewpoint before = hall.target().views.front();
  const std::uint32_t cluster = (*hall.book.targets().begin()).first;
  hall.set_plane(kKnown + 2, true);
  for (int z = 0; z < 16; ++z) hall.map.update({kKnown, 2, z}, false);
  const auto view_now = [&]() -> const Viewpoint& {
    REQUIRE((*hall.book.targets().begin()).first != cluster);
    const auto& views = hall.target().views;
    const auto found =
        std::find_if(views.begin(), views.end(), [&](const Viewpoint& v) { return v.voxel == before.voxel; });
    REQUIRE(found != views.end());
    return *found;
  };
  hall.update(10.5, budget);
  CHECK(hall.gain_now_m3(before) < before.gain_m3);
  CHECK(view_now().gain_m3 == before.gain_m3);
  hall.update(11.0, budget);
  CHECK(view_now().gain_m3 == hall.gain_now_m3(before));
}

TEST_CASE("where there is much to look at a cluster that changes a little is mostly seen from the same places",
          "[target_book]") {
  const bool much = GENERATE(true, false);
  TargetBook::Budget budget;
  budget.samples = much ? 1 : 2;
  HalfKnownHall hall;
  hall.update(0.0);
  const Places first = hall.standing();
  for (int round = 1; round <= 4; ++round) {
    const std::uint32_t before = (*hall.book.targets().begin()).first;
    for (int z = 0; z < 16; ++z) hall.map.update({kKnown, 2 * round, z}, false);
    hall.update(round, budget);
    REQUIRE((*hall.book.targets().begin()).first != before);
    const Places now = hall.standing();
    CAPTURE(much, round);
    CHECK(std::includes(first.begin(), first.end(), now.begin(), now.end()) == (much && round < 4));
  }
}

TEST_CASE("where there is much to look at, what was searched for in vain is not searched for again", "[target_book]") {
  const bool much = GENERATE(true, false);
  TargetBook::Budget budget;
  budget.samples = much ? 1 : 2;
  HalfKnownHall hall;
  hall.places.reachable = [](const VoxelIndex&) { return false; };
  hall.update(0.0, budget);
  const auto searches = [&] { return (*hall.book.targets().begin()).second.searches; };
  REQUIRE(hall.book.targets().size() == 1);
  REQUIRE(searches() == 1);
  for (int i = 0; i < 5; ++i) hall.map.update({24, 8, 8}, true);  // nearby, but the cluster stays
  hall.update(1.0, budget);
  CHECK(hall.book.targets().size() == 1);
  CHECK(searches() == (much ? 1 : 2));
}
