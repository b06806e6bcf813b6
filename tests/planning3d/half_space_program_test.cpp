/// The linear programme of reciprocal avoidance against slow references.
#include "planning3d/half_space_program.hpp"
#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace stairwell;
using namespace stairwell::planning3d;

namespace {

constexpr double kSpeed_mps = 2.0;

Eigen::Vector3d random_in_cube(Rng& rng, double half) {
  return {rng.uniform(-half, half), rng.uniform(-half, half), rng.uniform(-half, half)};
}

Eigen::Vector3d random_direction(Rng& rng) {
  return Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized();
}

/// All hold at `inside`, so that there is a solution.
std::vector<HalfSpace> feasible_half_spaces(Rng& rng, int count, const Eigen::Vector3d& inside_mps) {
  std::vector<HalfSpace> half_spaces;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d normal = random_direction(rng);
    half_spaces.push_back({normal, normal.dot(inside_mps) - rng.uniform(0.0, 0.8)});
  }
  return half_spaces;
}

std::vector<HalfSpace> any_half_spaces(Rng& rng, int count) {
  std::vector<HalfSpace> half_spaces;
  for (int i = 0; i < count; ++i) half_spaces.push_back({random_direction(rng), rng.uniform(-0.5, 1.5)});
  return half_spaces;
}

/// Dykstra's alternating projections (Boyle and Dykstra 1986): the nearest point of the intersection, slowly. It may
/// stand still for many rounds, so there is no telling when it is done.
Eigen::Vector3d dykstra(const std::vector<HalfSpace>& half_spaces, const Eigen::Vector3d& preferred_mps) {
  Eigen::Vector3d x = preferred_mps;
  std::vector<Eigen::Vector3d> correction(half_spaces.size() + 1, Eigen::Vector3d::Zero());
  for (int round = 0; round < 4'000; ++round) {
    for (std::size_t i = 0; i <= half_spaces.size(); ++i) {
      const Eigen::Vector3d y = x + correction[i];
      x = y;
      if (i == half_spaces.size()) {
        if (y.norm() > kSpeed_mps) x = kSpeed_mps / y.norm() * y;
      } else {
        x += std::max(0.0, half_spaces[i].violation_mps(y)) * half_spaces[i].normal;
      }
      correction[i] = y - x;
    }
  }
  return x;
}

double worst_of(const std::vector<HalfSpace>& half_spaces, std::size_t from, std::size_t to,
                const Eigen::Vector3d& velocity_mps) {
  double worst = 0.0;
  for (std::size_t i = from; i < to; ++i) worst = std::max(worst, half_spaces[i].violation_mps(velocity_mps));
  return worst;
}

/// The least greatest violation of the soft ones by random search that narrows down.
double sampled_violation(Rng& rng, const std::vector<HalfSpace>& half_spaces, std::size_t hard) {
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double least = worst_of(half_spaces, hard, half_spaces.size(), best);
  double half = kSpeed_mps;
  for (int i = 0; i < 12'000; ++i) {
    const Eigen::Vector3d v = best + random_in_cube(rng, half);
    if (i % 400 == 399) half *= 0.7;
    if (v.norm() > kSpeed_mps || worst_of(half_spaces, 0, hard, v) > 0.0) continue;
    const double worst = worst_of(half_spaces, hard, half_spaces.size(), v);
    if (worst >= least) continue;
    least = worst;
    best = v;
  }
  return least;
}

}  // namespace

TEST_CASE("The velocity nearest to the preferred one is the projection onto the allowed ones") {
  Rng rng = make_rng(1, "half space program");
  for (int round = 0; round < 300; ++round) {
    const Eigen::Vector3d inside_mps = random_in_cube(rng, 1.0);
    const auto half_spaces = feasible_half_spaces(rng, rng.uniform_int(0, 12), inside_mps);
    const Eigen::Vector3d preferred_mps = random_in_cube(rng, 3.0);
    const ProgramResult result = nearest_velocity(half_spaces, 0, kSpeed_mps, preferred_mps);
    INFO("round " << round);
    CHECK(result.violation_mps == 0.0);
    CHECK(result.velocity_mps.norm() <= kSpeed_mps + 1e-9);
    CHECK(worst_of(half_spaces, 0, half_spaces.size(), result.velocity_mps) <= 1e-8);
    const Eigen::Vector3d reference_mps = dykstra(half_spaces, preferred_mps);
    CHECK((result.velocity_mps - preferred_mps).norm() <= (reference_mps - preferred_mps).norm() + 1e-6);
    CHECK((result.velocity_mps - reference_mps).norm() < 1e-5);
  }
}

TEST_CASE("Without a common velocity the greatest violation of the soft half-spaces is the least possible") {
  Rng rng = make_rng(2, "half space program");
  int infeasible = 0;
  for (int round = 0; round < 150; ++round) {
    std::vector<HalfSpace> half_spaces;
    const int hard = rng.uniform_int(0, 4);
    for (int i = 0; i < hard; ++i) half_spaces.push_back({random_direction(rng), rng.uniform(-1.0, 0.0)});
    for (const HalfSpace& soft : any_half_spaces(rng, 8)) half_spaces.push_back(soft);
    const auto result =
        nearest_velocity(half_spaces, static_cast<std::size_t>(hard), kSpeed_mps, random_in_cube(rng, 2.0));
    INFO("round " << round);
    const auto first = static_cast<std::size_t>(hard);
    CHECK(result.velocity_mps.norm() <= kSpeed_mps + 1e-8);
    CHECK(worst_of(half_spaces, 0, first, result.velocity_mps) <= 1e-8);
    const double worst = worst_of(half_spaces, first, half_spaces.size(), result.velocity_mps);
    CHECK(worst <= result.violation_mps + 1e-8);
    if (worst <= 1e-9) continue;
    ++infeasible;
    CHECK(worst <= sampled_violation(rng, half_spaces, first) + 1e-8);
  }
  CHECK(infeasible > 50);
}

TEST_CASE("Degenerate programmes have an answer") {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  SECTION("no half-spaces: the ball alone") {
    CHECK(nearest_velocity({}, 0, kSpeed_mps, {1.0, 0.0, 0.0}).velocity_mps.isApprox(x));
    CHECK(nearest_velocity({}, 0, kSpeed_mps, {9.0, 0.0, 0.0}).velocity_mps.isApprox(2.0 * x));
    CHECK(nearest_velocity({}, 0, 0.0, {9.0, 0.0, 0.0}).velocity_mps.norm() == 0.0);
  }
  SECTION("the same half-space many times, and zero wish") {
    const std::vector<HalfSpace> same(9, HalfSpace{x, 0.5});
    CHECK(nearest_velocity(same, 9, kSpeed_mps, Eigen::Vector3d::Zero()).velocity_mps.isApprox(0.5 * x));
  }
  SECTION("opposite ones: halfway") {
    const std::vector<HalfSpace> opposite = {{x, 0.6}, {-x, 0.2}};
    const ProgramResult result = nearest_velocity(opposite, 0, kSpeed_mps, {0.0, 1.0, 0.0});
    CHECK(result.violation_mps == Approx(0.4));
    CHECK(result.velocity_mps.x() == Approx(0.2));
  }
  SECTION("hard ones without anything in common: stand still") {
    const std::vector<HalfSpace> opposite = {{x, 0.6}, {-x, 0.2}};
    CHECK(nearest_velocity(opposite, 2, kSpeed_mps, {0.0, 1.0, 0.0}).velocity_mps.norm() == 0.0);
  }
  SECTION("out of the ball's reach: as near as the ball goes") {
    const ProgramResult result = nearest_velocity({{x, 5.0}}, 0, kSpeed_mps, {0.0, 1.0, 0.0});
    CHECK(result.velocity_mps.isApprox(2.0 * x));
    CHECK(result.violation_mps == Approx(3.0));
  }
}
