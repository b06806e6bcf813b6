#include "planning3d/shorten_path.hpp"

#include <algorithm>

namespace stairwell::planning3d {

namespace {

constexpr int kMostCuts = 300;
constexpr int kMostMisses = 60;    // in a row
constexpr double kWorth_m = 1e-3;  // less is no gain

/// From each point on to the last one that can be seen from it.
bool leave_out(const SegmentCheck& check, std::vector<Eigen::Vector3d>& path_m, const std::function<bool()>& stop) {
  std::vector<Eigen::Vector3d> kept_m{path_m.front()};
  for (std::size_t i = 0; i + 1 < path_m.size();) {
    std::size_t next = path_m.size() - 1;
    while (next > i + 1 && !check.segment_free(path_m[i], path_m[next])) {
      if (stop()) return false;
      --next;
    }
    kept_m.push_back(path_m[next]);
    i = next;
  }
  path_m = std::move(kept_m);
  return true;
}

struct Place {
  std::size_t leg;  ///< on the way to path_m[leg + 1]
  Eigen::Vector3d at_m;
};

Place place_at(const std::vector<Eigen::Vector3d>& path_m, double along_m) {
  std::size_t leg = 0;
  for (; leg + 2 < path_m.size(); ++leg) {
    const double length_m = (path_m[leg + 1] - path_m[leg]).norm();
    if (along_m <= length_m) break;
    along_m -= length_m;
  }
  const Eigen::Vector3d leg_m = path_m[leg + 1] - path_m[leg];
  const double length_m = leg_m.norm();
  return {leg, path_m[leg] + (length_m > 0.0 ? std::min(1.0, along_m / length_m) : 0.0) * leg_m};
}

}  // namespace

double path_length_m(const std::vector<Eigen::Vector3d>& path_m) {
  double length_m = 0.0;
  for (std::size_t i = 0; i + 1 < path_m.size(); ++i) length_m += (path_m[i + 1] - path_m[i]).norm();
  return length_m;
}

std::vector<Eigen::Vector3d> shorten_path(const SegmentCheck& check, std::vector<Eigen::Vector3d> path_m, Rng& rng,
                                          const std::function<bool()>& stop) {
  if (path_m.size() < 3 || !leave_out(check, path_m, stop)) return path_m;
  int misses = 0;
  for (int cut = 0; cut < kMostCuts && misses < kMostMisses && path_m.size() > 2; ++cut) {
    if (stop()) return path_m;
    const double length_m = path_length_m(path_m);
    double from_along_m = rng.uniform(0.0, length_m);
    double to_along_m = rng.uniform(0.0, length_m);
    if (from_along_m > to_along_m) std::swap(from_along_m, to_along_m);
    const Place from = place_at(path_m, from_along_m);
    const Place to = place_at(path_m, to_along_m);
    ++misses;
    if (from.leg == to.leg) continue;
    const double gain_m = to_along_m - from_along_m - (to.at_m - from.at_m).norm();
    if (gain_m < kWorth_m || !check.segment_free(from.at_m, to.at_m)) continue;
    // The rests of the two cut legs have ends of their own: a voxel walk from elsewhere on a line may round otherwise.
    if (!check.segment_free(path_m[from.leg], from.at_m) || !check.segment_free(to.at_m, path_m[to.leg + 1])) continue;
    std::vector<Eigen::Vector3d> cut_m(path_m.begin(), path_m.begin() + static_cast<std::ptrdiff_t>(from.leg) + 1);
    cut_m.push_back(from.at_m);
    cut_m.push_back(to.at_m);
    cut_m.insert(cut_m.end(), path_m.begin() + static_cast<std::ptrdiff_t>(to.leg) + 1, path_m.end());
    path_m = std::move(cut_m);
    misses = 0;
  }
  leave_out(check, path_m, stop);
  return path_m;
}

}  // namespace stairwell::planning3d
