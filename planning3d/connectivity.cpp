#include "planning3d/connectivity.hpp"

#include <algorithm>

namespace stairwell::planning3d {

std::optional<Connectivity> Connectivity::find(const FreeSpace& space, Neighbours neighbours,
                                               const std::function<bool()>& stop) {
  Connectivity found(space.grid());
  const int ny = found.grid_.size()[1];
  const int reach = neighbours == Neighbours::kAll ? 1 : 0;
  found.row_begin_.reserve(found.row_of(0, found.grid_.size()[2]) + 1);
  found.row_begin_.push_back(0);
  for (int z = 0; z < found.grid_.size()[2]; ++z) {
    if (stop && stop()) return std::nullopt;
    for (int y = 0; y < ny; ++y) {
      found.add_row(space, y, z);
      const std::size_t row = found.row_of(y, z);
      if (y > 0) found.join_rows(row - 1, row, reach);
      for (int side = -reach; side <= reach && z > 0; ++side) {
        if (y + side >= 0 && y + side < ny) found.join_rows(found.row_of(y + side, z - 1), row, reach);
      }
    }
  }
  return found;
}

void Connectivity::add_row(const FreeSpace& space, int y, int z) {
  if (y >= space.lo().y && y <= space.hi().y && z >= space.lo().z && z <= space.hi().z) {
    const std::uint16_t* const squared = space.blocked_distance().data().data() + grid_.linear({0, y, z});
    for (int x = space.lo().x; x <= space.hi().x; ++x) {
      if (squared[x] < space.min_squared_cells()) continue;
      const int lo = x;
      while (x < space.hi().x && squared[x + 1] >= space.min_squared_cells()) ++x;
      runs_.push_back({lo, x, static_cast<std::uint32_t>(runs_.size())});
    }
  }
  row_begin_.push_back(static_cast<std::uint32_t>(runs_.size()));
}

/// Two rows side by side: runs that meet when each is made longer by `reach` become one part.
void Connectivity::join_rows(std::size_t a, std::size_t b, int reach) {
  std::uint32_t i = row_begin_[a];
  std::uint32_t j = row_begin_[b];
  while (i < row_begin_[a + 1] && j < row_begin_[b + 1]) {
    if (runs_[i].lo <= runs_[j].hi + reach && runs_[j].lo <= runs_[i].hi + reach) {
      const std::uint32_t one = root(i);
      const std::uint32_t other = root(j);
      runs_[std::max(one, other)].parent = std::min(one, other);
      runs_[i].parent = runs_[j].parent = std::min(one, other);
    }
    if (runs_[i].hi < runs_[j].hi) {
      ++i;
    } else {
      ++j;
    }
  }
}

std::uint32_t Connectivity::root(std::uint32_t run) const {
  while (runs_[run].parent != run) run = runs_[run].parent;
  return run;
}

std::uint32_t Connectivity::part(const VoxelIndex& v) const {
  if (!grid_.contains(v)) return kNone;
  const std::size_t row = row_of(v.y, v.z);
  const auto begin = runs_.begin() + row_begin_[row];
  const auto end = runs_.begin() + row_begin_[row + 1];
  const auto run = std::lower_bound(begin, end, v.x, [](const Run& r, int x) { return r.hi < x; });
  return run == end || run->lo > v.x ? kNone : root(static_cast<std::uint32_t>(run - runs_.begin()));
}

GivingUp::GivingUp(const FreeSpace& space, const PlanRequest& request) : space_(space), request_(request) {
  if (!request.clock_s) return;
  constexpr double kMoreTime = 0.1;
  until_s_ = request.deadline_s + kMoreTime * std::max(0.0, request.deadline_s - request.clock_s());
}

PlanStatus GivingUp::status(PlanStatus ended, const VoxelIndex& start, const VoxelIndex& goal) const {
  if (ended != PlanStatus::kTimedOut && ended != PlanStatus::kLocalMinimum) return ended;
  const auto late = [this] { return request_.clock_s && request_.clock_s() >= until_s_; };
  const auto parts = Connectivity::find(space_, Connectivity::Neighbours::kAll, late);
  return parts && !parts->connected(start, goal) ? PlanStatus::kNoPath : ended;
}

}  // namespace stairwell::planning3d
