#include "coverage3d/kmeans_strategy.hpp"

#include "coverage3d/clustering.hpp"

#include <algorithm>

namespace stairwell::coverage3d {
namespace {

constexpr std::size_t kMostPoints = 48;  // the largest; the others wait
constexpr std::size_t kMostClusters = 10;
constexpr double kNoCenter_m = 1e6;

}  // namespace

void KMeansStrategy::share_out(const planning3d::FreeSpace& space, const AssignmentRequest& request, const Crew& crew,
                               const std::vector<Stop>& stops, Assignment& assignment) {
  std::vector<const Stop*> points;
  for (const Stop& stop : stops) points.push_back(&stop);
  std::stable_sort(points.begin(), points.end(),
                   [](const Stop* a, const Stop* b) { return a->cluster->area_m2 > b->cluster->area_m2; });
  points.resize(std::min(points.size(), kMostPoints));
  ways_.begin(space, motion_rule(), static_cast<int>(kMostPoints));
  std::vector<std::vector<double>> way_m(points.size(), std::vector<double>(points.size(), 0.0));
  std::vector<double> weight;
  for (std::size_t i = 0; i < points.size(); ++i) {
    weight.push_back(points[i]->cluster->area_m2);
    for (std::size_t j = 0; j < i; ++j)
      way_m[i][j] = way_m[j][i] = ways_.distance_m(space, points[i]->pose().position_m, points[j]->pose().position_m);
  }
  centers_.clear();
  if (!points.empty())
    for (const std::size_t center : elbow_clusters(way_m, weight, kMostClusters).centers)
      centers_.insert(points[center]->cluster->id);
  PickStrategy::share_out(space, request, crew, stops, assignment);
}

double KMeansStrategy::rank(const Choice& choice, const Stop& stop) const {
  return way_m(choice.vehicle, stop.pose()) + (centers_.contains(stop.cluster->id) ? 0.0 : kNoCenter_m);
}

}  // namespace stairwell::coverage3d
