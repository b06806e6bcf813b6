#include "mapping/potential_window.hpp"
#include "core/errors.hpp"
#include "potential_scene.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

namespace {

GridSpec small_box() { return {{Eigen::Vector3d(-1.0, 0.5, 0.0), Eigen::Vector3d(2.0, 3.0, 2.0)}, 0.1}; }

/// U at a point from the cells' values, by the definition: clamped to the window, then linear along each axis.
double slow_value(const PotentialLayers& layers, Eigen::Vector3d point_m, PotentialLayer layer) {
  const GridSpec& lattice = layers.lattice();
  point_m = point_m.cwiseMax(lattice.center_of(layers.window().lo)).cwiseMin(lattice.center_of(layers.window().hi));
  double sum = 0.0;
  for_each_cell(layers.window(), [&](const VoxelIndex& v) {
    const Eigen::Vector3d away = (point_m - lattice.center_of(v)).cwiseAbs() / lattice.resolution_m();
    if (away.maxCoeff() >= 1.0) return;
    sum += (1.0 - away.x()) * (1.0 - away.y()) * (1.0 - away.z()) * layers.at(layer, v);
  });
  return sum;
}

PotentialScene scribbled(std::uint64_t seed, const Eigen::Vector3d& window_m) {
  Rng rng = make_rng(seed, "potential-window");
  PotentialModelConfig config;
  config.window_m = window_m;
  config.potential.k_rep = 20.0;
  PotentialScene scene(small_box(), config);
  scribble(rng, scene.map, 30);
  scene.goal_m = {1.5, 1.0, 0.5};
  scene.center_m = {-0.4, 1.2, 0.6};
  scene.update();
  scene.center_m = {0.7, 1.9, 1.1};  // the storage is wrapped round now
  scene.update();
  return scene;
}

}  // namespace

TEST_CASE("windows are what the definition says", "[potential][window]") {
  Rng rng = make_rng(60, "potential-samples");
  PotentialScene scene = scribbled(60, {1.7, 1.5, 1.1});
  for (int round = 0; round < 60; ++round) {
    const PotentialLayers& layers = round % 3 == 0 ? scene.model.coarse() : scene.model.fine();
    WindowShape shape;
    shape.samples = {rng.uniform_int(1, 9), rng.uniform_int(1, 9), round % 2 == 0 ? 1 : rng.uniform_int(1, 5)};
    shape.spacing_m = rng.uniform(0.02, 0.4);
    shape.full_scale = rng.uniform(5.0, 100.0);
    const WindowPose pose{{rng.uniform(-2.0, 3.0), rng.uniform(-1.0, 4.0), rng.uniform(-1.0, 3.0)},
                          rng.uniform(-7.0, 7.0)};
    std::vector<float> window(shape.size(), 77.0F);
    sample_window(layers, shape, pose, window);
    const double offset = slow_value(layers, pose.center_m, PotentialLayer::kTotal);
    std::size_t next = 0;
    for (int k = 0; k < shape.samples[2]; ++k) {
      for (int j = 0; j < shape.samples[1]; ++j) {
        for (int i = 0; i < shape.samples[0]; ++i) {
          const Eigen::Vector3d in_window =
              shape.spacing_m * Eigen::Vector3d(i - 0.5 * (shape.samples[0] - 1), j - 0.5 * (shape.samples[1] - 1),
                                                k - 0.5 * (shape.samples[2] - 1));
          const Eigen::Vector3d at_m =
              pose.center_m + Eigen::AngleAxisd(pose.yaw_rad, Eigen::Vector3d::UnitZ()) * in_window;
          const double potential = slow_value(layers, at_m, PotentialLayer::kTotal);
          CHECK(layers.value(at_m) == Approx(potential).epsilon(1e-9).margin(1e-9));
          const double expected = std::clamp((potential - offset) / shape.full_scale, -1.0, 1.0);
          REQUIRE(static_cast<double>(window[next++]) == Approx(expected).margin(2e-5));
        }
      }
    }
  }
}

TEST_CASE("a window's samples on cell centres are the cells, to the last bit", "[potential][window]") {
  PotentialScene scene = scribbled(61, {2.1, 2.1, 1.5});
  const PotentialLayers& fine = scene.model.fine();
  const VoxelIndex middle = fine.window().lo + VoxelIndex{10, 10, 7};
  WindowShape shape;
  shape.samples = {21, 21, 15};
  std::vector<float> window(shape.size());
  sample_window(fine, shape, {fine.lattice().center_of(middle), 0.0}, window);
  std::size_t next = 0;
  for_each_cell(fine.window(), [&](const VoxelIndex& v) {
    const double above = fine.at(PotentialLayer::kTotal, v) - fine.at(PotentialLayer::kTotal, middle);
    REQUIRE(static_cast<double>(window[next++]) == Approx(above / 1000.0).margin(1e-9));
  });
  CHECK(window[(7 * 21 + 10) * 21 + 10] == 0.0F);
}

TEST_CASE("every layer can be sampled between cells", "[potential][window]") {
  Rng rng = make_rng(62, "potential-layers-sampled");
  PotentialScene scene = scribbled(62, {1.7, 1.5, 1.1});
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d at_m(rng.uniform(-2.0, 3.0), rng.uniform(-1.0, 4.0), rng.uniform(-1.0, 3.0));
    for (const PotentialLayer layer : kAllLayers) {
      CHECK(scene.model.fine().value(at_m, layer) ==
            Approx(slow_value(scene.model.fine(), at_m, layer)).epsilon(1e-9).margin(1e-9));
    }
  }
}

TEST_CASE("windows beyond everything known are ordinary", "[potential][window]") {
  PotentialScene scene = scribbled(63, {1.7, 1.5, 1.1});
  WindowShape shape;
  std::vector<float> window(shape.size(), 77.0F);
  sample_window(scene.model.fine(), shape, {{1e12, -1e12, 500.0}, 0.3}, window);  // wholly outside
  CHECK(std::all_of(window.begin(), window.end(), [](float value) { return value == 0.0F; }));
  sample_window(scene.model.fine(), shape, {{-1.0, 0.5, 0.0}, 0.0}, window);  // larger than the box, at its corner
  CHECK(std::all_of(window.begin(), window.end(), [](float value) { return std::isfinite(value); }));
  CHECK(window.front() == window[1]);
  CHECK(window.back() != window.front());

  PotentialScene empty(small_box(), {});
  empty.update();
  sample_window(empty.model.fine(), shape, {{0.0, 1.0, 1.0}, 1.0}, window);
  CHECK(std::all_of(window.begin(), window.end(), [](float value) { return value == 0.0F; }));
}

TEST_CASE("values beyond the full scale are cut", "[potential][window]") {
  PotentialScene scene = scribbled(64, {9.0, 9.0, 9.0});
  WindowShape shape;
  shape.full_scale = 0.1;
  std::vector<float> window(shape.size());
  sample_window(scene.model.fine(), shape, {{0.0, 1.5, 1.0}, 0.0}, window);
  CHECK(*std::max_element(window.begin(), window.end()) == 1.0F);
  CHECK(*std::min_element(window.begin(), window.end()) == -1.0F);
}

TEST_CASE("a slice is one plane of the volume", "[potential][window]") {
  PotentialScene scene = scribbled(65, {2.1, 1.9, 0.9});
  const PotentialLayers& fine = scene.model.fine();
  const PotentialSlice slice(fine, 1.23);
  CHECK(slice.z() == 12);
  CHECK(slice.size() == std::array<int, 2>{21, 19});
  const VoxelBox box = fine.window();
  for (int y = box.lo.y; y <= box.hi.y; ++y) {
    for (int x = box.lo.x; x <= box.hi.x; ++x) {
      for (const PotentialLayer layer : kAllLayers) REQUIRE(slice.at(x, y, layer) == fine.at(layer, {x, y, 12}));
    }
  }
  CHECK(slice.at(-500, box.lo.y) == slice.at(box.lo.x, box.lo.y));
  CHECK(PotentialSlice(fine, 100.0).z() == box.hi.z);
  CHECK(PotentialSlice(fine, -100.0).z() == box.lo.z);

  WindowShape shape;
  std::vector<float> flat(shape.size()), volume(shape.size());
  slice.sample(shape, {0.7, 1.9}, 0.4, flat);
  sample_window(fine, shape, {{0.7, 1.9, fine.lattice().center_of({0, 0, 12}).z()}, 0.4}, volume);
  CHECK(flat == volume);
  shape.samples[2] = 2;
  flat.resize(shape.size());
  CHECK_THROWS_AS(slice.sample(shape, {0.7, 1.9}, 0.4, flat), InputError);
  CHECK_THROWS_AS(PotentialSlice(fine, std::nan("")), InputError);
}

TEST_CASE("unusable windows are refused", "[potential][window]") {
  PotentialScene scene(small_box(), {});
  scene.update();
  std::vector<float> window(75 * 75);
  const auto sample = [&](const WindowShape& shape, const WindowPose& pose) {
    sample_window(scene.model.fine(), shape, pose, window);
  };
  CHECK_NOTHROW(sample({}, {}));
  CHECK_THROWS_AS(sample({{75, 75, 2}, 0.1, 1000.0}, {}), InputError);
  CHECK_THROWS_AS(sample({{75, 0, 1}, 0.1, 1000.0}, {}), InputError);
  CHECK_THROWS_AS(sample({{75, 75, 1}, 0.0, 1000.0}, {}), InputError);
  CHECK_THROWS_AS(sample({{75, 75, 1}, 0.1, std::nan("")}, {}), InputError);
  CHECK_THROWS_AS(sample({}, {no_point(), 0.0}), InputError);
  CHECK_THROWS_AS(sample({}, {Eigen::Vector3d::Zero(), std::nan("")}), InputError);
}
