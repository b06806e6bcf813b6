/// What the baselines and the clustering of k-means promise beyond seeing everything (strategy_test.cpp).
#include "core/rng.hpp"
#include "coverage3d/clustering.hpp"
#include "coverage3d/hybrid_strategy.hpp"
#include "coverage3d/pick_strategy.hpp"
#include "half_seen.hpp"
#include "planning3d/travel_costs.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace {

using namespace stairwell;
using namespace stairwell::coverage3d;
using toy::HalfSeen;

using Points = std::vector<Eigen::Vector3d>;
using Matrix = std::vector<std::vector<double>>;

Matrix distances(const Points& points) {
  Matrix d(points.size(), std::vector<double>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < points.size(); ++j) d[i][j] = (points[i] - points[j]).norm();
  return d;
}

Points heaps(Rng& rng, const Points& centers, int each) {
  Points points;
  for (const Eigen::Vector3d& c : centers)
    for (int i = 0; i < each; ++i)
      points.emplace_back(c + Eigen::Vector3d(rng.normal(0, 0.4), rng.normal(0, 0.4), rng.normal(0, 0.4)));
  return points;
}

/// Every inertia that a choice of `k` centres can have: the least of them.
double least_inertia(const Matrix& d, const std::vector<double>& weight, std::size_t k) {
  std::vector<char> chosen(weight.size(), 0);
  std::fill(chosen.end() - static_cast<std::ptrdiff_t>(k), chosen.end(), 1);
  double least = std::numeric_limits<double>::infinity();
  do {
    double sum = 0.0;
    for (std::size_t i = 0; i < weight.size(); ++i) {
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t c = 0; c < weight.size(); ++c)
        if (chosen[c] != 0) nearest = std::min(nearest, d[i][c]);
      sum += weight[i] * nearest * nearest;
    }
    least = std::min(least, sum);
  } while (std::next_permutation(chosen.begin(), chosen.end()));
  return least;
}

}  // namespace

TEST_CASE("clusters hold the points nearest to their centres, and come near the best choice of centres") {
  Rng rng(5);
  double found = 0.0;
  double best = 0.0;
  for (int round = 0; round < 30; ++round) {
    Points points;
    std::vector<double> weight;
    for (int i = 0; i < 12; ++i) {
      points.emplace_back(rng.uniform(0, 10), rng.uniform(0, 10), rng.uniform(0, 3));
      weight.push_back(rng.uniform(0.1, 2.0));
    }
    const Matrix d = distances(points);
    for (const std::size_t k : {1u, 2u, 3u, 4u}) {
      const Clustering clustering = cluster_points(d, weight, k);
      REQUIRE(clustering.centers.size() == k);
      CHECK(std::set<std::size_t>(clustering.centers.begin(), clustering.centers.end()).size() == k);
      double inertia = 0.0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double own = d[i][clustering.centers[clustering.cluster_of[i]]];
        for (const std::size_t c : clustering.centers) CHECK(own <= d[i][c]);
        inertia += weight[i] * own * own;
      }
      CHECK(clustering.inertia == Approx(inertia));
      const double least = least_inertia(d, weight, k);
      CHECK(clustering.inertia >= least - 1e-9);
      if (k == 1) CHECK(clustering.inertia == Approx(least));
      found += clustering.inertia;
      best += least;
    }
  }
  CHECK(found < 1.2 * best);
}

TEST_CASE("the elbow is at the number of heaps") {
  Rng rng(7);
  const Points places{{0, 0, 0}, {12, 0, 0}, {0, 14, 0}, {13, 15, 0}, {25, 7, 0}};
  for (std::size_t heaps_there = 2; heaps_there <= places.size(); ++heaps_there) {
    const Points points = heaps(rng, {places.begin(), places.begin() + static_cast<std::ptrdiff_t>(heaps_there)}, 8);
    const Clustering found = elbow_clusters(distances(points), std::vector<double>(points.size(), 1.0), 10);
    CHECK(found.centers.size() == heaps_there);
  }
  const Points alone{{1, 2, 3}};
  CHECK(elbow_clusters(distances(alone), {1.0}, 10).centers.size() == 1);
  const Points same(6, Eigen::Vector3d(1, 2, 3));
  CHECK(elbow_clusters(distances(same), std::vector<double>(6, 1.0), 10).centers.size() == 1);
}

TEST_CASE("by the ways between them, points on both sides of a slab are in different clusters") {
  const toy::World world = toy::two_storeys(0.2);
  mapping::OccupancyMap map(world.grid());
  for (std::size_t i = 0; i < world.grid().voxel_count(); ++i)
    map.update(world.grid().voxel(i), world.occupied(world.grid().voxel(i)));
  mapping::DistanceField distance(world.grid(), 1.0, mapping::Obstacles::kBlocked);
  distance.update(map);
  const CoverageConfig config = toy::config_for(world, toy::lidar());
  const planning3d::FreeSpace space(map, distance, config.robot, config.box);
  Points points;  // one above the other, far from the opening in the slab
  for (const double z_m : {2.5, 3.7})
    for (const double x_m : {0.7, 2.3, 3.9})
      for (const double y_m : {1.1, 1.5, 1.9}) points.emplace_back(x_m, y_m, z_m);
  Matrix way_m(points.size(), std::vector<double>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    planning3d::TravelCosts costs;
    costs.compute(space, points[i], planning3d::MotionRule::volume());
    for (std::size_t j = 0; j < points.size(); ++j) way_m[i][j] = static_cast<double>(costs.distance_m(points[j]));
  }
  const std::vector<double> weight(points.size(), 1.0);
  const auto spans_slab = [&](const Clustering& c) {
    return std::any_of(c.cluster_of.begin(), c.cluster_of.end(), [&](std::size_t cluster) {
      bool below = false, above = false;
      for (std::size_t i = 0; i < points.size(); ++i)
        if (c.cluster_of[i] == cluster) (points[i].z() < 3.0 ? below : above) = true;
      return below && above;
    });
  };
  CHECK_FALSE(spans_slab(elbow_clusters(way_m, weight, 10)));
  CHECK(spans_slab(cluster_points(distances(points), weight, 3)));  // as the crow flies they do
}

TEST_CASE("the nearest goal is as near as any that can be drawn, the greediest gains as much per second") {
  HalfSeen scene(false);
  planning3d::TravelCosts costs;
  costs.compute(scene.space(), scene.request.uavs[0].position_m, planning3d::MotionRule::volume());
  const auto first_goal = [&](std::string_view name) {
    const Assignment given = make_strategy(name, scene.config)->assign(scene.space(), scene.request);
    REQUIRE(given.goals[0].has_value());
    return *given.goals[0];
  };
  const auto way_m = [&](const Goal& goal) { return static_cast<double>(costs.distance_m(goal.position_m)); };
  const auto rate = [&](const Goal& goal) { return goal.gain_m3 / std::max(way_m(goal), 1.0); };
  double shortest_m = std::numeric_limits<double>::infinity(), longest_m = 0.0, best_rate = 0.0;
  for (scene.config.seed = 1; scene.config.seed <= 40; ++scene.config.seed) {
    const Goal drawn = first_goal("random");
    shortest_m = std::min(shortest_m, way_m(drawn));
    longest_m = std::max(longest_m, way_m(drawn));
    best_rate = std::max(best_rate, rate(drawn));
  }
  CHECK(way_m(first_goal("nearest")) <=
        shortest_m + 0.5);  // a stop's view may be a little farther than its nearest one
  CHECK(shortest_m + 1.0 < longest_m);
  CHECK(rate(first_goal("greedy")) >= 0.7 * best_rate);
}

TEST_CASE("random goals follow the seed, and are kept while they are open") {
  std::set<double> seen_m;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    HalfSeen scene(false);
    scene.config.seed = seed;
    const Assignment first = make_strategy("random", scene.config)->assign(scene.space(), scene.request);
    const auto strategy = make_strategy("random", scene.config);
    const Assignment again = strategy->assign(scene.space(), scene.request);
    REQUIRE(first.goals[0].has_value());
    REQUIRE(again.goals[0].has_value());
    CHECK(first.goals[0]->position_m == again.goals[0]->position_m);
    seen_m.insert(first.goals[0]->target_m.x());
    for (int i = 1; i < 8; ++i) {
      scene.request.time_s = i;
      scene.request.uavs[0].goal = again.goals[0];
      const Assignment later = strategy->assign(scene.space(), scene.request);
      REQUIRE(later.goals[0].has_value());
      CHECK(later.goals[0]->target_m == again.goals[0]->target_m);
    }
  }
  CHECK(seen_m.size() > 1);
}

TEST_CASE("the mower's line goes on without jumps and passes every place once") {
  const Aabb box{{-3, 2, 1}, {21, 17, 7.5}};
  const double lane_m = 5.0, band_m = 3.0;  // 3 lanes, 2 bands
  std::vector<std::pair<double, Eigen::Vector3d>> line;
  for (int band = 0; band < 2; ++band)
    for (int lane = 0; lane < 3; ++lane)
      for (int i = 0; i < 48; ++i) {
        const Eigen::Vector3d at_m(-3 + 0.5 * (i + 0.5), 2 + 5.0 * (lane + 0.5), 1 + 3.25 * (band + 0.5));
        line.emplace_back(mown_part(box, lane_m, band_m, at_m), at_m);
      }
  std::sort(line.begin(), line.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < line.size(); ++i) {
    CHECK(line[i].first == Approx((static_cast<double>(i) + 0.5) / static_cast<double>(line.size())));
    if (i > 0) CHECK((line[i].second - line[i - 1].second).norm() <= lane_m + 1e-9);
  }
  CHECK(mown_part(box, lane_m, band_m, {-50, -50, -50}) == Approx(0.0));
  CHECK(mown_part(box, lane_m, band_m, {50, 50, 50}) <= 1.0);
}

TEST_CASE("hybrid goes over to k-means at its share of the box, and stays there") {
  const HalfSeen scene(false);
  const double known = scene.map.known_volume_m3() / scene.config.box.volume_m3();
  for (const double switch_at : {0.5 * known, 1.5 * known}) {
    HybridStrategy hybrid(make_strategy("nearest", scene.config), make_strategy("kmeans", scene.config),
                          scene.config.box, switch_at);
    CHECK_FALSE(hybrid.switched());
    const Assignment given = hybrid.assign(scene.space(), scene.request);
    CHECK(hybrid.switched() == (switch_at < known));
    const auto alone = make_strategy(switch_at < known ? "kmeans" : "nearest", scene.config);
    const Assignment expected = alone->assign(scene.space(), scene.request);
    REQUIRE(given.goals[0].has_value());
    REQUIRE(expected.goals[0].has_value());
    CHECK(given.goals[0]->position_m == expected.goals[0]->position_m);
    HybridStrategy resumed(make_strategy("nearest", scene.config), make_strategy("kmeans", scene.config),
                           scene.config.box, switch_at);
    resumed.load_state(hybrid.save_state());
    CHECK(resumed.switched() == hybrid.switched());
  }
}
