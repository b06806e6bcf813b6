#pragma once

#include <cstddef>
#include <vector>

namespace stairwell::coverage3d {

/// Points grouped about some of them.
struct Clustering {
  std::vector<std::size_t> centers;     ///< the point that stands for each cluster
  std::vector<std::size_t> cluster_of;  ///< [point]: index into `centers`
  double inertia = 0.0;                 ///< weighted sum of squared distances to the centres
};

/// k-means where only distances are known, so that a centre is one of the points (k-medoids): Lloyd's iteration from
/// centres chosen farthest first. Repeatable.
/// @param distance_m [point][point], symmetric; infinite where there is no way
/// @param weight [point] @pre 1 <= k <= number of points
Clustering cluster_points(const std::vector<std::vector<double>>& distance_m, const std::vector<double>& weight,
                          std::size_t k);

/// The number of clusters by the elbow method (SPEC A9): where the inertia's fall slows down most from one k to the
/// next, in proportion. k runs from 1 to `most`.
Clustering elbow_clusters(const std::vector<std::vector<double>>& distance_m, const std::vector<double>& weight,
                          std::size_t most);

}  // namespace stairwell::coverage3d
