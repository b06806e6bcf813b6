/// Half-spaces of reciprocal avoidance, free cells and single decisions.
#include "planning3d/orca.hpp"

#include "core/rng.hpp"
#include "test_world.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace stairwell;
using namespace stairwell::planning3d;
using stairwell::test::TestWorld;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kCombined_m = 0.5;
constexpr double kHorizon_s = 3.0;

Eigen::Vector3d random_in_cube(Rng& rng, double half) {
  return {rng.uniform(-half, half), rng.uniform(-half, half), rng.uniform(-half, half)};
}

SeenUav random_uav(Rng& rng, std::size_t number) {
  return {random_in_cube(rng, 3.0), random_in_cube(rng, 1.2), number};
}

/// Least distance of two UAVs that keep their velocities for `time_s`.
double least_distance_m(const SeenUav& a, const SeenUav& b, const Eigen::Vector3d& va_mps,
                        const Eigen::Vector3d& vb_mps, double time_s) {
  const Eigen::Vector3d apart_m = a.position_m - b.position_m;
  const Eigen::Vector3d relative_mps = va_mps - vb_mps;
  const double squared = relative_mps.squaredNorm();
  const double t_s = squared > 0.0 ? std::clamp(-apart_m.dot(relative_mps) / squared, 0.0, time_s) : 0.0;
  return (apart_m + t_s * relative_mps).norm();
}

/// A random velocity on the boundary of the half-space or inside it.
Eigen::Vector3d allowed(Rng& rng, const HalfSpace& half_space) {
  const Eigen::Vector3d v_mps = random_in_cube(rng, 2.0);
  const double missing_mps = half_space.violation_mps(v_mps);
  return missing_mps > 0.0 ? Eigen::Vector3d(v_mps + missing_mps * half_space.normal) : v_mps;
}

OrcaConfig slow_config() {
  OrcaConfig config;
  config.limits.speed_mps = 1.5;
  return config;
}

}  // namespace

TEST_CASE("Two UAVs that both keep to their half-spaces do not collide within the horizon") {
  Rng rng = make_rng(1, "orca");
  int met = 0;
  for (int round = 0; round < 20'000; ++round) {
    const SeenUav a = random_uav(rng, 0);
    const SeenUav b = random_uav(rng, 1);
    if ((a.position_m - b.position_m).norm() <= kCombined_m) continue;
    const HalfSpace of_a = reciprocal_half_space(a, b, kCombined_m, kHorizon_s, 0.5);
    const HalfSpace of_b = reciprocal_half_space(b, a, kCombined_m, kHorizon_s, 0.5);
    const Eigen::Vector3d va_mps = allowed(rng, of_a);
    const Eigen::Vector3d vb_mps = allowed(rng, of_b);
    INFO("round " << round);
    CHECK(of_a.normal.norm() == Approx(1.0));
    CHECK((of_a.normal + of_b.normal).norm() < 1e-6);
    REQUIRE(least_distance_m(a, b, va_mps, vb_mps, kHorizon_s) > kCombined_m - 1e-6);
    met += least_distance_m(a, b, a.velocity_mps, b.velocity_mps, kHorizon_s) < kCombined_m ? 1 : 0;
  }
  CHECK(met > 100);
}

TEST_CASE("The change of velocity is the smallest that avoids the collision, half of it each") {
  Rng rng = make_rng(2, "orca");
  int met = 0;
  for (int round = 0; round < 4'000; ++round) {
    const SeenUav a = random_uav(rng, 0);
    const SeenUav b = random_uav(rng, 1);
    if ((a.position_m - b.position_m).norm() <= 1.01 * kCombined_m) continue;
    if (least_distance_m(a, b, a.velocity_mps, b.velocity_mps, kHorizon_s) >= kCombined_m) continue;
    const double half = reciprocal_half_space(a, b, kCombined_m, kHorizon_s, 0.5).violation_mps(a.velocity_mps);
    const double whole = reciprocal_half_space(a, b, kCombined_m, kHorizon_s, 0.5, 1.0).violation_mps(a.velocity_mps);
    CHECK(whole == Approx(2.0 * half));
    ++met;
    for (int i = 0; i < 500; ++i) {
      const Eigen::Vector3d change_mps = random_in_cube(rng, 1.0).normalized() * 0.99 * whole;
      REQUIRE(least_distance_m(a, b, a.velocity_mps + change_mps, b.velocity_mps, kHorizon_s) < kCombined_m + 1e-6);
    }
  }
  CHECK(met > 20);
}

TEST_CASE("Exactly opposite motions and same places are told apart") {
  const SeenUav a{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 0};
  const SeenUav b{{2.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}, 1};
  const HalfSpace of_a = reciprocal_half_space(a, b, kCombined_m, kHorizon_s, 0.5);
  const HalfSpace of_b = reciprocal_half_space(b, a, kCombined_m, kHorizon_s, 0.5);
  CHECK((of_a.normal + of_b.normal).norm() < 1e-9);
  CHECK(of_a.normal.y() < -0.5);  // to the right of +x
  const SeenUav here{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0};
  const SeenUav also_here{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1};
  const HalfSpace one = reciprocal_half_space(here, also_here, kCombined_m, kHorizon_s, 0.5);
  const HalfSpace other = reciprocal_half_space(also_here, here, kCombined_m, kHorizon_s, 0.5);
  CHECK(one.normal.isApprox(-other.normal));
  CHECK(one.offset_mps > 0.0);
}

TEST_CASE("Nowhere in a free cell does the robot touch anything blocked") {
  Rng rng = make_rng(3, "orca");
  for (int round = 0; round < 6; ++round) {
    TestWorld world({5.0, 5.0, 3.0}, 0.1);
    world.clutter(rng, 25, 1.2);
    const FreeSpace space = world.space();
    for (int place = 0; place < 15; ++place) {
      const Eigen::Vector3d center_m = world.random_place(space, rng) + random_in_cube(rng, 0.04);
      if (!space.sphere_free(center_m, 0.2)) continue;
      const FreeCell cell(space, center_m, 1.0, 0.0);
      CHECK(cell.contains(center_m));
      for (int i = 0; i < 300; ++i) {
        const Eigen::Vector3d point_m = center_m + random_in_cube(rng, 1.0);
        if (cell.contains(point_m)) REQUIRE(space.sphere_free(point_m, 0.2));
      }
    }
  }
}

TEST_CASE("Alone in free space the wish is flown, within the acceleration limit") {
  TestWorld world({8.0, 8.0, 8.0}, 0.2);
  const FreeSpace space = world.space();
  const OrcaConfig config;
  SeenUav own{{4.0, 4.0, 4.0}, {0.0, 0.0, 0.0}, 0};
  const Eigen::Vector3d wish_mps(0.0, 0.8, 0.3);
  for (int i = 0; i < 10; ++i) {
    const OrcaChoice choice = choose_velocity(space, config, own, wish_mps, {});
    CHECK_FALSE(choice.braking);
    CHECK((choice.velocity_mps - own.velocity_mps).norm() <= config.limits.acceleration_mps2 * config.period_s);
    own.velocity_mps = choice.velocity_mps;
  }
  CHECK(own.velocity_mps.isApprox(wish_mps));
}

TEST_CASE("Whatever is wished for, the map is not touched and the limits are kept") {
  Rng rng = make_rng(4, "orca");
  const OrcaConfig config = slow_config();
  for (int round = 0; round < 12; ++round) {
    TestWorld world({4.0, 4.0, 3.0}, 0.1);
    world.clutter(rng, 15, 1.0);
    const FreeSpace space = world.space();
    SeenUav own{world.random_place(space, rng), Eigen::Vector3d::Zero(), 0};
    Eigen::Vector3d wish_mps = Eigen::Vector3d::Zero();
    for (int i = 0; i < 150; ++i) {
      if (i % 10 == 0) wish_mps = random_in_cube(rng, 4.0);
      const SeenUav ghost{own.position_m + random_in_cube(rng, 1.5), random_in_cube(rng, 1.5), 1};
      const Eigen::Vector3d next_mps = choose_velocity(space, config, own, wish_mps, {ghost}).velocity_mps;
      REQUIRE(next_mps.norm() <= config.limits.speed_mps + 1e-9);
      REQUIRE((next_mps - own.velocity_mps).norm() <= config.limits.acceleration_mps2 * config.period_s + 1e-9);
      own.position_m += 0.5 * config.period_s * (own.velocity_mps + next_mps);
      own.velocity_mps = next_mps;
      REQUIRE(space.sphere_free(own.position_m, space.robot().radius_m));
    }
  }
}

TEST_CASE("Degenerate input is answered by a finite velocity") {
  TestWorld world({6.0, 6.0, 6.0}, 0.2);
  const FreeSpace space = world.space();
  const OrcaConfig config;
  const SeenUav own{{3.0, 3.0, 3.0}, {0.5, 0.0, 0.0}, 0};
  const Eigen::Vector3d nan = Eigen::Vector3d::Constant(kNaN);
  const SeenUav same_place{own.position_m, own.velocity_mps, 1};
  const SeenUav lost{nan, Eigen::Vector3d::Zero(), 2};
  CHECK(choose_velocity(space, config, own, {1.0, 0.0, 0.0}, {same_place}).velocity_mps.allFinite());
  CHECK(choose_velocity(space, config, own, {1.0, 0.0, 0.0}, {lost})
            .velocity_mps.isApprox(choose_velocity(space, config, own, {1.0, 0.0, 0.0}, {}).velocity_mps));
  CHECK(choose_velocity(space, config, own, nan, {}).velocity_mps.x() < 0.5);
  const SeenUav of_no_speed{{3.5, 3.0, 3.0}, nan, 3};
  CHECK(choose_velocity(space, config, own, {1.0, 0.0, 0.0}, {of_no_speed}).velocity_mps.allFinite());
  const OrcaChoice blind = choose_velocity(space, config, {nan, Eigen::Vector3d::Zero(), 0}, {1.0, 0.0, 0.0}, {});
  CHECK(blind.braking);
  CHECK(blind.velocity_mps.norm() == 0.0);
  const SeenUav still{own.position_m, Eigen::Vector3d::Zero(), 0};
  CHECK(choose_velocity(space, config, still, Eigen::Vector3d::Zero(), {}).velocity_mps.norm() == 0.0);
  const SeenUav in_a_wall{{-1.0, 3.0, 3.0}, Eigen::Vector3d::Zero(), 0};
  CHECK(choose_velocity(space, config, in_a_wall, {1.0, 0.0, 0.0}, {same_place}).velocity_mps.allFinite());
}

TEST_CASE("Every problem of an avoidance configuration is named") {
  CHECK(OrcaConfig{}.problems().empty());
  OrcaConfig config;
  config.horizon_s = kNaN;
  config.period_s = 0.0;
  config.margin_m = -1.0;
  CHECK(config.problems().size() == 3);
}
