#include "planning3d/arrival_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace stairwell::planning3d {

namespace {

constexpr std::size_t kStopEvery = 8;  ///< buckets
constexpr float kImpassable = -1.0F;
constexpr float kLeastGain = 1e-4F;  // cell edges: less is not worth another visit
constexpr double kExactCells = 2.5;  // around the goal T is the plain distance
constexpr std::array<std::array<int, 3>, 6> kFaces{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

}  // namespace

bool ArrivalField::inside(const Cell& c) const {
  return c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && c[0] < size_[0] && c[1] < size_[1] && c[2] < size_[2];
}

ArrivalField::Cell ArrivalField::cell_of(std::size_t linear) const {
  const auto at = static_cast<std::uint32_t>(linear);
  const auto row = static_cast<std::uint32_t>(row_), slab = static_cast<std::uint32_t>(slab_);
  return {static_cast<int>(at % row) - 1, static_cast<int>(at % slab / row) - 1,
          static_cast<int>(at / slab) - (config_.plane ? 0 : 1)};
}

ArrivalField::Cell ArrivalField::cell_at(const Eigen::Vector3d& at_m) const {
  const Eigen::Vector3d u = (at_m - origin_m_) / cell_m_;
  return {static_cast<int>(std::floor(u.x())), static_cast<int>(std::floor(u.y())),
          config_.plane ? 0 : static_cast<int>(std::floor(u.z()))};
}

Eigen::Vector3d ArrivalField::center_m(const Cell& c) const {
  Eigen::Vector3d center = origin_m_ + cell_m_ * Eigen::Vector3d(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
  if (config_.plane) center.z() = goal_m_.z();
  return center;
}

void ArrivalField::resize(const FreeSpace& space, const Eigen::Vector3d& goal_m) {
  const GridSpec& grid = space.grid();
  const double voxel_m = grid.resolution_m();
  stride_ = config_.plane ? 1 : std::max(1, static_cast<int>(std::lround(config_.cell_m / voxel_m)));
  cell_m_ = stride_ * voxel_m;
  for (std::size_t a = 0; a < 3; ++a) size_[a] = (grid.size()[a] + stride_ - 1) / stride_;
  first_z_ = 0;
  if (config_.plane) {
    first_z_ = grid.index_of(goal_m).z;
    size_[2] = 1;
  }
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * voxel_m);
  origin_m_ = grid.center_of({0, 0, first_z_}) - half;
  goal_m_ = goal_m;
  row_ = size_[0] + 2;
  slab_ = row_ * (size_[1] + 2);
  first_ = row_ + 1 + (config_.plane ? 0 : slab_);
  const auto count = static_cast<std::size_t>(slab_ * (config_.plane ? 1 : size_[2] + 2));
  arrival_.assign(count, kFar);
  slowness_.assign(count, 0.0F);
  close_border();
  for (auto& bucket : buckets_) bucket.clear();
  turn_ = 0;
}

void ArrivalField::close_border() {
  const auto slab = static_cast<std::size_t>(slab_), row = static_cast<std::size_t>(row_);
  const std::size_t slabs = slowness_.size() / slab, rows = slab / row;
  for (std::size_t z = 0; z < slabs; ++z) {
    for (std::size_t y = 0; y < rows; ++y) {
      float* begin = slowness_.data() + z * slab + y * row;
      const bool outside = y == 0 || y + 1 == rows || (!config_.plane && (z == 0 || z + 1 == slabs));
      if (outside) std::fill_n(begin, row, kImpassable);
      begin[0] = begin[row - 1] = kImpassable;
    }
  }
}

float ArrivalField::slowness_of(const FreeSpace& space, const SegmentCheck& check, const Cell& c) const {
  const int deep = config_.plane ? 1 : stride_;
  const VoxelIndex first{c[0] * stride_, c[1] * stride_, c[2] * stride_ + first_z_};
  const VoxelIndex &lo = space.lo(), &hi = space.hi();
  const std::uint16_t* squared_cells = space.blocked_distance().data().data();
  int most = -1;  // squared cells to the nearest obstacle, at the best voxel
  int free = 0;
  for (int z = std::max(first.z, lo.z); z < first.z + deep && z <= hi.z; ++z) {
    for (int y = std::max(first.y, lo.y); y < first.y + stride_ && y <= hi.y; ++y) {
      const std::uint16_t* row = squared_cells + space.grid().linear({0, y, z});
      for (int x = std::max(first.x, lo.x); x < first.x + stride_ && x <= hi.x; ++x) {
        const int squared = row[x];
        if (squared < space.min_squared_cells() || !check.outside_keep_out(VoxelIndex{x, y, z})) continue;
        ++free;
        most = std::max(most, squared);
      }
    }
  }
  if (narrow_ ? free == 0 : 2 * free < deep * stride_ * stride_) return kImpassable;
  if (config_.clearance_weight <= 0.0) return 1.0F;
  const double beyond_m =
      std::sqrt(static_cast<double>(most)) * space.grid().resolution_m() - space.robot().clearance_m();
  const double nearness = std::clamp(1.0 - beyond_m / config_.comfort_m, 0.0, 1.0);
  return static_cast<float>(1.0 + config_.clearance_weight * nearness * nearness);
}

void ArrivalField::push(std::size_t cell, float arrival) {
  arrival_[cell] = arrival;
  const auto bucket = std::max(turn_, static_cast<std::uint32_t>(arrival * kBucketsPerCell));
  buckets_[std::min(bucket, turn_ + static_cast<std::uint32_t>(kBuckets) - 1) % kBuckets].push_back(
      {static_cast<std::uint32_t>(cell), arrival});
}

void ArrivalField::start_from(const FreeSpace& space, const SegmentCheck& check) {
  const Cell middle = cell_at(goal_m_);
  const int reach = static_cast<int>(std::ceil(kExactCells));
  for (int z = config_.plane ? 0 : -reach; z <= (config_.plane ? 0 : reach); ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Cell c{middle[0] + x, middle[1] + y, middle[2] + z};
        if (!inside(c)) continue;
        const double cells = (center_m(c) - goal_m_).norm() / cell_m_;
        if (cells > kExactCells) continue;
        const float slow = slowness(space, check, linear(c));
        if (slow > 0.0F) push(linear(c), static_cast<float>(cells) * slow);
      }
    }
  }
}

/// Godunov's upwind scheme: the largest root that all the sides used lie below.
float ArrivalField::solve(std::size_t cell, float slowness) const {
  const float* at = arrival_.data() + cell;
  std::array<float, 3> lower{std::min(at[-1], at[1]), std::min(at[-row_], at[row_]), kFar};
  if (!config_.plane) lower[2] = std::min(at[-slab_], at[slab_]);
  const auto order = [&lower](std::size_t i, std::size_t j) {  // without branches, which nothing could foretell
    const float least = std::min(lower[i], lower[j]);
    lower[j] = std::max(lower[i], lower[j]);
    lower[i] = least;
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  float t = lower[0] + slowness;
  if (t > lower[1]) {
    const float d = lower[0] - lower[1];
    t = 0.5F * (lower[0] + lower[1] + std::sqrt(2.0F * slowness * slowness - d * d));
  }
  if (t > lower[2]) {
    const float sum = lower[0] + lower[1] + lower[2];
    const float squares = lower[0] * lower[0] + lower[1] * lower[1] + lower[2] * lower[2];
    t = (sum + std::sqrt(std::max(0.0F, sum * sum - 3.0F * (squares - slowness * slowness)))) / 3.0F;
  }
  return t;
}

bool ArrivalField::spread(const FreeSpace& space, const SegmentCheck& check, const Cell& start,
                          const std::function<bool()>& stop) {
  const bool bounded = inside(start);
  const std::array<std::ptrdiff_t, 6> all_sides{-1, 1, -row_, row_, -slab_, slab_};
  const auto sides = std::span(all_sides).first(config_.plane ? 4 : 6);
  for (std::size_t empty = 0; empty < kBuckets; ++turn_) {
    if (stop && turn_ % kStopEvery == 0 && stop()) return false;
    auto& bucket = buckets_[turn_ % kBuckets];
    empty = bucket.empty() ? empty + 1 : 0;
    for (std::size_t i = 0; i < bucket.size(); ++i) {
      const auto [cell, waited] = bucket[i];
      if (arrival_[cell] != waited) continue;
      for (const std::ptrdiff_t side : sides) {
        const std::size_t n = cell + static_cast<std::size_t>(side);
        if (arrival_[n] <= arrival_[cell]) continue;
        const float slow = slowness(space, check, n);
        if (slow < 0.0F) continue;
        const float arrival = solve(n, slow);
        if (arrival < arrival_[n] - kLeastGain) push(n, arrival);
      }
      if (config_.plane) spread_diagonally(space, check, cell);
    }
    bucket.clear();
    const float spare = static_cast<float>(config_.spare_m / cell_m_);
    if (bounded && static_cast<float>(turn_) > (at(start) + spare) * kBucketsPerCell) break;
  }
  return true;
}

/// Planners may pass between two obstacles that touch in a corner, so the field must.
void ArrivalField::spread_diagonally(const FreeSpace& space, const SegmentCheck& check, std::size_t cell) {
  for (const std::ptrdiff_t side : {-row_ - 1, -row_ + 1, row_ - 1, row_ + 1}) {
    const std::size_t n = cell + static_cast<std::size_t>(side);
    const float slow = slowness(space, check, n);
    const float arrival = arrival_[cell] + std::numbers::sqrt2_v<float> * slow;
    if (slow > 0.0F && arrival < arrival_[n] - kLeastGain) push(n, arrival);
  }
}

ArrivalField::Cell ArrivalField::cell_to_reach(const FreeSpace& space, const SegmentCheck& check,
                                               const Eigen::Vector3d& start_m) {
  const Cell none{-1, -1, -1};
  if (!start_m.allFinite()) return none;
  const Cell start = cell_at(start_m);
  if (inside(start) && slowness(space, check, linear(start)) > 0.0F) return start;
  for (const auto& face : kFaces) {
    const Cell n{start[0] + face[0], start[1] + face[1], start[2] + face[2]};
    if (inside(n) && slowness(space, check, linear(n)) > 0.0F) return n;
  }
  return none;
}

bool ArrivalField::compute(const FreeSpace& space, const SegmentCheck& check, const Eigen::Vector3d& goal_m,
                           const Eigen::Vector3d& start_m, const std::function<bool()>& stop) {
  for (const bool narrow : {false, true}) {
    narrow_ = narrow;
    resize(space, goal_m);
    start_from(space, check);
    if (!spread(space, check, cell_to_reach(space, check, start_m), stop)) return false;
    Cell near;
    if (!start_m.allFinite() || lowest_around(start_m, near)) break;
  }
  return true;
}

bool ArrivalField::lowest_around(const Eigen::Vector3d& at_m, Cell& found) const {
  const Cell middle = cell_at(at_m);
  double least = kFar;
  for (int z = config_.plane ? 0 : -1; z <= (config_.plane ? 0 : 1); ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const Cell c{middle[0] + x, middle[1] + y, middle[2] + z};
        if (at(c) == kFar) continue;
        const double through = at(c) + (center_m(c) - at_m).norm() / cell_m_;
        if (through >= least) continue;
        least = through;
        found = c;
      }
    }
  }
  return least < kFar;
}

float ArrivalField::value_m(const Eigen::Vector3d& at_m) const {
  if ((at_m - goal_m_).norm() <= kExactCells * cell_m_) return static_cast<float>((at_m - goal_m_).norm());
  const Eigen::Vector3d u = (at_m - origin_m_) / cell_m_ - Eigen::Vector3d::Constant(0.5);
  const Cell low{static_cast<int>(std::floor(u.x())), static_cast<int>(std::floor(u.y())),
                 config_.plane ? 0 : static_cast<int>(std::floor(u.z()))};
  double sum = 0.0, weights = 0.0;
  for (int corner = 0; corner < (config_.plane ? 4 : 8); ++corner) {
    const Cell c{low[0] + (corner & 1), low[1] + (corner >> 1 & 1), low[2] + (corner >> 2 & 1)};
    const float value = at(c);
    if (value == kFar) continue;
    double weight = 1.0;
    for (int a = 0; a < (config_.plane ? 2 : 3); ++a) {
      const double part = u[a] - low[static_cast<std::size_t>(a)];
      weight *= (corner >> a & 1) != 0 ? part : 1.0 - part;
    }
    sum += weight * value;
    weights += weight;
  }
  return weights > 1e-3 ? static_cast<float>(sum / weights * cell_m_) : kFar;
}

/// -grad T by the sides that T came from. @pre inside(c)
Eigen::Vector3d ArrivalField::downhill(const Cell& c) const {
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  const float* at = arrival_.data() + linear(c);
  const std::array<std::ptrdiff_t, 3> strides{1, row_, slab_};
  for (std::size_t a = 0; a < (config_.plane ? 2U : 3U); ++a) {
    const float left = at[-strides[a]], right = at[strides[a]], least = std::min(left, right);
    if (least >= *at) continue;
    down[static_cast<Eigen::Index>(a)] = left < right ? -(*at - left) : *at - right;
  }
  return down;
}

Eigen::Vector3d ArrivalField::step_down(const Eigen::Vector3d& at_m) const {
  const Eigen::Vector3d u = (at_m - origin_m_) / cell_m_ - Eigen::Vector3d::Constant(0.5);
  const Cell low{static_cast<int>(std::floor(u.x())), static_cast<int>(std::floor(u.y())),
                 config_.plane ? 0 : static_cast<int>(std::floor(u.z()))};
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < (config_.plane ? 4 : 8); ++corner) {
    const Cell c{low[0] + (corner & 1), low[1] + (corner >> 1 & 1), low[2] + (corner >> 2 & 1)};
    if (at(c) == kFar) continue;
    double weight = 1.0;
    for (int a = 0; a < (config_.plane ? 2 : 3); ++a) {
      const double part = u[a] - low[static_cast<std::size_t>(a)];
      weight *= (corner >> a & 1) != 0 ? part : 1.0 - part;
    }
    down += weight * downhill(c);
  }
  if (down.norm() > 1e-6) {
    const Eigen::Vector3d to_m = at_m + 0.5 * cell_m_ * down.normalized();
    if (at(cell_at(to_m)) != kFar) return to_m;
  }
  Cell lowest;
  if (!lowest_around(at_m, lowest)) return at_m;
  const Eigen::Vector3d towards = center_m(lowest) - at_m;
  return towards.norm() <= 0.5 * cell_m_ ? center_m(lowest) : at_m + 0.5 * cell_m_ * towards.normalized();
}

void ArrivalField::descend(const Eigen::Vector3d& at_m, double length_m, std::vector<Eigen::Vector3d>& way_m) const {
  way_m.clear();
  Cell near;
  if (!lowest_around(at_m, near)) return;
  way_m.push_back(at_m);
  const int most = static_cast<int>(2.0 * length_m / cell_m_) + 2;
  for (double gone_m = 0.0; gone_m < length_m && static_cast<int>(way_m.size()) <= most;) {
    const Eigen::Vector3d here = way_m.back();
    const bool arrived = (here - goal_m_).norm() <= cell_m_;
    const Eigen::Vector3d next = arrived ? goal_m_ : step_down(here);
    gone_m += (next - here).norm();
    if (next != here) way_m.push_back(next);
    if (arrived || next == here) return;
  }
}

}  // namespace stairwell::planning3d
