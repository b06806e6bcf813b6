#include "perception/storeys.hpp"
#include "core/errors.hpp"
#include "core/rng.hpp"
#include "core/units.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

namespace {

using stairwell::Aabb;
using stairwell::GridSpec;
using stairwell::InputError;
using stairwell::make_rng;
using stairwell::Occupancy;
using stairwell::rad_from_deg;
using stairwell::Rng;
using stairwell::VoxelIndex;
using stairwell::perception::detect_storeys;
using stairwell::perception::layer_heights;
using stairwell::perception::Storey;
using stairwell::perception::StoreyConfig;

/// A map to paint on: boxes by coordinates, cells by their centres.
struct Canvas {
  GridSpec grid;
  std::vector<Occupancy> cells;

  explicit Canvas(const Aabb& box) : grid(box, 0.1), cells(grid.voxel_count(), Occupancy::kUnknown) {}

  template <typename Inside>
  void paint_where(Occupancy value, Inside&& inside) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (inside(grid.center_of(grid.voxel(i)))) {
        cells[i] = value;
      }
    }
  }
  void paint(Occupancy value, const Eigen::Vector3d& lo_m, const Eigen::Vector3d& hi_m) {
    paint_where(value, [box = Aabb{lo_m, hi_m}](const Eigen::Vector3d& p) { return box.contains(p); });
  }
  std::vector<Storey> storeys(const StoreyConfig& config = {}) const { return detect_storeys(cells, grid, config); }
};

/// Two rooms of 6 x 5 m above each other (floors at 0 and 3, ceilings at 2.7 and 5.7), joined by an opening.
Canvas two_rooms() {
  Canvas canvas({{-0.5, -0.5, -0.5}, {6.5, 5.5, 6.5}});
  canvas.paint(Occupancy::kOccupied, {-0.1, -0.1, -0.1}, {6.1, 5.1, 5.8});
  canvas.paint(Occupancy::kFree, {0, 0, 0}, {6, 5, 2.7});
  canvas.paint(Occupancy::kFree, {0, 0, 3}, {6, 5, 5.7});
  canvas.paint(Occupancy::kFree, {4, 3, 2.7}, {6, 5, 3});
  return canvas;
}

}  // namespace

TEST_CASE("two storeys with an opening") {
  const std::vector<Storey> storeys = two_rooms().storeys();
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[0].floor_z_m == Approx(0.0).margin(1e-9));
  CHECK(storeys[0].ceiling_z_m == Approx(2.7));
  CHECK(storeys[0].area_m2 == Approx(30.0));
  CHECK(storeys[1].floor_z_m == Approx(3.0));
  CHECK(storeys[1].ceiling_z_m == Approx(5.7));
  CHECK(storeys[1].area_m2 == Approx(26.0));
}

TEST_CASE("the callable form gives the same answer") {
  const Canvas canvas = two_rooms();
  const std::vector<Storey> storeys =
      detect_storeys([&](const VoxelIndex& v) { return canvas.cells[canvas.grid.linear(v)]; }, canvas.grid);
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[1].floor_z_m == canvas.storeys()[1].floor_z_m);
  CHECK(storeys[1].area_m2 == canvas.storeys()[1].area_m2);
}

TEST_CASE("desks, shelves and steps are not storeys") {
  Canvas canvas = two_rooms();
  for (int i = 0; i < 4; ++i) {
    canvas.paint(Occupancy::kOccupied, {0.2 + 1.4 * i, 0.2, 0.6}, {1.4 + 1.4 * i, 1.8, 0.8});
  }
  canvas.paint(Occupancy::kOccupied, {0, 4, 1.8}, {2, 5, 1.9});
  for (int i = 0; i < 14; ++i) {
    canvas.paint(Occupancy::kOccupied, {4, 3 + 0.14 * i, 0}, {6, 3.14 + 0.14 * i, 0.2 * i});
  }
  const std::vector<Storey> storeys = canvas.storeys();
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[0].floor_z_m == Approx(0.0).margin(1e-9));
  CHECK(storeys[1].floor_z_m == Approx(3.0));
}

TEST_CASE("tilted floors are one storey each") {
  for (const double slope : {0.01, 0.03, 0.06}) {
    CAPTURE(slope);
    Canvas canvas({{-0.5, -0.5, -0.5}, {8.5, 8.5, 7.5}});
    const auto height = [slope](const Eigen::Vector3d& p) { return p.z() - slope * (p.x() - 4.0); };
    const auto between = [&](double lo, double hi) {
      return [&height, lo, hi](const Eigen::Vector3d& p) { return height(p) > lo && height(p) < hi; };
    };
    canvas.paint_where(Occupancy::kOccupied, between(0.2, 0.5));
    canvas.paint_where(Occupancy::kFree, between(0.5, 3.2));
    canvas.paint_where(Occupancy::kOccupied, between(3.2, 3.5));
    canvas.paint_where(Occupancy::kFree, between(3.5, 6.2));
    canvas.paint_where(Occupancy::kOccupied, between(6.2, 6.5));
    const std::vector<Storey> storeys = canvas.storeys();
    REQUIRE(storeys.size() == 2);
    CHECK(storeys[0].floor_z_m == Approx(0.5).margin(0.2));
    CHECK(storeys[0].ceiling_z_m == Approx(3.2).margin(0.3));
    CHECK(storeys[1].floor_z_m == Approx(3.5).margin(0.2));
    CHECK(storeys[1].area_m2 > 0.9 * 81.0);
  }
}

TEST_CASE("noise of half the voxels by one cell and two per cent of wrong voxels change nothing but centimetres") {
  Rng rng = make_rng(4, "test");
  Canvas canvas = two_rooms();
  const auto [nx, ny, nz] = canvas.grid.size();
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) {
      for (const double floor_m : {0.0, 3.0}) {
        VoxelIndex v = canvas.grid.index_of({0.0, 0.0, floor_m + 0.05});
        v.x = x;
        v.y = y;
        if (canvas.cells[canvas.grid.linear(v)] == Occupancy::kFree && rng.uniform() < 0.4) {
          canvas.cells[canvas.grid.linear(v)] = Occupancy::kOccupied;
        }
      }
    }
  }
  for (Occupancy& cell : canvas.cells) {
    const double draw = rng.uniform();
    if (draw < 0.002) {
      cell = Occupancy::kOccupied;
    } else if (draw < 0.02) {
      cell = Occupancy::kUnknown;
    }
  }
  const std::vector<Storey> storeys = canvas.storeys();
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[0].floor_z_m == Approx(0.0).margin(0.11));
  CHECK(storeys[0].ceiling_z_m == Approx(2.7).margin(0.11));
  CHECK(storeys[1].floor_z_m == Approx(3.0).margin(0.11));
  CHECK(storeys[1].ceiling_z_m == Approx(5.7).margin(0.11));
}

TEST_CASE("a half-seen storey: the top of the seen free space stands for the ceiling") {
  Canvas canvas({{-0.5, -0.5, -0.5}, {6.5, 5.5, 6.5}});
  canvas.paint(Occupancy::kOccupied, {0, 0, -0.1}, {4, 4, 0});
  canvas.paint(Occupancy::kFree, {0, 0, 0}, {4, 4, 1.0});
  const std::vector<Storey> storeys = canvas.storeys();
  REQUIRE(storeys.size() == 1);
  CHECK(storeys[0].ceiling_z_m == Approx(1.0));
  CHECK(storeys[0].area_m2 == Approx(16.0));
}

TEST_CASE("a void does not lift the ceiling of the floor below it") {
  Canvas canvas({{-0.5, -0.5, -0.5}, {8.5, 8.5, 6.5}});
  canvas.paint(Occupancy::kOccupied, {-0.1, -0.1, -0.1}, {8.1, 8.1, 5.8});
  canvas.paint(Occupancy::kFree, {0, 0, 0}, {8, 8, 2.7});
  canvas.paint(Occupancy::kFree, {0, 0, 3}, {8, 8, 5.7});
  canvas.paint(Occupancy::kFree, {2, 2, 2.7}, {6, 6, 3});
  const std::vector<Storey> storeys = canvas.storeys();
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[0].ceiling_z_m == Approx(2.7));
  CHECK(storeys[1].area_m2 == Approx(48.0));
}

TEST_CASE("a void larger than its galleries ends the storey at the next floor") {
  Canvas canvas({{-0.5, -0.5, -0.5}, {8.5, 8.5, 6.5}});
  canvas.paint(Occupancy::kOccupied, {-0.1, -0.1, -0.1}, {8.1, 8.1, 5.8});
  canvas.paint(Occupancy::kFree, {0, 0, 0}, {8, 8, 2.7});
  canvas.paint(Occupancy::kFree, {0, 0, 3}, {8, 8, 5.7});
  canvas.paint(Occupancy::kFree, {1, 1, 2.7}, {7, 7, 3});
  const std::vector<Storey> storeys = canvas.storeys();
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[0].ceiling_z_m == Approx(3.0));
  CHECK(storeys[1].area_m2 == Approx(28.0));
}

TEST_CASE("high shelves in a hall are not storeys, a small part of a storey is one") {
  Canvas canvas({{-0.5, -0.5, -0.5}, {12.5, 12.5, 10.5}});
  canvas.paint(Occupancy::kOccupied, {-0.1, -0.1, -0.1}, {12.1, 12.1, 10.1});
  canvas.paint(Occupancy::kFree, {0, 0, 0}, {12, 12, 10});
  for (int i = 1; i <= 4; ++i) {
    canvas.paint(Occupancy::kOccupied, {2, 4, 1.8 * i}, {10, 5.2, 1.8 * i + 0.1});
    canvas.paint(Occupancy::kOccupied, {2, 7, 1.8 * i}, {10, 8.2, 1.8 * i + 0.1});
  }
  const std::vector<Storey> hall = canvas.storeys();
  REQUIRE(hall.size() == 1);
  CHECK(hall[0].ceiling_z_m == Approx(10.0));

  Canvas house = two_rooms();
  house.paint(Occupancy::kUnknown, {-1, -1, 2.7}, {3.4, 9, 9});
  house.paint(Occupancy::kUnknown, {3.4, -1, 2.7}, {9, 1.2, 9});
  const std::vector<Storey> storeys = house.storeys();  // above the opening and a little around it
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[1].floor_z_m == Approx(3.0));
  CHECK(storeys[1].area_m2 < 6.5);
}

TEST_CASE("boards without headroom above them are neither floors nor stand on one") {
  Canvas canvas = two_rooms();
  canvas.paint(Occupancy::kOccupied, {0, 0, 0.8}, {3, 5, 0.9});
  canvas.paint(Occupancy::kOccupied, {0, 0, 1.6}, {3, 5, 1.7});
  const std::vector<Storey> storeys = canvas.storeys();
  REQUIRE(storeys.size() == 2);
  CHECK(storeys[0].floor_z_m == Approx(0.0).margin(1e-9));
  CHECK(storeys[0].area_m2 == Approx(15.0));
  CHECK(storeys[0].ceiling_z_m == Approx(2.7));
}

TEST_CASE("nothing known, nothing occupied, nothing free: no storeys") {
  Canvas canvas({{0, 0, 0}, {3, 3, 3}});
  CHECK(canvas.storeys().empty());
  canvas.paint(Occupancy::kFree, {0, 0, 0}, {3, 3, 3});
  CHECK(canvas.storeys().empty());
  canvas.paint(Occupancy::kOccupied, {0, 0, 0}, {3, 3, 3});
  CHECK(canvas.storeys().empty());
  CHECK(detect_storeys(std::vector<Occupancy>{}, GridSpec{}).empty());
}

TEST_CASE("random stacks of floors are found again") {
  Rng rng = make_rng(12, "test");
  for (int round = 0; round < 20; ++round) {
    const int count = rng.uniform_int(1, 6);
    std::vector<double> floors_m, ceilings_m;
    double z_m = 0.1 * rng.uniform_int(-20, 5);
    for (int i = 0; i < count; ++i) {
      floors_m.push_back(z_m);
      ceilings_m.push_back(z_m + 0.1 * rng.uniform_int(22, 45));
      z_m = ceilings_m.back() + 0.1 * rng.uniform_int(1, 5);
    }
    Canvas canvas({{0, 0, floors_m[0] - 0.3}, {4, 5, z_m}});
    canvas.paint(Occupancy::kOccupied, {0, 0, -99}, {9, 9, 99});
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<std::size_t>(i);
      canvas.paint(Occupancy::kFree, {0, 0, floors_m[k]}, {9, 9, ceilings_m[k]});
    }
    const std::vector<Storey> storeys = canvas.storeys();
    REQUIRE(storeys.size() == floors_m.size());
    for (std::size_t i = 0; i < storeys.size(); ++i) {
      CHECK(storeys[i].floor_z_m == Approx(floors_m[i]).margin(1e-6));
      CHECK(storeys[i].ceiling_z_m == Approx(ceilings_m[i]).margin(1e-6));
    }
  }
}

TEST_CASE("layer heights: few for a wide view, more for a narrow one, all inside the storeys") {
  const std::vector<Storey> storeys{{0.0, 2.8, 30.0}, {3.0, 5.8, 30.0}};
  const std::vector<double> wide = layer_heights(storeys, rad_from_deg(120.0), 3.0);
  REQUIRE(wide.size() == 2);
  CHECK(wide[0] == Approx(1.4));
  CHECK(wide[1] == Approx(4.4));
  const std::vector<double> narrow = layer_heights(storeys, rad_from_deg(45.0), 3.0);
  REQUIRE(narrow.size() == 4);  // bands of at most 1.24 m
  CHECK(narrow[0] == Approx(0.9));
  CHECK(narrow[1] == Approx(1.9));
  CHECK(layer_heights(storeys, rad_from_deg(120.0), 0.5).size() == 8);
  CHECK(layer_heights(storeys, rad_from_deg(360.0), 99.0).size() == 2);
  CHECK(layer_heights({}, 1.0, 1.0).empty());
  const std::vector<Storey> low{{0.0, 0.6, 30.0}};
  REQUIRE(layer_heights(low, 1.0, 1.0).size() == 1);
  CHECK(layer_heights(low, 1.0, 1.0)[0] == Approx(0.3));
  CHECK_THROWS_AS(layer_heights(storeys, 0.0, 1.0), InputError);
  CHECK_THROWS_AS(layer_heights(storeys, 1.0, std::numeric_limits<double>::quiet_NaN()), InputError);
}

TEST_CASE("storey configs and cell counts are validated") {
  CHECK(StoreyConfig{}.problems().empty());
  StoreyConfig config;
  config.min_area_m2 = -1.0;
  config.min_share = 1.5;
  config.min_height_m = std::numeric_limits<double>::quiet_NaN();
  CHECK(config.problems().size() == 4);  // merge_m is not below NaN either
  const Canvas canvas = two_rooms();
  CHECK_THROWS_AS(canvas.storeys(config), InputError);
  CHECK_THROWS_AS(detect_storeys(std::vector<Occupancy>(7), canvas.grid), InputError);
}
