#include "planning3d/curve.hpp"

#include "core/rng.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

using namespace stairwell;
using namespace stairwell::planning3d;

namespace {

std::vector<Eigen::Vector3d> random_corners(Rng& rng) {
  std::vector<Eigen::Vector3d> corners_m{{rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0)}};
  for (int legs = rng.uniform_int(1, 8); legs > 0; --legs) {
    const Eigen::Vector3d direction(rng.normal(), rng.normal(), rng.normal());
    const double length_m = rng.uniform() < 0.3 ? rng.uniform(0.1, 0.5) : rng.uniform(0.5, 15.0);
    corners_m.push_back(corners_m.back() + length_m * direction.normalized());
  }
  return corners_m;
}

/// Distance to the nearest corner between two legs.
double to_corner(const std::vector<Eigen::Vector3d>& corners_m, const Eigen::Vector3d& p_m) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < corners_m.size(); ++i) nearest_m = std::min(nearest_m, (corners_m[i] - p_m).norm());
  return nearest_m;
}

/// Where two spans meet a corner's control points weigh 1, 4, 1 sixths; the next one on a leg is a metre on at most.
double leaves_within_m(double reach_m) { return (5.0 * reach_m + 1.0) / 6.0; }

void check_table(const Curve& curve, const std::vector<Eigen::Vector3d>& corners_m) {
  CHECK(curve.point_m.front() == corners_m.front());
  CHECK(curve.point_m.back() == corners_m.back());
  double longest_step_m = 0.0;
  double least_step_m = std::numeric_limits<double>::infinity();
  double tangent_error = std::abs(curve.tangent.front().norm() - 1.0);
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const double step_m = (curve.point_m[i] - curve.point_m[i - 1]).norm();
    longest_step_m = std::max(longest_step_m, step_m);
    least_step_m = std::min(least_step_m, curve.arc_m[i] - curve.arc_m[i - 1]);
    tangent_error = std::max(tangent_error, std::abs(curve.tangent[i].norm() - 1.0));
  }
  CHECK(longest_step_m <= 0.032);  // nodes every 3 cm, the end moved by a millimetre
  CHECK(least_step_m > 0.0);
  CHECK(tangent_error < 1e-9);
}

}  // namespace

TEST_CASE("rounded paths leave straight legs only near corners, and little there", "[curve]") {
  Rng rng = make_rng(21, "rounded-paths");
  std::size_t straight = 0;
  std::size_t rounded = 0;
  for (int path = 0; path < 200; ++path) {
    const std::vector<Eigen::Vector3d> corners_m = random_corners(rng);
    const double reach_m = rng.uniform(0.1, 1.5);
    const Curve curve = RoundedPath(corners_m, reach_m).curve();
    CAPTURE(path, reach_m, corners_m.size());
    check_table(curve, corners_m);
    double worst_m = 0.0;
    double worst_on_legs_m = 0.0;
    for (const Eigen::Vector3d& p_m : curve.point_m) {
      const double away_m = distance_to_polyline(corners_m, p_m);
      worst_m = std::max(worst_m, away_m);
      const bool on_leg = to_corner(corners_m, p_m) > leaves_within_m(reach_m);
      if (on_leg) worst_on_legs_m = std::max(worst_on_legs_m, away_m);
      ++(on_leg ? straight : rounded);
    }
    CHECK(worst_m <= reach_m / 6.0 + 1e-9);
    CHECK(worst_on_legs_m < 1e-9);
  }
  CHECK(straight > 10000);
  CHECK(rounded > 10000);
}

TEST_CASE("points on a straight line are flown through, never back", "[curve]") {
  Rng rng = make_rng(23, "straight-paths");
  for (int path = 0; path < 100; ++path) {
    const Eigen::Vector3d direction = Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    std::vector<Eigen::Vector3d> corners_m{Eigen::Vector3d::Zero()};
    for (int i = 0; i < 5; ++i) corners_m.push_back(corners_m.back() + rng.uniform(0.1, 2.0) * direction);
    const Curve curve = RoundedPath(corners_m, 1.5).curve();
    CHECK(curve.length_m() == Approx(corners_m.back().norm()).epsilon(1e-9));
    for (const Eigen::Vector3d& tangent : curve.tangent) REQUIRE(tangent.dot(direction) > 0.999);
  }
}

TEST_CASE("a tightened corner is cut less, the others as before", "[curve]") {
  const std::vector<Eigen::Vector3d> corners_m{{0, 0, 0}, {6, 0, 0}, {6, 6, 0}, {12, 6, 0}};
  constexpr double kReach_m = 0.9;
  const auto worst_near = [&](const RoundedPath& path, const Eigen::Vector3d& corner_m) {
    double worst_m = 0.0;
    for (const Eigen::Vector3d& p_m : path.curve().point_m) {
      if ((p_m - corner_m).norm() < 2.0) worst_m = std::max(worst_m, distance_to_polyline(corners_m, p_m));
    }
    return worst_m;
  };
  RoundedPath path(corners_m, kReach_m);
  CHECK(worst_near(path, corners_m[1]) == Approx(kReach_m / 6.0));
  REQUIRE(path.tighten_near(corners_m[1] + Eigen::Vector3d(0.1, 0.1, 0.0)));
  CHECK(worst_near(path, corners_m[1]) == Approx(0.45 * kReach_m / 6.0));
  CHECK(worst_near(path, corners_m[2]) == Approx(kReach_m / 6.0));
  CHECK_FALSE(path.tighten_near({6, 3, 0}));  // no corner's rounding comes here
  int times = 1;
  while (path.tighten_near(corners_m[1])) ++times;
  CHECK(times < 10);
  CHECK(worst_near(path, corners_m[1]) <= 0.03 / 6.0);
}

TEST_CASE("the distance to a polyline is that to its nearest point", "[curve]") {
  Rng rng = make_rng(22, "polylines");
  for (int i = 0; i < 100; ++i) {
    const std::vector<Eigen::Vector3d> path_m = random_corners(rng);
    const Eigen::Vector3d p_m(rng.uniform(-9.0, 9.0), rng.uniform(-9.0, 9.0), rng.uniform(-9.0, 9.0));
    double nearest_m = std::numeric_limits<double>::infinity();
    for (std::size_t leg = 0; leg + 1 < path_m.size(); ++leg) {
      for (int k = 0; k <= 1000; ++k) {
        const Eigen::Vector3d at_m = path_m[leg] + k / 1000.0 * (path_m[leg + 1] - path_m[leg]);
        nearest_m = std::min(nearest_m, (at_m - p_m).norm());
      }
    }
    CHECK(distance_to_polyline(path_m, p_m) <= nearest_m + 1e-12);
    CHECK(distance_to_polyline(path_m, p_m) >= nearest_m - 0.0076);  // half a sample's spacing on the longest leg
  }
  const Eigen::Vector3d p_m(0.0, 3.0, 4.0);
  CHECK(distance_to_polyline({{0, 0, 0}}, p_m) == 5.0);
  CHECK(distance_to_polyline({{0, 0, 0}, {0, 0, 0}}, p_m) == 5.0);
  CHECK(std::isinf(distance_to_polyline({}, p_m)));
}
