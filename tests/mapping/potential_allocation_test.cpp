/// Once warm, a step of the potential and its windows take no memory.
#include "mapping/potential_window.hpp"
#include "potential_scene.hpp"

#include <catch2/catch.hpp>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<bool> counting{false};
std::atomic<long> allocations{0};

void* counted_or_null(std::size_t size) noexcept {
  if (counting) ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}

void* counted(std::size_t size) {
  void* memory = counted_or_null(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return counted_or_null(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return counted_or_null(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

using namespace stairwell;
using namespace stairwell::mapping;
using namespace stairwell::mapping::test;

TEST_CASE("a step of the potential allocates nothing", "[potential][allocation]") {
  const RepulsionForm form = GENERATE(RepulsionForm::kSummed, RepulsionForm::kNearest);
  PotentialModelConfig config;
  config.form = form;
  config.window_m = {3.0, 3.0, 2.0};
  config.potential.k_exp = 0.5;
  config.potential.reach_m = 0.6;
  PotentialScene scene(GridSpec({Eigen::Vector3d::Zero(), Eigen::Vector3d(6.0, 6.0, 3.0)}, 0.1), config);
  scene.mobile_m = {{1.0, 1.0, 1.0}, {2.0, 4.0, 1.0}};
  scene.update();
  Rng rng = make_rng(70, "potential-allocations");
  WindowShape shape;
  shape.samples = {41, 41, 5};
  std::vector<float> window(shape.size());
  for (int step = 0; step < 40; ++step) {
    scribble(rng, scene.map, 2);
    scene.center_m = {rng.uniform(-1.0, 7.0), rng.uniform(-1.0, 7.0), rng.uniform(0.0, 3.0)};
    if (step % 3 == 0) scene.goal_m = {rng.uniform(0.0, 6.0), 1.0, 1.0};
    scene.mobile_m[0].x() += 0.1;
    scene.field.update(scene.map);              // not the potential's
    counting = form == RepulsionForm::kSummed;  // with kNearest the coarse distance field allocates
    scene.obstacles.update(scene.map);
    counting = true;
    scene.model.update(scene.map, scene.obstacles, {scene.center_m, scene.goal_m, scene.mobile_m}, &scene.field);
    sample_window(scene.model.fine(), shape, {scene.center_m, 0.1 * step}, window);
    sample_window(scene.model.coarse(), shape, {scene.center_m, 0.1 * step}, window);
    counting = false;
  }
  CHECK(allocations == 0);
  allocations = 0;
  counting = true;
  const std::vector<int> proof(100);
  counting = false;
  CHECK(allocations == 1);
  allocations = 0;
}
