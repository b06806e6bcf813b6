#include "coverage3d/clustering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace stairwell::coverage3d {
namespace {

using Matrix = std::vector<std::vector<double>>;
constexpr int kRounds = 20;
constexpr double kFar_m = 1e4;  // stands for "no way", so that sums stay finite

double squared(const Matrix& distance_m, std::size_t a, std::size_t b) {
  const double d_m = std::min(distance_m[a][b], kFar_m);
  return d_m * d_m;
}

/// The point with the least weighted sum of squares to the others of its group.
std::size_t middle_of(const Matrix& distance_m, const std::vector<double>& weight,
                      const std::vector<std::size_t>& members) {
  std::size_t best = members.front();
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t a : members) {
    double sum = 0.0;
    for (const std::size_t b : members) sum += weight[b] * squared(distance_m, a, b);
    if (sum >= least) continue;
    least = sum;
    best = a;
  }
  return best;
}

std::vector<std::size_t> spread_centers(const Matrix& distance_m, const std::vector<double>& weight, std::size_t k) {
  std::vector<std::size_t> everyone(weight.size());
  std::iota(everyone.begin(), everyone.end(), std::size_t{0});
  std::vector<std::size_t> centers{middle_of(distance_m, weight, everyone)};
  while (centers.size() < k) {
    std::size_t farthest = 0;
    double most = -1.0;
    for (std::size_t i = 0; i < weight.size(); ++i) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const std::size_t c : centers) nearest = std::min(nearest, squared(distance_m, i, c));
      if (nearest <= most) continue;
      most = nearest;
      farthest = i;
    }
    centers.push_back(farthest);
  }
  return centers;
}

void attach(const Matrix& distance_m, const std::vector<double>& weight, Clustering& found) {
  found.inertia = 0.0;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    std::size_t nearest = 0;
    for (std::size_t c = 1; c < found.centers.size(); ++c)
      if (squared(distance_m, i, found.centers[c]) < squared(distance_m, i, found.centers[nearest])) nearest = c;
    found.cluster_of[i] = nearest;
    found.inertia += weight[i] * squared(distance_m, i, found.centers[nearest]);
  }
}

}  // namespace

Clustering cluster_points(const Matrix& distance_m, const std::vector<double>& weight, std::size_t k) {
  Clustering found;
  found.centers = spread_centers(distance_m, weight, k);
  found.cluster_of.assign(weight.size(), 0);
  attach(distance_m, weight, found);
  for (int round = 0; round < kRounds; ++round) {
    Clustering next = found;
    for (std::size_t c = 0; c < k; ++c) {
      std::vector<std::size_t> members;
      for (std::size_t i = 0; i < weight.size(); ++i)
        if (found.cluster_of[i] == c) members.push_back(i);
      if (!members.empty()) next.centers[c] = middle_of(distance_m, weight, members);
    }
    attach(distance_m, weight, next);
    if (next.inertia >= found.inertia) break;
    found = std::move(next);
  }
  return found;
}

Clustering elbow_clusters(const Matrix& distance_m, const std::vector<double>& weight, std::size_t most) {
  const std::size_t last = std::min(most, weight.size());
  std::vector<Clustering> tried;
  for (std::size_t k = 1; k <= last; ++k) tried.push_back(cluster_points(distance_m, weight, k));
  std::size_t best = 0;
  double sharpest = 1.0;  // a straight line has no elbow
  for (std::size_t i = 1; i < tried.size(); ++i) {
    const double before = tried[i - 1].inertia - tried[i].inertia;
    const double after = i + 1 < tried.size() ? tried[i].inertia - tried[i + 1].inertia : 0.0;
    const double floor = 1e-3 * tried[0].inertia + 1e-12;  // nothing is gained any more
    const double bend = before / std::max(after, floor);
    if (before <= floor || bend <= sharpest) continue;
    sharpest = bend;
    best = i;
  }
  return tried[best];
}

}  // namespace stairwell::coverage3d
