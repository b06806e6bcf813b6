#include "mapping/ray_walk.hpp"

namespace stairwell::mapping {

namespace {

/// Rays shorter than this have squared lengths with too few digits to be walked (OctoMap may not end on them).
constexpr float kShortest_m = 1e-15F;

/// Axis of the nearest voxel border, ties broken as OctoMap breaks them.
std::size_t next_axis(const std::array<double, 3>& t) {
  if (t[0] < t[1]) {
    return t[0] < t[2] ? 0 : 2;
  }
  return t[1] < t[2] ? 1 : 2;
}

}  // namespace

bool RayWalker::start(const Eigen::Vector3f& end_m, Ray& ray) const {
  Eigen::Vector3f direction = end_m - origin_m_;
  const float length = static_cast<float>(octomap_norm(direction));
  if (!(length > kShortest_m) || !std::isfinite(length)) {
    return false;
  }
  direction /= length;
  ray.length = static_cast<double>(length);
  const std::array<int, 3> origin_key{origin_key_.x, origin_key_.y, origin_key_.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto along = direction[static_cast<Eigen::Index>(axis)];
    ray.step[axis] = along > 0.0F ? 1 : (along < 0.0F ? -1 : 0);
    if (ray.step[axis] == 0) {
      ray.t_max[axis] = std::numeric_limits<double>::max();
      ray.t_delta[axis] = std::numeric_limits<double>::max();
      continue;
    }
    double border_m = lattice_.center_of(origin_key[axis]);
    border_m += static_cast<double>(static_cast<float>(ray.step[axis] * lattice_.resolution_m() * 0.5));
    ray.t_max[axis] =
        (border_m - static_cast<double>(origin_m_[static_cast<Eigen::Index>(axis)])) / static_cast<double>(along);
    ray.t_delta[axis] = lattice_.resolution_m() / std::fabs(static_cast<double>(along));
  }
  return true;
}

std::size_t RayWalker::walk(const Eigen::Vector3f& end_m, const LatticeKey& end_key, ScanWindow& window) const {
  if (origin_key_ == end_key) {
    return 0;
  }
  Ray ray;
  if (!start(end_m, ray)) {
    window.mark_miss(origin_key_);
    return 1;
  }
  return window.covers(origin_key_) && window.covers(end_key) ? walk_inside(ray, origin_key_, end_key, window)
                                                              : walk_clipped(ray, origin_key_, end_key, window);
}

/// @pre both ends lie in the window. Rounding lets a walk pass its end voxel by at most one voxel (the error of the
/// float direction over the whole key space is below 0.05 voxels), and the window has a rim of that width.
std::size_t RayWalker::walk_inside(Ray& ray, const LatticeKey& from, const LatticeKey& to, ScanWindow& window) {
  std::uint8_t* const cells = window.cells();
  const std::array<std::ptrdiff_t, 3> stride{ray.step[0], ray.step[1] * window.stride_y(),
                                             ray.step[2] * window.stride_z()};
  std::ptrdiff_t cell = window.index_of(from);
  const std::ptrdiff_t end = window.index_of(to);
  std::array<double, 3> t = ray.t_max;
  const std::array<double, 3> delta = ray.t_delta;
  std::size_t steps = 0;
  do {
    cells[cell] = ScanWindow::kMiss;
    ++steps;
    const std::size_t axis = next_axis(t);
    cell += stride[axis];
    t[axis] += delta[axis];
  } while (cell != end && !(std::min(std::min(t[0], t[1]), t[2]) > ray.length));
  return steps;
}

std::size_t RayWalker::walk_clipped(Ray& ray, LatticeKey key, const LatticeKey& end_key, ScanWindow& window) {
  const std::array<int*, 3> coordinate{&key.x, &key.y, &key.z};
  std::array<double, 3>& t = ray.t_max;
  bool was_inside = false;
  std::size_t steps = 0;
  do {
    const bool inside = window.covers(key);
    if (inside) {
      window.mark_miss(key);
      ++steps;
    } else if (was_inside) {
      break;  // a straight walk never comes back
    }
    was_inside = inside;
    const std::size_t axis = next_axis(t);
    *coordinate[axis] += ray.step[axis];
    t[axis] += ray.t_delta[axis];
  } while (key != end_key && !(std::min(std::min(t[0], t[1]), t[2]) > ray.length));
  return steps;
}

}  // namespace stairwell::mapping
