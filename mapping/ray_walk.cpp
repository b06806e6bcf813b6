#include "mapping/ray_walk.hpp"

// The same arithmetic in wider registers where the processor has them (chosen when the program is loaded).
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define STAIRWELL_WALK_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define STAIRWELL_WALK_CLONES
#endif

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

constexpr int kLanes = 4;
using Doubles = double __attribute__((vector_size(kLanes * sizeof(double))));
using Integers = std::int64_t __attribute__((vector_size(kLanes * sizeof(std::int64_t))));

struct Lanes {
  Doubles t[3];
  Doubles delta[3];
  Doubles length;
  Integers stride[3];
  Integers cell;
  Integers end;
  Integers done;
};

/// A lane that marks the spare cell for ever.
void idle(Lanes& lanes, int lane, std::ptrdiff_t spare_cell) {
  for (int axis = 0; axis < 3; ++axis) {
    lanes.t[axis][lane] = 0.0;
    lanes.delta[axis][lane] = 0.0;
    lanes.stride[axis][lane] = 0;
  }
  lanes.length[lane] = std::numeric_limits<double>::infinity();
  lanes.cell[lane] = spare_cell;
  lanes.end[lane] = -1;
}

/// Steps all lanes, marking what they enter, until at least one is done; voxels of the step that ended it are left
/// to the caller. @return voxels marked by the active lanes
STAIRWELL_WALK_CLONES std::size_t advance(Lanes& lanes, std::uint8_t* cells, std::size_t active) {
  Doubles tx = lanes.t[0], ty = lanes.t[1], tz = lanes.t[2];
  Integers cell = lanes.cell;
  std::size_t steps = 0;
  for (;;) {
    const Doubles yz = ty < tz ? ty : tz;
    const Doubles nearest = tx < yz ? tx : yz;
    const Integers along_z = tz == nearest;
    const Integers along_y = (ty == nearest) & ~along_z;
    const Integers along_x = ~(along_y | along_z);
    tx += reinterpret_cast<Doubles>(reinterpret_cast<Integers>(lanes.delta[0]) & along_x);
    ty += reinterpret_cast<Doubles>(reinterpret_cast<Integers>(lanes.delta[1]) & along_y);
    tz += reinterpret_cast<Doubles>(reinterpret_cast<Integers>(lanes.delta[2]) & along_z);
    cell += (lanes.stride[0] & along_x) | (lanes.stride[1] & along_y) | (lanes.stride[2] & along_z);
    // The nearest border is beyond the length when all three are.
    const Integers done = (cell == lanes.end) | ((tx > lanes.length) & (ty > lanes.length) & (tz > lanes.length));
    if ((done[0] | done[1] | done[2] | done[3]) != 0) {
      lanes.done = done;
      break;
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      cells[cell[lane]] = ScanWindow::kMiss;
    }
    steps += active;
  }
  lanes.t[0] = tx;
  lanes.t[1] = ty;
  lanes.t[2] = tz;
  lanes.cell = cell;
  return steps;
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
    const float from_m = origin_m_[static_cast<Eigen::Index>(axis)];
    ray.t_max[axis] = lattice_.to_border_m(origin_key[axis], ray.step[axis], from_m) / static_cast<double>(along);
    ray.t_delta[axis] = lattice_.resolution_m() / std::fabs(static_cast<double>(along));
  }
  return true;
}

/// Hands out rays that lie inside the window one after another; walks the others itself.
struct RayWalker::Feed {
  const RayWalker& walker;
  std::span<const RayEnd> ends;
  ScanWindow& window;
  std::size_t next = 0;
  std::size_t steps = 0;

  bool take(Ray& ray, const RayEnd*& end) {
    while (next < ends.size()) {
      end = &ends[next++];
      if (walker.origin_key_ == end->end_key) {
        continue;
      }
      if (!walker.start(end->end_m, ray)) {
        window.mark_miss(walker.origin_key_);
        ++steps;
      } else if (window.covers(walker.origin_key_) && window.covers(end->end_key)) {
        return true;
      } else {
        steps += walk_clipped(ray, walker.origin_key_, end->end_key, window);
      }
    }
    return false;
  }
};

/// Four rays in lock-step, so that the arithmetic of one hides the latency of the others; a ray that ends makes
/// room for the next. Each lane does what OctoMap does: step along the axis with the nearest border (z before y
/// before x on ties), stop at the end voxel or when the nearest border lies beyond the ray's length. Rounding lets
/// a walk pass its end voxel by at most one voxel (the error of the float direction over the whole key space is
/// below 0.05 voxels), and the window has a rim of that width.
std::size_t RayWalker::walk(std::span<const RayEnd> ends, ScanWindow& window) const {
  Feed feed{*this, ends, window};
  std::uint8_t* const cells = window.cells();
  const std::ptrdiff_t first_cell = window.covers(origin_key_) ? window.index_of(origin_key_) : 0;
  Lanes lanes{};
  int active = 0;
  const auto load = [&](int lane) {
    Ray ray;
    const RayEnd* end = nullptr;
    if (!feed.take(ray, end)) {
      idle(lanes, lane, window.spare_cell());
      return;
    }
    ++active;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lanes.t[axis][lane] = ray.t_max[axis];
      lanes.delta[axis][lane] = ray.t_delta[axis];
    }
    lanes.length[lane] = ray.length;
    lanes.stride[0][lane] = ray.step[0];
    lanes.stride[1][lane] = ray.step[1] * window.stride_y();
    lanes.stride[2][lane] = ray.step[2] * window.stride_z();
    lanes.cell[lane] = first_cell;
    lanes.end[lane] = window.index_of(end->end_key);
    cells[first_cell] = ScanWindow::kMiss;
    ++feed.steps;
  };
  for (int lane = 0; lane < kLanes; ++lane) {
    load(lane);
  }
  while (active > 0) {
    feed.steps += advance(lanes, cells, static_cast<std::size_t>(active));
    for (int lane = 0; lane < kLanes; ++lane) {
      if (lanes.done[lane] != 0) {
        --active;
        load(lane);
      } else {
        feed.steps += lanes.cell[lane] != window.spare_cell() ? 1U : 0U;
        cells[lanes.cell[lane]] = ScanWindow::kMiss;
      }
    }
  }
  return feed.steps;
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
